"""Files that are either the old or the new one, never half of one."""

import os
from pathlib import Path
from tempfile import NamedTemporaryFile


def write_atomically(path: Path, content: bytes) -> None:
    """Write `content` beside `path` and move it there in one step; on an error the old file stays as it is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = None
    try:
        with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", suffix=".part", delete=False) as file:
            part = file.name
            file.write(content)
        os.chmod(part, 0o644)
        os.replace(part, path)
    except BaseException:
        if part is not None and os.path.exists(part):
            os.unlink(part)
        raise

"""The data files that a scene depends on beside its own: height maps, designs, masks."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def data_digests(written: Any) -> dict[str, str]:
    """A digest of each file that scenes, as plain values, name under a key `path`: height maps, designs, masks."""
    found: dict[str, str] = {}
    parts = written.values() if isinstance(written, Mapping) else written if isinstance(written, list) else ()
    for part in parts:
        found |= data_digests(part)
    if isinstance(written, Mapping) and isinstance(path := written.get("path"), str):
        found[path] = hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]
    return found

"""Where figures come from: versions, commit, machine, and a digest of all code that they depend on."""

import hashlib
import os
import platform
from collections.abc import Sequence
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from dirt_env import __version__
from dirt_env.bench.provenance import LIBRARIES, commit, processor
from dirt_env.config.loading import scene_folder
from dirt_env.policy import NETWORK, PACKAGE, policy_file

ROOT = Path(__file__).resolve().parents[2]


def code_digest(policies: Sequence[str]) -> str:
    """A digest of the sources of library, behaviours and networks, of shipped numbers, and of these policies' files."""
    digest = hashlib.sha256(_library_digest())
    for name in policies:
        if (path := policy_file(name)) is not None:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@lru_cache(maxsize=1)
def _library_digest() -> bytes:
    digest = hashlib.sha256()
    behaviours = Path(import_module(PACKAGE).__file__).parent
    for folder in dict.fromkeys((ROOT, behaviours)):
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode())
            digest.update(path.read_bytes())
    for path in sorted(scene_folder().with_name("policy").glob("*.toml")):
        digest.update(path.name.encode() + path.read_bytes())
    digest.update(Path(find_spec(NETWORK).origin).read_bytes())
    return digest.digest()


def origin() -> dict[str, Any]:
    """Versions, commit (None outside a checkout) and machine, as plain values."""
    return {
        "versions": {
            "dirt_env": __version__,
            "python": platform.python_version(),
            **{name: version(name) for name in LIBRARIES},
        },
        "commit": commit(),
        "machine": {
            "system": platform.system(),
            "architecture": platform.machine(),
            "processor": f"{processor()}, {os.cpu_count()} cores",
        },
    }

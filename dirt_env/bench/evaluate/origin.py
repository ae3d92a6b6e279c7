"""Where figures come from: versions, commit, machine, and a digest of all code that they depend on."""

import hashlib
import os
import platform
import subprocess
from collections.abc import Sequence
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from dirt_env import __version__
from dirt_env.policy import PACKAGE, policy_file

ROOT = Path(__file__).resolve().parents[2]
LIBRARIES = ("gymnasium", "numba", "numpy")


def code_digest(policies: Sequence[str]) -> str:
    """A digest of the sources of the library, of the scripted behaviours and of the files of these policies."""
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
    return digest.digest()


def origin() -> dict[str, Any]:
    """Versions, commit (None outside a checkout) and machine, as plain values."""
    return {
        "versions": {
            "dirt_env": __version__,
            "python": platform.python_version(),
            **{name: version(name) for name in LIBRARIES},
        },
        "commit": _commit(),
        "machine": {"system": platform.system(), "architecture": platform.machine(), "processor": _processor()},
    }


def _commit() -> str | None:
    """The commit that is checked out, with a plus where files were changed since."""
    if not (ROOT.parent / ".git").exists():
        return None
    try:
        ask = ["git", "-C", str(ROOT), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"]
        return subprocess.run(ask, capture_output=True, text=True, check=True, timeout=20).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def _processor() -> str:
    """The processor's model, with the number of its cores that may be used."""
    name = platform.processor()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        models = [line.partition(":")[2].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        name = models[0] if models else name
    return f"{name}, {os.cpu_count()} cores"

"""What a report was made with: the commit, the machine, the versions."""

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from dirt_env import __version__

ROOT = Path(__file__).resolve().parents[2]
LIBRARIES = ("numpy", "numba", "gymnasium")


def provenance() -> dict:
    """`commit` (with "-dirty" after it if files were edited; None outside a checkout), `machine`, `versions`."""
    return {"commit": commit(), "machine": machine(), "versions": versions()}


def commit() -> str | None:
    """The commit of the checkout that the library lies in."""
    if not (ROOT / ".git").exists():
        return None
    command = ["git", "-C", str(ROOT), "describe", "--always", "--abbrev=40", "--dirty", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=20, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def machine() -> str:
    """Processor and operating system, in words."""
    return f"{processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}"


def processor() -> str:
    """The processor's name, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown processor"


def versions() -> dict[str, str]:
    """Versions of Python, this library and what it computes with."""
    found = {"python": platform.python_version(), "dirt-push": __version__}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found

"""What all tests share: no display, few threads, repeatable examples; browser tests where there is a browser."""

import os
import shutil

import pytest
from hypothesis import settings

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("OMP_NUM_THREADS", "1")

# No deadlines: the first example of a kernel may compile it.
settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("long", deadline=None, print_blob=True)  # see tests/test_state_machine.py
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") else "local"))

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
NO_BROWSER = f"no browser: none of {', '.join(BROWSERS)} is on the PATH"


def pytest_addoption(parser: pytest.Parser) -> None:
    """`pytest --renew-golden` writes the recorded traces anew instead of comparing with them."""
    parser.addoption("--renew-golden", action="store_true", help="record the golden traces anew")


def pytest_report_header() -> str | None:
    """Say why the browser tests are skipped."""
    return None if _browser() else f"{NO_BROWSER}; tests marked `browser` are skipped"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip the tests marked `browser` where there is none."""
    if not _browser():
        for item in items:
            if item.get_closest_marker("browser"):
                item.add_marker(pytest.mark.skip(reason=NO_BROWSER))


def _browser() -> str | None:
    return next(filter(None, map(shutil.which, BROWSERS)), None)

"""What commands share: how they end and speak, which folders they may write to, how they read numbers."""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130  # exit statuses


def end(name: str, command: Callable[[], int], interrupted: str = "interrupted") -> int:
    """Run a command; returns its exit status. Bad input is one line on stderr, after its name, and status 2."""
    try:
        return command()
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, OSError, ImportError) as error:
        sys.stderr.write(f"{name}: error: {error}\n")
        return BAD_INPUT
    except MemoryError as error:
        sys.stderr.write(f"{name}: error: there is not enough memory: {error}\n")
        return FAILED
    except KeyboardInterrupt:
        sys.stderr.write(f"{name}: {interrupted}\n")
        return INTERRUPTED


def say(*lines: str) -> None:
    if sys.stdout is None:  # closed by whoever started this
        return
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


def forgive(stream: Any) -> None:
    """Let a stream write '?' for letters that it cannot encode."""
    if hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="replace")


def columns(pairs: Any) -> list[str]:
    rows = list(pairs)
    width = max(len(name) for name, _ in rows)
    return [f"{name:<{width}}  {text}" for name, text in rows]


def writable(out: Path) -> Path:
    """The folder, made if it is not there; an error if it cannot be written to."""
    if out.exists() and not out.is_dir():
        raise ValueError(f"--out is {out}, which is a file; allowed: a folder, or a new name")
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            return out
    except OSError as error:
        raise ValueError(f"--out is {out}: {error.strerror}; allowed: a folder that can be written to") from error


def whole(least: int) -> Any:
    """A parser of whole numbers from `least`."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if value < least:
            raise argparse.ArgumentTypeError(f"is {text!r}; allowed: whole numbers >= {least}")
        return value

    return parse

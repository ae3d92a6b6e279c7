"""The command line: `dirt-push`, the same as `python -m dirt_env`."""

import argparse
import sys
import warnings
from collections.abc import Sequence

from dirt_env import __version__
from dirt_env.cli.evaluate import add_evaluate
from dirt_env.cli.lists import add_lists
from dirt_env.cli.record import add_record
from dirt_env.cli.reports import add_reports
from dirt_env.cli.run import add_run
from dirt_env.terminal import end, forgive


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status. Bad input is one line on stderr and status 2."""
    forgive(sys.stdout)
    options = _parser().parse_args(arguments)
    said = set()

    def show(message, *_) -> None:
        if str(message) not in said:
            said.add(str(message))
            sys.stderr.write(f"dirt-push: warning: {message}\n")

    with warnings.catch_warnings():
        warnings.showwarning = show
        return end("dirt-push", lambda: options.command(options))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("dirt-push", description="Machines that push soil, in a simulator.")
    parser.add_argument("--version", action="version", version=f"dirt-push {__version__}")
    commands = parser.add_subparsers(required=True, metavar="command")
    add_run(commands)
    add_evaluate(commands)
    add_record(commands)
    add_reports(commands)
    add_lists(commands)
    return parser

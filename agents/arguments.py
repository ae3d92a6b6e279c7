"""The arguments that all training commands have."""

import argparse
from pathlib import Path
from typing import NoReturn


class _Parser(argparse.ArgumentParser):
    """Says where settings go to whoever took one for an argument, as in `--steps 1000`."""

    def error(self, message: str) -> NoReturn:
        """One line on stderr, and status 2."""
        hint = "; settings are changed by --set, as in --set steps=1000" if message.startswith("unrecognized") else ""
        super().error(message + hint)


def training_parser(module: str, description: str, folder: str) -> argparse.ArgumentParser:
    """A parser for the training command of a module; `folder` is where its runs go by default."""
    parser = _Parser(f"python -m {module}", description=description)
    parser.add_argument(
        "--config",
        type=Path,
        required=True,
        metavar="FILE",
        help="settings of the run: a TOML file, or the name of a shipped one",
    )
    parser.add_argument("--seed", type=int, metavar="S", help="of the run (default: the file's)")
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"folder of the run (default: {folder}/NAME-seedS)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change a setting, as in --set ppo.gamma=0.98"
    )
    parser.add_argument("--fresh", action="store_true", help="begin anew; what the folder holds of a run goes")
    return parser

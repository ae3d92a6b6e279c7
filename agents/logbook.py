"""What a run says of itself: CSV files, TensorBoard, a line on the terminal."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from torch.utils.tensorboard import SummaryWriter

from dirt_env.render.atomic import write_atomically

from .course import Ended
from .selection import Score

LOGS = TRAINING, SELECTION = "training.csv", "selection.csv"
EPISODE = ("return", "share_end", "success", "length")
UPDATE = {  # of each algorithm, name: that of stable-baselines3
    "ppo": {
        "learning_rate": "train/learning_rate",
        "kl": "train/approx_kl",
        "clip_fraction": "train/clip_fraction",
        "policy_loss": "train/policy_gradient_loss",
        "value_loss": "train/value_loss",
        "explained_variance": "train/explained_variance",
        "std": "train/std",
    },
    "sac": {
        "learning_rate": "train/learning_rate",
        "actor_loss": "train/actor_loss",
        "critic_loss": "train/critic_loss",
        "ent_coef": "train/ent_coef",
    },
}
TIME = ("environment", "inference", "update", "steps_per_s", "cpu_seconds")


class Table:
    """A CSV file with a line for each step of the environment that is noted; whatever stands behind `steps` goes."""

    def __init__(self, path: Path, columns: Sequence[str], steps: int) -> None:
        """Open the file; it begins anew with `steps` 0."""
        self._columns = columns
        try:
            kept = [row for row in _rows(path) if steps and int(row["steps"]) <= steps]
        except (ValueError, TypeError, KeyError) as error:
            raise ValueError(f"{path} is damaged: {error}; allowed: as it was written, or --fresh") from error
        content = io.StringIO()
        writer = csv.DictWriter(content, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)
        write_atomically(path, content.getvalue().encode())
        self._file = open(path, "a", newline="", encoding="utf-8")  # noqa: SIM115  closed by `close`
        self._writer = csv.DictWriter(self._file, columns, lineterminator="\n")

    def add(self, row: Mapping[str, object]) -> None:
        """Write a line; numbers to six digits."""
        self._writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class Logbook:
    """The files of one run, from `steps` on."""

    def __init__(self, out: Path, steps: int, algorithm: str) -> None:
        """Open the files in the folder; what they say of later steps, from before a crash, is dropped."""
        self._update = UPDATE[algorithm]
        columns = ("steps", "seconds", "stage", "episodes", *EPISODE, *self._update, *TIME)
        self._training = Table(out / TRAINING, columns, steps)
        self._selection = Table(out / SELECTION, ("steps", "seconds", *Score._fields), steps)
        self._board = SummaryWriter(str(out / "tensorboard"), purge_step=steps + 1)

    def note(
        self,
        steps: int,
        seconds: float,
        stage: int,
        ended: Sequence[Ended],
        update: Mapping[str, float],
        time: Mapping[str, float],
    ) -> None:
        """One rollout and update: the episodes that ended in it, what the update says, and TIME."""
        means = dict.fromkeys(EPISODE, "")
        if ended:
            columns = zip(*(one[1:] for one in ended), strict=True)
            means = {name: float(np.mean(column)) for name, column in zip(EPISODE, columns, strict=True)}
        found = {name: float(update[key]) for name, key in self._update.items() if key in update}
        row = {"steps": steps, "seconds": seconds, "stage": stage, "episodes": len(ended), **means, **found, **time}
        self._training.add(row)
        for name, value in {**means, **found, **time, "stage": stage}.items():
            if value != "":
                self._board.add_scalar(f"training/{name}", value, steps)
        for level in {one.level for one in ended} - {None}:
            share = np.mean([one.share for one in ended if one.level == level])
            self._board.add_scalar(f"training/share_end_level_{level}", share, steps)

    def judge(self, steps: int, seconds: float, scores: Sequence[Score]) -> None:
        """What an evaluation on selection layouts gave."""
        for score in scores:
            self._selection.add({"steps": steps, "seconds": seconds, **score._asdict()})
            for name, value in score._asdict().items():
                if name != "level":
                    where = "" if score.level is None else f"_level_{score.level}"
                    self._board.add_scalar(f"selection/{name}{where}", value, steps)

    def close(self) -> None:
        """Close all files."""
        for one in (self._training, self._selection, self._board):
            one.close()


def _rows(path: Path) -> list[dict[str, str]]:
    """The whole lines of a CSV file; none where there is no file."""
    if not path.is_file():
        return []
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]  # a kill may have cut the last line off
    return list(csv.DictReader(io.StringIO(whole)))

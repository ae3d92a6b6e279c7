"""The tables of docs/jobs.md, made anew from an evaluation: `dirt-push evaluate ... --renew-docs docs`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dirt_env.bench.document import markdown, renewed
from dirt_env.bench.evaluate.suite import Suite, Task
from dirt_env.render.atomic import write_atomically

NAME = "jobs.md"
VARIED = 1  # the level of the paper's scenes that paper.toml lays its own ranges over


def check_document(folder: Path, suite: str) -> None:
    """Raise ValueError if the folder has no document with a place for this suite."""
    path = folder / NAME
    if not path.is_file():
        raise ValueError(f"--renew-docs is {folder}; allowed: a folder with {NAME}")
    if f"<!-- {_mark(suite)}:" not in path.read_text(encoding="utf-8"):
        raise ValueError(f"{path} has no table of the suite {suite}; needed: <!-- {_mark(suite)}:table -->")


def renew_document(folder: Path, suite: Suite, result: Mapping[str, Any]) -> Path:
    """Write the suite's blocks of jobs.md anew: `command`, `table`, `score`, `pairs`."""
    path = folder / NAME
    blocks = {
        "command": _command(suite.name, result),
        "table": _table(suite, result),
        "score": _score(result),
        "pairs": _pairs(result),
    }
    text = renewed(path.read_text(encoding="utf-8"), _mark(suite.name), blocks)
    write_atomically(path, text.encode())
    return path


def _mark(suite: str) -> str:
    return f"evaluate-{suite}"


def _command(suite: str, result: Mapping[str, Any]) -> str:
    """How the figures are had again."""
    policies = ",".join(policy["name"] for policy in result["policies"])
    count = len(result["layouts"])
    command = f"    dirt-push evaluate --policies {policies} --suite {suite} --layouts {count} --renew-docs docs"
    return f"\n{command}\n\nLayouts {result['layouts'][0]} to {result['layouts'][-1]}.\n"


def _table(suite: Suite, result: Mapping[str, Any]) -> str:
    """A row for each task: what is asked, in which time, and how each policy does."""
    names = [policy["name"] for policy in result["policies"]]
    found = {(row["job"], row["level"], row["policy"]): row["metrics"] for row in result["results"]}
    rows = [["job", "level", "asked", "time, s", *(f"`{name}`" for name in names)]]
    for task in _in_order(suite.tasks):
        config = task.config()
        time = (task.steps or config.steps) * config.task.period
        cells = [_cell(task, found[task.job, task.level, name]) for name in names]
        rows.append([task.job, _level(task), _asked(task), f"{time:g}", *cells])
    return markdown(rows)


def _in_order(tasks: Sequence[Task]) -> list[Task]:
    """By job as they come, and by level; a job without one is a middle level that the suite varies in its own way."""
    jobs = list(dict.fromkeys(task.job for task in tasks))
    return sorted(tasks, key=lambda task: (jobs.index(task.job), VARIED if task.level is None else task.level))


def _level(task: Task) -> str:
    return f"{VARIED}, varied" if task.level is None else str(task.level)


def _asked(task: Task) -> str:
    config = task.config()
    return f"{config.task.success:.0%}" if config.design is None else f"{config.design.tolerance:g} m"


def _cell(task: Task, metrics: Mapping[str, Any]) -> str:
    """How often it was done; interquartile means of what was reached, with its interval, and of the time until then."""
    success = metrics["success"]
    done = f"{round(success['n'] * success['mean'])} of {success['n']}"
    if task.config().design is None:
        reached = "{iqm:.1%} [{low:.1%}, {high:.1%}]".format(**metrics["share_end"])
    else:
        reached = "{iqm:.3f} m [{low:.3f}, {high:.3f}]".format(**metrics["grade_error_m"])
    return f"{done}; {reached}; {metrics['time_s']['iqm']:.0f} s"


def _score(result: Mapping[str, Any]) -> str:
    """All jobs and levels together."""
    rows = [["policy", "done", "score", "95 %"]]
    for row in result["overall"]:
        success, score = row["metrics"]["success"], row["metrics"]["score"]
        done = f"{round(success['n'] * success['mean'])} of {success['n']}"
        rows.append([f"`{row['policy']}`", done, f"{score['iqm']:.3f}", f"[{score['low']:.3f}, {score['high']:.3f}]"])
    return markdown(rows)


def _pairs(result: Mapping[str, Any]) -> str:
    """How likely the first of each pair scores higher on the same layout."""
    rows = [["first", "second", "the first scores higher", "95 %"]]
    for pair in result["pairs"]:
        found = pair["probability"]
        interval = f"[{found['low']:.2f}, {found['high']:.2f}]"
        rows.append([f"`{pair['first']}`", f"`{pair['second']}`", f"{found['value']:.2f}", interval])
    return markdown(rows)

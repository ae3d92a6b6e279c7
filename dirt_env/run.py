"""`dirt-push run`: rolls a policy out in a scene and keeps what came of it in a folder."""

import json
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from dirt_env import __version__
from dirt_env.config import SceneConfig
from dirt_env.env import DirtPushEnv
from dirt_env.policy import complaint, load_policy, needed, overrides_for
from dirt_env.progress import Progress
from dirt_env.render.atomic import write_atomically
from dirt_env.render.pair import write_pair
from dirt_env.render.replay import Recorder
from dirt_env.rollout import Summary, mean, play
from dirt_env.terrain import cells_of

SIDE_BY_SIDE = "side_by_side.html"
MOMENTS = 600  # of one episode in the replay
COLUMNS = (
    ("share_in_goal", "in goal", "{:.1%}"),
    ("volume_moved_m3", "moved m3", "{:.2f}"),
    ("spilled_m3", "spilled m3", "{:.2f}"),
    ("time_s", "time s", "{:.0f}"),
    ("distance_m", "way m", "{:.0f}"),
    ("work_kj", "work kJ", "{:.0f}"),
    ("grade_error_m", "grade err m", "{:.3f}"),
    ("m3_per_h", "m3/h", "{:.1f}"),
)


def idle_figures(config: SceneConfig) -> tuple[str, ...]:
    """What the replay of a scene does not show: figures that say nothing there, and the time, which it shows anyway."""
    design = () if config.design is not None else ("grade_error_m",)
    traction = () if config.traction is not None else ("energy_kj", "slip")
    loose = () if config.soil.swell > 0.0 else ("loose_moved_m3",)
    return ("time_s", *design, *traction, *loose)


class Run:
    """Episodes of one policy in one scene; `summaries` are those that were finished, of the `wanted` ones.

    `steps` bounds an episode, by default to the scene's nominal time; `record` keeps every one for the replay.
    """

    def __init__(
        self,
        scene: str,
        policy: str,
        seed: int = 0,
        steps: int | None = None,
        overrides: Mapping[str, Any] | None = None,
        record: bool = True,
    ) -> None:
        """Read scene and policy; raises ValueError or ImportError with a sentence that helps."""
        if record and find_spec("PIL") is None:
            raise ImportError(
                'the animated picture needs pillow: pip install ".[render]" in the checkout, or --no-replay'
            )
        self.scene, self.policy_name, self.seed = scene, policy, seed
        self.env = DirtPushEnv(scene=scene, **(overrides or {}))
        self.policy = load_policy(policy, self.env.config)
        if needed(self.policy):
            self.env = DirtPushEnv(scene=scene, **overrides_for(policy, self.policy, overrides or {}))
        config = self.env.config
        self.steps = steps or config.steps
        self.summaries: list[Summary] = []
        self.wanted, self.interrupted = 0, False
        self.failure: str | None = None
        title = f"{config.name}: {policy}"
        every = max(1, self.steps // MOMENTS)
        recorder = Recorder(title, config.description, config.grid.cell, config.blade, config.machine, every)
        self.recorder = recorder if record else None

    def play(self, episodes: int) -> None:
        """Play the episodes, on the layouts of `seed`, `seed` + 1, ...

        Ctrl-C, and an error of the policy's, drops the one that is being played and ends it; `failure` then says what
        went wrong and where.
        """
        self.wanted = episodes
        progress = Progress(episodes * self.steps)
        try:
            progress.show(0, "starting; the first run compiles the kernels")
            for episode in range(episodes):
                label = f"episode {episode + 1} of {episodes}"
                self.summaries.append(
                    play(self.env, self.policy, self.seed + episode, self.steps, self._watch(label, episode, progress))
                )
        except KeyboardInterrupt:
            self.interrupted = True
        except Exception as error:
            seed = self.seed + len(self.summaries)
            self.failure = f"policy {self.policy_name} failed on layout {seed}: {complaint(error)}"
        finally:
            progress.clear()
        if self.recorder is not None:
            self.recorder.keep(len(self.summaries))

    def _watch(self, label: str, episode: int, progress: Progress) -> Any:
        """What looks on at one episode: the progress bar, and the recorder."""

        def watch(env: DirtPushEnv, info: dict) -> None:
            world, layout, done = env.episode.world, env.episode.layout, env.episode.totals.steps
            progress.show(episode * self.steps + done, f"{label}, {info['share_in_goal']:.0%} in the goal")
            if self.recorder is None:
                return
            if done == 0:
                regions = {name: getattr(layout, name) for name in ("start", "goal", "target", "design", "solid")}
                self.recorder.begin(label, **regions)
            left_out = idle_figures(env.config)
            stats = {name: value for name, value in info.items() if isinstance(value, float) and name not in left_out}
            self.recorder.add(world.height, world.machine[0], info["time_s"], stats, cells_of(world))

        return watch

    def summary(self) -> dict[str, Any]:
        """Everything in numbers: the episodes' figures and their means."""
        return {
            "policy": self.policy_name,
            "sees": self.policy.sees,
            "scene": self.scene,
            "seed": self.seed,
            "max_steps": self.steps,
            "version": __version__,
            "config": self.env.config.to_dict(),
            "interrupted": self.interrupted,
            "failure": self.failure,
            "episodes_wanted": self.wanted,
            "episodes": self.summaries,
            "mean": mean(self.summaries),
        }

    def write(self, folder: Path) -> list[Path]:
        """Write summary.json, replay.html and replay.gif of the finished episodes; returns what was written.

        The replay of an earlier run in the folder goes first: it never lies beside another run's figures.
        """
        summary, page, film = folder / "summary.json", folder / "replay.html", folder / "replay.gif"
        page.unlink(missing_ok=True)
        film.unlink(missing_ok=True)
        write_atomically(summary, (json.dumps(self.summary(), indent=2) + "\n").encode())
        if self.recorder is None:
            return [summary]
        self.recorder.write_html(page)
        self.recorder.write_gif(film)
        return [summary, page, film]

    def table(self) -> str:
        """The figures of the episodes and their means, a line each."""
        lines = [["episode", "done", *(title for _, title, _ in COLUMNS)]]
        done = ["yes" if figures["is_success"] else "no" for figures in self.summaries]
        done.append(f"{done.count('yes')} of {len(done)}")
        rows = [*enumerate(self.summaries, 1), ("mean", mean(self.summaries))]
        for (label, figures), reached in zip(rows, done, strict=True):
            cells = ["-" if figures[name] is None else form.format(figures[name]) for name, _, form in COLUMNS]
            lines.append([str(label), reached, *cells])
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join("  ".join(map(str.rjust, line, widths)) for line in lines)


def write_side_by_side(left: Run, right: Run, folder: Path) -> Path:
    """Write side_by_side.html of two runs on the same layouts, both recorded; returns its path."""
    path, config = folder / SIDE_BY_SIDE, left.env.config
    write_pair(path, f"{config.name}: {config.description}", {run.policy_name: run.recorder for run in (left, right)})
    return path

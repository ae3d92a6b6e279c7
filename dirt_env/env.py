"""`DirtPush-v0`: a machine with a blade moves soil to where it belongs."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, Self

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from dirt_env.arguments import check_known, read_options
from dirt_env.config import layout as draw_layout
from dirt_env.config import load
from dirt_env.episode import Episode, tree_form
from dirt_env.snapshot import check, pack, unpack
from dirt_env.task.observation import read_pose
from dirt_env.task.reward import TERMS
from dirt_env.task.step import FIRST_TERM, INFO, REWARD, SUCCESS
from dirt_env.terrain import cells_of
from dirt_env.worlds import Worlds

VIEWS = ("top", "surface", "cells")
NOT_RESET = "Cannot call env.step() or env.render() before calling env.reset()"


class DirtPushEnv(gymnasium.Env):
    """A tracked machine with a straight blade pushes soil from start regions into goal regions, or to a design surface.

    ## Action space
    `Box(-1, 1, (3,), float32)`; values outside count as clipped, NaN and infinity are refused.

    | # | action | -1 | 0 | 1 |
    |---|---|---|---|---|
    | 0 | steering | turn right at `machine.yaw_rate` (0.6 rad/s) | straight | turn left |
    | 1 | speed | reverse at `machine.speed` (2 m/s) | stand | forward |
    | 2 | blade | cut `machine.cut` (0.25 m) deep: *dig* | at grade: *push* | lift `machine.lift`: *navigate* |

    The cutting edge goes to its height over the plane of the tracks at no more than `machine.edge_rate` (0.5 m/s).
    With `action.blade` "grade" it is under automatic grade control, as machines with a design model on board have it:
    0 holds the middle of the edge at the target surface (the ground as it was, or the design) as far as `machine.cut`
    below and `machine.lift` above the tracks reach, -1 holds it `machine.cut` lower, and up to 1 it goes evenly to
    `machine.lift` over the tracks.

    ## Observation space
    `Dict` of float32 arrays, always finite and inside their bounds.

    `patch` (1 to 3, P, P): the ground around the machine, heading up: row 0 is farthest ahead, column 0 farthest left,
    `observation.resolution` m a pixel, with the share `observation.ahead` of its rows ahead of the pivot.

    | channel | content | unit |
    |---|---|---|
    | 0 | height over the ground under the machine, within `observation.height_limit` (4 m) | m |
    | 1 | what is to do: soil to take away (positive), soil missing (negative), 0 elsewhere | m |
    | 2 | 1 on obstacles and outside the site; only in scenes that can have obstacles | - |

    `observation.channels` chooses among them by name, in any order: "height", "todo", "walls".

    Outside the site channel 0 shows a wall as high as the blade, or as deep a drop where the border is open. What is to
    do in the goal is minus the blade's height, for soil is welcome there; on a design surface, height minus design.

    `pose` (15,): (physical value - offset) / scale, clipped. `env.unwrapped.read_pose(pose)` turns it back.

    | # | entry | unit | scale | bounds |
    |---|---|---|---|---|
    | 0, 1 | x, y in the site, from its centre | m | half the site's extent | -1, 1 |
    | 2, 3 | sine and cosine of the heading, counter-clockwise from east | - | 1 | -1, 1 |
    | 4 | cutting edge over the plane of the tracks | m | the larger of cut and lift | -2, 2 |
    | 5 | speed, forward positive | m/s | `machine.speed` | -2, 2 |
    | 6 | yaw rate, left positive | rad/s | `machine.yaw_rate` | -2, 2 |
    | 7, 8 | slope under the tracks along the heading and to the left, up positive | - | 1 | -2, 2 |
    | 9 | soil ahead of the blade | m3 | 0.8 width height^2 of the blade (SAE J1265) | 0, 5 |
    | 10, 11 | direction to the nearest goal's centre, ahead and left: a unit vector | - | 1 | -1, 1 |
    | 12 | distance to that centre | m | diagonal of the site | 0, 1 |
    | 13 | share of the soil still to move | - | 1 | 0, 2 |
    | 14 | share of `task.time` left | - | 1 | 0, 1 |

    `overview` (2, 12, 12), if `observation.overview`: the whole site around the machine, heading up, in squares that
    together are as wide as its longer side; what lies farther out counts to the outermost squares. Channel 0: soil to
    move, as share of all the soil; channel 1: share of the goal's area.

    `map` (2 or 3, rows, cols), if `observation.map`: the site, north up in row order from the south. Height over the
    datum [m], and channels 1 and 2 as in the patch. For scripted behaviours that see everything.

    With a table `observation.noise`, all of this is what the machine measures: heights, its own position and heading
    have normal errors, drawn anew in every step. The overview leaves out what may be nothing but an error: cells that
    are less than three standard deviations too high.

    ## Dynamics
    A height field of `site.cell` m that never gets steeper than the angle of repose; its volume is exact to the last
    bit. A control step lasts `task.period` seconds, in as many substeps as the blade needs. The blade cuts, pushes,
    carries and spills; border walls and obstacles stop the machine. With a table `traction` in the scene, so does the
    ground: the machine slows down under the draft of load and cut, slips, and stalls (docs/machine.md). With tables
    `zone` the soil differs by region; with `soil.swell` soil that is dug takes more room than it did in the ground, and
    all volumes of the job, in the reward too, are those of bank (undisturbed) soil.

    ## Reward
    The sum of the terms of `info["reward"]` times the weights of the same names in the scene's table `reward`.

    | term | content |
    |---|---|
    | work | fall of the potential, as share of what it was at the start: 1 for the whole job, 0 for any loop |
    | energy | minus `energy_kj` of the step, as share of what dragging all the soil straight to the goal takes |
    | time | minus the share of `task.time` that a step takes |
    | spill | minus the soil lost over an open border, as share of all the soil |
    | success | 1 in the step that completes the job |
    | log_work | fall of ln(0.05 + d), 1 for the whole job; weight 0 by default |

    The potential is the sum of misplaced volume times its distance to the goal, round obstacles; with a design surface
    soil that is missing counts too, times the mean way that soil has to go there. In `log_work`
    d is the potential plus 3 m times the misplaced volume, as share of that at the start: the tail of a job counts more
    (the last tenth of d is worth more than the first two thirds), and the goal's rim is not yet the goal.

    ## Start and end
    `reset` draws a layout from the scene with the environment's generator. Options: `layout_seed` (int) draws it from a
    generator of its own instead; `pose` (x m, y m, heading rad) puts the machine elsewhere. The episode terminates with
    `info["is_success"]` when the share `task.success` of the soil is in the goal; in a scene with a design, when that
    is within its tolerance. It is never truncated here; `gymnasium.make` does that after `max_episode_steps`, by
    default 600, the time of the default job. `env.unwrapped.config.steps` is what a scene's own `task.time` comes to.

    ## Info
    Plain numbers: `share_in_goal`, `volume_moved_m3`, `loose_moved_m3` (the same soil as it lies, which is more with
    `soil.swell`), `misplaced_m3`, `spilled_m3` (soil that lies neither in start nor in goal nor in design regions where
    there was none, or is lost), `lost_m3`, `grade_error_m` (root mean square; 0 without a design), `work_kj` on the
    soil, `energy_kj` (the same; with `traction`, what the tracks took from the engine), `distance_m`, `time_s` since
    the start; `load_m3`, `draft_kn` (mean force on the blade), `slip` of the tracks (1: stalled; 0 without `traction`)
    and `blocked` (share of the step in which something solid held the machine) of the last step; `is_success`; the dict
    `reward`.

    ## Arguments
    `scene`: name of a shipped scene, path of a TOML file, or a mapping (default "heap"). `render_mode`: None,
    "rgb_array" or "human". `view`: what `render` shows: "top" (a map), "surface" (the surface with the machine, seen
    obliquely) or "cells" (the cells of `terrain="voxel"` with partly filled tops). Everything else overrides a table or
    key of the scene, as in
    `gymnasium.make("DirtPush-v0", scene="heap", level=2, soil={"repose": 30}, observation={"size": 48})`.

    `terrain="voxel"` puts the paper's three-dimensional grid of cells in place of the height field: everything above
    stays the same but the dynamics, which docs/paper.md describes.

    Many worlds at once: `gymnasium.make_vec("DirtPush-v0", num_envs=N)`, see `dirt_env.vector.DirtPushVectorEnv`.

    ## Versions
    v0: first.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 10}

    def __init__(
        self, render_mode: str | None = None, scene: Any = "heap", view: str = "top", **overrides: Any
    ) -> None:
        """Read and check the scene; raises ValueError that names what is wrong and what is allowed."""
        check_known(overrides)
        worlds = Worlds([load(scene, **overrides)])
        self._join(worlds, 0, _spaces(worlds), render_mode, view)

    @classmethod
    def all_of(cls, worlds: Worlds, render_mode: str | None = None, view: str = "top") -> list[Self]:
        """The environments of the worlds of a batch; each steps and resets its world, in the batch's arrays."""
        envs, shared = [cls.__new__(cls) for _ in worlds.configs], _spaces(worlds)
        for index, env in enumerate(envs):
            env._join(worlds, index, shared, render_mode, view)
        return envs

    def _join(
        self,
        worlds: Worlds,
        index: int,
        both: tuple[spaces.Box, spaces.Dict],
        render_mode: str | None,
        view: str,
    ) -> None:
        """Be the environment of world `index`."""
        self._worlds, self._index = worlds, index
        self.config = worlds.configs[index]
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise ValueError(f"render_mode is {render_mode!r}; allowed: None, {', '.join(modes)}")
        if view not in VIEWS or (view == "cells" and self.config.terrain.kind != "voxel"):
            raise ValueError(f'view is {view!r}; allowed: {", ".join(VIEWS[:2])}, and cells with terrain "voxel"')
        self.render_mode, self._view = render_mode, view
        self.action_space, self.observation_space = both
        self._picture = self._window = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Start an episode on a new layout; options: see RESET_OPTIONS and the class.

        Raises ValueError, and changes neither the episode nor the generator, if an option is bad.
        """
        self.put(self.begin(seed, options))
        self.measure()
        seen, figures = self._worlds.look(self._index)
        return seen, _info(figures)

    def begin(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Episode:
        """The start of an episode as `reset` draws it, for `put`; only the generator has changed then."""
        layout_seed, pose = read_options(options)
        self._worlds.prepare()
        with self.generator_kept_on_error():
            super().reset(seed=seed)
            generator = self.np_random if layout_seed is None else np.random.default_rng(layout_seed)
            layout = draw_layout(self.config, generator)
            if pose is not None:
                layout = layout._replace(pose=pose)
            return Episode.begin(self.config, layout)

    def put(self, episode: Episode) -> None:
        """Go on from an episode."""
        self._worlds.put(self._index, episode)
        self._picture = None
        if self.render_mode == "human":
            self.render()

    def step(self, action: Any) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """One control step of `task.period` seconds; raises ValueError, and changes nothing, if the action is bad."""
        worlds, index = self._worlds, self._index
        if worlds.layouts[index] is None:
            raise ResetNeeded(NOT_RESET)
        seen, figures = worlds.step(index, action, None if worlds.noise is None else self.np_random)
        info = _info(figures)
        info["reward"] = dict(zip(TERMS, figures[FIRST_TERM:REWARD], strict=True))
        if self.render_mode == "human":
            self.render()
        return seen, figures[REWARD], info["is_success"], False, info

    def measure(self) -> None:
        """Draw anew what the machine measures wrong, from the environment's generator; see `observation.noise`."""
        if self._worlds.noise is not None:
            self._worlds.perturb(self._index, self.np_random)

    def render(self) -> np.ndarray | None:
        """Picture of the site, uint8 (height, width, 3); in the mode "human" it is shown in a window instead."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() without a render_mode; make the environment with one of rgb_array, human")
            return None
        frame = self._frame()
        if self.render_mode == "rgb_array":
            return frame
        if self._window is None:
            from dirt_env.render.window import Window  # brings in pygame

            self._window = Window("DirtPush")
        self._window.show(frame, self.metadata["render_fps"])
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    @property
    def episode(self) -> Episode:
        """The episode that is under way, its arrays the world's own; raises ResetNeeded before the first reset."""
        if self._worlds.layouts[self._index] is None:
            raise ResetNeeded(NOT_RESET)
        return self._worlds.episode(self._index)

    def _frame(self) -> np.ndarray:
        """The picture that the view asks for."""
        world = self.episode.world
        if self._view == "top":
            return self.picture.frame(world.height, world.machine[0])
        if self._view == "surface":
            return self.picture.surface(getattr(world, "surface", world.height), world.machine[0])
        return self.picture.cells(*cells_of(world), world.machine[0])

    @property
    def picture(self) -> Any:
        """Draws the site of the current episode."""
        if self._picture is None and self._view != "top":
            from dirt_env.render.oblique import ObliquePicture

            place, config = self.episode.layout, self.config
            regions = {name: getattr(place, name) for name in ("start", "goal", "design", "solid")}
            sizes = config.blade, config.machine
            self._picture = ObliquePicture(config.grid.cell, regions, place.target, *sizes)
        if self._picture is None:
            from dirt_env.render.picture import Picture

            place, config = self.episode.layout, self.config
            regions = place.start, place.goal, place.design, place.solid, place.target
            self._picture = Picture(config.grid.cell, *regions, config.blade, config.machine)
        return self._picture

    def read_pose(self, pose: np.ndarray) -> dict[str, float]:
        """The observation's pose vector in physical units, by name; `heading` [rad] is added."""
        return read_pose(pose, self._worlds.observer.table)

    def get_state(self) -> bytes:
        """All that the future depends on, the generator too, for `set_state` of an environment of the same scene."""
        tree = {
            "config": _fingerprint(self.config),
            "generator": self.np_random.bit_generator.state,
            "seed": self._np_random_seed,
            "episode": self.episode.to_tree(),
        }
        return pack(tree)

    def set_state(self, state: bytes) -> None:
        """Go on from a state of `get_state`; ValueError, and nothing changes, if it is damaged or of another scene."""
        self.take_up(*self.read_state(state))

    def read_state(self, state: bytes) -> tuple[Episode, dict[str, Any], int | None]:
        """What a state of `get_state` holds, for `take_up`: episode, generator's state, seed; nothing changes yet."""
        tree = unpack(state)
        if isinstance(tree, dict) and tree.get("config") != _fingerprint(self.config):
            raise ValueError("state comes from a differently configured scene; allowed: states of this one")
        form = {"config": str, "generator": dict, "seed": (None, int), "episode": tree_form(self.config)}
        check(tree, form, "state")
        return (
            Episode.from_tree(self.config, tree["episode"]),
            _checked(self.np_random, tree["generator"]),
            tree["seed"],
        )

    def take_up(self, episode: Episode, generator: dict[str, Any], seed: int | None) -> None:
        """Go on from an episode, with a generator in that state and the seed it was made from."""
        self._worlds.put(self._index, episode)
        self.take_over(generator, seed)

    def take_over(self, generator: dict[str, Any], seed: int | None) -> None:
        """Go on with a generator in that state; the world itself has been replaced."""
        self.np_random.bit_generator.state = generator
        self._np_random_seed = seed
        self._picture = None

    @contextmanager
    def generator_kept_on_error(self) -> Iterator[None]:
        """Leave the generator as it was if what is done meanwhile raises."""
        generator, seed = self._np_random, self._np_random_seed
        state = None if generator is None else generator.bit_generator.state
        try:
            yield
        except BaseException:
            self._np_random, self._np_random_seed = generator, seed
            if generator is not None:
                generator.bit_generator.state = state
            raise

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and deepcopy take along: everything but what was only drawn."""
        return {**self.__dict__, "_picture": None, "_window": None}


def _spaces(worlds: Worlds) -> tuple[spaces.Box, spaces.Dict]:
    """Action and observation space of one world."""
    parts = {name: spaces.Box(low, high, dtype=np.float32) for name, (low, high) in worlds.observer.bounds.items()}
    return spaces.Box(-1.0, 1.0, (3,), np.float32), spaces.Dict(parts)


def _info(figures: list[float]) -> dict[str, Any]:
    """The numbers of `info` by name; they are the first of the figures."""
    info: dict[str, Any] = dict(zip(INFO, figures, strict=False))
    info["is_success"] = figures[SUCCESS] == 1.0
    return info


def _checked(generator: np.random.Generator, state: dict[str, Any]) -> dict[str, Any]:
    """The state, if the generator can take it; else raises ValueError."""
    trial = type(generator.bit_generator)()
    try:
        trial.state = state
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"state.generator is {state!r}: {error}; allowed: what get_state returned") from error
    return trial.state


def _fingerprint(config: Any) -> str:
    """The configuration as text."""
    return json.dumps(config.to_dict(), sort_keys=True)

"""Checks between the tables of a scene, and what follows from all of them."""

import warnings
from math import ceil, degrees, hypot

import numpy as np

from dirt_env.config.episode import layout, parts, plan
from dirt_env.config.scene import SceneConfig
from dirt_env.config.tables import READING
from dirt_env.config.terrain import HeightField
from dirt_env.scene import fixed, vary
from dirt_env.scene.design import Design
from dirt_env.scene.ground import Rough, face_slopes
from dirt_env.scene.layout import Layout
from dirt_env.scene.survey import HeightFile
from dirt_env.scene.zone import MOST, zone_map
from dirt_env.sim.advance import fits
from dirt_env.sim.draft import STEEPEST
from dirt_env.sim.state import make_world, quantum_for
from dirt_env.sim.timestep import STRIDE

MOST_CELLS = 2**24
MOST_SUBSTEPS = 10_000  # of one control step; a second or so of computing
SECONDS_PER_M3 = 20.0  # a fair machine's pace, for jobs that name no time


def check(config: SceneConfig) -> None:
    """Errors for tables that do not go together; warnings for a goal without room, ground that will slump, cells that
    will not.
    """
    _check_site(config)
    _check_machine(config)
    _check_action(config)
    if config.traction is not None:
        _check_traction(config)
    _check_soils(config)
    _check_ground(config)
    _check_cells(config)
    if config.layout is not None:
        _check_random(config)
    else:
        _check_fixed(config)
    _check_beginning(config)


def nominal_time(config: SceneConfig) -> float:
    """Time for the job where the scene names none, s: 20 s for each m3 of the largest job, in whole minutes."""
    if config.layout is not None:
        soil = config.layout.heaps[1] * config.layout.volume[1]
    else:
        soil = layout(config, np.random.default_rng(0)).soil
    return 60.0 * ceil(SECONDS_PER_M3 * soil / 60 - 1e-9)


def _check_site(config: SceneConfig) -> None:
    cell = config.site.cell
    for length in config.site.size:
        if abs(length / cell - round(length / cell)) > 1e-6 or round(length / cell) < 1:
            nearest = max(1, round(length / cell)) * cell
            raise ValueError(
                f"site.size is {list(config.site.size)} m, no whole number of cells of site.cell {cell:g} m; "
                f"allowed: for instance {nearest:g} for {length:g}"
            )
    rows, cols, _ = config.grid
    if rows * cols > MOST_CELLS:
        raise ValueError(f"site.size and site.cell make {rows} x {cols} cells; allowed: at most {MOST_CELLS} in all")


def _check_machine(config: SceneConfig) -> None:
    blade, machine, cell = config.blade, config.machine, config.site.cell
    if blade.width < 2 * cell:
        raise ValueError(
            f"blade.width is {blade.width:g} m; allowed: >= {2 * cell:g} m, two cells of site.cell {cell:g} m"
        )
    pieces = (machine.speed + machine.yaw_rate * hypot(blade.reach, blade.width / 2)) * config.task.period
    pieces /= STRIDE * cell
    if pieces > MOST_SUBSTEPS:
        raise ValueError(
            f"machine.speed {machine.speed:g} m/s and machine.yaw_rate {machine.yaw_rate:g} rad/s move the blade by "
            f"{pieces:g} times half a cell in a task.period of {config.task.period:g} s; allowed: {MOST_SUBSTEPS}"
        )
    room = min(config.site.size)
    need = max(machine.length / 2 + max(blade.reach, machine.length / 2), blade.width, machine.width)
    if need > room:
        raise ValueError(
            f"machine and blade take {need:g} m (machine.length, machine.width, blade.width, blade.reach); "
            f"allowed: at most the site's {room:g} m (site.size)"
        )


def _check_action(config: SceneConfig) -> None:
    if config.action.blade == "grade" and not isinstance(config.terrain, HeightField):
        raise ValueError(
            f'action.blade is "grade" and terrain is "{config.terrain.kind}"; '
            f'allowed: "{HeightField.kind}", or action.blade "tracks"'
        )


def _check_traction(config: SceneConfig) -> None:
    if not isinstance(config.terrain, HeightField):
        raise ValueError(
            f'traction is given and terrain is "{config.terrain.kind}"; allowed: "{HeightField.kind}", or no traction'
        )
    for i, earth in enumerate(config.soils):
        key, strength = "soil" if i == 0 else f"zone[{i - 1}]", earth.strength
        angles = config.traction.rake, strength.internal_friction, strength.external_friction
        if sum(angles) > STEEPEST:
            rake, internal, external = map(degrees, angles)
            raise ValueError(
                f"traction.rake {rake:g}, {key}.internal_friction {internal:g} and {key}.external_friction "
                f"{external:g} degrees make {rake + internal + external:g}; allowed: at most {degrees(STEEPEST):.1f} "
                "together, or the blade breaks no wedge out of the ground"
            )


def _check_soils(config: SceneConfig) -> None:
    if len(config.zones) > MOST:
        raise ValueError(f"the scene has {len(config.zones)} zones; allowed: at most {MOST}")
    zone_map([zone.region for zone in config.zones], config.grid)
    field = isinstance(config.terrain, HeightField)
    for key, given in (("zone", bool(config.zones)), ("soil.swell", config.soil.swell > 0.0)):
        if given and not field:
            raise ValueError(
                f'{key} is given and terrain is "{config.terrain.kind}"; allowed: "{HeightField.kind}", or no {key}'
            )


def _check_ground(config: SceneConfig) -> None:
    slope = min(earth.soil.slope for earth in config.soils)
    if isinstance(config.ground, Rough):
        _check_length("ground.length", config.ground.length, config.site.cell)
    if not isinstance(config.ground, HeightFile):
        if config.ground.steepest() > slope:
            raise ValueError(
                f"ground is as steep as {config.ground.steepest():.3f}; allowed: at most {slope:.3f}, "
                f"the slope of soil.repose{' or of the gentlest zone' if config.zones else ''}"
            )
        return
    survey = config.ground.survey(config.grid)
    walled = config.ground.nodata == "wall"
    found = face_slopes(np.where(survey.missing, np.nan, survey.height) if walled else survey.height, config.site.cell)
    steep = int((found > slope * (1 + config.soil.tolerance)).sum())
    if steep:
        warnings.warn(
            f"the ground is steeper than its soil's repose ({slope:.2f}) at {steep} of {found.size} cell faces, "
            f"at most {found.max():.3g}: there it will slump; a larger soil.repose keeps it",
            stacklevel=4,
        )


def _check_cells(config: SceneConfig) -> None:
    if isinstance(config.terrain, HeightField):
        return
    difference = config.terrain.rules_for(config.grid, config.soil).difference
    if difference >= 1.0:
        warnings.warn(
            f"terrain.required_difference is {difference:.2f}: from 1 on a full cell beside an empty one stays, so "
            "vertical walls never fall; a smaller one lets them, as do higher levels (terrain.dy)",
            stacklevel=4,
        )


def _check_length(key: str, length: float, cell: float) -> None:
    if length < 2 * cell:
        raise ValueError(f"{key} is {length:g} m; allowed: >= {2 * cell:g} m, two cells of site.cell {cell:g} m")


def _check_random(config: SceneConfig) -> None:
    _check_length("layout.rough_length", config.layout.rough_length, config.site.cell)
    if config.starts or config.goals or config.design or config.obstacles or config.hollows or config.vary:
        raise ValueError(
            "layout is random and start, goal, design, obstacle, hollow or vary are given; allowed: one or the other"
        )
    if fixed.walled(config.ground, config.grid) is not None:
        raise ValueError('ground.nodata is "wall" and the layout is random; allowed: "fill", or fixed starts and goals')
    if config.layout.room < 1:
        warnings.warn(
            f"layout.room is {config.layout.room:g}: a goal for a heap of {config.layout.volume[1]:.1f} m3 may hold "
            f"only {config.layout.room * config.layout.volume[1]:.1f} m3",
            stacklevel=4,
        )


def _check_fixed(config: SceneConfig) -> None:
    for index, start in enumerate(config.starts):
        given = [name for name in ("volume", "depth", "dig") if getattr(start, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"start[{index}] has {' and '.join(given) or 'no amount'}; allowed: one of volume m3, depth m, dig m"
            )
    if not config.design and not (config.starts and config.goals):
        raise ValueError(
            f"the scene has {len(config.starts)} start and {len(config.goals)} goal; "
            f"allowed: at least one of each, or a design{_instead(config)}"
        )
    if config.design is not None:
        _check_design(config.design)
    fixed.check(plan(config), config.pose)
    if config.vary is not None:
        vary.check(parts(config), config.vary, config.setting)
    elif any(any(part.shift) for part in config.starts + config.goals):
        raise ValueError("a start or goal has a shift and the scene has no [vary]; allowed: both, or no shift")


def _instead(config: SceneConfig) -> str:
    """Why a scene without starts and goals has no random layout either."""
    others = {"obstacle": config.obstacles, "hollow": config.hollows, "vary": config.vary}
    given = [key for key, value in others.items() if value]
    return f" ({' and '.join(given)} takes the place of a random layout)" if given else ""


def _check_design(design: Design) -> None:
    """An error for keys of which one would be ignored: a plane, a layer, a file and the ground exclude each other."""
    unread = [name for name in READING if not design.path and getattr(design, name) != getattr(Design, name)]
    if unread:
        raise ValueError(f"design has {' and '.join(unread)}; allowed: only beside design.path, the file to be read")
    given = {name: getattr(design, name) for name in ("layer", "path", "height", "slope")}
    given = [name for name, value in given.items() if value is not None]
    if given == ["height", "slope"] and design.height != "ground":
        return
    if len(given) > 1:
        raise ValueError(
            f'design has {" and ".join(given)}; allowed: one of layer, path, height = "ground", or a plane by height '
            "and slope; None takes a key out of the scene"
        )


def _check_beginning(config: SceneConfig) -> None:
    """Errors for what a reset would refuse in a layout drawn on trial; a warning for one with nothing to do."""
    trial = layout(config, np.random.default_rng(0))
    if isinstance(config.terrain, HeightField):
        quantum_for(config.grid.cell, float(np.abs(trial.height).max()))
    if config.layout is None and config.pose != "random":
        _check_stand(config, trial)
    if config.design is not None:
        _warn_if_done(config, trial)


def _check_stand(config: SceneConfig, trial: Layout) -> None:
    """An error where the blade would not fit; the tracks have been looked at."""
    grid, (x, y, heading) = config.grid, trial.pose
    world = make_world(np.zeros((grid.rows, grid.cols)), grid, trial.solid, config.site.border == "open")
    if not fits(world, grid, config.blade, config.machine, x, y, heading):
        pose = f'"{config.pose}"' if isinstance(config.pose, str) else list(config.pose)
        raise ValueError(
            f"machine.pose is {pose}: with the pivot at ({x:.2f}, {y:.2f}) m the blade, {config.blade.width:g} m wide "
            f"and {config.blade.reach:g} m ahead, is outside the site or on something solid; allowed: inside and clear"
        )


def _warn_if_done(config: SceneConfig, trial: Layout) -> None:
    """A warning where the ground is as the design asks for from the start; such an episode ends with its first step."""
    tolerance, error = config.design.tolerance, _grade_error(trial)
    if error <= tolerance:
        warnings.warn(
            f"design.tolerance is {tolerance:g} m and the ground is within {error:.3g} m of the design from the start: "
            f"the first step ends the job; a tolerance < {error:.3g} m leaves something to do",
            stacklevel=5,
        )


def _grade_error(trial: Layout) -> float:
    """Root mean square of height minus design, m."""
    return float(np.sqrt(np.square(trial.height - trial.target)[trial.design].mean()))

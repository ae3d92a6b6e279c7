"""The terrains a scene may have behind one interface: make the ground, keep it, take it up again."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dirt_env.config import SceneConfig
from dirt_env.config.terrain import HeightField
from dirt_env.render.cell_track import Cells
from dirt_env.scene.layout import Layout
from dirt_env.sim.advance import place, settle
from dirt_env.sim.state import POSE, TALLY, WORK_SPACE, World, make_world, quantum_for, work_space
from dirt_env.sim.voxel_advance import VoxelWorld, make_voxel_world, place_on_voxels, settle_voxels
from dirt_env.sim.voxel_state import VOXEL_WORK_SPACE, voxel_work_space
from dirt_env.sim.zones import Zones

AnyWorld = World | VoxelWorld


def begin_world(config: SceneConfig, layout: Layout) -> AnyWorld:
    """The ground of a layout, settled, with the machine in its place; ValueError where it cannot stand there."""
    grid, soil, terrain = config.grid, config.soil, config.terrain
    open_border = config.site.border == "open"
    if isinstance(terrain, HeightField):
        world = make_world(layout.height, grid, layout.solid, open_border)
        zones = config.zones_for(layout.zone)
        settle(world, grid, soil, zones=zones if _repose_varies(zones) else None)
        if soil.swell > 0.0:
            world = _with_bank(world, layout)
        place(world, grid, soil, config.blade, config.machine, *layout.pose, zones)
    else:
        rules, dy = terrain.rules_for(grid, soil), terrain.dy_for(grid, soil)
        depth = terrain.depth + max(0.0, float((layout.height - layout.target).max()))
        world = make_voxel_world(layout.height, grid, rules, dy, depth, terrain.headroom, layout.solid, open_border)
        settle_voxels(world, rules)
        place_on_voxels(world, grid, soil, config.blade, config.machine, rules, layout.pose)
    return world


def _repose_varies(zones: Zones | None) -> bool:
    """Whether soils differ in how the ground slumps: where they do not, it settles as if there were one."""
    return zones is not None and bool(np.ptp(zones.soils["slope"]) > 0.0)


def _with_bank(world: World, layout: Layout) -> World:
    """The world with its undisturbed soil told apart: the ground without the heaps, as far as it has not slumped."""
    rounded = np.round(layout.ground / world.quantum) * world.quantum
    natural = np.minimum(rounded.astype(world.height.dtype), world.height)
    return world._replace(bank=natural.copy(), natural=natural)


def tree_of_world(world: AnyWorld) -> dict[str, Any]:
    """Everything in a world that its future depends on, by name."""
    return {name: part for name, part in world._asdict().items() if name not in (*WORK_SPACE, *VOXEL_WORK_SPACE)}


def world_of_tree(config: SceneConfig, tree: Mapping[str, Any]) -> AnyWorld:
    """The world that `tree_of_world` described."""
    if isinstance(config.terrain, HeightField):
        return World(**tree, **work_space(tree["height"]))
    return VoxelWorld(**tree, **voxel_work_space(tree["fill"].shape))


def cells_of(world: AnyWorld) -> Cells | None:
    """The cells of a world for a picture, not copied; None on a height field."""
    if isinstance(world, World):
        return None
    return Cells(world.fill[1:-1, 1:-1, 1:-1], world.bottom, world.dy)


def world_form(config: SceneConfig) -> dict[str, Any]:
    """What `tree_of_world` gives in a scene, as a form for `dirt_env.snapshot.check`."""
    rows, cols = config.grid.rows, config.grid.cols
    ground, box = np.empty((rows, cols), np.float32), np.empty(4, np.int64)
    form = {
        "height": ground,
        "solid": (None, np.empty((rows, cols), bool)) if config.has_walls else None,
        "outside": ground if config.site.border == "open" else None,
        "machine": np.empty(1, POSE),
        "tally": np.empty(1, TALLY),
        "changed": box,
    }
    if isinstance(config.terrain, HeightField):
        bank = ground if config.soil.swell > 0.0 else None
        return {**form, "pending": box, "quantum": float, "bank": bank, "natural": bank}
    cells = np.empty((rows + 2, cols + 2, 0))  # any number of levels
    boxes = {"active": box, "touched": box, "bottom": float, "dy": float}
    return {**form, "surface": ground, "fill": cells, "incoming": cells, "life": cells.astype(np.int16), **boxes}


def check_ranges(config: SceneConfig, world: AnyWorld, layout: Layout) -> None:
    """Raise ValueError for a world whose numbers would lead out of its arrays, or whose quantum is another one."""
    grid, machine = config.grid, world.machine[0]
    width, depth = grid.cols * grid.cell, grid.rows * grid.cell
    if not (0.0 <= machine.x <= width and 0.0 <= machine.y <= depth):
        allowed = f"0..{width:g} m x 0..{depth:g} m"
        raise ValueError(f"state has the machine at x {machine.x:g} m, y {machine.y:g} m; allowed: {allowed}")
    field = isinstance(world, World)
    for name, rim in (("changed", 0), ("pending", 0)) if field else (("changed", 0), ("active", 2), ("touched", 2)):
        rows, cols = grid.rows + rim, grid.cols + rim
        r0, r1, c0, c1 = bounds = getattr(world, name).tolist()
        if not all(0 <= n <= rows for n in (r0, r1)) or not all(0 <= n <= cols for n in (c0, c1)):
            raise ValueError(f"state has the window {name} {bounds}; allowed: 0..{rows} rows, 0..{cols} cols")
    if layout.zone is not None and not 0 <= layout.zone.min() <= layout.zone.max() <= len(config.zones):
        numbers = f"{layout.zone.min()} to {layout.zone.max()}"
        raise ValueError(f"state has zones with the numbers {numbers}; allowed: 0 to {len(config.zones)}")
    if not field and not world.fill.shape == world.incoming.shape == world.life.shape:
        raise ValueError(f"state has {world.fill.shape[2]} levels of fill; allowed: as many of incoming and life")
    if field and world.quantum != (quantum := quantum_for(grid.cell, float(np.abs(layout.height).max()))):
        raise ValueError(f"state has the quantum {world.quantum!r} m; allowed: {quantum!r} m")

"""The terrains a scene may have behind one interface: make the ground, advance it, take it up again."""

from collections.abc import Mapping
from typing import Any

from dirt_env.config import SceneConfig
from dirt_env.config.terrain import HeightField
from dirt_env.scene.layout import Layout
from dirt_env.sim.advance import advance, place, settle
from dirt_env.sim.params import Command
from dirt_env.sim.state import WORK_SPACE, World, make_world, work_space
from dirt_env.sim.voxel_advance import VoxelWorld, advance_voxels, make_voxel_world, settle_voxels
from dirt_env.sim.voxel_state import VOXEL_WORK_SPACE, voxel_work_space

AnyWorld = World | VoxelWorld


def begin_world(config: SceneConfig, layout: Layout) -> AnyWorld:
    """The ground of a layout, settled, with the machine in its place; ValueError where it cannot stand there."""
    grid, soil, terrain = config.grid, config.soil, config.terrain
    open_border = config.site.border == "open"
    if isinstance(terrain, HeightField):
        world = make_world(layout.height, grid, layout.solid, open_border)
        settle(world, grid, soil)
    else:
        rules, dy = terrain.rules_for(grid, soil), terrain.dy_for(grid, soil)
        depth = terrain.depth + max(0.0, float((layout.height - layout.target).max()))
        world = make_voxel_world(layout.height, grid, rules, dy, depth, terrain.headroom, layout.solid, open_border)
        settle_voxels(world, rules)
    place(world, grid, soil, config.blade, config.machine, *layout.pose)
    return world


class Stepper:
    """step(world, command, seconds): one control step of the scene's terrain, in place."""

    def __init__(self, config: SceneConfig) -> None:
        constants = config.grid, config.soil, config.blade, config.machine
        if isinstance(config.terrain, HeightField):
            self._advance, self._constants = advance, constants
        else:
            rules = config.terrain.rules_for(config.grid, config.soil)
            self._advance, self._constants = (
                advance_voxels,
                (*constants, rules, float(config.terrain.updates_per_second)),
            )

    def __call__(self, world: AnyWorld, command: Command, seconds: float) -> None:
        """Advance the world."""
        self._advance(world, *self._constants, command, seconds)


def tree_of_world(world: AnyWorld) -> dict[str, Any]:
    """Everything in a world that its future depends on, by name."""
    return {name: part for name, part in world._asdict().items() if name not in (*WORK_SPACE, *VOXEL_WORK_SPACE)}


def world_of_tree(config: SceneConfig, tree: Mapping[str, Any]) -> AnyWorld:
    """The world that `tree_of_world` described."""
    if isinstance(config.terrain, HeightField):
        return World(**tree, **work_space(tree["height"]))
    return VoxelWorld(**tree, **voxel_work_space(tree["fill"].shape))

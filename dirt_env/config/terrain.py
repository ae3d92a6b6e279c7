"""What the ground is made of: a height field, or the paper's cells."""

from dataclasses import dataclass
from typing import ClassVar

from dirt_env.sim.params import Grid, Soil
from dirt_env.sim.voxel_state import FOOTINGS, GRAIN, Rules

STEEPEST = 0.75  # required difference beyond which levels are made higher, where nobody says how high


@dataclass(frozen=True)
class HeightField:
    """The default: one height for each cell of the site."""

    kind: ClassVar[str] = "heightfield"


@dataclass(frozen=True)
class VoxelGrid:
    """The paper's model. None: what follows from the site's cells and the soil's repose; see `dy_for`, `rules_for`.

    `dy` m a level; `depth` m of soil under the lowest ground, `headroom` m of cells over the highest;
    `updates_per_second`; the rest are the paper's numbers and the readings of its text, see `sim.voxel_state.Rules`.
    """

    kind: ClassVar[str] = "voxel"
    dy: float | None = None
    depth: float = 1.0
    headroom: float = 2.0
    updates_per_second: float = 60.0
    required_difference: float | None = None
    transfer_rate: float = 0.08
    life: int = 100
    exact: bool = False
    neighbours: int = 4
    reads: str = "snapshot"
    sinking: str = "at once"
    rise_into_constraint: bool = False
    footing: str = "tracks"

    def dy_for(self, grid: Grid, soil: Soil) -> float:
        """Height of a level [m]: as cells are wide, or as much higher as keeps the required difference under 3/4."""
        return grid.cell * max(1.0, soil.slope / STEEPEST) if self.dy is None else self.dy

    def rules_for(self, grid: Grid, soil: Soil) -> Rules:
        """The rules of the cells; the required difference is that of repose, slope * dx / dy."""
        follows = soil.slope * grid.cell / self.dy_for(grid, soil)
        return Rules(
            difference=follows if self.required_difference is None else self.required_difference,
            rate=self.transfer_rate,
            life=self.life,
            grain=GRAIN if self.exact else 0.0,
            neighbours=self.neighbours,
            in_place=self.reads == "in place",
            down_in_transit=self.sinking == "in transit",
            rise_into_constraint=self.rise_into_constraint,
            footing=FOOTINGS.index(self.footing),
        )


Terrain = HeightField | VoxelGrid

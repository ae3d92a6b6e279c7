"""The tables `soil` and `zone` of a scene: what the ground is made of, and where it is made of something else."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan, degrees, radians, tan
from pathlib import Path
from typing import Any, NamedTuple

from dirt_env.config.presets import PRESETS
from dirt_env.config.rules import Choice, Number, Rule, Table, join, known_keys
from dirt_env.scene.regions import Region
from dirt_env.sim.params import Soil, Strength


class Repose(Number):
    """An angle of repose in degrees, kept as its tangent; 12 decimals count, so that it survives being written back."""

    def read(self, value, key, folder) -> float:
        return tan(radians(round(super().read(value, key, folder), 12)))

    def write(self, value) -> float:
        return round(degrees(atan(value)), 12)


class Angle(Number):
    """An angle in degrees, kept in radians; 12 decimals count, so that it survives being written back."""

    def read(self, value, key, folder) -> float:
        return radians(round(super().read(value, key, folder), 12))

    def write(self, value) -> float:
        return round(degrees(value), 12)


def _rounded(angle: float) -> float:
    """The angle [rad] that comes back when it is written in degrees."""
    return radians(round(degrees(angle), 12))


class Earth(NamedTuple):
    """All that the table `soil` says: the loose soil, and what it stands before it gives way."""

    soil: Soil
    strength: Strength


def _earth(slope: float = Soil().slope, friction: float | None = None, **rest: float) -> Earth:
    """Soil whose friction on itself and inside is that of its repose, if nothing else is said; on steel 2/3 of it."""
    of_soil = {name: rest.pop(name) for name in Soil._fields if name in rest}
    internal = rest.pop("internal_friction", _rounded(atan(slope)))
    external = rest.pop("external_friction", _rounded(internal * 2 / 3))
    soil = Soil(slope=slope, friction=slope if friction is None else friction, **of_soil)
    return Earth(soil, Strength(internal_friction=internal, external_friction=external, **rest))


class SoilTable(Table):
    """The table `soil`; its `preset` gives the keys that are not there themselves."""

    def read(self, value, key, folder) -> Earth:
        if not isinstance(value, Mapping) or "preset" not in value:
            return super().read(value, key, folder)
        preset = self.rules["preset"].read(value["preset"], join(key, "preset"), folder)
        return super().read({**PRESETS[preset], **{k: v for k, v in value.items() if k != "preset"}}, key, folder)

    def write(self, value) -> dict[str, Any]:
        numbers = {**value.soil._asdict(), **value.strength._asdict()}
        return {name: rule.write(numbers[self.field(name)]) for name, rule in self.rules.items() if name != "preset"}


@dataclass(frozen=True)
class Zone:
    """A region with another soil: what is `said` of it, as keys and plain values; the rest is the scene's soil."""

    region: Region
    said: tuple[tuple[str, float | str], ...] = ()

    def earth(self, base: Earth) -> Earth:
        """Its soil, where `base` is the scene's."""
        said = dict(self.said)
        below = {**SOIL.write(base), **PRESETS.get(said.pop("preset", ""), {})}
        return SOIL.read({**below, **said}, "zone", Path())


class ZoneTable(Table):
    """A table `zone`: a region, and keys of a soil, which are kept as they are written."""

    def read(self, value, key, folder) -> Zone:
        known_keys(value, key, self.rules)
        if "region" not in value:
            raise ValueError(f"{join(key, 'region')} is missing; needed: region")
        for name, item in value.items():
            self.rules[name].read(item, join(key, name), folder)
        said = tuple((name, value[name]) for name in self.rules if name in value and name != "region")
        return Zone(self.rules["region"].read(value["region"], join(key, "region"), folder), said)

    def write(self, value) -> dict[str, Any]:
        return {"region": self.rules["region"].write(value.region), **dict(value.said)}


SOIL = SoilTable(
    _earth,
    {
        "preset": Choice(tuple(PRESETS)),
        "repose": Repose(0, 90, "degrees", below=True),
        "density": Number(0, 1e9, "kg/m3", above=True),
        "friction": Number(0, 1e6),
        "tolerance": Number(0, 0.1, above=True),
        "cohesion": Number(0, 1e9, "Pa"),
        "internal_friction": Angle(0, 90, "degrees", below=True),
        "adhesion": Number(0, 1e9, "Pa"),
        "external_friction": Angle(0, 90, "degrees", below=True),
        "shear_deformation": Number(0, 10, "m"),
        "swell": Number(0, 2),
    },
    fields={"repose": "slope"},
)

OF_THE_SCENE = ("tolerance", "swell")  # keys of a soil that all zones share


def zone_table(region: Rule) -> ZoneTable:
    """The table `zone`, whose region is under that rule."""
    rules = {name: rule for name, rule in SOIL.rules.items() if name not in OF_THE_SCENE}
    return ZoneTable(Zone, {"region": region, **rules}, ("region",))

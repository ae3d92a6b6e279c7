"""Soils by name: keys of a scene's table `soil`, for `soil.preset`. docs/machine.md says where each number is from.

Densities are those of loose soil, strengths those of soil as it is cut. Take them as typical: in the field 20 % more
or less is nothing unusual.
"""

KEYS = ("repose", "density", "friction", "cohesion", "internal_friction", "adhesion", "external_friction")
KEYS += ("shear_deformation",)
_ROWS = {
    "dry_sand": (34.0, 1420.0, 0.67, 0.0, 34.0, 0.0, 17.0, 0.025),
    "wet_sand": (45.0, 1840.0, 0.67, 1000.0, 34.0, 0.0, 17.0, 0.025),
    "gravel": (38.0, 1510.0, 0.78, 0.0, 38.0, 0.0, 22.0, 0.025),
    "loam": (38.0, 1250.0, 0.78, 20000.0, 20.0, 0.0, 10.0, 0.010),
    "clay": (33.0, 1480.0, 0.65, 30000.0, 10.0, 5000.0, 6.0, 0.006),
    "snow": (38.0, 300.0, 0.36, 1030.0, 19.7, 0.0, 5.0, 0.040),
    "lunar_regolith": (40.0, 1500.0, 0.75, 500.0, 37.0, 0.0, 18.0, 0.018),
}
PRESETS: dict[str, dict[str, float]] = {name: dict(zip(KEYS, row, strict=True)) for name, row in _ROWS.items()}

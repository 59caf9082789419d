"""A cable robot's workspace as lists: the cells of a grid, and outlines of sections. Headers carry the robot file's units."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._types import Array
from robocal.cables.boundary import Outline
from robocal.cables.closure import Dexterity
from robocal.cables.workspace import Grid
from robocal.files.cable.cable_model import CableUnits
from robocal.files.csvtext import csv_text

__all__ = ["cells_text", "outlines_text"]


def cells_text(made: Grid, acceleration: Array, even: Dexterity, units: CableUnits, closure: bool = False) -> str:
    """x, y, z of every cell's centre, whether it is held (1 or 0), its margin and the acceleration (nx, ny, nz) m/s^2 that is possible
    there, neither of `closure`; tension factor and condition number (nx, ny, nz); empty where there is no number."""
    length, force = units.length, units.force
    header = [*(f"{axis} [{length.name}]" for axis in "xyz"), "held", f"margin [{force.name}]", "acceleration [m/s2]"]
    header += ["tension factor", "condition number"]
    centres = np.stack(np.meshgrid(*made.axes, indexing="ij"), axis=-1).reshape(-1, 3)
    margin = np.full(made.inside.size, np.nan) if made.margin is None or closure else made.margin.ravel()
    columns = [_cells(length.from_si(c)) for c in centres.T]
    columns.append(["1" if held else "0" for held in made.inside.ravel().tolist()])
    columns += [_cells(force.from_si(margin)), _cells(acceleration.ravel())]
    columns += [_cells(even.tension_factor.ravel()), _cells(even.condition.ravel())]
    return csv_text(header, zip(*columns, strict=True))


def outlines_text(sections: Mapping[str, Outline], units: CableUnits) -> str:
    """Points of the boundary in order, by the name of the section."""
    length = units.length
    header = ["section", *(f"{axis} [{length.name}]" for axis in "xyz")]
    names = [name for name, line in sections.items() for _ in line.points]
    points = np.concatenate([line.points for line in sections.values()])
    return csv_text(header, zip(names, *(_cells(length.from_si(c)) for c in points.T), strict=True))


def _cells(values: Array) -> list[str]:
    return [f"{v:.9g}" if abs(v) < np.inf else "" for v in values.tolist()]

"""What `cable workspace` found, the files of its folder and the document that says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.boundary import Outline, Surface
from robocal.cables.closure import CLOSED, Dexterity
from robocal.cables.geometry import CableRobot
from robocal.cables.room import Regions, cut_off
from robocal.cables.workspace import Demand, Grid, dexterities, margins
from robocal.files.cable.grid import cells_text, outlines_text
from robocal.files.cable.values import CableUnits
from robocal.files.mesh import ply_text, stl_bytes
from robocal.files.plain import json_text
from robocal.files.text import InputFile
from robocal.geometry import so3
from robocal.remarks.remark import Remark, told
from robocal.session.cable.load import framed

__all__ = ["PLANES", "RayStart", "Workspace", "texts"]

Array = NDArray[np.float64]


def texts(made: Workspace) -> dict[str, str | bytes]:
    """The files of the folder, but its page."""
    out: dict[str, str | bytes] = {
        "workspace.json": json_text(made.document),
        "workspace.csv": cells_text(made.grid, made.room, made.dexterity, made.units, made.demand.closure),
    }
    if made.sections:
        out["outlines.csv"] = outlines_text(made.sections, made.units)
    if isinstance(made.boundary, Surface):
        out["surface.ply"] = ply_text(made.boundary.vertices, made.boundary.faces)
        out["surface.stl"] = stl_bytes(made.boundary.vertices, made.boundary.faces)
    return out


PLANES: Mapping[str, tuple[int, int]] = MappingProxyType({"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)})


@dataclass(frozen=True, eq=False)
class RayStart:
    """Where rays start, (3,) m, in words why there, and which share of the grid's held cells is seen from it."""

    at: Array
    why: str
    seen: float


@dataclass(frozen=True, eq=False)
class Workspace:
    """A workspace: what was demanded, in which box (3, 2) m and `how` that was chosen; the grid with margins, the possible
    accelerations (nx, ny, nz) m/s^2 and the dexterity of its cells (NaN outside), what its cells make up (None: nothing is held); the
    boundary by `rays` and its sections, whether X_0 is in it; remarks; and `doubts`: why it must not be trusted."""

    robot: CableRobot
    demand: Demand
    units: CableUnits
    box: Array
    how: str
    grid: Grid
    room: Array
    dexterity: Dexterity
    regions: Regions | None
    start: RayStart | None
    boundary: Surface | Outline | None
    sections: Mapping[str, Outline]
    rays: int
    home_held: bool
    warnings: tuple[Remark, ...]
    doubts: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str = ""

    @property
    def size(self) -> float | None:
        """Volume (m^3) or, of a planar robot, area (m^2) within the boundary."""
        if self.boundary is None:
            return None
        return self.boundary.area if isinstance(self.boundary, Outline) else self.boundary.volume

    @property
    def cut(self) -> tuple[str, ...]:
        """The sides of the box that it reaches."""
        if self.regions is None or self.grid.margin is None:
            return ()
        found = tuple(cut_off(self.regions.extent, self.box))
        if self.how == "--box" or (not self.demand.closure and self.demand.extra[:, :3].any()):
            return found
        # Beyond the frame all cables pull to one side, which weight does not balance: only the floor cuts, and where weight does not
        # count it does so within the frame alone.
        lowest = self.robot.a[:, 2].min() - (self.robot.b @ self.demand.rotations.swapaxes(-1, -2))[..., 2].max()
        floor = "z-" in found and not (self.demand.closure and self.box[2, 0] <= lowest)
        return ("z-",) if floor else ()

    @property
    def document(self) -> dict[str, Any]:
        """What workspace.json holds."""
        made, size = self.grid, self.size
        wide = float(np.prod(np.where(made.cell > 0, self.box[:, 1] - self.box[:, 0], 1.0)))
        what = "volume_m3" if (made.cell > 0).all() else "area_m2"
        home = self.robot.home[:3, 3]
        there = dexterities(self.robot, self.demand, home[None])
        spare = None if self.demand.closure else float(margins(self.robot, self.demand, home[None])[0])
        found = {
            "verdict": {"status": "empty" if self.start is None else "found", **told(self.doubts, "reasons")},
            "demand": self._demanded(),
            "box": {"m": self.box, "chosen": self.how},
            "grid": {
                "m": np.stack([[x[0] - c / 2, x[-1] + c / 2] for x, c in zip(made.axes, made.cell, strict=True)]),
                "cells": list(made.inside.shape), "held": int(made.inside.sum()), what: made.volume, "share_of_box": made.volume / wide,
            },
            "rays": None if self.start is None or size is None else {
                "count": self.rays, "start_m": self.start.at, "start": self.start.why, what: size,
                "difference": size / made.volume - 1.0 if made.volume > 0 else None, "seen_share": self.start.seen,
            },
            **self._shape(what),
            "home": {"position_m": home, "held": self.home_held, "margin_N": spare,
                     "tension_factor": float(there.tension_factor[0]), "condition": float(there.condition[0])},
            "sections": {name: {"area_m2": line.area} for name, line in self.sections.items()},
        }  # fmt: skip
        said = (*self.warnings, *self.doubts)
        return framed(self.robot, found, warnings=said, inputs=self.inputs, command=self.command)

    def _demanded(self) -> dict[str, Any]:
        demand = self.demand
        if demand.closure:
            return {"closure": True, "orientations_rad": so3.log(demand.rotations), "length_m": demand.length}
        return {
            "closure": False,
            "masses_kg": demand.masses,
            "orientations_rad": so3.log(demand.rotations),
            "wrenches": demand.extra,
            "acceleration_m_s2": demand.acceleration,
            "reserve_N": demand.reserve,
            "length_m": demand.length,
            "gravity_m_s2": demand.gravity,
            "limits_N": self.robot.limits,
        }

    def _shape(self, what: str) -> dict[str, Any]:
        """Where it lies, what it consists of, and what its cells have to spare."""
        found, made = self.regions, self.grid
        if found is None or made.margin is None:
            return {
                "centre_m": None,
                "extent_m": None,
                "reaches_box": [],
                "margin_N": None,
                "acceleration_m_s2": None,
                "tension_factor": None,
                "condition": None,
                "closed_share": None,
                "best": None,
            }
        one = made.volume / made.inside.sum()
        margin, room = made.margin[made.inside], self.room[made.inside]
        factor, condition = (x[made.inside] for x in (self.dexterity.tension_factor, self.dexterity.condition))
        plain = not self.demand.closure
        k = np.unravel_index(int(np.argmax(np.where(made.inside, made.margin, -np.inf))), made.inside.shape)
        return {
            "centre_m": found.centre,
            "extent_m": found.extent,
            "reaches_box": list(self.cut),
            f"parts_{what}": [n * one for n in found.parts],
            f"holes_{what}": [n * one for n in found.holes],
            "margin_N": _spread(margin) if plain else None,
            "acceleration_m_s2": _spread(room) if plain else None,
            "tension_factor": _spread(factor),
            "condition": _spread(condition),
            "closed_share": float((factor > CLOSED).mean()),
            "best": {
                "position_m": [float(made.axes[i][k[i]]) for i in range(3)],
                "margin_N": float(made.margin[k]) if plain else None,
                "acceleration_m_s2": float(self.room[k]) if plain else None,
                "tension_factor": float(self.dexterity.tension_factor[k]),
                "condition": float(self.dexterity.condition[k]),
            },
        }


def _spread(values: Array) -> dict[str, float]:
    return {"least": float(values.min()), "median": float(np.median(values)), "greatest": float(values.max())}

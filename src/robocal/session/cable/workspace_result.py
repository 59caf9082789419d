"""What `cable workspace` found, the files of its folder and the document that says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from robocal._types import Array
from robocal.cables.boundary import Outline, Surface
from robocal.cables.closure import CLOSED, Dexterity
from robocal.cables.grid_regions import Regions, cut_off
from robocal.cables.workspace import Demand, Grid, dexterities, margins
from robocal.files.cable.grid import cells_text, outlines_text
from robocal.files.mesh import ply_text, stl_bytes
from robocal.files.parts import CableDocument
from robocal.files.plain import json_text
from robocal.geometry import so3
from robocal.quantities import UnitValue, unit_value
from robocal.remarks.remark import remark_fields
from robocal.session.cable.cable_result import CableResult

__all__ = ["PLANES", "RayStart", "Workspace"]


PLANES: Mapping[str, tuple[int, int]] = MappingProxyType({"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)})


@dataclass(frozen=True, eq=False)
class RayStart:
    """Where rays start, (3,) m, in words why there, and which share of the grid's held cells is seen from it."""

    at: Array
    why: str
    visible: float


@dataclass(frozen=True, kw_only=True)
class Spread:
    """A number over the held cells, in its unit."""

    unit: str
    least: float
    median: float
    greatest: float

    @classmethod
    def of(cls, values: Array, unit: str = "") -> Spread:
        """Of the numbers of all held cells."""
        return cls(unit=unit, least=float(values.min()), median=float(np.median(values)), greatest=float(values.max()))


@dataclass(frozen=True, kw_only=True)
class GridPart:
    """The box that its cells cover (3, 2), how many they are along each axis, how many are held, and their size."""

    unit: str
    sides: Array
    cells: list[int]
    held: int
    size: UnitValue
    share_of_box: float


@dataclass(frozen=True, kw_only=True)
class RaysPart:
    """The size within the exact boundary that `count` rays from `start` meet; `why` they start there."""

    count: int
    start: UnitValue
    why: str
    size: UnitValue
    difference: float | None
    seen_share: float


@dataclass(frozen=True, kw_only=True)
class Shape:
    """Where it lies, what it consists of, and what its cells have to spare; lists are empty and the rest null where nothing is held."""

    centre: UnitValue | None = None
    extent: UnitValue | None = None
    reaches_box: tuple[str, ...] = ()
    parts: UnitValue | None = None
    holes: UnitValue | None = None
    margin: Spread | None = None
    acceleration: Spread | None = None
    tension_factor: Spread | None = None
    condition: Spread | None = None
    closed_share: float | None = None
    best: Spot | None = None


@dataclass(frozen=True, kw_only=True)
class Spot:
    """A place, and what the cables have to spare there."""

    position: UnitValue
    held: bool
    margin: UnitValue | None
    acceleration: UnitValue | None = None
    tension_factor: float
    condition: float


@dataclass(frozen=True, kw_only=True)
class WorkspaceDocument(CableDocument, Shape):
    """workspace.json."""

    verdict: dict[str, Any]
    demand: dict[str, Any]
    box: dict[str, Any]
    grid: GridPart
    rays: RaysPart | None
    home: Spot
    sections: dict[str, dict[str, UnitValue]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Workspace(CableResult):
    """A workspace: what was demanded, in which box (3, 2) m and `how` that was chosen; the grid with margins, the possible
    accelerations (nx, ny, nz) m/s^2 and the dexterity of its cells (NaN outside), what its cells make up (None: nothing is held); the
    boundary by `rays` and its sections, whether X_0 is in it."""

    demand: Demand
    box: Array
    how: str
    grid: Grid
    outer_box: Array
    dexterity: Dexterity
    regions: Regions | None
    start: RayStart | None
    boundary: Surface | Outline | None
    sections: Mapping[str, Outline]
    rays: int
    home_feasible: bool

    title: ClassVar[str] = "workspace"

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
    def document(self) -> WorkspaceDocument:
        """What workspace.json holds."""
        made, size = self.grid, self.size
        wide = float(np.prod(np.where(made.cell > 0, self.box[:, 1] - self.box[:, 0], 1.0)))
        home = self.robot.home[:3, 3]
        there = dexterities(self.robot, self.demand, home[None])
        spare = None if self.demand.closure else float(margins(self.robot, self.demand, home[None])[0])
        rays = None if self.start is None or size is None else RaysPart(
            count=self.rays, start=UnitValue(self.start.at, "m"), why=self.start.why, size=UnitValue(size, self.unit),
            difference=size / made.volume - 1.0 if made.volume > 0 else None, seen_share=self.start.visible,
        )  # fmt: skip
        sides = np.stack([[x[0] - c / 2, x[-1] + c / 2] for x, c in zip(made.axes, made.cell, strict=True)])
        return self.document_of(
            WorkspaceDocument,
            verdict={"status": "empty" if self.start is None else "found", **remark_fields(self.reasons, "reasons")},
            demand=self._demand_document(),
            box={"unit": "m", "sides": self.box, "chosen": self.how},
            grid=GridPart(
                unit="m", sides=sides, cells=list(made.inside.shape), held=int(made.inside.sum()), size=UnitValue(made.volume, self.unit),
                share_of_box=made.volume / wide,
            ),
            rays=rays,
            home=Spot(
                position=UnitValue(home, "m"), held=self.home_feasible, margin=unit_value(spare, "N"),
                tension_factor=float(there.tension_factor[0]), condition=float(there.condition[0]),
            ),
            sections={name: {"area": UnitValue(line.area, "m2")} for name, line in self.sections.items()},
            **vars(self.shape),
        )  # fmt: skip

    @property
    def unit(self) -> str:
        """That of its size: of a planar robot an area."""
        return "m3" if (self.grid.cell > 0).all() else "m2"

    def _demand_document(self) -> dict[str, Any]:
        demand = self.demand
        common = {
            "closure": demand.closure, "orientations": UnitValue(so3.log(demand.rotations), "rad"), "length": UnitValue(demand.length, "m"),
        }  # fmt: skip
        if demand.closure:
            return common
        return common | {
            "masses": UnitValue(demand.masses, "kg"),
            "wrenches": {"units": ["N", "Nm"], "values": demand.extra},
            "acceleration": UnitValue(demand.acceleration, "m/s2"),
            "reserve": UnitValue(demand.reserve, "N"),
            "gravity": UnitValue(demand.gravity, "m/s2"),
            "limits": UnitValue(self.robot.limits, "N"),
        }

    @property
    def shape(self) -> Shape:
        """Where it lies, what it consists of, and what its cells have to spare."""
        found, made = self.regions, self.grid
        if found is None or made.margin is None:
            return Shape()
        one, plain = made.volume / made.inside.sum(), not self.demand.closure
        factor, condition = self.dexterity.tension_factor, self.dexterity.condition
        k = np.unravel_index(int(np.argmax(np.where(made.inside, made.margin, -np.inf))), made.inside.shape)
        best = Spot(
            position=UnitValue([float(made.axes[i][k[i]]) for i in range(3)], "m"), held=True,
            margin=UnitValue(float(made.margin[k]), "N") if plain else None,
            acceleration=UnitValue(float(self.outer_box[k]), "m/s2") if plain else None,
            tension_factor=float(factor[k]), condition=float(condition[k]),
        )  # fmt: skip
        return Shape(
            centre=UnitValue(found.centre, "m"), extent=UnitValue(found.extent, "m"), reaches_box=self.cut,
            parts=UnitValue([n * one for n in found.parts], self.unit), holes=UnitValue([n * one for n in found.holes], self.unit),
            margin=Spread.of(made.margin[made.inside], "N") if plain else None,
            acceleration=Spread.of(self.outer_box[made.inside], "m/s2") if plain else None,
            tension_factor=Spread.of(factor[made.inside]), condition=Spread.of(condition[made.inside]),
            closed_share=float((factor[made.inside] > CLOSED).mean()), best=best,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The files of the folder, but its page."""
        cells = cells_text(self.grid, self.outer_box, self.dexterity, self.file.units, self.demand.closure)
        out: dict[str, str | bytes] = {"workspace.json": json_text(self.document), "workspace.csv": cells}
        if self.sections:
            out["outlines.csv"] = outlines_text(self.sections, self.file.units)
        if isinstance(self.boundary, Surface):
            out["surface.ply"] = ply_text(self.boundary.vertices, self.boundary.faces)
            out["surface.stl"] = stl_bytes(self.boundary.vertices, self.boundary.faces)
        return out

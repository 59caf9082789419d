"""What `cable workspace` found, the files of its folder, the document that says it, and its page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.boundary import Outline, Surface
from robocal.cables.closure import CLOSED, Dexterity
from robocal.cables.geometry import CableRobot
from robocal.cables.grid_regions import Regions, cut_off
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.cables.workspace import Demand, Grid, dexterities, grid, margins
from robocal.files.cable.grid import cells_text, outlines_text
from robocal.files.mesh import ply_text, stl_bytes
from robocal.files.parts import CableDocument
from robocal.files.plain import json_text
from robocal.geometry import se3, so3
from robocal.quantities import UnitValue, unit_value
from robocal.remarks.remark import remark_fields
from robocal.report.cable.length_unit import LengthUnit
from robocal.report.cable.part import part
from robocal.report.cable.plane_sections import section
from robocal.report.cable.scene import scene
from robocal.report.numbers import significant
from robocal.report.sections import Section
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.statics_options import limits_text

__all__ = ["PLANES", "RayStart", "Workspace"]

MOST = 20  # grid: orientations that are listed
PLANES: Mapping[str, tuple[int, int]] = MappingProxyType({"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)})


@record(eq=False)
class RayStart:
    """Where rays start, (3,) m, in words why there, and which share of the grid's held cells is seen from it."""

    at: Array
    why: str
    visible: float


@record(kw_only=True)
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


@record(kw_only=True)
class GridPart:
    """The box that its cells cover (3, 2), how many they are along each axis, how many are held, and their size."""

    unit: str
    sides: Array
    cells: list[int]
    held: int
    size: UnitValue
    share_of_box: float


@record(kw_only=True)
class RaysPart:
    """The size within the exact boundary that `count` rays from `start` meet; `why` they start there."""

    count: int
    start: UnitValue
    why: str
    size: UnitValue
    difference: float | None
    seen_share: float


@record(kw_only=True)
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


@record(kw_only=True)
class Spot:
    """A place, and what the cables have to spare there."""

    position: UnitValue
    held: bool
    margin: UnitValue | None
    acceleration: UnitValue | None = None
    tension_factor: float
    condition: float


@record(kw_only=True)
class WorkspaceDocument(CableDocument, Shape):
    """workspace.json."""

    verdict: dict[str, Any]
    demand: dict[str, Any]
    box: dict[str, Any]
    grid: GridPart
    rays: RaysPart | None
    home: Spot
    sections: dict[str, dict[str, UnitValue]]


@record(kw_only=True, eq=False)
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
        lowest = (
            self.robot.frame_points[:, 2].min()
            - (self.robot.platform_points @ self.demand.rotations.swapaxes(-1, -2))[..., 2].max()
        )
        floor = "z-" in found and not (self.demand.closure and self.box[2, 0] <= lowest)
        return ("z-",) if floor else ()

    @property
    def cut_text(self) -> str:
        """These sides in words."""
        return ", ".join(f"{side[0]} is {'least' if side[1] == '-' else 'greatest'}" for side in self.cut)

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

    def details(self) -> Iterator[Section]:
        """What a page has room for: the robot, sections with margins, what was demanded, how it was worked out."""
        robot, demand, ruler = self.robot, self.demand, self.length_unit
        if self.boundary is not None:
            yield _picture(robot, demand, self.boundary, ruler, _explanation(self))
        for k, (name, line) in enumerate(self.sections.items()):
            axes = ("xyz".index(name[0]), "xyz".index(name[1]))
            across = 3 - sum(axes)
            level = ruler.text(float(line.start[across]))
            where = f" at {'xyz'[across]} = {level} {ruler.name}" if len(self.sections) > 1 else ""
            text = (
                f"{'Tension factors' if demand.closure else 'Margins'} in the plane {name} through the start of the rays; the line is the "
                f"exact boundary seen from there. Area within it: {significant(line.area, 4)} m²{where}."
            )
            drawn = section(robot, [line], _sheet(self, line.start, axes), axes, ruler=ruler, closure=demand.closure)
            yield part(f"Section {name}", text, drawn, folded=k > 0)
        if not self.sections and not demand.closure:
            text = "Nothing is held: colours say by how much, at least, the cables fail. The middle layer of the grid."
            axes = (robot.axes[0], robot.axes[1])
            yield part("The grid", text, section(robot, [], self.grid, axes, ruler=ruler))
        yield part("What was demanded", _words(demand, ruler), table=_demand_rows(demand), folded=True)
        model = "Straight cables" + ("" if robot.wheels is None else " over pulleys")
        limits = "" if demand.closure else f"; limits {limits_text(robot.need('limits'))}"
        yield self.method_part(f"{model}, what they weigh left out{limits}.")


MARGIN = "The margin, in the sections, is the size of the smallest disturbance that the cables could not balance."


def _explanation(made: Workspace) -> str:
    text = (
        "A position of the platform's origin belongs to the workspace when cables that pull, as strongly as it takes, balance any wrench."
        if made.demand.closure
        else "A position of the platform's origin belongs to the workspace when tensions within the limits balance everything demanded."
    )
    return text + (f" It is cut off by the box where {made.cut_text}." if made.cut else "")


def _picture(robot: CableRobot, demand: Demand, boundary: Surface | Outline, ruler: LengthUnit, before: str) -> Section:
    """The robot where the rays start, with the least tensions for the first orientation and wrench and the greatest mass."""
    pose, heading = se3.compose(demand.rotations[0], boundary.start), "The robot and its workspace"
    place = f"{before}\n\nThe platform where the rays start, {ruler.point(boundary.start)}"
    if demand.closure:
        return part(heading, f"{place}.", scene(robot, pose, surface=boundary, ruler=ruler))
    mass = float(demand.masses.max())
    wrench = gravity_wrench(pose[None], mass, robot.com, demand.gravity) + demand.extra[:1]
    pull = distribute(structure_of(robot, pose[None]), wrench[:, list(robot.axes)], robot.need("limits")).tension[0]
    text = f"{place}, with {significant(mass, 4)} kg: the least tensions that hold it. {MARGIN}"
    return part(heading, text, scene(robot, pose, tension=pull, surface=boundary, ruler=ruler))


def _words(demand: Demand, ruler: LengthUnit) -> str:
    if demand.closure:
        return "Any wrench at all, in each orientation: neither weight nor tension limits take part."
    text = (
        "Each orientation with each mass and each wrench beside the weight; for a range of masses its ends are enough."
    )
    if demand.acceleration > 0:
        much = significant(demand.acceleration, 4)
        text += f" The centre of mass may accelerate at {much} m/s² in any direction, without turning."
    if demand.reserve > 0:
        much, lever = significant(demand.reserve, 4), ruler.short(demand.length)
        text += f" A disturbance of {much} N in any direction (moments over {lever}) is held on top."
    return text


def _demand_rows(demand: Demand) -> list[list[str]]:
    turns = np.degrees(so3.log(demand.rotations))
    rows = [["Orientations", "; ".join(_angles(v) for v in turns[:MOST]) + ("; ..." if len(turns) > MOST else "")]]
    if not demand.closure:
        rows.insert(0, ["Masses", ", ".join(f"{significant(float(m), 4)} kg" for m in demand.masses)])
        wrenches = (", ".join(f"{v:g}" for v in row) for row in demand.extra)
        rows.append(["Wrenches", "; ".join(wrenches) + " (N, Nm)"])
    return [["", ""], *rows]


def _angles(vector: Array) -> str:
    return "upright" if not np.abs(vector).max() > 1e-9 else ", ".join(f"{v:.3g}" for v in vector) + " deg"


def _sheet(made: Workspace, start: Array, axes: tuple[int, int]) -> Grid:
    """Margins in a plane through the start, over the box without thickness."""
    sides, counts, across = made.box.copy(), [max(n, 61) for n in made.grid.inside.shape], 3 - sum(axes)
    sides[across], counts[across] = start[across], 1
    return grid(made.robot, made.demand, sides, (counts[0], counts[1], counts[2]), with_margins=True)

"""What `cable workspace` is made of: the box, the grid, the start and length of rays, the boundary, remarks, files, and
the document that says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.boundary import Outline, Surface, outline, surface
from robocal.cables.geometry import CableRobot
from robocal.cables.room import Regions, cut_off, frame_box, regions, seen_from
from robocal.cables.workspace import Demand, Grid, accelerations, as_box, grid, holds, margins
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.grid import cells_text, outlines_text
from robocal.files.cable.robot import read_cable
from robocal.files.cable.values import CableUnits
from robocal.files.mesh import ply_text, stl_bytes
from robocal.files.plain import json_text
from robocal.files.text import InputFile
from robocal.geometry import so3
from robocal.jobs.cable.demand import demand_of
from robocal.jobs.cable.load import framed, held_robot, robot_input
from robocal.jobs.watching import Watch
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, told

__all__ = ["PLANES", "RayStart", "Workspace", "texts", "workspace"]

Array = NDArray[np.float64]
SECTION = 720  # rays of a section, at most


STEPS, MOST_STEPS = 64, 4096  # of a ray
NEAR = 0.02  # by how much volumes may differ without a remark
SEEN = 0.99  # the share of the held cells that the start has to see without one


def workspace(o: Any, command: str = "", watch: Watch | None = None) -> Workspace:
    """The workspace for what is demanded, by the options of the verb. Raises InputError."""
    file = read_cable(o.robot)
    si = o.si(file.units)
    able, demand = held_robot(file, si.limits), demand_of(file, o, si)
    sides, how = frame_box(able, demand.rotations) if o.box is None else (_box(o.box, si.box, able), "--box")
    counts = tuple(o.cells if high > low else 1 for low, high in sides)
    near = sides if o.box is not None else _close(able, demand, sides, counts, watch)
    made, room = _filled(able, demand, near, counts, watch)
    parts = regions(made) if made.inside.any() else None
    begin = _started(able, demand, made, parts, sides, o.start, si.start, file)
    edge, cuts = _boundary(able, demand, begin, sides, o.rays, _steps(made, sides), watch)
    remarks = () if parts is None or begin is None else _remarks(made, parts, begin, edge)
    return Workspace(
        able, demand, file.units, sides, how, made, room, parts, begin, edge, cuts, o.rays,
        bool(holds(able, demand, able.home[None, :3, 3])[0]), (*file.warnings, *remarks),
        _doubts(able, made, begin, file), (robot_input(file, o.robot),), command,
    )  # fmt: skip


def _box(text: str, ends: Array, robot: CableRobot) -> Array:
    """--box X0,Y0,Z0,X1,Y1,Z1 in m as rows (lower, upper), (3, 2) m. Raises ModelError when it is inverted, or a planar robot's
    is not flat."""
    sides = ends.reshape(2, 3).T
    flat = np.array([i not in robot.axes for i in range(3)])
    if (sides[~flat, 0] >= sides[~flat, 1]).any() or (sides[flat, 0] != sides[flat, 1]).any():
        lies = "".join(f", {'XYZ'[i]}0 = {'XYZ'[i]}1 for this planar robot" for i in np.flatnonzero(flat))
        expected = "X0 < X1, Y0 < Y1, Z0 < Z1" if not flat.any() else f"lower before upper{lies}"
        raise ModelError("an empty or inverted box", key="--box", found=text, expected=expected)
    return as_box(sides)


def _close(robot: CableRobot, demand: Demand, sides: Array, counts: tuple[int, ...], watch: Watch | None) -> Array:
    """The part of a box in which a first look finds anything held, one cell wider, so that the grid is not spent on the rest."""
    if watch is not None:
        watch({"stage": "looking where anything can be held"})
    first = grid(robot, demand, sides, (counts[0], counts[1], counts[2]))
    if not first.inside.any():
        return sides
    near, cell = regions(first).extent, first.cell[:, None]
    return np.clip(near + cell * [-1.0, 1.0], sides[:, :1], sides[:, 1:])


def _filled(
    robot: CableRobot, demand: Demand, sides: Array, counts: tuple[int, ...], watch: Watch | None
) -> tuple[Grid, Array]:
    """The grid with margins, and the accelerations that are possible in its held cells, slab by slab along x, so that somebody
    may watch, and stop it."""
    edges = np.linspace(sides[0, 0], sides[0, 1], counts[0] + 1)
    slabs, rooms = [], []
    for i in range(counts[0]):
        if watch is not None:
            watch({"stage": "filling the grid", "done": i, "total": counts[0]})
        slab = grid(robot, demand, np.stack([edges[i : i + 2], sides[1], sides[2]]), (1, counts[1], counts[2]), True)
        room = np.full(slab.inside.shape, np.nan)
        points = np.stack(np.meshgrid(*slab.axes, indexing="ij"), axis=-1)[slab.inside]
        room[slab.inside] = accelerations(robot, demand, points)
        slabs.append(slab)
        rooms.append(room)
    x = np.concatenate([slab.axes[0] for slab in slabs])
    inside = np.concatenate([slab.inside for slab in slabs])
    margin = np.concatenate([slab.margin for slab in slabs if slab.margin is not None])
    cell = (sides[:, 1] - sides[:, 0]) / np.array(counts)
    return Grid((x, slabs[0].axes[1], slabs[0].axes[2]), cell, inside, margin), np.concatenate(rooms)


def _started(
    robot: CableRobot,
    demand: Demand,
    made: Grid,
    found: Regions | None,
    sides: Array,
    text: str | None,
    at: Array | None,
    file: CableFile,
) -> RayStart | None:
    """Where rays start: as told, else X_0 if it is held, else in the middle of the greatest part; None if nothing is held."""
    if at is not None:
        if ((at < sides[:, 0]) | (at > sides[:, 1])).any():
            expected = (
                f"x, y and z of {np.round(file.units.length.from_si(sides), 4).tolist()} {file.units.length.name}"
            )
            raise ModelError("the start lies outside the box", key="--start", found=text, expected=expected)
        if not holds(robot, demand, at[None])[0]:
            raise ModelError(
                "the start cannot be held", key="--start", found=text, expected="a position inside the workspace"
            )
        return RayStart(at, "--start", seen_from(made, at))
    home, why = robot.home[:3, 3], "X_0 is not held"
    if ((home < sides[:, 0]) | (home > sides[:, 1])).any():
        why = "X_0 lies outside the box"
    elif holds(robot, demand, home[None])[0]:
        return RayStart(home, "X_0", seen_from(made, home))
    if found is None:
        return None
    heart = np.array([made.axes[i][k] for i, k in enumerate(found.heart)])
    return RayStart(heart, f"the middle of the greatest part, since {why}", seen_from(made, heart))


def _steps(made: Grid, sides: Array) -> int:
    """Steps of a ray: 64 across what the grid fills, where that is a small part of the box."""
    filled = np.array([x[-1] - x[0] for x in made.axes]) + made.cell
    wide = sides[:, 1] - sides[:, 0]
    return int(min(np.ceil(STEPS * (wide[wide > 0] / filled[wide > 0]).max()), MOST_STEPS))


def _boundary(
    robot: CableRobot, demand: Demand, start: RayStart | None, sides: Array, rays: int, steps: int, watch: Watch | None
) -> tuple[Surface | Outline | None, dict[str, Outline]]:
    """The boundary seen from the start, and its sections by the names of their planes."""
    if start is None:
        return None, {}
    planes = {n: ax for n, ax in PLANES.items() if set(ax) <= set(robot.axes)}
    if watch is not None:
        watch({"stage": "following rays to the boundary"})
    cuts = {n: outline(robot, demand, start.at, sides, ax, min(rays, SECTION), steps) for n, ax in planes.items()}
    if len(planes) == 1:
        (ax,) = planes.values()
        return outline(robot, demand, start.at, sides, ax, rays, steps), cuts
    return surface(robot, demand, start.at, sides, rays, steps), cuts


def _remarks(made: Grid, found: Regions, start: RayStart, edge: Surface | Outline | None) -> tuple[Remark, ...]:
    """What the grid knows and the rays do not: other parts, holes, what the start does not see; and when the two disagree."""
    flat = isinstance(edge, Outline)
    unit, size = ("m2", edge.area) if isinstance(edge, Outline) else ("m3", edge.volume if edge else 0.0)
    one = made.volume / made.inside.sum()
    out = []
    if (len(found.parts) > 1) and sum(found.parts[1:]) > 0.01 * sum(found.parts):
        shown = tuple(f"{n * one:.3g}" for n in found.parts[:5])
        out.append(Remark.of(Code.PARTS_APART, count=len(found.parts), sizes=shown, unit=unit))
    if found.holes:
        out.append(Remark.of(Code.HOLES, count=len(found.holes), size=float(sum(found.holes) * one), unit=unit))
    if start.seen < SEEN:
        edge_ = "outline" if flat else "surface"
        out.append(Remark.of(Code.START_SEES_PART, share=100 * (1 - start.seen), edge=edge_))
    if abs(size / made.volume - 1) > NEAR:
        # What the start does not see, no finer grid brings back.
        seen = None if start.seen < SEEN else start.seen
        out.append(Remark.of(Code.RAYS_DIFFER, percent=100 * (size / made.volume - 1), seen=seen))
    return tuple(out)


def _doubts(robot: CableRobot, made: Grid, start: RayStart | None, file: CableFile) -> tuple[Remark, ...]:
    """Why the result must not be trusted: no cell is held, and which comes closest; or nothing but singular poses are."""
    if made.margin is None:
        return ()
    if made.inside.any():
        if made.margin[made.inside].max() > 1e-9 * float(robot.need("limits").max()):
            return ()
        return (Remark.of(Code.ONLY_SINGULAR),)
    k = np.unravel_index(int(np.argmax(made.margin)), made.margin.shape)
    at = ", ".join(f"{file.units.length.from_si(float(made.axes[i][k[i]])):.4g}" for i in range(3))
    lack, force = file.units.force.from_si(-float(made.margin[k])), file.units.force.name
    code = Code.NOTHING_HELD if start is None else Code.ONLY_START_HELD
    return (Remark.of(code, at=at, length=file.units.length.name, lack=lack, force=force),)


def texts(made: Workspace) -> dict[str, str | bytes]:
    """The files of the folder, but its page."""
    out: dict[str, str | bytes] = {
        "workspace.json": json_text(made.document),
        "workspace.csv": cells_text(made.grid, made.room, made.units),
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
    """A workspace: what was demanded, in which box (3, 2) m and `how` that was chosen, the grid with margins and the possible
    accelerations (nx, ny, nz) m/s^2 (NaN outside), what its cells make up (None: nothing is held), the boundary by `rays` and its
    sections, whether X_0 is in it; remarks; and `doubts`: why it must not be trusted."""

    robot: CableRobot
    demand: Demand
    units: CableUnits
    box: Array
    how: str
    grid: Grid
    room: Array
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
        return () if self.regions is None or self.grid.margin is None else tuple(cut_off(self.regions.extent, self.box))

    @property
    def document(self) -> dict[str, Any]:
        """What workspace.json holds."""
        made, size = self.grid, self.size
        wide = float(np.prod(np.where(made.cell > 0, self.box[:, 1] - self.box[:, 0], 1.0)))
        what = "volume_m3" if (made.cell > 0).all() else "area_m2"
        home = self.robot.home[:3, 3]
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
            "home": {"position_m": home, "held": self.home_held,
                     "margin_N": float(margins(self.robot, self.demand, home[None])[0])},
            "sections": {name: {"area_m2": line.area} for name, line in self.sections.items()},
        }  # fmt: skip
        said = (*self.warnings, *self.doubts)
        return framed(self.robot, found, warnings=said, inputs=self.inputs, command=self.command)

    def _demanded(self) -> dict[str, Any]:
        demand = self.demand
        return {
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
                "best": None,
            }
        one = made.volume / made.inside.sum()
        margin, room = made.margin[made.inside], self.room[made.inside]
        k = np.unravel_index(int(np.argmax(np.where(made.inside, made.margin, -np.inf))), made.inside.shape)
        return {
            "centre_m": found.centre,
            "extent_m": found.extent,
            "reaches_box": list(self.cut),
            f"parts_{what}": [n * one for n in found.parts],
            f"holes_{what}": [n * one for n in found.holes],
            "margin_N": _spread(margin),
            "acceleration_m_s2": _spread(room),
            "best": {
                "position_m": [float(made.axes[i][k[i]]) for i in range(3)],
                "margin_N": float(made.margin[k]),
                "acceleration_m_s2": float(self.room[k]),
            },
        }


def _spread(values: Array) -> dict[str, float]:
    return {"least": float(values.min()), "median": float(np.median(values)), "greatest": float(values.max())}

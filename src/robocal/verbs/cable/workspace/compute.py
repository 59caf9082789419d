"""What `cable workspace` is made of: the box, the grid, the start and length of rays, the boundary, remarks.

What a cable robot is to hold wherever it goes: a `Demand` from options in its file's units.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.cables.boundary import Outline, Surface, outline, surface
from robocal.cables.closure import Dexterity
from robocal.cables.geometry import CableRobot
from robocal.cables.grid_regions import Regions, frame_box, regions, visible_share
from robocal.cables.workspace import Demand, Grid, accelerations, as_box, dexterities, grid, holds
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.units import in_si
from robocal.geometry import so3
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.cable import statics_options as statics
from robocal.session.cable.calibrated import open_robot
from robocal.session.cable.workspace_result import PLANES, RayStart, Workspace
from robocal.session.watching import Watch

__all__ = ["workspace"]

AROUND = 8  # directions in which a platform is tilted, by half the angle and by all of it
TURNS = ("RX", "RY", "RZ")


def demand_of(file: CableFile, said: Any, si: Any) -> Demand:
    """Everything that is asked for, in SI, from the options of the verb as they were said and in SI. Raises FormatError naming the
    file where the mass is missing, ModelError naming an option that makes no sense.

    payload and mass are a range or one number: mass stands for the platform's own, payload hangs at its centre of mass; wrench
    as for `wrench_of`, every one of them. With closure none of them is asked for.
    """
    turns = _orientations(file.robot, said, si)
    if said.closure:
        others = ("mass", "payload", "wrench", "acceleration", "reserve", "limits")
        why = "with wrench closure, tensions have any size and hold any wrench, so this option has no effect"
        said.refuse(others, why, "--closure alone, or without it")
        return Demand(np.zeros(1), turns, length=si.length or 1.0, closure=True)
    own = _range(said.mass, "--mass", file) if said.mass is not None else (statics.mass_of(file),)
    more = _range(said.payload, "--payload", file)
    masses = sorted({own[0] + more[0], own[-1] + more[-1]})  # least with least, greatest with greatest
    extra = np.array([statics.wrench_of(file, text) for text in said.wrench]) if said.wrench else np.zeros((1, 6))
    return Demand(np.array(masses), turns, extra, si.acceleration, si.reserve, si.length or 1.0)


def _range(text: str | None, option: str, file: CableFile) -> tuple[float, ...]:
    """One mass or the ends of a range, in kg; nothing is no mass at all."""
    if text is None:
        return (0.0,)
    ends = "LO,HI" if "," in text else "MASS"
    values = in_si(text, ends, [file.units.mass] * (ends.count(",") + 1), key=option)
    if values[0] < 0 or values[-1] < values[0]:
        raise ModelError("a mass is 0 or more, a range rises", key=option, found=text, expected="0 <= LO <= HI")
    return tuple(float(v) for v in values)


def _orientations(robot: CableRobot, said: Any, si: Any) -> Array:
    """Rotations (n, 3, 3): each of those given, and where tilts are asked for, tilted to all sides about horizontal axes."""
    vectors = np.array(si.orientation or [np.zeros(3)])
    lost = [i for i in range(3) if i + 3 not in robot.axes]
    if vectors[:, lost].any():
        found = said.orientation[int(np.argmax(vectors[:, lost].any(axis=1)))]
        expected = f"0 for {', '.join(TURNS[i] for i in lost)}: it is {_moves(robot)}"
        message = f"{robot.name} does not turn that way"
        raise ModelError(message, key="--orientation", found=found, expected=expected)
    upright = so3.exp(vectors)
    if si.tilt is None:
        return upright
    if not 0 < si.tilt < math.pi:
        raise ModelError("out of range", key="--tilt", found=said.tilt, expected="above 0 and below half a turn")
    return np.asarray((so3.exp(si.tilt * _sides(robot))[:, None] @ upright).reshape(-1, 3, 3))


def _moves(robot: CableRobot) -> str:
    return f"{robot.degrees} in {robot.plane}" if robot.planar else robot.degrees


def _sides(robot: CableRobot) -> Array:
    """Upright, and half and whole tilts about the horizontal axes that the robot has, (n, 3)."""
    if 4 not in robot.axes:
        raise ModelError("this robot cannot tilt", key="--tilt", found=_moves(robot))
    turn = 2 * np.pi * np.arange(AROUND) / AROUND if 3 in robot.axes else np.array([0.5, 1.5]) * np.pi
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    if 3 not in robot.axes:
        ring[:, 0] = 0.0
    return np.concatenate([np.zeros((1, 3)), 0.5 * ring, ring])


SECTION = 720  # rays of a section, at most
STEPS, MOST_STEPS = 64, 4096  # of a ray
NEAR = 0.02  # by how much volumes may differ without a remark
SEEN = 0.99  # the share of the held cells that the start has to see without one


def workspace(o: Any, command: str = "", watch: Watch | None = None) -> Workspace:
    """The workspace for what is demanded, by the options of the verb. Raises InputError."""
    tell: Watch = watch or (lambda event: None)
    file = open_robot(o.robot)
    si = o.si(file.units)
    demand = demand_of(file, o, si)
    able = statics.redundant_robot(file, 1) if demand.closure else statics.robot_with_limits(file, si.limits)
    sides, how = frame_box(able, demand.rotations) if o.box is None else (_box(o.box, si.box, able), "--box")
    counts = tuple(o.cells if high > low else 1 for low, high in sides)
    near = sides if o.box is not None else _close(able, demand, sides, counts, tell)
    made, room, even = _fill_grid(able, demand, near, counts, tell)
    parts = regions(made) if made.inside.any() else None
    begin = _ray_start(able, demand, made, parts, sides, o.start, si.start, file)
    edge, cuts = _boundary(able, demand, begin, sides, o.rays, _steps(made, sides), tell)
    remarks = () if parts is None or begin is None else _remarks(made, parts, begin, edge)
    if o.output is not None:
        tell({"stage": "write"})
    return Workspace(
        file=file.with_machine(able), demand=demand, box=sides, how=how, grid=made, outer_box=room, dexterity=even, regions=parts,
        start=begin, boundary=edge, sections=cuts, rays=o.rays,
        home_feasible=bool(holds(able, demand, able.home[None, :3, 3])[0]),
        warnings=(*file.warnings, *statics.balance_remarks(able, demand.extra), *remarks),
        reasons=_doubts(able, demand, made, begin, file), inputs=statics.robot_inputs(file, o.robot), command=command,
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


def _close(robot: CableRobot, demand: Demand, sides: Array, counts: tuple[int, ...], tell: Watch) -> Array:
    """The part of a box in which a first look finds anything held, one cell wider, so that the grid is not spent on the rest."""
    tell({"stage": "looking where anything can be held"})
    first = grid(robot, demand, sides, (counts[0], counts[1], counts[2]))
    if not first.inside.any():
        return sides
    near, cell = regions(first).extent, first.cell[:, None]
    return np.clip(near + cell * [-1.0, 1.0], sides[:, :1], sides[:, 1:])


def _fill_grid(
    robot: CableRobot, demand: Demand, sides: Array, counts: tuple[int, ...], tell: Watch
) -> tuple[Grid, Array, Dexterity]:
    """The grid with margins, the accelerations that are possible in its held cells (NaN for closure), and their dexterity, slab by
    slab along x, so that somebody may watch, and stop it."""
    edges = np.linspace(sides[0, 0], sides[0, 1], counts[0] + 1)
    slabs, numbers = [], np.full((3, *counts), np.nan)  # accelerations, tension factors, condition numbers
    for i in range(counts[0]):
        tell({"stage": "filling the grid", "done": i, "total": counts[0]})
        slab = grid(robot, demand, np.stack([edges[i : i + 2], sides[1], sides[2]]), (1, counts[1], counts[2]), True)
        points = np.stack(np.meshgrid(*slab.axes, indexing="ij"), axis=-1)[slab.inside]
        even, here = dexterities(robot, demand, points), slab.inside[0]
        numbers[1, i][here], numbers[2, i][here] = even.tension_factor, even.condition
        if not demand.closure:
            numbers[0, i][here] = accelerations(robot, demand, points)
        slabs.append(slab)
    x, inside = np.concatenate([slab.axes[0] for slab in slabs]), np.concatenate([slab.inside for slab in slabs])
    margin = np.concatenate([slab.margin for slab in slabs if slab.margin is not None])
    cell = (sides[:, 1] - sides[:, 0]) / np.array(counts)
    whole = Grid((x, slabs[0].axes[1], slabs[0].axes[2]), cell, inside, margin)
    return whole, numbers[0], Dexterity(numbers[1], numbers[2], demand.length)


def _ray_start(
    robot: CableRobot, demand: Demand, made: Grid, found: Regions | None, sides: Array, text: str | None, at: Array | None,
    file: CableFile,
) -> RayStart | None:  # fmt: skip
    """Where rays start: as told, else X_0 if it is held, else in the middle of the greatest part; None if nothing is held."""

    def outside(place: Array) -> bool:
        return bool(((place < sides[:, 0]) | (place > sides[:, 1])).any())

    if at is not None:
        if outside(at):
            box, unit = np.round(file.units.length.from_si(sides), 4).tolist(), file.units.length.name
            expected = f"x, y and z of {box} {unit}"
            raise ModelError("the start lies outside the box", key="--start", found=text, expected=expected)
        if not holds(robot, demand, at[None])[0]:
            expected = "a position inside the workspace"
            raise ModelError("the start cannot be held", key="--start", found=text, expected=expected)
        return RayStart(at, "--start", visible_share(made, at))
    home, why = robot.home[:3, 3], "X_0 is not held"
    if outside(home):
        why = "X_0 lies outside the box"
    elif holds(robot, demand, home[None])[0]:
        return RayStart(home, "X_0", visible_share(made, home))
    if found is None:
        return None
    heart = np.array([made.axes[i][k] for i, k in enumerate(found.heart)])
    return RayStart(heart, f"the middle of the greatest part, since {why}", visible_share(made, heart))


def _steps(made: Grid, sides: Array) -> int:
    """Steps of a ray: 64 across what the grid fills, where that is a small part of the box."""
    filled = np.array([x[-1] - x[0] for x in made.axes]) + made.cell
    wide = sides[:, 1] - sides[:, 0]
    return int(min(np.ceil(STEPS * (wide[wide > 0] / filled[wide > 0]).max()), MOST_STEPS))


def _boundary(
    robot: CableRobot, demand: Demand, start: RayStart | None, sides: Array, rays: int, steps: int, tell: Watch
) -> tuple[Surface | Outline | None, dict[str, Outline]]:
    """The boundary seen from the start, and its sections by the names of their planes."""
    if start is None:
        return None, {}
    planes = {n: ax for n, ax in PLANES.items() if set(ax) <= set(robot.axes)}
    tell({"stage": "following rays to the boundary"})
    cuts = {n: outline(robot, demand, start.at, sides, ax, min(rays, SECTION), steps) for n, ax in planes.items()}
    if len(planes) == 1:
        (ax,) = planes.values()
        return outline(robot, demand, start.at, sides, ax, rays, steps), cuts
    return surface(robot, demand, start.at, sides, rays, steps), cuts


def _remarks(made: Grid, found: Regions, start: RayStart, edge: Surface | Outline | None) -> Iterator[Remark]:
    """What the grid knows and the rays do not: other parts, holes, what the start does not see; and when the two disagree."""
    unit, size = ("m2", edge.area) if isinstance(edge, Outline) else ("m3", edge.volume if edge else 0.0)
    one = made.volume / made.inside.sum()
    if (len(found.parts) > 1) and sum(found.parts[1:]) > 0.01 * sum(found.parts):
        shown = tuple(f"{n * one:.3g}" for n in found.parts[:5])
        yield Remark.of(Code.PARTS_APART, count=len(found.parts), sizes=shown, unit=unit)
    if found.holes:
        yield Remark.of(Code.HOLES, count=len(found.holes), size=float(sum(found.holes) * one), unit=unit)
    if start.visible < SEEN:
        kind = "outline" if isinstance(edge, Outline) else "surface"
        yield Remark.of(Code.START_SEES_PART, share=100 * (1 - start.visible), edge=kind)
    if abs(size / made.volume - 1) > NEAR:
        # What the start does not see, no finer grid brings back.
        seen = None if start.visible < SEEN else start.visible
        yield Remark.of(Code.RAYS_DIFFER, percent=100 * (size / made.volume - 1), seen=seen)


def _doubts(
    robot: CableRobot, demand: Demand, made: Grid, start: RayStart | None, file: CableFile
) -> tuple[Remark, ...]:
    """Why the result must not be trusted: no cell is held, and which comes closest; or nothing but singular poses are."""
    if made.margin is None:
        return ()
    if demand.closure:
        none = Code.NOTHING_CLOSED if start is None else Code.ONLY_START_CLOSED
        return () if made.inside.any() else (Remark.of(none),)
    if made.inside.any():
        spare = made.margin[made.inside].max() > 1e-9 * float(robot.need("limits").max())
        return () if spare else (Remark.of(Code.ONLY_SINGULAR),)
    k = np.unravel_index(int(np.argmax(made.margin)), made.margin.shape)
    at = ", ".join(f"{file.units.length.from_si(float(made.axes[i][k[i]])):.4g}" for i in range(3))
    lack, force = file.units.force.from_si(-float(made.margin[k])), file.units.force.name
    code = Code.NOTHING_HELD if start is None else Code.ONLY_START_HELD
    return (Remark.of(code, at=at, length=file.units.length.name, lack=lack, force=force),)

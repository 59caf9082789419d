"""Lists for cable robots: poses of the platform, and cable lengths, one per row of a CSV whose headers carry units; and lists of
reachable poses and programs for a controller, which are read back as either.

id, x [m], y [m], z [m], rx [deg], ry [deg], rz [deg]       a pose: translation and rotation vector (none where it does not turn)
id, c1 [m], c2 [m], ...                                     lengths as the sensors show them, one column per cable
id, c1.geometric [m], c2.geometric [m], ...                 the same where the cables stretch and nobody said by how much
c1.current [A], ..., c1.speed [mm/s], ...                   in either, in place of tensions: of winches that a run has identified
c1.tension [N], c2.tension [N], ...                         in either, where cables stretch or sag; t1 [N], t2 [N], ... with poses too
fx [N], fy, fz, mx [Nm], my, mz                             with poses: what else pulls at the platform, base axes
id, x [m], ..., rz [deg], c1 [m], ..., c1.tension [N], ..., lambda, limit, contact, rank     poses.csv
id, x [m], ..., rz [deg], c1 [m], ..., c1.tension [N], ..., pose, way, share                 program.csv
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.cables.check import FAR
from robocal.cables.geometry import CableRobot
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.headers import IDS, row_names
from robocal.files.kinds.kind import column_units, unit_rows
from robocal.files.orientation import quaternion
from robocal.files.units import is_unit, parse_unit
from robocal.files.unread import left_over, unread_remarks
from robocal.files.yamlio import YamlDocument
from robocal.geometry import se3, so3
from robocal.parameters import FRAME_SYMBOLS
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

if TYPE_CHECKING:
    from robocal.cables.pose_list import MotionProgram, PoseList

__all__ = [
    "COLUMNS",
    "WRENCH",
    "CableList",
    "length_columns",
    "pose_columns",
    "pose_listing",
    "program_listing",
    "read_cable_lengths",
    "read_platform_poses",
    "tension_columns",
]

QUATERNION = ("qx", "qy", "qz", "qw")
AWAY = (0.01, np.radians(1.0))  # m and rad across what a platform can do: more than an instrument is off
DIGITS = 9  # of a length in m: a nanometre
WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")
# What columns of lists are called, and so no cable.
COLUMNS = (
    *(*IDS, *FRAME_SYMBOLS, *QUATERNION, *WRENCH),
    *("lambda", "limit", "contact", "rank", "feasible", "margin", "pose", "way", "share"),
    *("residual", "sigma_position", "sigma_orientation", "solutions"),
)


@record(eq=False)
class CableList:
    """Names of the rows, their values in SI (poses (k, 4, 4) or lengths (k, m)), and where given tensions (k, m), wrenches (k, 6), and
    currents (k, m) of winches with speeds (k, m), m/s; lengths are `geometric`, or as the sensors show them; `lines` are the rows as an
    editor numbers them, `sha256` is that of the file, `warnings` are what is odd about it."""

    names: tuple[str, ...]
    values: Array
    tension: Array | None
    wrench: Array | None = None
    lines: tuple[int, ...] = ()
    sha256: str = ""
    warnings: tuple[Remark, ...] = ()
    geometric: bool = False
    current: Array | None = None
    speed: Array | None = None


def read_platform_poses(path: str | os.PathLike[str], robot: CableRobot) -> CableList:
    """Poses of the platform, x, y, z with a rotation vector rx, ry, rz or a quaternion qx, qy, qz, qw; a platform that does not turn
    needs neither. Raises FileError or FormatError naming file, row and column."""
    table = replace(read_csv(path), alone=True)
    given, turned = _given(table, QUATERNION), _given(table, FRAME_SYMBOLS[3:])
    if not given and not turned and max(robot.axes) < 3:
        poses = se3.compose(np.eye(3), _columns(table, FRAME_SYMBOLS[:3], ("m",) * 3))
    elif given and turned:
        raise table.fail("the orientation is given twice", column=given[0], expected="rx, ry, rz or qx, qy, qz, qw")
    elif given:
        place = _columns(table, FRAME_SYMBOLS[:3], ("m",) * 3)
        q = unit_rows(_columns(table, QUATERNION, ("1",) * 4), table, QUATERNION, "quaternion")
        poses = se3.compose(quaternion(q), place)
    else:
        poses = se3.from_vector(_columns(table, FRAME_SYMBOLS, ("m", "m", "m", "rad", "rad", "rad")))
    place, expected = poses[:, :3, 3], f"within {FAR:g} m"
    table.insist(np.abs(place) < FAR, FRAME_SYMBOLS[:3], "so far away is no platform", place, expected=expected)
    made = replace(_list(table, poses, robot), wrench=_wrenches(table))
    return replace(made, warnings=(*_unread(table, robot, (*IDS, *WRENCH)), *_beyond(robot, made)))


def read_cable_lengths(path: str | os.PathLike[str], robot: CableRobot) -> CableList:
    """Measured lengths of all cables. Raises FileError or FormatError naming file, row and column."""
    table = replace(read_csv(path), alone=True)
    other = [_geometric(cable) for cable in robot.cables]
    geometric = len(_given(table, other)) > 0 and not _given(table, robot.cables)
    read = other if geometric else robot.cables
    made = _list(table, _columns(table, read, ("m",) * len(read)), robot)
    return replace(made, warnings=_unread(table, robot, (*IDS, *read)), geometric=geometric)


def _geometric(cable: str) -> str:
    """The column of a length that no tension has stretched. One name is one length: what a sensor shows has the cable's."""
    return f"{cable}.geometric"


def _unread(table: CsvTable, robot: CableRobot, known: Sequence[str]) -> tuple[Remark, ...]:
    """What nobody read, but for columns of other lists and those that `cable tension` adds."""
    pulls = [f"{cable}.tension" for cable in robot.cables]
    missing = [f"missing.{name}" for name in WRENCH]
    silent = (*COLUMNS, *robot.cables, *missing)
    return table.remarks + unread_remarks([left_over(table, (*known, *pulls), silent)])


def _list(table: CsvTable, values: Array, robot: CableRobot) -> CableList:
    lines = tuple(int(line) for line in table.lines)
    tension, (current, speed) = _tensions(table, robot), _currents(table, robot)
    if tension is not None and current is not None:
        raise table.fail(
            "tensions are given twice", column=f"{robot.cables[0]}.current", expected="tensions or currents"
        )
    return CableList(
        row_names(table, "rows"), values, tension, lines=lines, sha256=table.sha256, current=current, speed=speed
    )


def _currents(table: CsvTable, robot: CableRobot) -> tuple[Array | None, Array | None]:
    """Currents (k, m) in A and speeds (k, m) in m/s, where there are any."""
    found: list[Array | None] = []
    for what, si in (("current", "A"), ("speed", "m/s")):
        names = [f"{cable}.{what}" for cable in robot.cables]
        found.append(_columns(table, names, (si,) * len(names)) if _given(table, names) else None)
    if found[0] is None and found[1] is not None:
        raise table.fail(
            "speeds without currents", column=f"{robot.cables[0]}.speed", expected=f"{robot.cables[0]}.current [A]"
        )
    return found[0], found[1]


def _beyond(robot: CableRobot, rows: CableList) -> tuple[Remark, ...]:
    """A remark on the pose that lies furthest from where the first one could go to: a robot in a plane does not leave it, one that
    only shifts does not turn. How a point is turned makes no difference."""
    t = rows.values
    way = np.concatenate([t[:, :3, 3] - t[0, :3, 3], so3.log(t[:, :3, :3] @ t[0, :3, :3].T)], axis=1)
    point = not np.ptp(robot.b, axis=0).any()
    out = [i for i in range(6) if i not in robot.axes and not (i > 2 and point)]
    share = np.abs(way[:, out]) / np.where(np.array(out) < 3, AWAY[0], AWAY[1]) if out else np.zeros((1, 1))
    if share.max() <= 1:
        return ()
    row, at = (int(v) for v in np.unravel_index(int(share.argmax()), share.shape))
    axis = out[at]
    off = Quantity(abs(float(way[row, axis])), "m" if axis < 3 else "rad")
    names = {"pose": rows.names[row], "first": rows.names[0]}
    return (Remark.of(Code.POSE_OUT_OF_REACH, **names, degrees=robot.degrees, off=off, column=FRAME_SYMBOLS[axis]),)


def _columns(table: CsvTable, names: Sequence[str], si: Sequence[str]) -> Array:
    units = column_units(table, list(names), None, si, YamlDocument(Path(table.path), "", "", {}), ("columns",))
    raw = table.numbers(list(names))
    return np.column_stack([unit.to_si(raw[:, i]) for i, unit in enumerate(units)])


def _tensions(table: CsvTable, robot: CableRobot) -> Array | None:
    names = _tension_names(table, robot)
    if not names:
        return None
    found = _columns(table, names, ("N",) * len(names))
    table.insist(~(found < 0), names, "a cable cannot push", found, expected="0 N or more")
    return found


def _tension_names(table: CsvTable, robot: CableRobot) -> list[str]:
    """The columns of tensions: c1.tension, or with a unit of force c1 or t1, which counts the cables in the robot's order; none where no
    list of them is whole. Raises FormatError for one of c1.tension that is missing."""
    named = [f"{cable}.tension" for cable in robot.cables]
    if _given(table, named):
        return named
    forces = {n for n, unit in zip(table.names, table.units, strict=True) if _is_force(unit)}
    counted = [f"t{i + 1}" for i in range(len(robot.cables) + 1)]
    if counted[-1] in forces:
        raise table.fail("a tension of no cable", column=counted[-1], expected=", ".join(named))
    for names in (list(robot.cables), counted[:-1]):
        there = [n for n in names if n in forces]
        if there and len(there) < len(names):
            lost = next(n for n in names if n not in forces)
            raise table.fail("a tension of every cable is needed", column=lost, expected=f"{lost} [N]")
        if there:
            return names
    return []


def _is_force(unit: str | None) -> bool:
    return unit is not None and is_unit(unit) and parse_unit(unit).si == "N"


def _given(table: CsvTable, names: Sequence[str]) -> list[str]:
    """Those of the columns that are there. Raises FormatError for one that is only written otherwise: it would be
    passed over without a word."""
    wanted = {name.lower(): name for name in names}
    for found in table.names:
        name = wanted.get(found.lower(), found)
        if name != found and name not in table.names:
            raise table.fail("no column of this name is read", column=found, expected=name)
    return [name for name in names if name in table.names]


def _wrenches(table: CsvTable) -> Array | None:
    """Those of the six columns that are there; the others are zero."""
    given = [WRENCH.index(name) for name in _given(table, WRENCH)]
    if not given:
        return None
    out = np.zeros((len(table), 6))
    out[:, given] = _columns(table, [WRENCH[i] for i in given], ["N" if i < 3 else "N m" for i in given])
    return out


def length_columns(
    robot: CableRobot, lengths: Array, *, geometric: bool = False, decimals: int | None = None
) -> tuple[Column, ...]:
    """Columns of lengths (k, m) in m, `geometric` or as the sensors show them; a CSV has so many `decimals` of a metre."""
    names = map(_geometric, robot.cables) if geometric else robot.cables
    return tuple(Column(name, "m", column, si_decimals=decimals) for name, column in zip(names, lengths.T, strict=True))


def tension_columns(robot: CableRobot, tension: Array) -> tuple[Column, ...]:
    """Columns of tensions (k, m) in N, under the names that lists are read by."""
    return tuple(Column(f"{c}.tension", "N", t, digits=10) for c, t in zip(robot.cables, tension.T, strict=True))


def pose_columns(names: Sequence[str], poses: Array) -> tuple[Column, ...]:
    """Columns of poses (k, 4, 4) with their names, as `read_platform_poses` reads them; nothing where a pose is not a number."""
    known = np.asarray(np.isfinite(poses).all(axis=(-2, -1)))
    values = se3.to_vector(np.where(known[:, None, None], poses, np.eye(4)))
    values[~known] = np.nan
    units = ("m",) * 3 + ("rad",) * 3
    return (
        Column("id", "", tuple(names)),
        *(Column(s, u, v, decimals=12) for s, u, v in zip(FRAME_SYMBOLS, units, values.T, strict=True)),
    )


def pose_listing(
    robot: CableRobot, names: Sequence[str], poses: PoseList, made: MotionProgram, rank: Mapping[int, int] | None = None
) -> Listing:
    """poses.csv: the poses; `rank` says which are chosen, 1 the most telling."""
    from robocal.cables.pose_list import LIMITS

    who = poses.contacts.names(robot.cables)
    met = [LIMITS[i].startswith("cable") for i in poses.limit]
    return Listing((
        *pose_columns(names, made.pose[:, -1]),
        *_cable_columns(robot, made.lengths[:, -1], made.tension[:, -1]),
        Column("lambda", "", poses.fraction, digits=9),
        Column("limit", "", [LIMITS[i] for i in poses.limit]),
        Column("contact", "", [w if m else None for w, m in zip(who, met, strict=True)]),
        *([] if rank is None else [Column("rank", "", [rank.get(i) for i in range(len(names))])]),
    ))  # fmt: skip


def program_listing(robot: CableRobot, names: Sequence[str], made: MotionProgram, order: Ints) -> Listing:
    """program.csv: all waypoints in the order in which a controller takes them: from X_0 out to a pose, back, to the next.

    `id` counts them from 0; `way` is start, out, pose or back; `share` is how far from X_0 (0) to the pose (1).
    """
    last = len(made.shares) - 1
    one = [*range(1, last + 1), *range(last - 1, -1, -1)]
    ways = np.repeat(np.concatenate([order[:1], order]), [1, *[len(one)] * len(order)])
    points = np.concatenate([[0], np.tile(one, len(order))])
    words = ["out"] * (last - 1) + ["pose"] + ["back"] * last
    return Listing((
        *pose_columns([str(i) for i in range(len(ways))], made.pose[ways, points]),
        *_cable_columns(robot, made.lengths[ways, points], made.tension[ways, points]),
        Column("pose", "", ["", *(names[i] for i in ways[1:])]),
        Column("way", "", ["start", *words * len(order)]),
        Column("share", "", np.asarray(made.shares)[points], digits=6),
    ))  # fmt: skip


def _cable_columns(robot: CableRobot, lengths: Array, tension: Array) -> tuple[Column, ...]:
    return (*length_columns(robot, lengths, decimals=DIGITS), *tension_columns(robot, tension))

"""Other readings of a robot's file that may have been meant: another convention, other units, a column that stands one row late, and of a
URDF other chains. Each is one entry of a table: words, the line to write, and the rows as they would be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS, chain, rows
from robocal.diagnose import limits
from robocal.diagnose.hypotheses.changes import Change
from robocal.diagnose.hypotheses.explain import Doubt, alike, explain_beside, left_of
from robocal.diagnose.hypotheses.sights import sights
from robocal.errors import InputError, ModelError
from robocal.files.cause_text import CauseText
from robocal.files.dataset import Reading as DataReading
from robocal.files.robot import Robot
from robocal.files.units import UNITS, number
from robocal.files.urdfchains import Reread, option, other_chains
from robocal.measure.data import DataSet
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["OtherRobot", "other_robots", "other_robots_beside"]

Rows = list[dict[str, Any]]
BESIDE = 3  # grid: how many robots are looked at beside a change, and changes beside each
LENGTHS_OF = ("xyz", "units.length")
OTHER_CONVENTION = {"dh": "mdh", "dh-hayati": "mdh-hayati", "mdh": "dh", "mdh-hayati": "dh-hayati"}
LENGTHS = ("length", "point")
ANGLES = ("angle", "angles")


@record
class OtherRobot:
    """Another robot that the file may mean, in words, with the line that says so and its key; what it leaves of the data (m)."""

    robot: Robot
    text: str
    line: str
    key: str = ""
    left: float = math.inf


Reading = tuple[str, str, str, Rows, str]  # words, line, key, rows, convention


def other_robots(robot: Robot, data: DataSet, doubt: Doubt, reread: Reread) -> tuple[OtherRobot, ...]:
    """The robots that explain the data, alike, those that leave least first."""
    tried = [(o, data) for o in _readings(robot)]
    sizes = [(o.kind, len(o)) for o in data.observations]
    for other in _links(robot, data):
        try:
            read = reread(other.robot.chain)
        except InputError:  # there are no columns for its joints
            continue
        if [(o.kind, len(o)) for o in read.observations] == sizes:
            tried.append((other, read))
    found = [replace(o, left=left) for o, d in tried if math.isfinite(left := left_of(o.robot.chain, d, doubt))]
    best = min((f.left for f in found), default=math.inf)
    return tuple(sorted((f for f in found if alike(f.left, best)), key=lambda f: f.left))


def other_robots_beside(
    robot: Robot, reading: DataReading, doubt: Doubt, changes: Sequence[Change]
) -> tuple[OtherRobot, ...]:
    """The robots that explain the data beside one change more, of their own lengths or of the data, those that leave least first."""
    if doubt.few:
        return ()
    data, found = reading.dataset, []
    looked = [(*explain_beside(o.robot.chain, data, changes, doubt), o) for o in _readings(robot)]
    near = sorted((t for t in looked if t[0] <= limits.PAIR_LEAVES), key=lambda t: t[0])
    for _, look, one in near[:BESIDE]:
        for other in _readings(one.robot):
            if other.key in LENGTHS_OF and other.key != one.key:
                left = left_of(other.robot.chain, data, doubt)
                found.append(
                    replace(other, text=f"{one.text}, and {other.text}", line=f"{one.line} and {other.line}", left=left)
                )
        explained = look()
        if explained is None:
            continue
        for trial in explained.changes[:BESIDE]:
            told = CauseText.of(trial, robot, reading)
            line = f"{one.line} (in {robot.place}) and {told.line} (in {told.file})"
            found.append(replace(one, text=f"{one.text}, and {told.text}", line=line, left=explained.left))
    best = min((f.left for f in found), default=math.inf)
    return tuple(sorted((f for f in found if math.isfinite(f.left) and alike(f.left, best)), key=lambda f: f.left))


def _links(robot: Robot, data: DataSet) -> Iterator[OtherRobot]:
    """The other chains of a URDF."""
    if robot.format != "urdf":
        return
    seen = sights(robot.chain, [data])
    assert seen is not None
    turned = 6 if seen.turned.any() else 3
    base_free, tip_free = bool(seen.frames_free.all()), bool(seen.things_free[:, :turned].all())
    for other in other_chains(robot, base_free=base_free, tip_free=tip_free):
        words = f"the chain that was measured is {other.root} to {other.tip}, not {robot.root} to {robot.tip}"
        yield OtherRobot(other, words, option(robot, other))


def _readings(robot: Robot) -> Iterator[OtherRobot]:
    """The robot with its rows read in other ways."""
    arm = robot.chain
    if arm.groups or arm.derived:
        return
    # The rows of a table hide turns by more than pi; those of a URDF are as the file has them.
    given: Any = arm.meta["rows"] if robot.format == "urdf" else rows(arm)
    for read in READINGS:
        for words, line, key, made, convention in read(robot, given):
            try:
                yield OtherRobot(robot.with_machine(_chain_of(arm, made, convention)), words, line, key)
            except ModelError:  # no arm can be read so
                continue


def _chain_of(arm: Chain, made: Rows, convention: str) -> Chain:
    """The arm of other rows, with the same base and tool, and the same of them free."""
    frames = {
        owner: [arm.table[f"{owner}.{s}"].value for s in FRAME_SYMBOLS]
        for owner in ("base", "tool", "home")
        if f"{owner}.x" in arm.table
    }
    new = chain(arm.name, convention, made, **frames)  # type: ignore[arg-type]
    return new.with_table(new.table.with_free({n for n in arm.table.free if n in new.table}))


# --- the table --------------------------------------------------------------------------------------------------------


def _other_convention(robot: Robot, given: Rows) -> Iterator[Reading]:
    other = OTHER_CONVENTION.get(robot.convention)
    if other is not None:
        words = f"the table is one of the convention {other}, not {robot.convention}"
        yield words, f"convention: {other}", "convention", given, other


def _late_columns(robot: Robot, given: Rows) -> Iterator[Reading]:
    """Alpha, or a, of each joint in the row after its own, or before."""
    for symbol in ("alpha", "a"):
        if symbol not in CONVENTIONS[robot.convention].key or any(r.get("type") == "fixed" for r in given):
            continue
        column = [float(row.get(symbol, 0.0)) for row in given]
        unit = robot.units.angle if symbol == "alpha" else robot.units.length
        for step, where in ((-1, "late"), (1, "early")):
            moved = np.roll(column, step).tolist()
            line = f"{symbol}: {', '.join(number(round(unit.from_si(v), 9)) for v in moved)}, joint by joint"
            made = [{**row, symbol: v} for row, v in zip(given, moved, strict=True)]
            yield f"each {symbol} stands one row too {where}", line, f"joints.{symbol}", made, robot.convention


def _other_units(robot: Robot, given: Rows) -> Iterator[Reading]:
    """Lengths in another unit; all angles, or one column of them."""
    rule, urdf = CONVENTIONS[robot.convention], robot.format == "urdf"
    length, angle = robot.units.length, robot.units.angle
    for name in ("mm", "cm", "m", "inch"):
        if name == length.name or (urdf and name == "inch"):
            continue
        share = UNITS[name].factor / length.factor
        line = (
            f"every xyz divided by {number(1 / share)}" if urdf else f"units: {{length: {name}, angle: {angle.name}}}"
        )
        made = [_scale_row(row, rule.key, LENGTHS, share) for row in given]
        yield f"the lengths of the robot are in {name}", line, "xyz" if urdf else "units.length", made, robot.convention
    other = {"deg": "rad", "rad": "deg"}.get(angle.name)
    if other is None:
        return
    share = UNITS[other].factor / angle.factor
    columns = [k.name for k in rule.keys if k.quantity in ANGLES]
    if urdf:
        made = [_scale_row(row, rule.key, ANGLES, share) for row in given]
        line = f"every rpy times {number(share)}: a URDF is in rad"
        yield "the angles rpy of the robot are in deg", line, "rpy", made, robot.convention
        return
    yield (
        f"the angles of the robot are in {other}", f"units: {{length: {length.name}, angle: {other}}}", "units.angle",
        [_scale_row(row, rule.key, ANGLES, share) for row in given], robot.convention,
    )  # fmt: skip
    for column in columns if len(columns) > 1 else ():
        made = [{**row, **({column: row[column] * share} if column in row else {})} for row in given]
        shown = ", ".join(number(round(angle.from_si(float(row.get(column, 0.0))), 6)) for row in made)
        line = f"{column}: {shown}, joint by joint"
        yield f"the values of {column} are in {other}", line, f"joints.{column}", made, robot.convention


def _scale_row(
    row: Mapping[str, Any], keys: Mapping[str, Any], quantities: Sequence[str], share: float
) -> dict[str, Any]:
    """A row with every number of some quantities in another unit."""
    out = dict(row)
    for name, value in row.items():
        if name in keys and keys[name].quantity in quantities:
            out[name] = [v * share for v in value] if isinstance(value, Sequence) else value * share
    return out


READINGS: tuple[Callable[[Robot, Rows], Iterator[Reading]], ...] = (_other_convention, _late_columns, _other_units)

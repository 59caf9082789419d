"""Changes that explain a misfit, in the words of the files: what is wrong, the file, its key, and the line to write there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal.arms.conventions import CONVENTIONS
from robocal.diagnose.hypotheses.changes import Change, Trial, What
from robocal.files.dataset import Reading
from robocal.files.notation import TableNotation
from robocal.files.robot import Robot
from robocal.files.units import UNITS, number
from robocal.files.yamlio import flow

__all__ = ["LENGTHS", "METRIC", "SWAPPED", "CauseText"]

SWAPPED = {"deg": "rad", "rad": "deg"}
METRIC = {"mm": "m", "m": "mm"}
LENGTHS = ("mm", "m", "cm", "inch")
PLACE = ("x", "y", "z")  # where a table names no columns
ACROSS = {  # the columns of a matrix, row by row, as those of its transpose
    9: (0, 3, 6, 1, 4, 7, 2, 5, 8),
    12: (0, 4, 8, 3, 1, 5, 9, 7, 2, 6, 10, 11),
    16: (0, 4, 8, 3, 1, 5, 9, 7, 2, 6, 10, 11, 12, 13, 14, 15),
}


@record
class CauseText:
    """One change in words: what is wrong, the file, its key, and the line to write."""

    text: str
    line: str
    file: str
    key: str = ""

    @classmethod
    def of(cls, trial: Trial, robot: Robot, reading: Reading) -> CauseText:
        parts = [_one(c, robot, reading) for c in trial]
        several = len({p.file for p in parts}) > 1
        words = " and ".join(p.text for p in parts)
        lines = " and ".join(f"{p.line} (in {p.file})" if several else p.line for p in parts)
        return cls(words, lines, parts[0].file, parts[0].key)


def _line(speech: TableNotation, **keys: Mapping[str, Any]) -> str:
    """The keys for the data file; where there is none, the whole file to put beside the table, in one line."""
    if not speech.described:
        return " and ".join(f"{k}: {flow(v)}" for k, v in keys.items())
    whole = {k: v for k, v in speech.described.items() if v != {}}
    for key, value in keys.items():
        whole[key] = {**whole.get(key, {}), **value}
    return f"a data.yaml beside it, with the line {flow(whole)}"


def _in_header(names: list[str], units: list[str]) -> str:
    return ", ".join(f"{n} [{u}]" for n, u in zip(names, units, strict=True)) + " in the header"


def _one(change: Change, robot: Robot, reading: Reading) -> CauseText:
    own = [s for s in reading.notations if not change.sources or s.source in change.sources] or list(reading.notations)
    speech = next((s for s in own if s.place), own[0]) if change.what in (What.AXES, What.LENGTH_UNIT) else own[0]
    if change.what in (What.SIGN, What.ZERO, What.WITH, What.GAINS):
        return _of_the_arm(change, robot, speech, reading)
    file = str(speech.file)
    if len(reading.notations) > 1 and not change.sources:
        file = ", ".join(dict.fromkeys(str(s.file) for s in reading.notations))
    return replace(_OF[change.what](change, robot, speech, reading), file=file)


# --- the arm's own --------------------------------------------------------------------------------------------------


def _of_the_arm(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    joint = robot.chain.joints[change.at[0]].name
    file = robot.place
    where = "" if robot.path is not None else ", in the robot.yaml that robocal new writes"
    column = speech.joints[change.at[0]]
    if change.what == What.SIGN:
        joints = [robot.chain.joints[i].name for i in change.at]
        words = f"{_several(joints)} {'counts' if len(joints) == 1 else 'count'} the other way"
        if robot.format == "urdf":
            return CauseText(words, f"the axis of {_several(joints)} with the other sign", file, joints[0])
        gains = [f"gain: {number(-robot.chain.table[f'{j}.gain'].value)} for {j}" for j in joints]
        return CauseText(words, f"{_several(gains)}{where}", file, joints[0])
    if robot.format == "urdf" and change.what in (What.WITH, What.GAINS):
        where = f" in the robot.yaml that robocal export {robot.path} --format yaml -o robot.yaml writes"
    if change.what == What.WITH:
        return _with(change, robot, file, where)
    if change.what == What.GAINS:
        return _gains(change, robot, reading, where)
    degrees = math.degrees(change.amount)
    words = f"the zero of {joint} is off by {degrees:+.0f} deg"
    rule = CONVENTIONS.get(robot.chain.convention)
    name = f"{joint}.{rule.revolute}" if rule is not None else ""
    if robot.format == "urdf" or name not in robot.chain.table:
        return CauseText(words, f"{degrees:+.0f} deg added to every value of {column}", str(speech.file), column)
    gain = robot.chain.table[f"{joint}.gain"].value
    unit = robot.unit_of(name)
    value = robot.chain.table[name].value + gain * change.amount
    value = (value + math.pi) % (2 * math.pi) - math.pi if abs(value) > math.pi + 1e-9 else value
    symbol = name.rpartition(".")[2]
    return CauseText(words, f"{symbol}: {number(round(unit.from_si(value), 9))} for {joint}{where}", file, name)


def _several(words: Sequence[str]) -> str:
    return " and ".join([*([", ".join(words[:-1])] if len(words) > 1 else []), words[-1]])


def _with(change: Change, robot: Robot, file: str, where: str) -> CauseText:
    joint, other = (robot.chain.joints[i].name for i in change.at)
    shares = robot.chain.shares.get(joint, {})
    shares = {**shares, other: shares.get(other, 0.0) + change.amount}
    line = f"with: {flow({n: float(number(v)) if v % 1 else int(v) for n, v in shares.items()})} for {joint}{where}"
    return CauseText(f"{joint} counts with {other}", line, file, joint)


def _gains(change: Change, robot: Robot, reading: Reading, where: str) -> CauseText:
    chain, zeros = robot.chain, {z.joint: z for z in robot.chain.zeros}
    lines, values = [], reading.dataset.configurations.joints
    for i, factor, offset in zip(change.at, change.factors, change.zeros, strict=True):
        joint = chain.joints[i].name
        keys = {"gain": chain.table[f"{joint}.gain"].value * factor}
        if joint in zeros:
            zero = zeros[joint]
            turn = chain.table[zero.parameter].value + zero.factor * offset
            keys[zero.parameter.rpartition(".")[2]] = robot.unit_of(zero.parameter).from_si(turn)
        lines.append(f"{', '.join(f'{k}: {number(round(v, 6))}' for k, v in keys.items())} for {joint}")
    assert values is not None
    units = np.array([UNITS[u].factor for u in reading.notations[0].joint_units])
    hundred = np.nanmax(np.abs(values / units)[:, list(change.at)]) <= 100.0
    words = "each joint counts in a unit of its own" + (", such as from -100 to 100 over its range" if hundred else "")
    return CauseText(words, f"{_several(lines)}{where}", robot.place, chain.joints[change.at[0]].name)


# --- columns and readings ---------------------------------------------------------------------------------------------


def _swap(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    a, b = change.at
    names = list(speech.joints)
    names[a], names[b] = names[b], names[a]
    first, second = (robot.chain.joints[i].name for i in (a, b))
    line = _line(speech, joints={"columns": names})
    if speech.described:
        line = f"the names {names[a]} and {names[b]} exchanged in the header"
    return CauseText(f"the columns of {first} and {second} are exchanged", line, "", "joints.columns")


def _unit(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    if change.what is What.JOINT_UNIT:
        section, known, stated, names, headed = (
            "joints",
            tuple(SWAPPED),
            speech.joint_units,
            speech.joints,
            speech.headed,
        )
    else:
        section, known, stated, headed = "position", LENGTHS, speech.lengths, speech.place_headed
        names = speech.place or PLACE
    units = list(stated)
    for i, factor in zip(change.at, change.factors, strict=True):
        units[i] = next(
            u for u in known if math.isclose(UNITS[u].factor, factor * UNITS[stated[i]].factor, rel_tol=1e-6)
        )
    those, others = [names[i] for i in change.at], [units[i] for i in change.at]
    line = _line(speech, **{section: {"unit": units[0] if len(set(units)) == 1 else units}})
    words = f"the values of {', '.join(those)} are in {' and '.join(dict.fromkeys(others))}"
    return CauseText(words, _in_header(those, others) if headed else line, "", f"{section}.unit")


def _axes(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    own = speech.place or PLACE
    names = [own[i] for i in change.at]
    signs = [s * speech.signs[i] for s, i in zip(change.signs, change.at, strict=True)]
    keys: dict[str, Any] = {"columns": names} if tuple(change.at) != (0, 1, 2) else {}
    if any(s < 0 for s in (*signs, *speech.signs)):
        keys["sign"] = signs
    line = _line(speech, position=keys)
    if speech.described and "sign" not in keys:
        old, new = zip(*((n, own[change.at.index(i)]) for i, n in enumerate(own) if n != names[i]), strict=True)
        line = f"the columns {', '.join(old)} named {', '.join(new)} in the header"
    mirrored = np.linalg.det(np.eye(3)[list(change.at)] * np.array(change.signs)[:, None]) < 0
    words = "the measured axes are mirrored" if mirrored else "the measured axes are in another order"
    return CauseText(words, line, "", "position.columns")


def _bearing(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    if change.at == (1,):
        return CauseText("the azimuth counts clockwise seen from above", "every azimuth times -1", "", "bearing")
    return CauseText("the elevation counts from the zenith", "90 deg less every elevation, in its place", "", "bearing")


def _shift(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    rows = abs(int(change.amount))
    shift = f"{rows} row" if rows == 1 else f"{rows} rows"
    where, way = ("below", "down") if change.amount > 0 else ("above", "up")
    words = f"each reading stands {shift} {where} its joint values"
    return CauseText(words, f"the joint columns moved {way} by {shift}", "", "file")


def _reverse_order(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    words = "the readings stand in the reverse order of the joint values"
    return CauseText(words, "one of the two turned round, last row first", "", "file")


def _inverse(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    words = "the poses are those of the instrument in the frame of the measured object"
    obs = reading.dataset.observations
    mine = next((o for o in obs if o.kind == "pose" and (not change.sources or o.source in change.sources)), None)
    instrument, target = ("tool", "base")
    if mine is not None and mine.frame is not None and mine.frame.mount == "tool":
        instrument, target = target, instrument
    name = mine.targets[0].name if mine is not None and mine.targets else "board"
    line = _line(speech, frame={"mount": instrument}, targets={name: {"mount": target}})
    return CauseText(words, line, "", "orientation")


def _transpose_rotations(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    line = "every rotation written as its inverse"
    if len(speech.turned) in ACROSS:
        line = _line(speech, orientation={"columns": [speech.turned[i] for i in ACROSS[len(speech.turned)]]})
    return CauseText("the rotations are transposed", line, "", "orientation")


def _turns(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    form = speech.forms[change.at[0]]
    stated = speech.orientation
    same = stated is not None and all(getattr(stated, k) == v for k, v in form.keys.items())
    lines = [] if same else [_line(speech, orientation=form.keys)]
    lines += [_in_header(list(speech.turned), [form.unit] * len(speech.turned))] if form.unit else []
    return CauseText("the orientations are read in the wrong form", " and ".join(lines), "", "orientation")


def _targets(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    one, two = (target.name for target in change.swapped)
    words = f"the targets {one} and {two} are exchanged"
    return CauseText(words, "their places exchanged under targets", "", "targets")


_OF = {
    What.SWAP: _swap,
    What.JOINT_UNIT: _unit,
    What.LENGTH_UNIT: _unit,
    What.AXES: _axes,
    What.BEARING: _bearing,
    What.SHIFT: _shift,
    What.REVERSED: _reverse_order,
    What.INVERSE: _inverse,
    What.TRANSPOSED: _transpose_rotations,
    What.TURNS: _turns,
    What.TARGETS: _targets,
}

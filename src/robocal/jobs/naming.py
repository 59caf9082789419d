"""What is wrong with the data is named before anything is fitted, with the line to write."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from robocal.arms.conventions import CONVENTIONS
from robocal.calibrate.hypotheses.changes import Change, What, changes
from robocal.calibrate.hypotheses.explain import Explanation, Trial, explain
from robocal.calibrate.hypotheses.remounted import remounted
from robocal.errors import FormatError
from robocal.files.dataset import Reading
from robocal.files.robot import Robot
from robocal.files.spoken import Spoken
from robocal.files.units import UNITS, number
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["refuse_wrong", "tried"]

SWAPPED = {"deg": "rad", "rad": "deg"}
METRIC = {"mm": "m", "m": "mm"}
MOST = 4  # ways of saying it


def tried(robot: Robot, reading: Reading) -> list[Change]:
    """Every single change that is worth a trial with these files."""
    angles = {s.source: _other_factor(s) for s in reading.spoken}
    lengths = {UNITS[METRIC[s.length.name]].factor / s.length.factor for s in reading.spoken
               if s.length is not None and s.length.name in METRIC}  # fmt: skip
    out = changes(robot.chain, reading.dataset, {k: v for k, v in angles.items() if v}, tuple(sorted(lengths)))
    for s in reading.spoken:
        read = [o for o in reading.dataset.observations if o.source == s.source and o.kind == "pose"]
        if len(read) == 1:
            out += [
                Change(What.TURNS, sources=(s.source,), turns=turns, words=words)
                for words, turns in s.turns
                if len(turns) == len(read[0])
            ]
    return out


def _other_factor(speech: Spoken) -> float:
    """Of the joints' other unit against the stated one; 0 where there is none."""
    name = next((u for u in speech.joint_units if u in SWAPPED), None)
    return UNITS[SWAPPED[name]].factor / UNITS[name].factor if name else 0.0


def refuse_wrong(robot: Robot, reading: Reading) -> tuple[Remark, ...]:
    """Raises FormatError where a change explains what the nominal arm does not, with the line that makes it; remarks on a
    target that was put on anew between files."""
    found = explain(robot.chain, reading.dataset, tried(robot, reading))
    if found is None:
        return _of_targets(robot, reading)
    told = [_Told.of(c, robot, reading) for c in _shown(found)]
    words = ", or ".join(dict.fromkeys(t.words for t in told))
    lines = list(dict.fromkeys(t.line for t in told))
    alike = " (these data cannot tell them apart)" if len(lines) > 1 else ""
    raise FormatError(
        f"{words}{alike}: with that, what the nominal model leaves falls from {_mm(found.stated)} to {_mm(found.left)}",
        file=told[0].file,
        key=told[0].key or None,
        expected=" or ".join(lines),
    )


def _of_targets(robot: Robot, reading: Reading) -> tuple[Remark, ...]:
    found = remounted(robot.chain, reading.dataset)
    if found is None:
        return ()
    files = tuple(Path(s).name for s in found.sources)
    amounts = {"together": Quantity(found.together), "apart": Quantity(found.apart)}
    told = Remark.of(Code.REMOUNTED, target=found.target, files=files, **amounts)
    if found.alone:
        raise FormatError(
            told.sentence, file=", ".join(files), key="targets", expected="a target of its own in each file"
        )
    return (told,)


def _shown(found: Explanation) -> Sequence[Trial]:
    """The changes to tell: of one change in all files or in some, the former."""
    every = {replace(c.parts[0], sources=(), turns=None) for c in found.changes if not c.parts[0].sources}
    kept = [
        c for c in found.changes
        if not c.parts[0].sources or replace(c.parts[0], sources=(), turns=None) not in every
    ]  # fmt: skip
    return kept[:MOST]


def _mm(value: float) -> str:
    return f"{value * 1e3:.3g} mm"


@dataclass(frozen=True)
class _Told:
    """One change in words: what is wrong, the file, its key, and the line to write."""

    words: str
    line: str
    file: str
    key: str = ""

    @classmethod
    def of(cls, trial: Trial, robot: Robot, reading: Reading) -> _Told:
        parts = [_one(c, robot, reading) for c in trial.parts]
        if len(parts) == 1:
            return parts[0]
        return cls(
            " and ".join(p.words for p in parts), " and ".join(p.line for p in parts), parts[0].file, parts[0].key
        )


def _one(change: Change, robot: Robot, reading: Reading) -> _Told:
    speech = next((s for s in reading.spoken if not change.sources or s.source in change.sources), reading.spoken[0])
    if change.what in (What.SIGN, What.ZERO):
        return _of_the_arm(change, robot, speech)
    file = str(speech.file)
    if len(reading.spoken) > 1 and not change.sources:
        file = ", ".join(dict.fromkeys(str(s.file) for s in reading.spoken))
    return replace(_OF[change.what](change, robot, speech), file=file)


# --- the arm's own --------------------------------------------------------------------------------------------------


def _of_the_arm(change: Change, robot: Robot, speech: Spoken) -> _Told:
    joint = robot.chain.joints[change.at[0]].name
    file = str(robot.path) if robot.path is not None else f"catalogue robot {robot.name}"
    column = speech.joints[change.at[0]]
    if change.what == What.SIGN:
        gain = robot.chain.table[f"{joint}.gain"].value
        words = f"{joint} counts the other way"
        if robot.format == "urdf":
            return _Told(words, f"the axis of {joint} with the other sign", file, joint)
        return _Told(words, f"gain: {number(-gain)} for {joint}", file, joint)
    degrees = math.degrees(change.amount)
    words = f"the zero of {joint} is off by {degrees:+.0f} deg"
    rule = CONVENTIONS.get(robot.chain.convention)
    name = f"{joint}.{rule.revolute}" if rule is not None else ""
    if robot.format == "urdf" or name not in robot.chain.table:
        return _Told(words, f"{degrees:+.0f} deg added to every value of {column}", str(speech.file), column)
    gain = robot.chain.table[f"{joint}.gain"].value
    unit = robot.unit_of(name)
    value = robot.chain.table[name].value + gain * change.amount
    value = (value + math.pi) % (2 * math.pi) - math.pi if abs(value) > math.pi + 1e-9 else value
    symbol = name.rpartition(".")[2]
    return _Told(words, f"{symbol}: {number(round(unit.from_si(value), 9))} for {joint}", file, name)


# --- columns and readings ---------------------------------------------------------------------------------------------


def _swap(change: Change, robot: Robot, speech: Spoken) -> _Told:
    a, b = change.at
    names = list(speech.joints)
    names[a], names[b] = names[b], names[a]
    first, second = (robot.chain.joints[i].name for i in (a, b))
    return _Told(
        f"the columns of {first} and {second} are exchanged",
        f"joints: {{columns: [{', '.join(names)}]}}",
        "",
        "joints.columns",
    )


def _joint_unit(change: Change, robot: Robot, speech: Spoken) -> _Told:
    units = [SWAPPED.get(u, u) if i in change.at else u for i, u in enumerate(speech.joint_units)]
    names = ", ".join(speech.joints[i] for i in change.at)
    other = units[change.at[0]]
    line = f"joints: {{unit: [{', '.join(units)}]}}"
    if len(set(units)) == 1:
        line = f"joints: {{unit: {units[0]}}}"
    if speech.headed:
        line = ", ".join(f"{speech.joints[i]} [{units[i]}]" for i in change.at) + " in the header"
    return _Told(f"the values of {names} are in {other}", line, "", "joints.unit")


def _place_names(speech: Spoken) -> tuple[str, ...]:
    return speech.place or ("x", "y", "z")


def _length_unit(change: Change, robot: Robot, speech: Spoken) -> _Told:
    assert speech.length is not None
    units = [METRIC[speech.length.name] if i in change.at else speech.length.name for i in range(3)]
    names = [_place_names(speech)[i] for i in change.at]
    line = f"position: {{unit: [{', '.join(units)}]}}" if len(set(units)) > 1 else f"position: {{unit: {units[0]}}}"
    if speech.place_headed:
        line = ", ".join(f"{name} [{units[i]}]" for name, i in zip(names, change.at, strict=True)) + " in the header"
    words = f"the values of {', '.join(names)} are in {METRIC[speech.length.name]}"
    return _Told(words, line, "", "position.unit")


def _axes(change: Change, robot: Robot, speech: Spoken) -> _Told:
    names = [_place_names(speech)[i] for i in change.at]
    old = [speech.signs[i] for i in change.at]
    signs = [s * o for s, o in zip(change.signs, old, strict=True)]
    moved = tuple(change.at) != (0, 1, 2)
    line = f"columns: [{', '.join(names)}]" if moved else ""
    if any(s < 0 for s in signs) or any(s < 0 for s in speech.signs):
        line += f"{', ' if line else ''}sign: {signs}"
    mirrored = np.linalg.det(np.eye(3)[list(change.at)] * np.array(change.signs)[:, None]) < 0
    words = "the measured axes are mirrored" if mirrored else "the measured axes are in another order"
    return _Told(words, f"position: {{{line}}}", "", "position.columns")


def _shift(change: Change, robot: Robot, speech: Spoken) -> _Told:
    rows = abs(int(change.amount))
    noun = "row" if rows == 1 else "rows"
    where, way = ("below", "down") if change.amount > 0 else ("above", "up")
    words = f"each reading stands {rows} {noun} {where} its joint values"
    return _Told(words, f"the joint columns moved {way} by {rows} {noun}", "", "file")


def _reversed(change: Change, robot: Robot, speech: Spoken) -> _Told:
    return _Told(
        "the readings stand in the reverse order of the joint values",
        "one of the two turned round, last row first",
        "",
        "file",
    )


def _inverse(change: Change, robot: Robot, speech: Spoken) -> _Told:
    words = "the poses are those of the instrument seen from the thing that it measures"
    return _Told(
        words, "frame: {mount: tool} and targets: {board: {mount: base}}, or the other way round", "", "orientation"
    )


def _transposed(change: Change, robot: Robot, speech: Spoken) -> _Told:
    return _Told("the rotations are transposed", "every rotation written as its inverse", "", "orientation")


def _turns(change: Change, robot: Robot, speech: Spoken) -> _Told:
    return _Told("the orientations are read in the wrong form", f"orientation: {{{change.words}}}", "", "orientation")


def _targets(change: Change, robot: Robot, speech: Spoken) -> _Told:
    return _Told("two targets are exchanged", "their places exchanged under targets", "", "targets")


_OF = {
    What.SWAP: _swap,
    What.JOINT_UNIT: _joint_unit,
    What.LENGTH_UNIT: _length_unit,
    What.AXES: _axes,
    What.SHIFT: _shift,
    What.REVERSED: _reversed,
    What.INVERSE: _inverse,
    What.TRANSPOSED: _transposed,
    What.TURNS: _turns,
    What.TARGETS: _targets,
}

"""What is wrong with the data is named before anything is fitted: the change that explains them, in words, and the line to write."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robocal.arms.conventions import CONVENTIONS
from robocal.diagnose.check_registry import Finding
from robocal.diagnose.hypotheses.changes import Change, What, changes
from robocal.diagnose.hypotheses.explain import Explanation, Trial, alike
from robocal.diagnose.hypotheses.one_change import Mistake
from robocal.diagnose.hypotheses.reading import OtherChain
from robocal.errors import FormatError, ToWrite
from robocal.files.dataset import Reading
from robocal.files.notation import TableNotation
from robocal.files.robot import Robot
from robocal.files.units import UNITS, number
from robocal.files.yamlio import quote

__all__ = ["METRIC", "SWAPPED", "CauseText", "candidate_changes", "change_error", "target_error"]

MOST = 4  # ways of saying it


def candidate_changes(robot: Robot, reading: Reading) -> list[Change]:
    """Every single change that is worth a trial with these files."""
    angles = {s.source: tuple(_other(SWAPPED, u) for u in s.joint_units) for s in reading.notations}
    lengths = {s.source: tuple(_other(METRIC, u) for u in s.lengths) for s in reading.notations}
    out = changes(robot.chain, reading.dataset, angles, lengths)
    for s in reading.notations:
        read = [o for o in reading.dataset.observations if o.source == s.source and o.kind == "pose"]
        if len(read) == 1:
            out += [
                Change(What.TURNS, (i,), sources=(s.source,), turns=form.turns)
                for i, form in enumerate(s.forms)
                if len(form.turns) == len(read[0])
            ]
    return out


def _other(swapped: Mapping[str, str], unit: str) -> float:
    """Of the other unit against the stated one; 0 where there is none."""
    return UNITS[swapped[unit]].factor / UNITS[unit].factor if unit in swapped else 0.0


def change_error(robot: Robot, reading: Reading, mistake: Mistake) -> FormatError:
    """What a change, or another chain of the URDF, explains that the nominal arm does not, with the line that makes it."""
    best = mistake.best
    found = mistake.explanation
    told = (
        [CauseText.of(c, robot, reading) for c in _changes_to_report(found)]
        if found and alike(found.left, best)
        else []
    )
    told += [_of_links(robot, o) for o in mistake.others[:MOST] if alike(o.left, best)]
    words = ", or ".join(dict.fromkeys(t.text for t in told))
    lines = list(dict.fromkeys(t.line for t in told))
    apart = " (these data cannot tell them apart)" if len(lines) > 1 else ""
    return FormatError(
        f"{words}{apart}: with that, the residual of the nominal model falls from {_mm(mistake.stated)} to {_mm(best)}",
        file=told[0].file,
        key=told[0].key or None,
        expected=ToWrite(" or ".join(lines)),
    )


def target_error(reading: Reading, finding: Finding) -> FormatError:
    """A target that was put on anew between files, as wrong input."""
    alone = any(s.described for s in reading.notations)
    where = "a column target with a name of its own" if alone else "a target of its own"
    files = finding.numbers["files"]
    assert isinstance(files, tuple)
    return FormatError(
        finding.remark.sentence, file=", ".join(map(str, files)), key="targets", expected=f"{where} in each file"
    )


def _of_links(robot: Robot, other: OtherChain) -> CauseText:
    from robocal.files.urdfchains import option

    words = f"the chain that was measured is {other.robot.root} to {other.robot.tip}, not {robot.root} to {robot.tip}"
    return CauseText(words, option(robot, other.robot), str(robot.path), "")


def _changes_to_report(found: Explanation) -> Sequence[Trial]:
    """The changes to tell: of one change in all files or in some, the former."""
    every = {replace(c[0], sources=(), turns=None) for c in found.changes if not c[0].sources}
    kept = [
        c for c in found.changes
        if not c[0].sources or replace(c[0], sources=(), turns=None) not in every
    ]  # fmt: skip
    return kept[:MOST]


def _mm(value: float) -> str:
    return f"{value * 1e3:.3g} mm"


SWAPPED = {"deg": "rad", "rad": "deg"}
METRIC = {"mm": "m", "m": "mm"}
ACROSS = {  # the columns of a matrix, row by row, as those of its transpose
    9: (0, 3, 6, 1, 4, 7, 2, 5, 8),
    12: (0, 4, 8, 3, 1, 5, 9, 7, 2, 6, 10, 11),
    16: (0, 4, 8, 3, 1, 5, 9, 7, 2, 6, 10, 11, 12, 13, 14, 15),
}


@dataclass(frozen=True)
class CauseText:
    """One change in words: what is wrong, the file, its key, and the line to write."""

    text: str
    line: str
    file: str
    key: str = ""

    @classmethod
    def of(cls, trial: Trial, robot: Robot, reading: Reading) -> CauseText:
        parts = [_one(c, robot, reading) for c in trial]
        if len(parts) == 1:
            return parts[0]
        return cls(
            " and ".join(p.text for p in parts), " and ".join(p.line for p in parts), parts[0].file, parts[0].key
        )


def _flow(value: Any) -> str:
    """A value as YAML in one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return quote(value) if isinstance(value, str) else str(value)


def _line(speech: TableNotation, **keys: Mapping[str, Any]) -> str:
    """The keys for the data file; where there is none, the whole file to put beside the table, in one line."""
    if not speech.described:
        return " and ".join(f"{k}: {_flow(v)}" for k, v in keys.items())
    whole = {k: v for k, v in speech.described.items() if v != {}}
    for key, value in keys.items():
        whole[key] = {**whole.get(key, {}), **value}
    return f"a data.yaml beside it, with the line {_flow(whole)}"


def _in_header(names: list[str], units: list[str]) -> str:
    return ", ".join(f"{n} [{u}]" for n, u in zip(names, units, strict=True)) + " in the header"


def _both(units: list[str]) -> str:
    return " and ".join(dict.fromkeys(units))


def _one(change: Change, robot: Robot, reading: Reading) -> CauseText:
    own = [s for s in reading.notations if not change.sources or s.source in change.sources] or list(reading.notations)
    speech = next((s for s in own if s.place), own[0]) if change.what in (What.AXES, What.LENGTH_UNIT) else own[0]
    if change.what in (What.SIGN, What.ZERO):
        return _of_the_arm(change, robot, speech)
    file = str(speech.file)
    if len(reading.notations) > 1 and not change.sources:
        file = ", ".join(dict.fromkeys(str(s.file) for s in reading.notations))
    return replace(_OF[change.what](change, robot, speech, reading), file=file)


# --- the arm's own --------------------------------------------------------------------------------------------------


def _of_the_arm(change: Change, robot: Robot, speech: TableNotation) -> CauseText:
    joint = robot.chain.joints[change.at[0]].name
    file = str(robot.path) if robot.path is not None else f"catalogue robot {robot.name}"
    where = "" if robot.path is not None else ", in the robot.yaml that robocal new writes"
    column = speech.joints[change.at[0]]
    if change.what == What.SIGN:
        gain = robot.chain.table[f"{joint}.gain"].value
        words = f"{joint} counts the other way"
        if robot.format == "urdf":
            return CauseText(words, f"the axis of {joint} with the other sign", file, joint)
        return CauseText(words, f"gain: {number(-gain)} for {joint}{where}", file, joint)
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


def _joint_unit(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    units = [SWAPPED.get(u, u) if i in change.at else u for i, u in enumerate(speech.joint_units)]
    names = ", ".join(speech.joints[i] for i in change.at)
    other = _both([units[i] for i in change.at])
    line = _line(speech, joints={"unit": units[0] if len(set(units)) == 1 else units})
    if speech.headed:
        line = _in_header([speech.joints[i] for i in change.at], [units[i] for i in change.at])
    return CauseText(f"the values of {names} are in {other}", line, "", "joints.unit")


def _place_names(speech: TableNotation) -> tuple[str, ...]:
    return speech.place or ("x", "y", "z")


def _length_unit(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    units = [METRIC[u] if i in change.at else u for i, u in enumerate(speech.lengths)]
    names = [_place_names(speech)[i] for i in change.at]
    line = _line(speech, position={"unit": units[0] if len(set(units)) == 1 else units})
    if speech.place_headed:
        line = _in_header(names, [units[i] for i in change.at])
    words = f"the values of {', '.join(names)} are in {_both([units[i] for i in change.at])}"
    return CauseText(words, line, "", "position.unit")


def _axes(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    names = [_place_names(speech)[i] for i in change.at]
    old = [speech.signs[i] for i in change.at]
    signs = [s * o for s, o in zip(change.signs, old, strict=True)]
    keys: dict[str, Any] = {"columns": names} if tuple(change.at) != (0, 1, 2) else {}
    if any(s < 0 for s in (*signs, *speech.signs)):
        keys["sign"] = signs
    line = _line(speech, position=keys)
    if speech.described and "sign" not in keys:
        old_names = [n for n, own in zip(_place_names(speech), names, strict=True) if n != own]
        new_names = [
            _place_names(speech)[change.at.index(i)] for i, n in enumerate(names) if n != _place_names(speech)[i]
        ]
        line = f"the columns {', '.join(old_names)} named {', '.join(new_names)} in the header"
    mirrored = np.linalg.det(np.eye(3)[list(change.at)] * np.array(change.signs)[:, None]) < 0
    words = "the measured axes are mirrored" if mirrored else "the measured axes are in another order"
    return CauseText(words, line, "", "position.columns")


def _shift(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    rows = abs(int(change.amount))
    noun = "row" if rows == 1 else "rows"
    where, way = ("below", "down") if change.amount > 0 else ("above", "up")
    words = f"each reading stands {rows} {noun} {where} its joint values"
    return CauseText(words, f"the joint columns moved {way} by {rows} {noun}", "", "file")


def _reverse_order(change: Change, robot: Robot, speech: TableNotation, reading: Reading) -> CauseText:
    return CauseText(
        "the readings stand in the reverse order of the joint values",
        "one of the two turned round, last row first",
        "",
        "file",
    )


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
    return CauseText(
        f"the targets {one} and {two} are exchanged", "their places exchanged under targets", "", "targets"
    )


_OF = {
    What.SWAP: _swap,
    What.JOINT_UNIT: _joint_unit,
    What.LENGTH_UNIT: _length_unit,
    What.AXES: _axes,
    What.SHIFT: _shift,
    What.REVERSED: _reverse_order,
    What.INVERSE: _inverse,
    What.TRANSPOSED: _transpose_rotations,
    What.TURNS: _turns,
    What.TARGETS: _targets,
}

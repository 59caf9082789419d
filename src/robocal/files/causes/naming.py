"""What is wrong with the data is named before anything is fitted, with the line to write."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robocal.calibrate.hypotheses.changes import Change, What, changes
from robocal.calibrate.hypotheses.explain import Explanation, Trial, alike, doubted, explain
from robocal.calibrate.hypotheses.remounted import remounted
from robocal.errors import FormatError, ToWrite
from robocal.files.causes.telling import METRIC, SWAPPED, Told
from robocal.files.dataset import Reading
from robocal.files.robot import Robot
from robocal.files.units import UNITS
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

if TYPE_CHECKING:
    from robocal.files.causes.otherlinks import Other, Reread

__all__ = ["refuse_wrong", "tried"]

MOST = 4  # ways of saying it


def tried(robot: Robot, reading: Reading) -> list[Change]:
    """Every single change that is worth a trial with these files."""
    angles = {s.source: tuple(_other(SWAPPED, u) for u in s.joint_units) for s in reading.spoken}
    lengths = {s.source: tuple(_other(METRIC, u) for u in s.lengths) for s in reading.spoken}
    out = changes(robot.chain, reading.dataset, angles, lengths)
    for s in reading.spoken:
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


def refuse_wrong(robot: Robot, reading: Reading, reread: Reread) -> tuple[Remark, ...]:
    """Raises FormatError where a change, or another chain of the URDF, explains what the nominal arm does not, with the
    line that makes it; remarks on a target that was put on anew between files. `reread` reads the data for another arm."""
    doubt = doubted(robot.chain, reading.dataset)
    if doubt is None:
        return _of_targets(robot, reading)
    from robocal.files.causes.otherlinks import other_links

    found = explain(robot.chain, reading.dataset, tried(robot, reading), doubt)
    others = other_links(robot, reading.dataset, doubt, reread)
    best = min([o.left for o in others] + ([found.left] if found else []), default=None)
    if best is None:
        return _of_targets(robot, reading)
    told = [Told.of(c, robot, reading) for c in _shown(found)] if found and alike(found.left, best) else []
    told += [_of_links(robot, o) for o in others[:MOST] if alike(o.left, best)]
    words = ", or ".join(dict.fromkeys(t.words for t in told))
    lines = list(dict.fromkeys(t.line for t in told))
    apart = " (these data cannot tell them apart)" if len(lines) > 1 else ""
    raise FormatError(
        f"{words}{apart}: with that, what the nominal model leaves falls from {_mm(doubt.stated)} to {_mm(best)}",
        file=told[0].file,
        key=told[0].key or None,
        expected=ToWrite(" or ".join(lines)),
    )


def _of_links(robot: Robot, other: Other) -> Told:
    from robocal.files.causes.otherlinks import option

    words = f"the chain that was measured is {other.robot.root} to {other.robot.tip}, not {robot.root} to {robot.tip}"
    return Told(words, option(robot, other.robot), str(robot.path), "")


def _of_targets(robot: Robot, reading: Reading) -> tuple[Remark, ...]:
    found = remounted(robot.chain, reading.dataset)
    if found is None:
        return ()
    files = tuple(Path(s).name for s in found.sources)
    amounts = {"together": Quantity(found.together), "apart": Quantity(found.apart)}
    told = Remark.of(Code.REMOUNTED, target=found.target, files=files, **amounts)
    if found.alone:
        alone = any(s.described for s in reading.spoken)
        where = "a column target with a name of its own" if alone else "a target of its own"
        raise FormatError(told.sentence, file=", ".join(files), key="targets", expected=f"{where} in each file")
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

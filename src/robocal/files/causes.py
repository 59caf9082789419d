"""What is wrong with the data of an arm is named before anything is fitted, as wrong input: what explains a misfit in the words of the
files, the file, its key, and the line to write there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from robocal.diagnose.check_registry import HYPOTHESES, ROWS, Finding, Level, When, run
from robocal.diagnose.hypotheses.changes import Change, Trial, What, changes
from robocal.diagnose.hypotheses.explain import Doubt, Explanation, alike
from robocal.diagnose.hypotheses.one_change import CHANGED, Mistake, mistake
from robocal.diagnose.hypotheses.reading import OtherChain, ReadContext
from robocal.diagnose.hypotheses.row_parts import parts_differ
from robocal.errors import FormatError, ToWrite
from robocal.files.cause_text import LENGTHS, METRIC, SWAPPED, CauseText
from robocal.files.dataset import Reading
from robocal.files.robot import Robot
from robocal.files.units import UNITS
from robocal.files.wrong_units import refuse_input
from robocal.progress import Watch
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.files.urdfchains import Reread

__all__ = ["data_remarks"]

MOST = 4  # ways of saying it


def data_remarks(robot: Robot, reading: Reading, reread: Reread, watch: Watch | None = None) -> tuple[Remark, ...]:
    """What checks of the data of an arm say. Raises FormatError for what they refuse; `reread` reads the data for another arm."""

    def others(doubt: Doubt, changed: bool) -> Sequence[OtherChain]:
        from robocal.files.other_robots import other_robots, other_robots_beside

        if changed:
            return other_robots_beside(robot, reading, doubt, candidate_changes(robot, reading))
        return other_robots(robot, reading.dataset, doubt, reread)

    context = ReadContext(
        robot.chain,
        reading.dataset,
        watch=watch,
        suspicions=reading.suspicions,
        alternatives=reading.alternatives,
        forgotten=tuple(w for w in robot.warnings if w.code == Code.KEYS_UNSTATED),
        changes=lambda: candidate_changes(robot, reading),
        others=others,
    )
    findings = run(When.READ, context, ROWS, HYPOTHESES)
    for finding in findings:
        if finding.level is Level.REFUSE and finding.code == CHANGED:
            found = mistake(context)
            assert found is not None
            raise change_error(robot, reading, found)
        if finding.level is Level.REFUSE and finding.code == Code.REMOUNTED:
            raise target_error(reading, finding)
        if finding.check == parts_differ.name:
            told, file = finding.remark, str(finding.numbers["file"])
            raise FormatError(told.sentence, file=file, key="file", expected=ToWrite(told.advice))
        refuse_input(robot, finding)
    return tuple(f.remark for f in findings)


def candidate_changes(robot: Robot, reading: Reading) -> list[Change]:
    """Every single change that is worth a trial with these files."""
    angles = {s.source: tuple(_other(SWAPPED, u) for u in s.joint_units) for s in reading.notations}
    lengths = {s.source: tuple(_other(METRIC, u) for u in s.lengths) for s in reading.notations}
    poses = [o for o in reading.dataset.observations if o.kind == "pose"]
    known = {u for s in reading.notations for u in s.lengths}
    stated = next(iter(known)) if len(known) == 1 else ""
    return (
        changes(robot.chain, reading.dataset, angles, lengths)
        + [
            Change(What.LENGTH_UNIT, (0, 1, 2), factors=(UNITS[u].factor / UNITS[stated].factor,) * 3)
            for u in LENGTHS
            if stated and u not in (stated, METRIC.get(stated))
        ]
        + [
            Change(What.TURNS, (i,), sources=(s.source,), turns=form.turns)
            for s in reading.notations
            for i, form in enumerate(s.forms)
            if [len(o) for o in poses if o.source == s.source] == [len(form.turns)]
        ]
    )


def _other(swapped: Mapping[str, str], unit: str) -> float:
    """Of the other unit against the stated one; 0 where there is none."""
    return UNITS[swapped[unit]].factor / UNITS[unit].factor if unit in swapped else 0.0


def change_error(robot: Robot, reading: Reading, made: Mistake) -> FormatError:
    """What a change, or another chain of the URDF, explains that the nominal arm does not, with the line that makes it."""
    best, found = made.best, made.explanation
    of_changes = _changes_to_report(found) if found and alike(found.left, best) else ()
    told = [CauseText.of(c, robot, reading) for c in of_changes]
    told += [CauseText(o.text, o.line, robot.place, o.key) for o in made.others[:MOST] if alike(o.left, best)]
    words = ", or ".join(dict.fromkeys(t.text for t in told))
    several = len({t.file for t in told}) > 1
    lines = list(dict.fromkeys(f"{t.line} (in {t.file})" if several and "(in " not in t.line else t.line for t in told))
    apart = " (these data cannot tell them apart)" if len(lines) > 1 else ""
    return FormatError(
        f"{words}{apart}: with that, the residual of the nominal model falls from {_mm(made.stated)} to {_mm(best)}",
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
    file, expected = ", ".join(map(str, files)), f"{where} in each file"
    return FormatError(finding.remark.sentence, file=file, key="targets", expected=expected)


def _changes_to_report(found: Explanation) -> Sequence[Trial]:
    """The changes to tell: of one change in all files or in some, the former."""
    bare = [replace(c[0], sources=(), turns=None) for c in found.changes]
    every = {b for c, b in zip(found.changes, bare, strict=True) if not c[0].sources}
    kept = [c for c, b in zip(found.changes, bare, strict=True) if not c[0].sources or b not in every]
    # Of each kind of change the best, then the second best; a joint that counts the other way is likelier than mirrored axes.
    nth = [sum(d[0].what == c[0].what for d in kept[:i]) for i, c in enumerate(kept)]
    best = sorted(
        sorted(range(len(kept)), key=lambda i: nth[i])[:MOST], key=lambda i: list(What).index(kept[i][0].what)
    )
    return [kept[i] for i in best]


def _mm(value: float) -> str:
    return f"{value * 1e3:.3g} mm"

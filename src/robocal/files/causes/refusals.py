"""Data of arms that checks refuse, as wrong input: the file, its key, and what to write there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from robocal.diagnose.check_registry import HYPOTHESES, ROWS, Finding, Level, When, run
from robocal.diagnose.hypotheses.explain import Doubt
from robocal.diagnose.hypotheses.one_change import CHANGED, mistake
from robocal.diagnose.hypotheses.reading import OtherChain, ReadContext
from robocal.diagnose.hypotheses.units import WRONG_UNIT
from robocal.diagnose.rows.table import STILL
from robocal.errors import FormatError
from robocal.files.causes.naming import candidate_changes, change_error, target_error
from robocal.files.dataset import Reading
from robocal.files.robot import Robot
from robocal.progress import Watch
from robocal.remarks.code import Code
from robocal.remarks.english import phrase_of
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.files.urdfchains import Reread

__all__ = ["data_remarks", "refuse_input"]


def data_remarks(robot: Robot, reading: Reading, reread: Reread, watch: Watch | None = None) -> tuple[Remark, ...]:
    """What checks of the data of an arm say. Raises FormatError for what they refuse; `reread` reads the data for another arm."""

    def others(doubt: Doubt) -> Sequence[OtherChain]:
        from robocal.files.urdfchains import other_links

        return other_links(robot, reading.dataset, doubt, reread)

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
        refuse_input(finding)
    return tuple(f.remark for f in findings)


def refuse_input(finding: Finding) -> None:
    """Raises FormatError for wrong units and for readings that never change."""
    n = finding.numbers
    if finding.code == STILL:
        raise FormatError(
            finding.remark.sentence,
            file=n["source"],
            key=str(n["kind"]),
            found=f"{n['rows']} equal rows",
            expected="a different reading at each configuration",
        )
    if finding.code == WRONG_UNIT:
        raise FormatError(
            phrase_of(WRONG_UNIT).sentence.format(**n),  # whole, however long the names of files are
            file=n["source"],
            key=f"{n['part']}.unit",
            found=n["stated"],
            expected=n["alternative"],
        )

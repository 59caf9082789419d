"""Findings on wrong units and on readings that never change, as wrong input: the file, its key, and what to write."""

from __future__ import annotations

from robocal.diagnose.check_registry import Finding, Level
from robocal.diagnose.hypotheses.units import WRONG_UNIT
from robocal.diagnose.rows.table import STILL
from robocal.errors import FormatError
from robocal.files.robot import Robot
from robocal.files.robot_rows import MOST_REACH
from robocal.remarks.english import phrase_of

__all__ = ["refuse_input", "refuse_robot_units"]


def refuse_robot_units(robot: Robot, finding: Finding) -> None:
    """Raises FormatError where readings fit in another unit because the robot's own lengths are in one: more than any arm measures."""
    reach = sum(abs(p.value) for p in robot.chain.table.rows if p.unit == "m" and p.name in robot.chain.geometric)
    n = finding.numbers
    wrong = (
        finding.level is Level.REFUSE and finding.code == WRONG_UNIT and (n["stated"], n["alternative"]) == ("mm", "m")
    )
    if not wrong or reach < MOST_REACH:
        return
    urdf = robot.format == "urdf"
    raise FormatError(
        f"the lengths of the robot are probably in mm: {n['why']}, and the misfit falls {n['times']:.3g} times with other units",
        file=str(robot.path),
        key="xyz" if urdf else "units.length",
        found=f"lengths of {reach:.3g} m in all",
        expected="a URDF in m: every xyz divided by 1000" if urdf else "mm",
    )


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

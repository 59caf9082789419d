"""Findings on wrong units and on readings that never change, as wrong input: the file, its key, and what to write."""

from __future__ import annotations

import math

from robocal.diagnose.check_registry import Finding, Level
from robocal.diagnose.hypotheses.units import WRONG_UNIT
from robocal.diagnose.limits import ARM_LONGEST, ARM_SHORTEST
from robocal.diagnose.rows.table import STILL
from robocal.diagnose.rows.torque_size import TORQUE_SIZE
from robocal.errors import FormatError
from robocal.files.robot import Robot
from robocal.files.units import UNITS, number
from robocal.remarks.english import phrase_of

__all__ = ["refuse_input"]


def refuse_input(robot: Robot, finding: Finding) -> None:
    """Raises FormatError for readings that never change, and for wrong units: of the data, or of the robot's own lengths where these
    are then as long as an arm is."""
    n = finding.numbers
    if finding.code == STILL:
        raise FormatError(
            finding.remark.sentence,
            file=n["source"],
            key=str(n["kind"]),
            found=f"{n['rows']} equal rows",
            expected="a different reading at each configuration",
        )
    if finding.code == TORQUE_SIZE:
        told = finding.remark
        raise FormatError(told.sentence, file=n["source"], key="torque.unit", expected=told.advice.rstrip("."))
    if finding.level is not Level.REFUSE or finding.code != WRONG_UNIT:
        return
    sentence, expected = (
        phrase_of(WRONG_UNIT).sentence.format(**n),
        str(n["alternative"]),
    )  # whole, however long the names of files are
    own, data_likely = _unit_of_robot(robot, UNITS[str(n["stated"])].factor / UNITS[expected].factor)
    urdf = robot.format == "urdf"
    line = f"a URDF in m: every xyz divided by {number(1 / UNITS[own].factor)}" if urdf and own else own
    if own and not data_likely:
        raise FormatError(
            f"the lengths of the robot are probably in {own}: {n['why']}, and the misfit falls {n['times']:.3g} times with other units",
            file=robot.place,
            key="xyz" if urdf else "units.length",
            found=f"lengths of {_reach(robot):.3g} m in all",
            expected=line,
        )
    if own:
        sentence += f"; or the lengths of the robot are in {own}"
        expected += f", or in {robot.place}: {line}"
    raise FormatError(sentence, file=n["source"], key=f"{n['part']}.unit", found=n["stated"], expected=expected)


def _reach(robot: Robot) -> float:
    """The sum of the robot's lengths (m)."""
    return sum(abs(p.value) for p in robot.chain.table.rows if p.unit == "m" and p.name in robot.chain.geometric)


def _unit_of_robot(robot: Robot, times: float) -> tuple[str, bool]:
    """The unit in which the robot's lengths are `times` as long, where that is as long as an arm is, else nothing; and whether they are as
    long as an arm now."""
    reach, wanted = _reach(robot), robot.units.length.factor * times
    near = (
        u
        for u in ("mm", "cm", "m", "inch")
        if u != robot.units.length.name and math.isclose(UNITS[u].factor, wanted, rel_tol=1e-6)
    )
    own = next(near, "")  # tolerance: factors of units are exact
    return own if ARM_SHORTEST <= reach * times <= ARM_LONGEST else "", ARM_SHORTEST <= reach <= ARM_LONGEST

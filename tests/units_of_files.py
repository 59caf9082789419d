"""Units of what a file says, doubted as the verbs doubt them."""

from __future__ import annotations

from robocal.diagnose.check_registry import HYPOTHESES, ROWS, When, run
from robocal.diagnose.hypotheses.reading import ReadContext
from robocal.files.robot import Robot
from robocal.files.units import Units
from robocal.files.wrong_units import refuse_input


def doubt_units(chain, reading):
    units = {"suspicions": reading.suspicions, "alternatives": reading.alternatives}
    findings = run(When.READ, ReadContext(chain, reading.dataset, **units), ROWS, HYPOTHESES)
    for finding in findings:
        refuse_input(Robot(chain, Units(), None, "", ""), finding)
    return tuple(f.remark for f in findings)

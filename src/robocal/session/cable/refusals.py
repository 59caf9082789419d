"""Data of cable robots that checks refuse, as wrong input: the file, its key, and what to write there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal.cables.geometry import CableRobot
from robocal.diagnose.cables.columns import ANCHORS, AXES, LENGTHS
from robocal.diagnose.cables.read_lengths import COPIED, TWO_SIZES
from robocal.diagnose.cables.rest import CELLS, EXCHANGED, NOT_AT_REST, SHIFTED
from robocal.diagnose.check_registry import CABLES, Context, Finding, Level, When, run
from robocal.errors import FormatError, ToWrite
from robocal.files.cable.cablefile import CableFile
from robocal.measure.data import DataSet
from robocal.remarks.remark import Remark
from robocal.session.watching import Watch

__all__ = ["data_remarks"]


# The key of the data file, what was found there, and what was expected, with the numbers of the finding.
PLACES: dict[str, tuple[str, str | None, str]] = {
    COPIED: ("configuration", "{count} of {of}, such as {one} and {other}", "every measurement once"),
    TWO_SIZES: (
        "{wrong}.unit", "positions that scatter by {positions:.3g} m, by the lengths {lengths:.3g} m",
        "the same; the robot's frame anchors scatter by {frame:.3g} m",
    ),
    ANCHORS: ("cables", None, "the platform anchors in the order of {right}"),
    LENGTHS: ("lengths.columns", None, "columns that hold {right} in this order"),
    EXCHANGED: ("{kind}.columns", None, "their columns in the order of {one}, {other}"),
    SHIFTED: ("{kind}", None, "each beside the id of its pose"),
    NOT_AT_REST: (
        "{kind}", "they leave {left:.3g} of force, geometry would {allowed:.3g}",
        "the order of the columns as that of the cables, one unit, the platform at rest",
    ),
    CELLS: (
        "{kind}.unit", "{mass:.3g} where the robot's file states {stated:.3g} ({unit}?)",
        "the unit of the cells, or the platform's mass in the robot's file",
    ),
}  # fmt: skip
for kind, code in AXES.items():
    key = "orientation" if kind == "orientation" else "position.columns"
    PLACES[code] = (key, None, "poses in right-handed axes, T_base_platform")


def data_remarks(file: CableFile, data: DataSet, watch: Watch | None = None) -> tuple[Remark, ...]:
    """What checks of the data say. Raises FormatError for the first finding that refuses."""
    context: Context[CableRobot] = Context(file.robot, data, watch=watch)
    findings = run(When.READ, context, CABLES)
    for finding in findings:
        if finding.level is Level.REFUSE:
            raise FormatError(finding.remark.sentence, **_place(finding, file.path))
    return tuple(f.remark for f in findings)


def _place(finding: Finding, robot: Path | None) -> dict[str, Any]:
    """File (`robot` is the robot's) and key, what was found there, and what was expected."""
    code, n = finding.code, finding.numbers
    key, found, expected = (None if text is None else text.format(**n) for text in PLACES[code])
    to_write = code in (ANCHORS, LENGTHS, EXCHANGED) and expected is not None
    place = {"file": robot if code == ANCHORS else n["source"], "key": key, "found": found}
    return {**place, "expected": ToWrite(expected) if to_write else expected}

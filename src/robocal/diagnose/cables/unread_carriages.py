"""Anchors on rails whose carriages moved while the lengths were read, and nobody wrote down where they stood."""

from __future__ import annotations

from collections.abc import Sequence

from robocal.diagnose.segments.find import Segment
from robocal.diagnose.segments.posed import ZERO
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.remarks.english import declare
from robocal.remarks.remark import Remark

__all__ = ["find_unread_carriages"]

UNREAD = declare(
    "carriages-not-read",
    "{file}: anchors of {cables} are on rails, and from row {first} to row {last} lengths are off as if their carriages stood elsewhere",
    "Write where the carriages stood into columns of the table: `carriage: {{columns: [...], cables: [...]}}` in the data file.",
)


def find_unread_carriages(model: Model, data: DataSet, moved: Sequence[Segment]) -> Remark | None:
    """What explains zeros that moved for a while, where carriages that nobody read may have moved; None where none may."""
    off = [s for s in moved if s.cause.startswith(ZERO)]
    if not off or "cable" not in model.parts:
        return None
    from robocal.cables.geometry import CableRobot

    robot = model.part(CableRobot)
    if robot is None or robot.rails is None:
        return None
    read = {o.source for o in data.observations if "carriage" in o.extra}
    held = tuple(c for c in robot.cables if robot.row(f"{c}.carriage") in robot.table)
    unread = [s for s in off if s.source not in read and (not s.name.endswith(".l0") or s.name[:-3] in held)]
    if not unread:
        return None
    first, last = unread[0].rows
    return Remark.of(UNREAD, file=unread[0].source, cables=held, first=first, last=last)

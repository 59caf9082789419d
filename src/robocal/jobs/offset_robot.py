"""A nominal robot whose joint values get offsets from a file: what a controller with these offsets makes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from robocal.arms.zeros import with_offsets
from robocal.files.offsets import OffsetFile, read_offsets
from robocal.files.robot import Robot
from robocal.jobs.reference import nominal_chain, run_result
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["OffsetRobot", "offset_robot"]


@dataclass(frozen=True)
class OffsetRobot:
    """The nominal robot, the same with the offsets of a file, and what a person should know of that file."""

    nominal: Robot
    robot: Robot
    file: OffsetFile
    warnings: tuple[Remark, ...]


def offset_robot(name: str, arm: Robot, file: str) -> OffsetRobot:
    """Puts the offsets of a file on the robot; of a run folder, on the robot that its identification started from. Raises
    InputError."""
    nominal = arm if run_result(name) is None else replace(arm, chain=nominal_chain(name, arm, None), left_out=())
    found = read_offsets(file, nominal.chain)
    lacks = Remark.of(Code.OFFSETS_MISSING, file=str(found.path), joints=found.missing)
    moved = replace(nominal, chain=with_offsets(nominal.chain, found.values))
    return OffsetRobot(nominal, moved, found, (*found.remarks, *((lacks,) if found.missing else ())))

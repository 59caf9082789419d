"""What a calibrated robot was before: the nominal model that its controller still has; the same with joint offsets from a
file, as a controller makes of them."""

from __future__ import annotations

from robocal._record import record, replace
from robocal.arms.chain import Chain, with_offsets
from robocal.errors import ModelError
from robocal.files.offset_file import OffsetFile, read_offsets
from robocal.files.robot import Robot
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.arm import open_arm
from robocal.session.runs import run_cautions, run_result

__all__ = ["OffsetRobot", "nominal_chain", "offset_robot", "run_cautions", "run_result"]


def nominal_chain(name: str, robot: Robot, nominal: str | None, *, base: str | None = None, tip: str | None = None,
                  what: str = "offsets need a robot to count from", whole: bool = False) -> Chain:  # fmt: skip
    """The nominal model of a calibrated robot: the one that is named, else what its run started from.

    Raises ModelError when nothing says what it was, or its joints (`whole`: any of its parameters) are others.
    """
    known = run_result(name)
    if nominal is not None:
        reference = open_arm(nominal, base=base, tip=tip).chain
    elif known is not None:
        table = robot.chain.table
        before = {
            p.name: robot.units.of(table[p.name].unit).to_si(p.nominal)
            for p in known.parameters
            if p.name in table and p.nominal is not None
        }
        reference = robot.chain.with_values(before)
    else:
        raise ModelError(what, key="--nominal", expected="--nominal ROBOT, or a run folder as ROBOT")
    other = reference.joint_names != robot.chain.joint_names
    if other or (whole and reference.table.names != robot.chain.table.names):
        message, expected = "the nominal robot has other joints or parameters", ", ".join(robot.chain.joint_names)
        raise ModelError(message, key="--nominal", found=nominal, expected=expected)
    return reference


@record
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

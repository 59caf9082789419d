"""The robot's poses from joint values and its file, which knows what its making leaves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.csvtable import read_csv
from robocal.files.headers import joint_columns
from robocal.files.robot_pose_source import TableSource, read_times
from robocal.files.robot_poses import RobotPoses, stated_units
from robocal.files.text import InputFile
from robocal.files.units import parse_unit
from robocal.measure.machine import Mechanism, joints_of
from robocal.measure.reach import reach
from robocal.session.inputs import open_machine

__all__ = ["read_joint_poses"]


def read_joint_poses(place: Path, arm: str, units: str | None) -> tuple[RobotPoses, Any, Array]:
    """T_base_tool of every row of joint values, the machine of which nothing is free, and the joint values (m, n) in rad or m. Raises
    InputError."""
    opened = open_machine(arm)
    machine = opened.machine
    moving: Mechanism | None = machine.mechanism
    if moving is None or not joints_of(machine):
        raise ModelError("this robot has no joints", key="--arm", found=arm, expected="an arm, or poses without --arm")
    source = TableSource(read_csv(place))
    table = source.table
    columns = joint_columns(table, machine)
    length, angle = stated_units(units)
    given, si = {"m": length, "rad": angle}, ["m" if j.type == "prismatic" else "rad" for j in joints_of(machine)]
    found = [
        given[s] or parse_unit(table.unit(c) or opened.units.of(s).name, s, file=table.path, column=c)
        for c, s in zip(columns, si, strict=True)
    ]
    joints = table.numbers(columns) * np.array([u.factor for u in found])
    pose = reach(moving, joints, (), {})[0]
    times, clock = read_times(source)
    notation = f"joints {', '.join(map(str, columns))} in {found[0].name}, through {opened.name}"
    file = opened.file
    files = source.files if file.path is None else (*source.files, InputFile(file.path, file.sha256))
    poses = RobotPoses(source.names, times, pose, notation, "joints", joints, files, clock)
    return poses, machine.with_table(machine.table.with_free(())), joints

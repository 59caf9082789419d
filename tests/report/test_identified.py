"""What an identification says at its end: commands that run as they stand."""

from __future__ import annotations

import shlex
from pathlib import Path
from types import SimpleNamespace as Made

import pytest

from robocal.report.identified import steps


def result(status: str, joints: int, *files: str) -> Made:
    inputs = [Made(file=f) for f in files]
    return Made(
        verdict=Made(status=status),
        robot=Made(joints=joints, convention="dh" if joints else "cable 3R3T"),
        working_range=Made(),
        provenance=Made(inputs=inputs),
    )


def test_a_folder_with_blanks_is_one_word() -> None:
    (line,) = steps(result("improved", 6), Path("r u n"))
    assert "r u n" in shlex.split(line.split(";")[0])


def test_a_machine_without_joints_is_sent_to_what_takes_it() -> None:
    """validate and compensate refuse cable robots."""
    (line,) = steps(result("improved", 0), Path("run"))
    assert "robocal cable forward run LENGTHS" in line and "validate" not in line and "compensate" not in line


@pytest.mark.parametrize("status", ["not_improved", "refused"])
def test_a_catalogue_robot_is_named_as_the_command_line_wants_it(status: str) -> None:
    (line,) = steps(result(status, 5, "catalogue:rv-2aj", "sim/data.yaml"), Path("run"))
    assert "robocal check rv-2aj sim/data.yaml " in line

"""Every cause of a misfit is named with its line; with the line obeyed, the robot is improved."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from causes import CAUSES, obey
from cli.runs import robocal

QUICK = ("shared", "dh_as_mdh", "urdf_angles", "by_columns", "rows_off")


def named(case, message: str) -> str:
    assert re.search(case.words, message), message
    return message


@pytest.mark.parametrize(
    ("name", "arm"),
    [
        pytest.param(name, arm, marks=() if name in QUICK and arm == "irb-120" else pytest.mark.slow)
        for name in CAUSES
        for arm in ("irb-120", "panda")
    ],
)
def test_a_cause_is_named_and_its_line_helps(name: str, arm: str, tmp_path: Path) -> None:
    rng = np.random.default_rng([list(CAUSES).index(name), 4])
    case = CAUSES[name](tmp_path, arm, rng, pose=bool(rng.integers(2)))
    ran = robocal("identify", case.robot, case.data)
    assert ran.status == 2, ran.out
    robot, data, more = obey(case, named(case, " ".join(ran.err.split())))
    ran = robocal("identify", robot, data, *more, "--json")
    assert ran.status == 0, (ran.out, ran.err)
    assert ran.document["verdict"]["status"] == "improved"

"""A study of a cable robot and one of an arm, each in a folder of its own."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from studies.specs import ARM, EXAMPLES, TEXT

from robocal.files.display import listing_text
from robocal.files.pose_table import joint_program
from robocal.files.robot import open_robot
from robocal.files.units import Units
from robocal.planning.candidates import joint_range


@pytest.fixture
def study(tmp_path):
    shutil.copy(EXAMPLES / "cable-laval" / "robot.yaml", tmp_path)
    (tmp_path / "study.yaml").write_text(TEXT)
    return tmp_path / "study.yaml"


@pytest.fixture
def arm(tmp_path):
    """A study of an arm, and lists of its poses: eight that are tests, thirty that are measured."""
    chain, rng = open_robot("rv-2aj").chain, np.random.default_rng(0)
    for name, many in (("tests.csv", 8), ("listed.csv", 30)):
        q = rng.uniform(*joint_range(chain).T, (many, len(chain.joints)))
        (tmp_path / name).write_text(
            listing_text(joint_program(chain, [f"p{i}" for i in range(many)], q, range(many)), Units())
        )
    (tmp_path / "study.yaml").write_text(ARM)
    return tmp_path / "study.yaml"

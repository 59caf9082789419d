"""What `new` hands out is valid as it is: robot, data file and table belong together."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.arms import catalog
from robocal.arms.conventions import CONVENTIONS
from robocal.errors import ModelError
from robocal.files.dataset import read_dataset
from robocal.files.robot import open_robot, read_robot
from robocal.files.templates import convention_chain, templates
from robocal.files.units import UNITS, Units
from robocal.files.writing import write_files


def check(folder, arm, kind, units=None):
    write_files(folder, templates(arm, kind=kind, units=units))
    robot = read_robot(folder / "robot.yaml")
    q = np.random.default_rng(0).uniform(-1, 1, (5, len(arm.joints)))
    np.testing.assert_allclose(robot.chain.pose(q), arm.pose(q), atol=1e-12)
    data, table = (
        read_dataset(folder / "data.yaml", robot.chain),
        read_dataset(folder / "measurements.csv", robot.chain),
    )
    a, b = data.dataset.observations[0], table.dataset.observations[0]
    np.testing.assert_array_equal(a.value, b.value)
    assert data.warnings == () and a.kind == kind and a.sigma is not None and b.sigma is None and len(a) == 5
    np.testing.assert_allclose(
        robot.chain.pose(data.dataset.configurations.joints)[:, :3, 3], a.value[:, :3], atol=1e-6
    )


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("kind", ["position", "pose"])
def test_templates_of_a_convention(tmp_path, convention, kind):
    arm = convention_chain(convention, 3)
    assert arm.joint_names == ("j1", "j2", "j3")
    check(tmp_path, arm, kind)


@pytest.mark.parametrize("name", catalog.names())
def test_templates_of_the_catalogue(tmp_path, name):
    check(tmp_path, catalog.get(name), "position", Units(UNITS["m"], UNITS["rad"]))


@pytest.mark.parametrize("name", catalog.names())
def test_a_catalogue_robot_opens_like_a_file(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    robot, arm = open_robot(name), catalog.get(name)
    assert robot.path is None and robot.format == "yaml" and robot.text.startswith("robocal: 1")
    q = np.random.default_rng(0).uniform(-1, 1, (5, len(arm.joints)))
    np.testing.assert_allclose(robot.chain.pose(q), arm.pose(q), atol=1e-12)
    np.testing.assert_allclose(robot.chain.limits, arm.limits, atol=1e-12)


def test_unknown_names():
    with pytest.raises(ModelError, match="did you mean"):
        open_robot(catalog.names()[0] + "x")
    with pytest.raises(ModelError, match="did you mean 'dh'"):
        convention_chain("dhh", 3)

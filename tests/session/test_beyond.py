"""Beyond geometry from files to files: simulated with groups, identified with them, validated from the run folder."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from called import identify, simulate, validate
from run_folders import earlier

from robocal.arms.groups import add
from robocal.errors import FormatError, ModelError
from robocal.files.robot import open_robot
from robocal.files.runfolder import layer_text
from robocal.prove.nongeometric.layer import learn
from robocal.remarks.code import Code
from robocal.session.inputs import open_arm

ROBOT = """robocal: 1
name: four axes
units: {length: mm, angle: deg}
convention: dh-hayati
joints:
  - {name: j1, d: 300, alpha: 90, limits: [-150, 150]}
  - {name: j2, a: 250, limits: [-120, 120]}
  - {name: j3, a: 200, alpha: 90, limits: [-120, 120]}
  - {name: j4, d: 120, limits: [-150, 150]}
tool: {xyz: [30, 10, 80]}
groups:
  eccentricity: {harmonics: [1, 2], joints: [j2, j3]}
  gain: {}
"""
TRUE = ("j2.cos2=0.04", "j3.sin2=-0.05")


@pytest.fixture
def made(tmp_path):
    """A robot file with groups, data of a robot that has one of them, and data to validate with."""
    (tmp_path / "robot.yaml").write_text(ROBOT)
    simulate(str(tmp_path / "robot.yaml"), tmp_path / "first", poses=120, settings=TRUE, seed=1)
    # The same robot, measured again: only the configurations differ.
    truth = (tmp_path / "first" / "truth.yaml").read_text()
    (tmp_path / "truth.yaml").write_text(truth)
    simulate(str(tmp_path / "truth.yaml"), tmp_path / "again", poses=80, length_error=0, angle_error=0, seed=9)
    return tmp_path


def test_simulate_honours_groups(made):
    truth = open_robot(made / "first" / "truth.yaml").chain.table
    assert truth["j2.cos2"].value == pytest.approx(np.radians(0.04))
    assert truth["j3.sin2"].value == pytest.approx(np.radians(-0.05))


def test_stated_groups_are_asked_and_the_run_folder_predicts_the_same(made):
    run = made / "run"
    choices = {"leave_one_out": False, "groups": ("ripple",)}
    outcome = identify(str(made / "robot.yaml"), [str(made / "first" / "data.yaml")], choices, output=run)
    tried = {t.name: t for t in outcome.result.groups_tried}
    assert set(tried) == {"eccentricity", "gain", "ripple"} and tried["eccentricity"].entered
    assert tried["eccentricity"].gain.low > 0 and not tried["ripple"].entered
    again = open_arm(run).chain
    q = np.random.default_rng(0).uniform(-2, 2, (50, 4))
    np.testing.assert_allclose(again.pose(q), outcome.identification.corrected.pose(q), atol=1e-9)
    document = json.loads((run / "result.json").read_text())
    assert [g["name"] for g in document["beyond"]] == ["eccentricity", "gain"]
    assert "Beyond geometry" in (run / "report.html").read_text()
    found = validate(str(run), [str(made / "again" / "data.yaml")], against=str(made / "robot.yaml"))
    assert found.gain.low > 0 and found.layer is None
    without = {
        "leave_one_out": False,
        "fix": ("j2.cos1", "j2.cos2", "j2.sin1", "j2.sin2", "j3.cos1", "j3.cos2", "j3.sin1", "j3.sin2"),
    }
    plain = identify(str(made / "robot.yaml"), [str(made / "first" / "data.yaml")], without)
    assert [t.name for t in plain.result.groups_tried] == ["gain"]
    assert plain.result.residuals.held_out.mean > 1.3 * outcome.result.residuals.held_out.mean


def test_a_layer_of_a_run_folder_is_used_by_validate(made):
    run = made / "run"
    identify(
        str(made / "robot.yaml"),
        [str(made / "first" / "data.yaml")],
        {"leave_one_out": False, "layer": True},
        output=run,
    )
    assert not (run / "layer.json").exists()  # nothing is left that a layer could learn
    earlier(run)
    plain = validate(str(run), [str(made / "again" / "data.yaml")])
    q = np.random.default_rng(0).uniform(-2, 2, (60, 4))
    wrong = learn(("j1", "j2", "j3", "j4"), (True,) * 4, q, np.full((60, 3), 1e-3) + 1e-5 * q[:, :3])
    (run / "layer.json").write_text(layer_text(wrong))
    layered = validate(str(run), [str(made / "again" / "data.yaml")])
    assert layered.errors == plain.errors and layered.layer.mean > 3 * plain.errors.this.mean
    assert any(w.code is Code.LAYER_ON_TOP for w in layered.warnings) and layered.document.layer["unit"] == "mm"
    (run / "layer.json").write_text(layer_text(wrong).replace('"j4"', '"j5"'))
    with pytest.raises(FormatError, match="another robot"):
        validate(str(run), [str(made / "again" / "data.yaml")])
    (run / "layer.json").write_text("{}")
    with pytest.raises(FormatError):
        validate(str(run), [str(made / "again" / "data.yaml")])


def test_the_run_folder_of_a_urdf_remembers_groups(made, tmp_path):
    from robocal.files.urdf_into import urdf_text

    nominal = open_robot(made / "robot.yaml").chain
    text = urdf_text(replace(nominal, groups=()))
    place = tmp_path / "arm.urdf"
    place.write_text(text if isinstance(text, str) else text[0])
    run = tmp_path / "urdf-run"
    outcome = identify(
        str(place),
        [str(made / "first" / "data.yaml")],
        {"leave_one_out": False, "groups": ("eccentricity",)},
        output=run,
    )
    assert [t.entered for t in outcome.result.groups_tried] == [True]
    again = open_arm(run)
    q = np.random.default_rng(0).uniform(-2, 2, (50, 4))
    np.testing.assert_allclose(again.chain.pose(q), outcome.identification.corrected.pose(q), atol=1e-9)
    assert "j2.cos2" in again.left_out


def test_an_unknown_group_is_named(made):
    with pytest.raises(ModelError, match="eccentricity"):
        identify(str(made / "robot.yaml"), [str(made / "first" / "data.yaml")], {"groups": ("excentricity",)})


def test_compensation_and_plans_can_ask_a_model_with_groups():
    """A recorded column that is not there is no column at all: everything that asks for poses still can."""
    chain = add(add(open_robot("ur10").chain, "expansion"), "backlash")
    assert np.isfinite(chain.jacobian(np.zeros((1, 6)))).all()

"""Chapter 6 of the thesis: ten real positions of a marker on a probe. The arm's joints explain nothing of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot
from robocal.fit.options import Options
from robocal.prove.compare import compare
from robocal.prove.identify import identify
from robocal.remarks.code import Code

EXAMPLES = Path(__file__).parents[2] / "examples"
CM = 0.01


def example(name):
    robot = read_robot(EXAMPLES / name / "robot.yaml").chain
    return robot, read_dataset(EXAMPLES / name / "data.yaml", robot).dataset


def test_transcribed_as_printed(shared_data):
    from ruamel.yaml import YAML

    tables = {}
    for part in YAML(typ="safe").load_all((shared_data / "seeds" / "arm-lse-ekf.yaml").read_text()):
        tables |= part
    robot, data = example("arm-with-probe")
    angles = np.array(tables["configs_deg"]["ch6_printed"])
    angles[[4, 6], 1] = 100.0  # 5 pi / 9, printed 9 pi / 9
    angles -= np.array(tables["configs_deg"]["ch5_zero_table5_2"])
    np.testing.assert_allclose(np.rad2deg(data.configurations.joints), angles[:, 1:7], atol=1e-9)
    value = CM * np.array(tables["Yprime"]["ch6_measured"]).reshape(10, 3)
    np.testing.assert_allclose(data.observations[0].value, value, atol=1e-12)
    assert len(robot.table.free) == 28


def test_the_example_is_the_catalogues_arm():
    from robocal.arms import catalog

    q = np.random.default_rng(1).uniform(-1, 1, (5, 6))
    for name, known in (("arm-with-probe", "small-arm-probe"), ("arm-with-camera", "small-arm-camera")):
        np.testing.assert_allclose(example(name)[0].pose(q), catalog.get(known).pose(q), atol=1e-12)


def test_refused_because_the_mean_does_as_well():
    found = identify(*example("arm-with-probe"))
    assert found.verdict.status == "refused" and found.verdict.reasons[0].code is Code.NO_BETTER_THAN_MEAN
    left = found.stages[0]
    print(
        f"leave-one-out {left.leave_one_out.mean / CM:.1f} cm, frames only {left.leave_one_out_before.mean / CM:.1f} cm, "
        f"mean {left.constant.mean / CM:.1f} cm"
    )
    assert 0.98 < left.leave_one_out.mean / left.constant.mean < 1.02
    assert 0.98 < left.leave_one_out.mean / left.leave_one_out_before.mean < 1.02
    assert not any(p.status == "identified" and not p.name.startswith("camera") for p in found.parameters)


@pytest.fixture(scope="module", params=["arm-with-camera", "arm-with-probe"])
def side_by_side(request):
    return request.param, compare(*example(request.param), ("lm", "ekf", "lse", "ekf-100"), Options())


@pytest.mark.slow
def test_why_the_thesis_estimators_failed(side_by_side):
    """Chapters 5 and 6: fitted and unseen errors of the linear step and of the filter, beside the models without them."""
    name, found = side_by_side
    by = {e.method: e for e in found.methods}
    for e in found.methods:
        print(
            f"{name} {e.method}: {e.after.mean / CM:.1f} cm fitted, {e.leave_one_out.mean / CM:.1f} cm unseen, {e.verdict}"
        )
    print(f"frames only {found.leave_one_out_before.mean / CM:.1f} cm, mean {found.constant.mean / CM:.1f} cm")
    assert not any(e.failed or e.verdict == "improved" for e in found.methods)
    # One linear step throws the arm away; the filter bends it to the ten poses and misses the others.
    assert by["lse"].leave_one_out.mean > 5 * found.constant.mean
    assert by["ekf-100"].after.mean < 0.4 * found.before.mean
    assert by["ekf-100"].leave_one_out.mean > 3 * by["ekf-100"].after.mean
    assert by["ekf"].leave_one_out.mean == pytest.approx(by["lm"].leave_one_out.mean, rel=1e-3)


@pytest.mark.parametrize("name", ["arm-with-camera", "arm-with-probe"])
def test_identify_says_that_one_step_would_mislead(name):
    found = identify(*example(name), Options(leave_one_out=False))
    assert found.linearity.ruins
    everything = found.linearity.everything
    assert everything.promised < 0.5 * everything.before < everything.before < 0.1 * everything.left
    assert any(w.code is Code.ONE_STEP_MISLEADS for w in found.warnings)

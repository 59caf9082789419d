"""Measurements without noise but the rounding of their file: the first thing that many try."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
from called import identify
from trials import perturbed

from robocal.files.robot import open_robot
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.remarks.code import Code

EXAMPLES = Path(__file__).parents[2] / "examples"
# The acceptance of the issue is 20 draws; in CI a few of each.
DRAWS = int(os.environ.get("ROBOCAL_TRIALS", "2"))
POINTS = 56
ROBOTS = {
    "plane, 25 free": EXAMPLES / "rv-2aj" / "robot.yaml",
    "plane, 17 free": EXAMPLES / "rv-2aj" / "robot-paper.yaml",
    "rx-90": EXAMPLES / "rx-90" / "robot.yaml",
    "irb-120": "irb-120",
    "ur10": "ur10",
}


def plane():
    """The 56 configurations of the seed."""
    spec = importlib.util.spec_from_file_location("rv_2aj_plane", EXAMPLES / "rv-2aj" / "make_data.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.plane(7, 8)


def table(q, x, digits):
    """A CSV that describes itself, so many significant digits of each number."""
    names = ",".join(f"q{i + 1} [deg]" for i in range(q.shape[1])) + ",x [mm],y [mm],z [mm]\n"
    rows = np.hstack([np.rad2deg(q), 1e3 * x])
    return names + "".join(",".join(f"{v:.{digits}g}" for v in row) + "\n" for row in rows)


def simulated(folder, name, digits, frame, seed, share=1.0):
    """The file of one draw: true errors of typical size, the instrument somewhere or at the base."""
    model, rng = open_robot(str(ROBOTS[name])).chain, np.random.default_rng(seed)
    truth = perturbed(model, rng, share)
    low, high = np.clip(model.limits, -2.1, 2.1).T
    q = plane() if name.startswith("plane") else rng.uniform(low, high, (POINTS, len(low)))
    place = (0.5, -0.8, 0.4, 0.1, 0.2, 1.0) if frame == "free" else (0.0,) * 6
    blank = Observations("position", np.arange(len(q)), np.zeros((len(q), 3)), frame=Frame("cell", place))
    made = synthesise(truth, DataSet(Configurations(tuple(map(str, range(len(q)))), q), (blank,)))
    path = folder / "cell.csv"
    path.write_text(table(q, made.observations[0].value, digits))
    return path


def run(folder, name, digits, frame, seed, share=1.0, **more):
    path = simulated(folder, name, digits, frame, seed, share)
    fix = () if frame == "free" else ("cell",)
    return identify(str(ROBOTS[name]), [str(path)], dict(fix=fix, **more)).identification


def carried(found, code):
    """What the remark of this code says that rounding leaves, in m."""
    numbers = {r.code: dict(r.items) for r in found.verdict.reasons}[code]
    return numbers["digits"].value


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["free", "fixed"])
@pytest.mark.parametrize("name", ROBOTS)
def test_data_without_noise_are_explained_to_their_digits(tmp_path, name, frame):
    for digits in (15, 9, 7):
        held, finest = [], []
        for seed in range(DRAWS):
            found = run(tmp_path, name, digits, frame, seed)
            assert found.verdict.status == "improved", (digits, seed, found.verdict.reasons)
            assert found.outliers == (), (digits, seed)
            held.append(found.stages[0].held_out.mean)
            finest.append(carried(found, Code.EXACT))
            assert held[-1] <= max(1e-9, 3 * finest[-1]), (digits, seed)
        print(
            f"\n{name}, frame {frame}, {digits} digits: {DRAWS} of {DRAWS} improved, held out at most {1e3 * max(held):.1e} mm, "
            f"where rounding leaves {1e3 * max(finest):.1e} mm"
        )


def test_the_plane_with_the_frame_free_converges(tmp_path):
    """A draw whose narrow curved valley took more than a hundred short steps, and ended 5e-5 mm off."""
    found = run(tmp_path, "plane, 25 free", 15, "free", 3, leave_one_out=False)
    assert found.verdict.status == "improved" and found.iterations < 50
    assert found.stages[0].held_out.max < 1e-9 * 1e-3


@pytest.mark.sampled(1)
@pytest.mark.parametrize("loss", ["huber", "cauchy", "tukey"])
def test_a_loss_does_not_fall_over_data_without_noise(tmp_path, loss):
    found = run(tmp_path, "plane, 25 free", 15, "free", 0, loss=loss)
    assert found.verdict.status == "improved"
    assert found.stages[0].held_out.max < 1e-9 and found.stages[0].leave_one_out.max < 1e-9


@pytest.mark.parametrize("digits", [15, 7])
@pytest.mark.parametrize("name", ["plane, 25 free", "irb-120"])
def test_a_nominal_robot_without_noise_is_not_improved_by_rounding(tmp_path, name, digits):
    found = run(tmp_path, name, digits, "free", 0, share=0.0, leave_one_out=False)
    assert found.verdict.status == "not_improved"
    assert [r.code for r in found.verdict.reasons] == [Code.NOMINAL_EXACT]
    said = found.verdict.reasons[0].sentence
    assert "exact to the digits given" in said and "nothing to improve" in said


def test_ordinary_noise_is_not_called_exact(tmp_path):
    """Four decimals of a millimetre and a degree, and 20 um of noise: the digits say nothing."""
    found = identify(str(ROBOTS["plane, 25 free"]), [str(EXAMPLES / "rv-2aj" / "data.yaml")]).identification
    assert found.verdict.status == "improved"
    assert {r.code for r in found.verdict.reasons}.isdisjoint({Code.EXACT, Code.NOMINAL_EXACT})

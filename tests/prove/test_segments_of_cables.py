"""A cable that slipped and a zero that was set anew between two files; nothing where neither was."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from cables.cable_robots import published
from cables.test_calibration import read
from sizes import size

from robocal.cables.geometry import cable_robot
from robocal.diagnose.segments.find import motion_size
from robocal.diagnose.segments.row_sequence import Candidate, Plain
from robocal.geometry import se3, so3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import identify

COUNT = 100
NOISE = np.array([2e-3] * 3 + [np.radians(0.3)] * 3)
LENGTH = 3e-3


def measured(rng, slip=0.0, at=50, cable=3, files=1):
    """Lengths, in one file or two, beside poses of an instrument whose place is known; from `at` on a cable shows `slip` more."""
    robot = published("laval")
    shift, turn = rng.uniform(-0.8, 0.8, (COUNT, 3)), np.radians(rng.uniform(-20, 20, (COUNT, 3)))
    t = se3.from_vector(np.concatenate([robot.a.mean(axis=0) + shift, turn], axis=1))
    y = read(robot, t) + LENGTH * rng.normal(size=(COUNT, 8))
    y[at:, cable] += slip
    e = NOISE * rng.normal(size=(COUNT, 6))
    told = t.copy()
    told[:, :3, 3] += e[:, :3]
    told[:, :3, :3] = so3.exp(e[:, 3:]) @ t[:, :3, :3]
    seen = []
    for f in range(files):
        mine = np.arange(COUNT) if files == 1 else np.arange(at) if f == 0 else np.arange(at, COUNT)
        rows = np.repeat(np.arange(len(mine)) + 2, 8)
        cables = {"cable": np.tile(np.arange(8), len(mine))}
        seen.append(
            Observations(
                "lengths",
                np.repeat(mine, 8),
                y[mine].reshape(-1, 1),
                np.full((8 * len(mine), 1), LENGTH),
                extra=cables,
                source=f"lengths{f}.csv",
                rows=rows,
            )
        )
    still = Frame("camera", (0.0,) * 6, (False,) * 6)
    seen.append(
        Observations(
            "pose",
            np.arange(COUNT),
            se3.to_vector(told),
            np.tile(NOISE, (COUNT, 1)),
            still,
            source="poses.csv",
            rows=np.arange(COUNT) + 2,
        )
    )
    off = robot.a + 0.02 * rng.normal(size=robot.a.shape)
    nominal = cable_robot("laval", off, robot.b, robot.zeros, free=("ax", "ay", "az", "l0"))
    return nominal, DataSet(Configurations(tuple(f"p{i}" for i in range(COUNT))), tuple(seen))


def reasons(found):
    return [r for r in found.verdict.reasons if r.code.startswith("segment")]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(size(20, 4)))
def test_a_cable_that_slipped_is_named(seed):
    rng = np.random.default_rng(seed)
    at, cable = int(rng.integers(20, 80)), int(rng.integers(8))
    found = identify(*measured(rng, 0.02, at, cable))
    (said,) = reasons(found)
    assert found.verdict.status == "refused" and said.code == "segment-of-zero"
    v = said.numbers
    assert v["zero"] == f"c{cable + 1}.l0" and v["file"] == "lengths0.csv"
    assert abs(v["shift"].value - 0.02) < 4e-3
    # Which of the two parts is off cannot be told: the later rows are named.
    assert abs(v["first"] - (at + 2)) <= 2 and v["last"] >= COUNT - 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(size(20, 4)))
def test_a_zero_that_was_set_anew_between_files_is_named(seed):
    rng = np.random.default_rng(100 + seed)
    cable = int(rng.integers(8))
    found = identify(*measured(rng, 0.01, 50, cable, files=2))
    (said,) = reasons(found)
    assert found.verdict.status == "refused" and said.code == "segment-of-zero"
    assert said.numbers["zero"] == f"c{cable + 1}.l0" and said.numbers["file"] == "lengths1.csv"
    assert (said.numbers["first"], said.numbers["last"]) == (2, 51) and abs(said.numbers["shift"].value - 0.01) < 4e-3


@pytest.mark.slow
@pytest.mark.parametrize("files", [1, 2])
@pytest.mark.parametrize("seed", range(size(20, 4)))
def test_where_nothing_moved_nothing_is_said(seed, files):
    found = identify(*measured(np.random.default_rng(200 + seed), files=files))
    assert found.verdict.status == "improved" and not reasons(found)
    told = [p for p in found.parameters if p.status == "identified"]
    assert len(told) == 32


def test_a_camera_that_moved_is_said_to_have_moved_no_cable():
    """Beside lengths a camera that moves changes pixels alone: no size in mm is told, least of all 0 mm."""
    column = np.zeros((4, 3, 1))
    column[:, 1:] = 2.0
    plain = Plain(column, np.tile([1e-3, 0.2, 0.2], (4, 1)), ((0, 1, "m"), (1, 3, "px")))
    stood = Candidate("instrument", "eye", column, plain, [("corners.csv", i) for i in range(4)])
    run = SimpleNamespace(sigma=None, parts=())
    moved = motion_size(
        SimpleNamespace(candidate=stood, run=run, column=column, step=np.array([3.0])), np.ones(4, bool)
    )
    assert list(moved) == ["px"] and moved["px"] == pytest.approx(6 * 0.2 * np.sqrt(2))

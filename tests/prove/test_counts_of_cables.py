"""What poses of cable robots cost, and which motions their lengths cannot tell: the rank of the Jacobian says both.

Random planar, point and spatial robots, with encoders alone, or with an instrument beside them whose place is not known.
"""

from __future__ import annotations

import numpy as np
import pytest
from cables.test_calibration import read
from sizes import size

from robocal.cables.geometry import DEGREES, cable_robot
from robocal.diagnose.motions import lacking, open_motions
from robocal.fit.baseline import baseline
from robocal.fit.fit import fit
from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import identify

POSES = 40
LENGTH, PLACE = 1e-4, 2e-4
KINDS = [("2T", "xz"), ("2T", "xy"), ("1R2T", "xz"), ("1R2T", "xy"), ("3T", "xz"), ("3R3T", "xz")]
INSTRUMENTS = (None, "position", "pose")


def robot_of(degrees, plane, rng):
    """A robot of this kind with more cables than freedoms, what is free of it, and poses of it (k, 4, 4)."""
    axes = DEGREES[degrees][plane]
    moves = [i for i in axes if i < 3]
    turns = len(axes) > len(moves)
    m = len(axes) + int(rng.integers(2, 4))
    a, b = np.zeros((m, 3)), np.zeros((m, 3))
    spread = rng.normal(size=(m, len(moves)))
    a[:, moves] = 3.0 * spread / np.linalg.norm(spread, axis=1, keepdims=True) + 0.3 * rng.normal(size=(m, len(moves)))
    if turns:
        b[:, moves] = rng.uniform(-0.4, 0.4, (m, len(moves)))
    free = [f"a{'xyz'[i]}" for i in moves] + [f"b{'xyz'[i]}" for i in moves if turns] + ["l0"]
    twist = np.zeros((POSES, 6))
    twist[:, moves] = rng.uniform(-0.8, 0.8, (POSES, len(moves)))
    where = [i for i in axes if i > 2]
    twist[:, where] = rng.uniform(-0.3, 0.3, (POSES, len(where)))
    return cable_robot("drawn", a, b, np.zeros(m), free=free, degrees=degrees, plane=plane), se3.from_vector(twist)


def measured(robot, t, instrument, rng):
    """Lengths at every pose, and poses or positions of the platform by an instrument that stands somewhere."""
    k, m = len(t), len(robot.cables)
    y = read(robot, t) + LENGTH * rng.normal(size=(k, m))
    cables = {"cable": np.tile(np.arange(m), k)}
    seen = [
        Observations("lengths", np.repeat(np.arange(k), m), y.reshape(-1, 1), np.full((k * m, 1), LENGTH), extra=cables)
    ]
    if instrument:
        width = 3 if instrument == "position" else 6
        frame = Frame("tracker", (0.0,) * 6, (True,) * 6)
        value = se3.to_vector(t)[:, :width] + PLACE * rng.normal(size=(k, width))
        seen.append(Observations(instrument, np.arange(k), value, np.full((k, width), PLACE), frame))
    return DataSet(Configurations(tuple(f"p{i}" for i in range(k))), tuple(seen))


@pytest.mark.parametrize("instrument", INSTRUMENTS)
@pytest.mark.parametrize(("degrees", "plane"), KINDS)
def test_counts_and_gauges_are_those_of_the_jacobian(degrees, plane, instrument):
    for seed in range(size(20, 4)):
        rng = np.random.default_rng(seed)
        robot, t = robot_of(degrees, plane, rng)
        data = measured(robot, t, instrument, rng)
        _, x = baseline(robot, data, np.arange(POSES))
        found = fit(robot, data, np.arange(POSES), Options(), x)
        every = found.problem.with_free(found.identifiability.names).linearize(found.solution.x)
        poses, rows = np.zeros((len(every.r), 6 * POSES)), np.arange(len(every.r))
        for i in range(every.jl.shape[1]):
            poses[rows, 6 * every.local + i] = every.jl[:, i]
        taken = np.linalg.matrix_rank(poses, tol=1e-9 * np.linalg.norm(poses, 2))
        assert found.spare.sum() == len(every.r) - taken, (seed, "counts")
        whole = np.hstack([every.j * found.problem.with_free(found.identifiability.names).scales, poses])
        rank = np.linalg.matrix_rank(whole, tol=1e-9 * np.linalg.norm(whole, 2)) - taken
        # An instrument's own number that nothing shows (a planar robot's tracker out of its plane) is no motion of the robot.
        own = [i for i, n in enumerate(found.identifiability.names) if n in robot.table]
        beside = np.delete(whole, own, axis=1)
        unseen = beside.shape[1] - np.linalg.matrix_rank(beside, tol=1e-9 * np.linalg.norm(whole, 2))
        unseen -= poses.shape[1] - taken
        motions = open_motions(robot, found.identifiability)
        assert len(found.identifiability.names) - rank == len(motions) + unseen, (seed, tuple(motions))
        assert lacking(robot, found) is None


def nominal_of(robot, rng):
    """As somebody wrote it down: every number that is free is off by a few millimetres."""
    table = robot.table
    return robot.with_values({n: table[n].value + 5e-3 * rng.normal() for n in table.free})


@pytest.mark.parametrize("instrument", INSTRUMENTS)
@pytest.mark.parametrize(("degrees", "plane"), KINDS)
def test_a_robot_of_any_kind_is_improved(degrees, plane, instrument):
    rng = np.random.default_rng(7)
    robot, t = robot_of(degrees, plane, rng)
    found = identify(nominal_of(robot, rng), measured(robot, t, instrument, rng), Options(leave_one_out=False))
    assert found.verdict.status == "improved", found.verdict.reasons


def test_too_few_numbers_are_still_refused():
    """Three poses of a planar point robot with four cables leave six numbers for eight anchors and four zeros."""
    rng = np.random.default_rng(1)
    robot, t = robot_of("2T", "xz", rng)
    data = measured(robot, t[:3], None, rng)
    _, x = baseline(robot, data, np.arange(3))
    found = fit(robot, data, np.arange(3), Options(), x)
    few = lacking(robot, found)
    assert few is not None and few.numbers["left"] == found.spare.sum() == 3 * (len(robot.cables) - 2)

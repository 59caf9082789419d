"""The first figure of a cable robot that an instrument saw: how far the pose is off that its lengths alone give."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.cables.forward import forward
from robocal.cables.geometry import lengths as read
from robocal.fit.options import Options
from robocal.geometry import se3, so3
from robocal.prove.identify import identify

from .test_region_of_cables import KINDS, LENGTH, measured

FRESH, WITHIN = 400, 0.1
EXACT = 3e-5  # m: the figure has the noise of the instrument in it


def true_errors(robot, truth, model, rng):
    """Mean errors of position (m) and turn (rad) at fresh poses, from lengths that the true robot shows, with their noise."""
    low, high = robot.a.min(axis=0), robot.a.max(axis=0)
    vector = np.zeros((FRESH, 6))
    vector[:, :3] = (low + high) / 2 + 0.35 * rng.uniform(-1, 1, (FRESH, 3)) * (high - low)
    vector[:, 3:] = rng.normal(0, 0.03, (FRESH, 3))
    vector[:, [i for i in range(6) if i not in robot.freedom]] = 0.0
    pose = se3.from_vector(vector)
    y = np.stack([read(pose[None], truth.numbers[i][None])[0][0] for i in range(len(truth.cables))], axis=1)
    found = forward(model, y + rng.normal(0, LENGTH, y.shape), start=pose).pose
    turn = so3.log(found[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2))
    return np.linalg.norm(found[:, :3, 3] - vector[:, :3], axis=1).mean(), np.linalg.norm(turn, axis=1).mean()


def ratios(kind, seed, m, **how):
    """What is told over what is true, before and after, of position and orientation; the instrument reads in base coordinates."""
    robot, truth, data = measured(kind, seed, m=m, place=EXACT)
    found = identify(robot, data, Options(**how))
    rng = np.random.default_rng(seed)
    out, told = [], found.pose_from_lengths
    for model, stage in ((robot, "_before"), (found.corrected, "")):
        true = true_errors(robot, truth, model, rng)
        for stages, value in zip((told.position, told.orientation), true, strict=True):
            if stages is not None:
                name = "held_out" if stages.held_out else "leave_one_out"
                out.append(getattr(stages, name + stage).mean / value)
    return out


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", KINDS)
def test_pose_from_lengths_is_the_true_error(kind):
    assert np.mean(ratios(kind, 2, 200)) == pytest.approx(1, abs=2 * WITHIN)


@pytest.mark.slow
def test_pose_from_lengths_over_many_robots():
    """Twenty robots: 10 % on average, of every kind and stage."""
    for kind in KINDS:
        mean = np.mean([ratios(kind, 30 + seed, 200, leave_one_out=False) for seed in range(5)], axis=0)
        print(f"\n{kind}: told over true {np.round(mean, 3)}")
        assert np.abs(mean - 1).max() < WITHIN


def test_few_poses_are_left_out_one_by_one():
    """Below 25 poses nothing is held out as a whole."""
    robot, _, data = measured("3R3T", 4, m=22)
    told = identify(robot, data).pose_from_lengths
    assert told.position.held_out is None and told.position.leave_one_out.n == 22
    # The instrument's own turn was 2 * PLACE: told beside itself, it would be no more.
    assert told.orientation.leave_one_out_before.mean > 10 * told.orientation.leave_one_out.mean


def test_lengths_alone_tell_no_error_of_a_pose():
    robot, _, data = measured("2T", 1, m=60)
    alone = type(data)(data.configurations, data.observations[:1])
    assert identify(robot, alone).pose_from_lengths is None

"""Where a correction of a cable robot holds: its position from lengths in the middle of its frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocal.cables.forward import forward
from robocal.cables.geometry import lengths as read
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet, Frame, Observations
from robocal.prove.identify import identify

from .machines import hung, lengths, where

KINDS = ("3R3T", "3T", "1R2T", "2T")
LENGTH, PLACE, OFF = 3e-4, 1.5e-4, 0.006
TRACKER = Frame("tracker", (1.0, 2.0, 0.4, 0.1, -0.2, 0.6), (True,) * 6, expected=(10.0, 3.0))


def measured(kind, seed, *, corner=0.0, frame=None, anew=False, m=50, place=PLACE):
    """A robot, the true one, and lengths and poses of it: across its frame, or in a cube of so many metres somewhere in it."""
    rng, robot = np.random.default_rng(seed), hung(kind)
    truth = robot.with_values({n: robot.table[n].value + rng.normal(0, OFF) for n in robot.table.free})
    low, high = robot.a.min(axis=0), robot.a.max(axis=0)
    middle = (low + high) / 2 + (0.2 * rng.choice([-1, 1], 3) * (high - low) if corner else 0.0)
    start = np.zeros((m, 6))
    start[:, :3] = middle + (corner / 2 if corner else 0.35 * (high - low)) * rng.uniform(-1, 1, (m, 3))
    start[:, 3:] = rng.normal(0, 0.03, (m, 3))
    start[:, [i for i in range(6) if i not in robot.freedom]] = 0.0
    drums = {"cables": robot.cables} | ({"zeros": "morning"} if anew else {})
    width = 3 if kind in ("2T", "3T") else 6
    spread = np.tile(np.repeat([place, 2 * place], 3)[:width], (m, 1))
    seen = Observations("position" if width == 3 else "pose", np.arange(m), np.zeros((m, width)), spread, frame)
    data = synthesise(truth, DataSet(where(start), (replace(lengths(robot, m, LENGTH), options=drums), seen)), rng)
    return robot, truth, replace(data, configurations=replace(data.configurations, start=None))


def missed(robot, truth, model, free=False):
    """Rms error (m) of the position from true lengths in the middle of the frame; where the instrument's frame is free, up to a rigid
    motion."""
    rng = np.random.default_rng(0)
    low, high = robot.a.min(axis=0), robot.a.max(axis=0)
    vector = np.zeros((200, 6))
    vector[:, :3] = (low + high) / 2 + 0.35 * rng.uniform(-1, 1, (200, 3)) * (high - low)
    vector[:, [i for i in range(6) if i not in robot.freedom]] = 0.0
    pose = se3.from_vector(vector)
    y = np.stack([read(pose[None], truth.numbers[i][None])[0][0] for i in range(len(truth.cables))], axis=1)
    found = forward(model, y, start=pose).pose[:, :3, 3]
    if not free:
        return float(np.sqrt(np.mean(np.sum((found - pose[:, :3, 3]) ** 2, axis=1))))
    a, b = found - found.mean(axis=0), pose[:, :3, 3] - pose[:, :3, 3].mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.sqrt(np.mean(np.sum((a @ turn - b) ** 2, axis=1))))


def corner_is_told(kind, seed):
    """Whether nobody hears that it holds in the whole frame, unless it does."""
    robot, truth, data = measured(kind, seed, corner=0.25, frame=TRACKER if seed % 2 else None)
    found = identify(robot, data)
    if found.verdict.region != "working":
        return True
    return missed(robot, truth, found.corrected, bool(seed % 2)) < missed(robot, truth, robot, bool(seed % 2))


def frame_is_told(kind, seed):
    robot, _, data = measured(kind, seed, frame=TRACKER if seed % 2 else None, anew=seed % 4 == 3)
    verdict = identify(robot, data).verdict
    return verdict.status != "improved" or verdict.region == "working"


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", KINDS)
def test_a_calibration_in_a_corner_holds_there_alone(kind):
    assert corner_is_told(kind, 1)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", KINDS)
def test_a_calibration_across_the_frame_holds_everywhere(kind):
    assert frame_is_told(kind, 3)


@pytest.mark.slow
def test_regions_over_many_draws():
    """Asked: at most 5 % of the corners are missed, and 3 % of what was measured across the frame."""
    corners = [corner_is_told(kind, 10 + seed) for kind in KINDS for seed in range(10)]
    frames = [frame_is_told(kind, 10 + seed) for kind in KINDS for seed in range(20)]
    print(f"\n{sum(corners)} of {len(corners)} corners are told; {sum(frames)} of {len(frames)} frames hold")
    assert np.mean(corners) >= 0.95
    assert np.mean(frames) >= 0.97


@pytest.mark.sampled(4)
@pytest.mark.parametrize("frame", [TRACKER, None], ids=["free", "stated"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_the_correction_moves_is_what_forward_kinematics_moves(kind, frame):
    """The true robot, identified to a hair: nominal and identified model differ by what the nominal one misses. Motions of all count
    where the frame of the instrument is stated, and are its own where it is free."""
    robot, truth, data = measured(kind, 5, frame=frame)
    holds = identify(robot, data).holds
    assert holds.moved == pytest.approx(missed(robot, truth, robot, frame is not None), rel=0.1)
    assert holds.band < 0.2 * holds.moved


@pytest.mark.sampled(1)
@pytest.mark.parametrize("kind", ["3R3T", "1R2T"])
def test_frames_and_zeros_that_are_set_anew_are_no_error_of_the_robot(kind):
    """A tracker that stands anywhere, and zeros of one power-up, make the band no wider than the pose is known."""
    for frame, anew in ((TRACKER, False), (None, True)):
        robot, _, data = measured(kind, 8, frame=frame, anew=anew)
        assert identify(robot, data).holds.band < 3 * LENGTH

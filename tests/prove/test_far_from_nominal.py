"""A frame that is far from its drawing: forward kinematics of the nominal robot puts poses beyond the frame, or turns the platform
over. What a fit leaves must be the noise all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocal.cables.geometry import cable_robot
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet
from robocal.prove.identify import identify

from .machines import lengths, where

WIDTH, HEIGHT, NOISE, POSES = 2.0, 1.3, 1e-3, 40
FREE = (
    "c2.ax",
    "c3.ax",
    "c3.az",
    "c4.ax",
    "c4.az",
)  # one anchor and one direction are held: lengths see no motion of the base


def drawn(degrees):
    """The nominal robot, four cables in a plane; its owner knows its anchors to two metres."""
    a = np.array([(0, 0, 0), (WIDTH, 0, 0), (WIDTH, 0, HEIGHT), (0, 0, HEIGHT)], float)
    b = 0.1 * np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], float) * (degrees != "2T")
    robot = cable_robot(degrees, a, b, degrees=degrees, plane="xz")
    return replace(robot, table=robot.table.with_free(FREE).with_priors(dict.fromkeys(FREE, 2.0)))


def far(degrees, wide, high, seed):
    """Its lengths in a frame that is so many times as wide and high."""
    rng, robot = np.random.default_rng(seed), drawn(degrees)
    factor = {"ax": wide, "az": high}
    table = robot.table
    truth = robot.with_values({n: table[n].value * factor[n[-2:]] + rng.normal(0, 0.02) for n in FREE})
    low, high_corner = truth.a.min(axis=0), truth.a.max(axis=0)
    start = np.zeros((POSES, 6))
    start[:, :3] = (low + high_corner) / 2 + 0.35 * rng.uniform(-1, 1, (POSES, 3)) * (high_corner - low)
    start[:, 4] = rng.normal(0, 0.05, POSES) * (4 in robot.freedom)
    data = synthesise(truth, DataSet(where(start), (lengths(robot, POSES, NOISE),)), rng)
    return robot, replace(data, configurations=replace(data.configurations, start=None))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("degrees", "wide", "high"), [("2T", 1.5, 1.6), ("2T", 1.7, 1.4), ("1R2T", 1.4, 0.7)])
def test_a_frame_far_from_its_drawing_is_found(degrees, wide, high, seed):
    robot, data = far(degrees, wide, high, seed)
    found = identify(robot, data)
    assert found.groups[0].rms < NOISE

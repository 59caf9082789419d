"""Arms whose joint origins are turned by half a turn, as every fourth public URDF has one: half a turn to one side is half a turn to
the other, and a change by a whole turn is none."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from trials import joints, observations, perturbed

from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.geometry import so3
from robocal.geometry._kernels import turn_vectors
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet
from robocal.prove.identify import identify

HALF = np.pi
# Of each arm the turned origins: joint, roll, pitch and yaw; 3.14159 is how most files write half a turn.
ARMS = [
    {3: (0, HALF, 0)},
    {4: (HALF / 2, 0, HALF)},
    {3: (3.14159, 0, 0), 5: (HALF / 2, 0, 3.14159)},
    {2: (-HALF / 2, HALF, 0)},
    {3: (0, 0, HALF), 4: (-HALF / 2, 0, -HALF)},
    {6: (HALF, 0, HALF / 2)},
    {1: (0, 0, -3.14159), 3: (HALF, 0, 0)},
    {2: (HALF / 2, 0, HALF), 6: (HALF / 2, HALF, 0)},
]
USUAL = [(0, 0, 0), (-HALF / 2, 0, 0), (0, 0, 0), (-HALF / 2, 0, 0), (HALF / 2, 0, 0), (-HALF / 2, 0, 0)]
PLACES = [(0, 0, 0.35), (0.06, 0, 0), (0.33, 0, 0), (0.03, 0.31, 0), (0, 0, 0), (0, 0, 0)]


def arm(number, folder):
    """The chain of one of the arms, as its URDF is read."""
    text = ['<robot name="arm"><link name="l0"/>']
    for i, (turn, place) in enumerate(zip(USUAL, PLACES, strict=True), 1):
        rpy = ARMS[number].get(i, turn)
        text.append(
            f'<link name="l{i}"/><joint name="j{i}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/>'
            f'<origin xyz="{place[0]} {place[1]} {place[2]}" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/><axis xyz="0 0 1"/>'
            '<limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>'
        )
    text.append(
        '<link name="tool0"/><joint name="flange" type="fixed"><parent link="l6"/><child link="tool0"/>'
        '<origin xyz="0.02 0 0.09" rpy="0 0 0"/></joint></robot>'
    )
    (folder / "arm.urdf").write_text("".join(text))
    return open_robot(folder / "arm.urdf").chain


@pytest.mark.sampled(8)
@pytest.mark.parametrize(("number", "seed"), list(product(range(len(ARMS)), range(8))))
def test_half_a_turn_is_no_change(number, seed, tmp_path):
    chain, rng = arm(number, tmp_path), np.random.default_rng(100 * number + seed)
    truth = perturbed(chain, rng)
    where = joints(truth, rng, 60)
    data = synthesise(truth, DataSet(where, (replace(observations("position", 60), frame=None),)), rng)
    found = identify(chain, data, Options(leave_one_out=False))
    assert found.verdict.status == "improved"
    assert max(abs(p.delta) for p in found.parameters if p.unit == "rad" and p.name in chain.geometric) < 0.1


def test_a_step_never_jumps_by_a_turn(rng):
    """Vectors that are stepped across half a turn go on beyond it, and stay the same rotation."""
    axis = so3.exp(rng.normal(size=(200, 3))) @ np.array([0.0, 0.0, 1.0])
    before = axis * rng.uniform(0.95, 1.05, size=(200, 1)) * np.pi
    step = rng.normal(size=(200, 3)) * 0.05
    after = before.copy()
    turn_vectors(after, np.array([0]), step, np.array([[0, 1, 2]]))
    assert np.linalg.norm(after - before, axis=1).max() < 0.5
    assert so3.exp(after) == pytest.approx(so3.exp(step) @ so3.exp(before), abs=1e-12)
    assert so3.nearest(so3.log(so3.exp(after)), before) == pytest.approx(after, abs=1e-9)

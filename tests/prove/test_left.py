"""What a fit leaves of what was measured: beyond the stated noise and beyond a share of the machine's size nothing is improved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet, Frame
from robocal.measure.reach import size_of
from robocal.prove.identify import identify
from robocal.remarks.code import Code

from .machines import arm, cables, hung, turntable

MACHINES = ("arm", "3R3T", "3T", "1R2T", "2T")
SMALL, LARGE = 0.001, 0.007  # of the machine's size, per axis: below the law's share, and above


def machine_of(kind, rng, m=40):
    """A machine, a truth that is clearly another, and its measurements without values."""
    if kind == "arm":
        robot, truth, data = arm(rng, m)
        zeros = [n for n in robot.table.free if n.endswith("theta")]
        return robot, truth.with_values({n: truth.table[n].value + rng.choice([-0.06, 0.06]) for n in zeros}), data
    robot, truth, data = cables(kind, rng, m)
    far = {n: truth.table[n].value + rng.normal(0, 0.15) for n in robot.table.free}
    return robot, truth.with_values(far), data


def measured(kind, share, stated, seed=0):
    """The machine and what it reads with errors of so much of its size; sigma is the `stated`, None: not stated."""
    rng = np.random.default_rng(seed)
    robot, truth, data = machine_of(kind, rng)
    size = share * size_of(robot)

    def at(o, sigma):
        angles = np.where(np.arange(o.value.shape[1]) < 3, 1.0, 1.0 / size_of(robot))
        return replace(o, sigma=None if sigma is None else np.broadcast_to(sigma * angles, o.value.shape).copy())

    made = synthesise(truth, DataSet(data.configurations, tuple(at(o, size) for o in data.observations)), rng)
    told = DataSet(made.configurations, tuple(at(o, stated and stated * size) for o in made.observations))
    return robot, replace(told, configurations=replace(told.configurations, start=None))


@pytest.mark.parametrize("kind", MACHINES)
def test_what_is_left_beyond_noise_and_size_is_no_improvement(kind):
    """Whatever the range in which it should hold."""
    robot, data = measured(kind, LARGE, 0.05)
    assert identify(robot, data, Options(measured=True)).verdict.status != "improved"


@pytest.mark.parametrize("kind", MACHINES)
def test_the_same_errors_stated_are_noise(kind):
    robot, data = measured(kind, LARGE, 1.0)
    assert not any(r.code is Code.LEFT for r in identify(robot, data).verdict.reasons)


@pytest.mark.parametrize("kind", MACHINES)
def test_without_a_stated_noise_the_size_decides(kind):
    robot, data = measured(kind, LARGE, None)
    assert identify(robot, data).verdict.status != "improved"


@pytest.mark.parametrize("kind", MACHINES)
def test_less_than_a_share_of_the_size_is_a_remark(kind):
    robot, data = measured(kind, SMALL, 0.05)
    found = identify(robot, data)
    assert found.verdict.status == "improved", found.verdict.remarks
    assert any(r.code is Code.ABOVE_STATED_NOISE for r in found.warnings)


def test_wrong_names_of_targets_are_no_improvement():
    """Every third reading has the name of the other of two targets, 0.3 m away."""
    rng = np.random.default_rng(1)
    robot, truth, data = machine_of("arm", rng, 60)
    seen = data.observations[0]
    one, other = (
        Frame(n, p, (True,) * 3 + (False,) * 3, "tool")
        for n, p in (("a", (0, 0, 0.1) + (0,) * 3), ("b", (0.3, 0, 0) + (0,) * 3))
    )
    target = np.arange(60) % 2
    made = synthesise(truth, DataSet(data.configurations, (replace(seen, targets=(one, other), target=target),)), rng)
    wrong = np.where(np.arange(60) % 3 == 0, 1 - target, target)
    mixed = DataSet(made.configurations, tuple(replace(o, target=wrong) for o in made.observations))
    assert identify(robot, made, Options(measured=True)).verdict.status == "improved"
    assert identify(robot, mixed, Options(measured=True)).verdict.status != "improved"


def test_a_size_knows_nothing_of_the_base():
    """An arm is about as large as it reaches, a frame as far as its anchors are from their middle; a plate upon an axis has its own."""
    rng = np.random.default_rng(0)
    small = arm(rng, 2)[0]
    assert 0.4 < size_of(small) < 0.3 + 0.25 + 0.16 + 0.07 + 0.1
    moved = small.with_values({f"base.{s}": 3.0 for s in "xyz" if f"base.{s}" in small.table})
    assert size_of(moved) == pytest.approx(size_of(small))
    assert size_of(hung("2T")) == pytest.approx(np.hypot(1.0, 0.5))
    assert size_of(turntable(rng, 2)[0]) < 0.01

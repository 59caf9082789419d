"""What a fit leaves of what was measured: beyond the stated noise and beyond a share of the machine's size nothing is improved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sizes import size

from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.reach import size_of
from robocal.prove.identify import identify
from robocal.prove.left import ANGLES
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
    far = share * size_of(robot)

    def at(o, sigma):
        angles = np.where(np.arange(o.value.shape[1]) < 3, 1.0, 1.0 / size_of(robot))
        return replace(o, sigma=None if sigma is None else np.broadcast_to(sigma * angles, o.value.shape).copy())

    made = synthesise(truth, DataSet(data.configurations, tuple(at(o, far) for o in data.observations)), rng)
    told = DataSet(made.configurations, tuple(at(o, stated and stated * far) for o in made.observations))
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


def turned(kind, angle, stated):
    """A machine whose instrument reads positions well, and orientations with errors of `angle`; `stated` is the sigma of these."""
    rng = np.random.default_rng(0)
    robot, truth, data = arm(rng, 40) if kind == "arm" else cables(kind, rng, 40)
    if kind == "arm":
        (o,) = data.observations
        data = replace(
            data, observations=(replace(o, kind="pose", value=np.zeros((40, 6)), sigma=np.full((40, 6), 5e-5)),)
        )

    def at(o, sigma):
        return (
            o if o.kind != "pose" else replace(o, sigma=np.hstack([o.sigma[:, :3], np.full((len(o.value), 3), sigma)]))
        )

    made = synthesise(truth, DataSet(data.configurations, tuple(at(o, angle) for o in data.observations)), rng)
    told = tuple(at(o, stated) for o in made.observations)
    return robot, replace(made, configurations=replace(made.configurations, start=None), observations=told)


@pytest.mark.parametrize("kind", ["arm", "3R3T", "1R2T"])
@pytest.mark.parametrize(("angle", "stated", "found"), [(0.03, 1e-3, True), (0.03, 0.03, False), (0.002, 1e-4, False)])
def test_angles_that_are_left_are_no_improvement_either(kind, angle, stated, found):
    """Beyond five times the stated noise, and so much that they move a point, as far away as the machine is large, by 0.5 % of that."""
    robot, data = turned(kind, angle, stated)
    done = identify(robot, data, Options(measured=True))
    assert (ANGLES in {r.code for r in done.verdict.reasons}) is found
    assert (done.verdict.status == "improved") is not found


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
    found = identify(robot, mixed, Options(measured=True))
    assert found.verdict.status != "improved"
    # The advice is to look at the names: no effect of an arm is as large.
    (said,) = [r for r in found.warnings if r.code is Code.ABOVE_STATED_NOISE]
    assert said.numbers["wrong"] == "targets" and "targets" in said.advice and "--groups" not in said.advice


@pytest.mark.parametrize("loss", ["huber", "tukey"])
def test_what_a_robust_loss_weighs_down_is_left_too(loss):
    """Two readings in five have the name of another of three targets: too many for outliers, and no median shows them."""
    seen = set()
    for seed in range(size(20, 2)):
        rng = np.random.default_rng(seed)
        robot, truth, data = machine_of("arm", rng, 60)
        places = ((0, 0, 0.1), (0.2, 0, 0), (0, 0.2, 0.05))
        frames = tuple(Frame(n, (*p, 0, 0, 0), (False,) * 6, "tool") for n, p in zip("abc", places, strict=True))
        target = np.arange(60) % 3
        blank = replace(data.observations[0], targets=frames, target=target)
        made = synthesise(truth, DataSet(data.configurations, (blank,)), rng).observations[0]
        wrong = np.where(rng.random(60) < 0.4, (target + 1) % 3, target)
        mixed = DataSet(data.configurations, (replace(made, target=wrong),))
        found = identify(robot, mixed, Options(measured=True, loss=loss))
        assert found.verdict.status != "improved"
        seen |= {r.code for r in found.verdict.reasons}
    assert Code.LEFT in seen


def camera_arm(rng, noise, stated, m=40):
    """An arm that holds a board before a camera, 3 m away, whose pixels err by `noise` and are stated to err by `stated`."""
    robot, truth, data = machine_of("arm", rng, m)
    looks = se3.inverse(se3.from_vector([3.0, 0, 0.3, 0, -np.pi / 2, 0]))
    eye = Frame("eye", tuple(se3.to_vector(looks)), (True,) * 6, expected=(10.0, 3.0))
    grid = np.array([(x, y, 0.0) for x in (-0.05, 0, 0.05) for y in (-0.05, 0.05)])
    k = len(grid)
    sigma = np.full((m * k, 2), noise)
    at, points = np.repeat(np.arange(m), k), {"point": np.tile(grid, (m, 1))}
    known = {"camera": "lens", "intrinsics": (900.0, 905.0, 640.0, 512.0) + (0.0,) * 5, "free": ()}
    blank = Observations("pixels", at, np.zeros((m * k, 2)), sigma, eye, extra=points, options=known)
    made = synthesise(truth, DataSet(data.configurations, (blank,)), rng)
    told = replace(made.observations[0], sigma=np.full((m * k, 2), stated))
    return robot, DataSet(data.configurations, (told,))


def left_of(robot, data):
    found = identify(robot, data, Options(measured=True))
    return found, [r for r in found.verdict.reasons if r.code is Code.LEFT]


def test_pixels_are_as_long_as_where_they_look():
    """1.6 px of a focal length of 900 px are 5.3 mm at 3 m, 0.8 % of this arm; 0.3 px are 0.2 %, and noise that was stated is noise."""
    for noise, stated, found in ((1.6, 0.1, True), (0.3, 0.02, False), (1.6, 1.6, False)):
        robot, data = camera_arm(np.random.default_rng(3), noise, stated, 150 if found else 40)
        done, left = left_of(robot, data)
        assert bool(left) is found
        assert not found or done.verdict.status == "not_improved"


def test_good_cameras_leave_nothing():
    for seed in range(size(40, 2)):
        robot, data = camera_arm(np.random.default_rng(seed), 0.2, 0.2)
        assert not left_of(robot, data)[1]


def test_a_size_knows_nothing_of_the_base():
    """An arm is about as large as it reaches, a frame as far as its anchors are from their middle; a plate upon an axis has its own."""
    rng = np.random.default_rng(0)
    small = arm(rng, 2)[0]
    assert 0.4 < size_of(small) < 0.3 + 0.25 + 0.16 + 0.07 + 0.1
    moved = small.with_values({f"base.{s}": 3.0 for s in "xyz" if f"base.{s}" in small.table})
    assert size_of(moved) == pytest.approx(size_of(small))
    assert size_of(hung("2T")) == pytest.approx(np.hypot(1.0, 0.5))
    assert size_of(turntable(rng, 2)[0]) < 0.01

"""The choice of poses for the calibration of a cable robot: what a pose tells, what is promised, and that it is nearly the best."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import EXPECTED, cable_robot
from robocal.cables.gradient import by_parameters
from robocal.errors import ModelError
from robocal.estimate.criteria import CRITERIA
from robocal.geometry import se3, so3
from robocal.planning.cable_poses import MeasurementNoise, cable_blocks, choose


def robot(**more):
    corners = np.array([(-2, -1.5), (-2, 1.5), (2, 1.5), (2, -1.5)])
    a = [(x, y, z) for z, lean in ((0.1, 0.2), (3.0, -0.2)) for x, y in corners + [0.0, lean]]
    b = [(0.15 * x, 0.1 * y, z) for z in (0.1, -0.12) for x, y in corners]
    return cable_robot("box", a, b, np.linspace(0, 0.7, 8), **more)


def planar():
    return cable_robot("planar", [[-2, 0, 3], [2, 0, 3], [0, 0, 0]], np.zeros((3, 3)), degrees="2T", plane="xz")


def spread(n, rng, turn=0.3):
    at = [0, 0, 1.5] + rng.uniform(-1, 1, (n, 3)) * [1.2, 0.9, 0.8]
    return se3.compose(so3.exp(rng.uniform(-turn, turn, (n, 3))), at)


def flat(n, rng):
    at = np.zeros((n, 3))
    at[:, [0, 2]] = rng.uniform([-1, 0.6], [1, 2.4], (n, 2))
    return se3.compose(np.eye(3), at)


def moved(machine, name, step):
    return replace(machine, table=machine.table.with_values({name: machine.table[name].value + step}))


@pytest.mark.parametrize(
    "noise", [MeasurementNoise(2e-3), MeasurementNoise(1e-3, 2e-3, 0.01)], ids=["lengths", "poses too"]
)
@pytest.mark.parametrize("free", [(), ("ax", "ay", "az", "bx", "by", "bz", "l0")], ids=["a l0", "a b l0"])
def test_information_is_that_of_the_whole_problem(rng, noise, free):
    """The pose's own errors as unknowns beside the parameters, all derivatives by differences: the same information."""
    machine = robot(free=free)
    pose = spread(1, rng)
    b = cable_blocks(machine, pose, noise)
    h = 1e-6
    j = np.column_stack(
        [
            (inverse(moved(machine, n, h), pose)[0] - inverse(moved(machine, n, -h), pose)[0])[0] / (2 * h)
            for n in b.names
        ]
    )
    twists = h * np.eye(6)
    step = [se3.compose(so3.exp(t[3:]) @ pose[0, :3, :3], pose[0, :3, 3] + t[:3])[None] for t in (*twists, *-twists)]
    lengths = np.array([inverse(machine, s)[0][0] for s in step])
    by_pose = (lengths[:6] - lengths[6:]).T / (2 * h)
    n = len(b.names)
    known = np.array([noise.position] * 3 + [noise.orientation] * 3)
    if known.any():
        whole = np.vstack([np.hstack([j, by_pose]) / noise.length, np.hstack([np.zeros((6, n)), np.diag(1 / known)])])
        m = whole.T @ whole
        m = m[:n, :n] - m[:n, n:] @ np.linalg.solve(m[n:, n:], m[n:, :n])
    else:
        m = j.T @ j / noise.length**2
    found = b.candidates[0].T @ b.candidates[0] / EXPECTED**2
    np.testing.assert_allclose(found, m, atol=1e-6 * np.abs(m).max())


def test_the_cables_do_not_hear_of_each_other(rng):
    """Four unknowns per cable, and with known poses a problem of its own for each (3.25)."""
    b = cable_blocks(robot(), spread(6, rng), MeasurementNoise(1e-3))
    assert b.names[:5] == ("c1.ax", "c1.ay", "c1.az", "c1.l0", "c2.ax") and len(b.names) == 32
    for i in range(8):
        assert not np.delete(b.candidates[:, i], np.arange(4 * i, 4 * i + 4), axis=1).any()


def test_what_is_promised_is_what_is_left(rng):
    """2000 simulated calibrations at the chosen poses: rms (3.39) as expected, and the platform's position too."""
    machine, noise = robot(), MeasurementNoise(1e-3)
    poses = spread(150, rng)
    made = choose(machine, poses, 12, noise=noise, rng=np.random.default_rng(1))
    there, every = poses[made.chosen], poses
    clean, _ = inverse(machine, there)
    runs = 2000
    a, l0 = np.empty((runs, 8, 3)), np.empty((runs, 8))
    measured = clean + rng.normal(scale=noise.length, size=(runs, *clean.shape))
    for i in range(8):
        ends = there[:, :3, 3] + there[:, :3, :3] @ machine.b[i]
        x = np.tile([*machine.a[i], machine.zeros[i]], (runs, 1))
        for _ in range(4):  # Gauss-Newton on |end - a| - l0 = l
            c = ends - x[:, None, :3]
            full = np.linalg.norm(c, axis=2)
            j = np.concatenate([-c / full[..., None], -np.ones((runs, len(there), 1))], axis=2)
            r = full - x[:, None, 3] - measured[:, :, i]
            x -= np.linalg.solve(j.swapaxes(1, 2) @ j, j.swapaxes(1, 2) @ r[..., None])[..., 0]
        a[:, i], l0[:, i] = x[:, :3] - machine.a[i], x[:, 3] - machine.zeros[i]
    expected = made.expected["chosen"]
    assert np.sqrt((a**2).mean()) == pytest.approx(expected["a"], rel=0.04)
    assert np.sqrt((l0**2).mean()) == pytest.approx(expected["l0"], rel=0.04)
    # A controller that believes these anchors is so far off where its lengths are what it wants.
    _, gradient = inverse(machine, every)
    ends = every[:, None, :3, 3] + np.einsum("kij,mj->kmi", every[:, :3, :3], machine.b)
    u = (ends - machine.a) / np.linalg.norm(ends - machine.a, axis=-1, keepdims=True)
    short = -np.einsum("kmi,rmi->rkm", u, a[:200]) - l0[:200, None]
    off = -np.einsum("kim,rkm->rki", np.linalg.pinv(gradient), short)[..., :3]
    assert np.sqrt((off**2).sum(axis=2).mean()) == pytest.approx(expected["position"], rel=0.06)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_a_choice_is_better_than_chance_and_all_are_better_still(rng, criterion):
    poses = spread(120, rng)
    made = choose(robot(), poses, 8, criterion=criterion, rng=np.random.default_rng(2))
    assert len(set(made.chosen.tolist())) == 8
    for what in ("a", "l0", "position"):
        assert made.expected["all"][what] < made.expected["chosen"][what] < made.expected["random"][what]
    if made.limit is not None:
        assert made.design.value <= made.limit


def test_nearly_the_best_of_all_sets(rng):
    """Every set of five out of twelve poses of a planar robot, looked at one by one."""
    poses = flat(12, rng)
    b = cable_blocks(planar(), poses, MeasurementNoise(1e-3))
    assert b.names == ("c1.ax", "c1.az", "c1.l0", "c2.ax", "c2.az", "c2.l0", "c3.ax", "c3.az", "c3.l0")
    each = b.candidates.swapaxes(1, 2) @ b.candidates
    value = [-np.trace(np.linalg.inv(b.known + each[list(s)].sum(axis=0))) for s in combinations(range(12), 5)]
    made = choose(planar(), poses, 5)
    assert max(value) * 1.01 <= made.design.value <= max(value) + 1e-12
    assert made.limit >= max(value) - 1e-12


@pytest.mark.parametrize(
    ("count", "more", "message"),
    [
        (0, {}, "cannot be chosen"),
        (11, {}, "cannot be chosen"),
        (3, {"criterion": "Q"}, "unknown criterion"),
        (3, {"noise": MeasurementNoise(0.0)}, "noise of a length"),
        (3, {"noise": MeasurementNoise(1e-3, -1.0)}, "noise of a position"),
    ],
)
def test_bad_wishes(rng, count, more, message):
    with pytest.raises(ModelError, match=message):
        choose(robot(), spread(10, rng), count, **more)


def test_encoders_alone_as_dense_least_squares(rng):
    """Every pose free beside the parameters, the six that stay open held: the same errors, and a choice beats chance."""
    machine = robot()
    t = spread(40, rng)
    noise = MeasurementNoise(length=2e-3, measured=False)
    best = choose(machine, t, 15, noise=noise, rng=rng)
    assert len(best.parameters) == 26 and best.expected["chosen"]["a"] < best.expected["random"]["a"]
    by_pose, by_number = by_parameters(machine, t, best.parameters)
    k, m, n = by_number.shape
    dense = np.zeros((k, m, n + 6 * k))
    dense[..., :n] = by_number
    for i in range(k):
        dense[i, :, n + 6 * i : n + 6 * i + 6] = by_pose[i]
    dense = dense.reshape(k * m, -1) / noise.length
    info = dense.T @ dense + np.diag([1 / EXPECTED**2] * n + [1e-9] * (6 * k))
    variance = np.diag(np.linalg.inv(info))[:n]
    at = np.array([name.split(".")[1].startswith("a") for name in best.parameters])
    assert np.isclose(np.sqrt(variance[at].mean()), best.expected["all"]["a"], rtol=1e-4)


def test_encoders_alone_need_more_cables_than_freedoms(rng):
    machine = robot()
    six = cable_robot("six", machine.a[:6], machine.b[:6])
    with pytest.raises(ModelError, match="no more cables than freedoms"):
        choose(six, spread(20, rng), 5, noise=MeasurementNoise(measured=False))

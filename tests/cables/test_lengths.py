"""Lengths of straight, stretched, sagging cables and of cables over pulleys: gradients and independent constructions."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED, box, moved, poses, published
from cables.catenaries import hang_by_length, sag, shape
from laws import check_jacobian
from scipy.optimize import fsolve, minimize_scalar

from robocal.cables.cable_lengths import inverse
from robocal.cables.elastic import catenary, hang_by_tension, stretch
from robocal.cables.geometry import lengths, straight
from robocal.cables.pulley import Pulleys, run
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Observations

LEVEL = np.array([4.925, 0.0])
SEED = ((4.6, 80.44, 3.502), (10.4, 35.57, 0.685), (14.5, 25.51, 0.352), (18.6, 19.89, 0.214))


def wheels(rng, m=8):
    axis = rng.normal(size=(m, 3)) * 0.3 + [0, 0, 1]
    return Pulleys(rng.uniform(0.02, 0.12, m), axis / np.linalg.norm(axis, axis=1, keepdims=True))


def some(pulleys):
    """Every other cable without one."""
    return replace(pulleys, radius=np.where(np.arange(len(pulleys.radius)) % 2, pulleys.radius, 0.0))


def heavy(robot):
    m = len(robot.cables)
    return robot.having(elasticity=np.linspace(1e-5, 4e-5, m), density=np.linspace(0.1, 3.0, m))


MODELS = {
    "straight": (lambda robot, rng: robot, None, False),
    "pulleys": (lambda robot, rng: robot.having(pulleys=wheels(rng, len(robot.cables))), None, False),
    "stretch": (lambda robot, rng: heavy(robot), 60.0, False),
    "stretch over pulleys": (lambda robot, rng: heavy(robot).having(pulleys=wheels(rng)), 60.0, False),
    "sag": (lambda robot, rng: heavy(robot), 60.0, True),
    "sag over pulleys": (lambda robot, rng: heavy(robot).having(pulleys=wheels(rng)), 60.0, True),
    "sag over some pulleys": (lambda robot, rng: heavy(robot).having(pulleys=some(wheels(rng))), 60.0, True),
}


@pytest.mark.parametrize("model", MODELS)
def test_gradient_of_every_length_model(model, rng):
    change, tension, sags = MODELS[model]
    robot = change(box(), rng)
    tensions = None if tension is None else tension * rng.uniform(0.8, 1.5, 8)
    for pose in poses(robot, rng, 3):

        def at(x, pose=pose):
            return inverse(robot, moved(pose, x)[None], tensions, sag=sags)

        check_jacobian(lambda x: at(x)[0][0], lambda x: at(x)[1][0], np.zeros(6), tolerance=1e-6)


@pytest.mark.parametrize("name", PUBLISHED)
def test_structure_matrix_is_minus_the_gradient_transposed(name, rng):
    """W from the free bodies alone: unit vectors from platform to frame anchor and their moments."""
    robot = published(name)
    pose = poses(robot, rng, 200)
    _, slope, _ = straight(robot, pose)
    for i in range(len(robot.cables)):
        lever = pose[:, :3, :3] @ robot.b[i]
        pull = robot.a[i] - pose[:, :3, 3] - lever
        pull /= np.linalg.norm(pull, axis=1, keepdims=True)
        w = np.concatenate([pull, np.cross(lever, pull)], axis=1)
        np.testing.assert_allclose(w, -slope[:, i], atol=1e-14)


def test_stretch_of_the_seed():
    """0.0025 %/N: a cable of 4925 mm gets 12.31 mm longer under 100 N, in the catenary and in a robot's lengths."""
    end, _ = catenary(np.array([100.0, 0.0]), np.array(4.925), 0.0, 2.5e-5)
    assert 1e3 * (end[0] - 4.925) == pytest.approx(12.31, abs=0.01)
    robot = box().having(elasticity=np.full(8, 2.5e-5), density=np.zeros(8))
    pose = robot.home[None].copy()
    toward = robot.b[0] + pose[0, :3, 3] - robot.a[0]
    pose[0, :3, 3] = robot.a[0] - robot.b[0] + toward * 4.93731 / np.linalg.norm(toward)
    for sags in (False, True):
        length = inverse(robot, pose, 100.0, sag=sags)[0][0, 0] + robot.zeros[0]
        assert length == pytest.approx(4.925, abs=1e-5)


def test_stretch_and_its_derivatives(rng):
    check_jacobian(
        lambda x: stretch(x[:1], x[1:] * 100, 2.5e-5)[0],
        lambda x: np.stack([stretch(x[:1], x[1:] * 100, 2.5e-5)[1], 100 * stretch(x[:1], x[1:] * 100, 2.5e-5)[2]], -1),
        np.array([4.9, 0.8]),
        tolerance=1e-6,
    )


# --- pulleys -------------------------------------------------------------------------------------------------------


def geometric(d, radius, n):
    """The taut string by construction: of all wraps, the one whose tangent passes through the end."""
    side = d - (d @ n) * n
    side /= np.linalg.norm(side)
    point = np.array([d @ side, d @ n])

    def miss(beta):
        at = np.array([radius * (1 - np.cos(beta)), radius * np.sin(beta)])
        along = np.array([np.sin(beta), np.cos(beta)])
        cross = along[0] * (point - at)[1] - along[1] * (point - at)[0]
        return cross, (point - at) @ along, at

    best = None
    grid = np.linspace(0, 2 * np.pi, 4001)
    for low, high in pairwise(grid):
        if miss(low)[0] * miss(high)[0] <= 0:
            found = minimize_scalar(
                lambda b: abs(miss(b)[0]), bounds=(low, high), method="bounded", options={"xatol": 1e-14}
            )
            if miss(found.x)[1] > 0 and best is None:
                best = found.x
    return best, radius * best + miss(best)[1]


def test_pulley_is_a_tangent_and_an_arc(rng):
    for _ in range(20):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        d, radius = rng.normal(size=3) * 2, rng.uniform(0.05, 0.2)
        length, u = run(d, Pulleys(radius, n))
        beta, expected = geometric(d, radius, n)
        assert length == pytest.approx(expected, abs=1e-7)
        side = d - (d @ n) * n
        np.testing.assert_allclose(u, np.sin(beta) * side / np.linalg.norm(side) + np.cos(beta) * n, atol=1e-5)


def test_pulley_by_hand():
    """Radius 0.1: straight out after a quarter turn; straight back after half a turn; not turned at all straight on."""
    axis = np.array([0.0, 0.0, 1.0])
    for end, length, way in (
        ([3.1, 0, 0.1], 0.1 * np.pi / 2 + 3.0, [1, 0, 0]),
        ([0.2, 0, -2.0], 0.1 * np.pi + 2.0, [0, 0, -1]),
        ([0, 0, 2.0], 2.0, [0, 0, 1]),
        ([0, 0.2, -2.0], 0.1 * np.pi + 2.0, [0, 0, -1]),
    ):
        got, u = run(np.array(end, float), Pulleys(np.array(0.1), axis))
        assert got == pytest.approx(length, abs=1e-12)
        np.testing.assert_allclose(u, way, atol=1e-12)
    assert np.isnan(run(np.array([0.1, 0, 0.01]), Pulleys(np.array(0.1), axis))[0])


def test_pulley_of_no_radius_is_an_eyelet(rng):
    d = rng.normal(size=(50, 3))
    length, u = run(d, Pulleys(np.array(0.0), np.array([0.0, 0.6, 0.8])))
    np.testing.assert_allclose(length, np.linalg.norm(d, axis=1), rtol=1e-14)
    np.testing.assert_allclose(u, run(d, None)[1], atol=1e-14)


def test_measured_lengths_know_the_pulleys(rng):
    """The kind `lengths` predicts what inverse kinematics says, and moves with the anchors as it should."""
    robot = box().having(pulleys=wheels(rng))
    pose = poses(robot, rng, 5)
    exact, _ = inverse(robot, pose)
    rows = Observations(
        "lengths", np.repeat(np.arange(5), 8), exact.reshape(-1, 1), np.full((40, 1), 1e-3),
        extra={"cable": np.tile(np.arange(8), 5)},
    )  # fmt: skip
    where = Configurations(tuple(f"p{i}" for i in range(5)), start=se3.to_vector(pose))
    p = problem(robot, DataSet(where, (rows,)))
    assert np.abs(p.linearize(p.start).r).max() < 1e-9
    numbers, wheel = robot.numbers[2], robot.pulley(2)
    check_jacobian(
        lambda c: lengths(pose[None], c[None], wheel)[0][0],
        lambda c: lengths(pose[None], c[None], wheel)[2][0],
        numbers,
        tolerance=1e-6,
    )


# --- sag -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("pull", "depth", "excess"), SEED)
def test_catenary_of_the_seed(pull, depth, excess):
    """Table 3.2 evaluated without its rounding: the printed tension is the horizontal one, and is told apart from that
    at the end by less than the tolerance."""
    hung = hang_by_tension(LEVEL, pull, 0.122, 0.0)
    assert hung.converged
    assert 1e3 * sag(hung.force, hung.length, 0.122, 0.0) == pytest.approx(depth, rel=0.01)
    assert 1e3 * (hung.length - 4.925) == pytest.approx(excess, rel=0.01)
    alpha = hung.force[0] / 0.122
    assert hung.length == pytest.approx(2 * alpha * np.sinh(4.925 / (2 * alpha)), rel=1e-12)


@pytest.mark.parametrize(("pull", "depth", "excess"), SEED)
def test_chain_of_the_seed(pull, depth, excess):
    """500 rigid links of 0.122 N/m between two points 4925 mm apart, that the horizontal force holds: no catenary."""
    n = 500

    def chain(length):
        v = 0.122 * length / n * (np.arange(n) - (n - 1) / 2)
        t = np.hypot(pull, v)
        return np.cumsum(length / n * np.stack([np.full(n, pull), v]) / t, axis=1)

    length = float(fsolve(lambda x: chain(x[0])[0, -1] - 4.925, 4.925)[0])
    assert 1e3 * (length - 4.925) == pytest.approx(excess, rel=0.01)
    assert -1e3 * chain(length)[1].min() == pytest.approx(depth, rel=0.01)
    at_end = np.hypot(pull, 0.122 * length / 2)
    hung = hang_by_tension(LEVEL, at_end, 0.122, 0.0)
    assert hung.force[0] == pytest.approx(pull, rel=1e-5) and hung.length == pytest.approx(length, rel=1e-7)


@pytest.mark.parametrize(
    ("end", "length", "weight", "elasticity"),
    [
        ((4.0, -2.0), 4.6, 2.0, 1e-5),
        ((4.0, 2.0), 4.468, 2.0, 1e-4),
        ((0.5, -3.0), 4.0, 5.0, 1e-6),
        ((3.0, 0.3), 3.01, 0.122, 2.5e-5),
    ],
)
def test_against_500_elements(end, length, weight, elasticity):
    """A chain of 500 springs with half of its weight at either end of each: its pull, its ends and its lowest point."""
    n = 500
    piece, unit = length / n, weight * length / n
    hung = hang_by_length(end, length, weight, elasticity)
    assert hung.converged

    def chain(force):
        v = force[1] - unit * (n - 0.5 - np.arange(n))  # at the middle of element i, from A
        t = np.hypot(force[0], v)
        pieces = (piece * (1 + elasticity * t) / t)[:, None] * np.stack([np.full(n, force[0]), v], axis=1)
        return np.vstack([np.zeros(2), np.cumsum(pieces, axis=0)])

    force = fsolve(lambda f: chain(f)[-1] - end, hung.force * 1.05, xtol=1e-13)
    np.testing.assert_allclose(hung.force, force, rtol=1e-3)
    points, tension = shape(hung.force, hung.length, weight, elasticity, n + 1)
    np.testing.assert_allclose(points, chain(force), atol=2e-4 * length)
    assert tension[-1] == pytest.approx(hung.tension, rel=1e-12)
    drop = (points[:, 0] * end[1] / end[0] - points[:, 1]).max()
    assert sag(hung.force, hung.length, weight, elasticity) == pytest.approx(drop, rel=1e-4)


def test_catenary_derivatives(rng):
    scale = np.array([100.0, 100, 1])
    for _ in range(5):
        force, length = rng.normal(size=2) * [20, 40] + [60, 0], rng.uniform(2, 6)
        args = (rng.uniform(0.1, 5), 10 ** rng.uniform(-6, -4))
        check_jacobian(
            lambda y, args=args: catenary((y * scale)[:2], (y * scale)[2], *args)[0],
            lambda y, args=args: catenary((y * scale)[:2], (y * scale)[2], *args)[1] * scale,
            np.array([*force, length]) / scale,
            tolerance=1e-6,
        )


def test_length_and_tension_are_each_others_inverse(rng):
    n = 500
    ends = np.stack([rng.uniform(0, 8, n), rng.uniform(-5, 5, n)], axis=1)
    weight, elasticity = 10 ** rng.uniform(-6, 0.5, n), 10 ** rng.uniform(-7, -4, n)
    tension = rng.uniform(30, 3000, n)
    hung = hang_by_tension(ends, tension, weight, elasticity)
    assert hung.converged.all()
    back = hang_by_length(ends, hung.length, weight, elasticity)
    assert back.converged.all()
    np.testing.assert_allclose(back.tension, tension, rtol=1e-6)
    np.testing.assert_allclose(back.gradient, hung.gradient, rtol=1e-6, atol=1e-9)


def test_slack_cables_hang(rng):
    ends = np.stack([rng.uniform(0.1, 8, 200), rng.uniform(-5, 5, 200)], axis=1)
    length = np.linalg.norm(ends, axis=1) * rng.uniform(1.0005, 3, 200)
    hung = hang_by_length(ends, length, 0.5, 1e-5)
    assert hung.converged.all()
    np.testing.assert_allclose(catenary(hung.force, length, 0.5, 1e-5)[0], ends, atol=1e-9)


def test_what_cannot_hang_says_so():
    assert not hang_by_tension([5.0, 0.0], 1.0, 2.0, 0.0).converged
    assert not hang_by_length([5.0, 0.0], 4.9, 2.0, 0.0).converged
    robot, pose = heavy(box()), box().home[None]
    with pytest.raises(ModelError, match="c8 cannot hang so"):
        inverse(replace(robot, density=np.array([0.1] * 7 + [90.0])), pose, 20.0, sag=True)
    with pytest.raises(ModelError, match="cannot push"):
        inverse(robot, pose, -1.0)
    with pytest.raises(ModelError, match="elasticity of box is not known"):
        inverse(box(), pose, 20.0)
    with pytest.raises(ModelError, match="density of box is not known"):
        inverse(box(), pose, 20.0, sag=True)
    with pytest.raises(ModelError, match="needs its tension"):
        inverse(robot, pose, sag=True)


def test_a_cable_without_length_is_refused():
    robot = box()
    pose = np.eye(4)
    pose[:3, 3] = robot.a[2] - robot.b[2]
    with pytest.raises(ModelError, match=r"c3 has no length.*pose 1"):
        inverse(robot, np.stack([robot.home, pose]))

"""What a calibration of frame anchors and zeros is worth: draws beside the error model, at the noises of figures 3.7 and 3.8 of the
thesis behind `examples/cable-laval`. Robot: that of its Table D.1; lists: up to 0.7 m from the mean of the frame anchors along each axis
and turned by up to 15 degrees about each, with which the squared residual gives the first row of its Table 3.1; drawn anew for every
calibration; no guess of anchors or zeros."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import published
from cables.test_calibration import blank, read
from cables.test_propagation import FIGURE_3_8
from measure.test_generalised import Draws
from scipy import stats
from sizes import size

from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.calibration.propagation import ErrorPropagation, Noise, Requirement, rms
from robocal.cables.geometry import cable_robot
from robocal.estimate.generalised.solver import generalised_least_squares
from robocal.estimate.least_squares import least_squares
from robocal.geometry import se3, so3

NOISES = {"3.7": Noise(3e-3), "3.8": FIGURE_3_8}
AT_ONCE = 100  # lists


def listed(robot, rng, n):
    """As many lists as are drawn at once."""
    shift, turn = rng.uniform(-0.7, 0.7, (AT_ONCE, n, 3)), np.radians(rng.uniform(-15, 15, (AT_ONCE, n, 3)))
    return se3.from_vector(np.concatenate([robot.a.mean(axis=0) + shift, turn], axis=-1))


def lists(robot, rng, n, noise, count):
    """Fits of `count` lists of their own, a hundred at a time, with the covariance that is foretold for the first of each."""
    for _ in range(0, count, AT_ONCE):
        t = listed(robot, rng, n)
        y = np.stack([read(robot, one) for one in t]) + noise.length * rng.normal(size=(AT_ONCE, n, 8))
        seen = t.copy()
        if noise.position or noise.orientation:
            seen[..., :3, 3] += noise.position * rng.normal(size=(AT_ONCE, n, 3))
            seen[..., :3, :3] = so3.exp(noise.orientation * rng.normal(size=(AT_ONCE, n, 3))) @ t[..., :3, :3]
        yield seen, y, t


@pytest.mark.slow
@pytest.mark.parametrize("figure", NOISES)
def test_lengths_are_unbiased_and_as_sure_as_they_say(figure):
    robot, noise = published("laval"), NOISES[figure]
    truth = np.column_stack([robot.a, robot.zeros])
    nobody, table = blank(robot), []
    for n in (100, 400, 1600):
        rng = np.random.default_rng(n)
        errors, foretold, held, chi2 = [], [], [], []
        for seen, y, t in lists(robot, rng, n, noise, size(3000, 300)):
            found = per_cable(nobody, seen, y)
            assert found.converged.all()
            e = np.concatenate([found.anchors, found.zeros[..., None]], axis=-1) - truth
            sigma = np.sqrt(np.diagonal(found.covariance, axis1=2, axis2=3)) * found.left[..., None]
            held.append((np.abs(e) < stats.t.ppf(0.975, n - 4) * sigma).mean())
            chi2.append((found.left**2).mean() / noise.length**2)
            errors.append(e)
            foretold.append(
                np.mean(
                    [
                        np.diag(ErrorPropagation(robot, one).covariance(noise)).reshape(8, 4)
                        for one in t[:: max(1, n // 200)]
                    ],
                    axis=0,
                )
            )
        e, sigma = np.concatenate(errors), np.sqrt(np.mean(foretold, axis=0))
        worth, bias = e.std(axis=0) / sigma, np.abs(e.mean(axis=0) / e.std(axis=0)).max()
        table.append((n, *rms(e[..., :3], e[..., 3])))
        print(
            f"{figure}, n {n}: anchors {1e3 * table[-1][1]:.2f} mm, zeros {1e3 * table[-1][2]:.2f} mm, drawn over foretold {worth.mean():.4f}, "
            f"bias {bias:.3f} sigma, 95 % intervals hold {np.mean(held):.4f}, chi2/dof of the lengths' sigma {np.mean(chi2):.4f}"
        )
        assert 0.97 < worth.mean() < 1.05
        assert bias < size(0.1, 0.25)
        assert 0.93 < np.mean(held) < 0.97
        if not noise.position:
            assert 0.95 < np.mean(chi2) < 1.05
    slope = np.polyfit(*np.log(np.array(table)[:, :2]).T, 1)[0]
    print(f"{figure}: error goes as n to the {slope:.3f}")
    assert abs(slope + 0.5) < size(0.03, 0.06)


@pytest.mark.slow
def test_the_first_row_of_table_3_1():
    """2.8 mm on the lengths, 100 poses: 13.0 mm and 20.0 mm, one run of the squared residual."""
    robot = published("laval")
    rng = np.random.default_rng(1)
    runs = []
    for seen, y, _ in lists(robot, rng, 100, Noise(2.8e-3), size(3000, 300)):
        found = per_cable(blank(robot), seen, y, residual="squared")
        a, z = ((found.anchors - robot.a) ** 2).mean(axis=(1, 2)), ((found.zeros - robot.zeros) ** 2).mean(axis=1)
        runs.append(1e3 * np.sqrt(np.column_stack([a, z])))
    mean, scatter = np.concatenate(runs).mean(axis=0), np.concatenate(runs).std(axis=0)
    print(
        f"anchors {mean[0]:.1f} mm (seed 13.0, one run scatters by {scatter[0]:.1f}), zeros {mean[1]:.1f} mm (20.0, {scatter[1]:.1f})"
    )
    assert mean == pytest.approx([13.0, 20.0], rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "printed"),
    [(Noise(position=2e-3), (5.3, 9.2)), (Noise(orientation=np.radians(0.4)), (2.5, 4.2))],
    ids=["p", "Q"],
)
def test_the_other_rows_of_table_3_1(noise, printed):
    """2.0 mm on the position, 0.4 degrees on the orientation, of every component. The first is met within the scatter of a run. The second
    is a third of ours: it is proportional to the levers b, which are not printed, and how its noise is meant is not either."""
    robot, rng = published("laval"), np.random.default_rng(2)
    runs = {"length": [], "squared": []}
    model = []
    for seen, y, t in lists(robot, rng, 100, noise, size(3000, 300)):
        for residual, out in runs.items():
            found = per_cable(blank(robot), seen, y, residual=residual)
            a, z = ((found.anchors - robot.a) ** 2).mean(axis=(1, 2)), ((found.zeros - robot.zeros) ** 2).mean(axis=1)
            out.append(1e3 * np.sqrt(np.column_stack([a, z])))
        model += [
            1e3 * np.array(ErrorPropagation(robot, one).rms_errors(ErrorPropagation(robot, one).covariance(noise)))
            for one in t[::10]
        ]
    told = {k: (np.concatenate(v).mean(axis=0), np.concatenate(v).std(axis=0)) for k, v in runs.items()}
    foretold = np.sqrt(np.mean(np.square(model), axis=0))
    for k, (mean, scatter) in told.items():
        print(
            f"{k}: anchors {mean[0]:.1f} ({scatter[0]:.1f}), zeros {mean[1]:.1f} mm ({scatter[1]:.1f}); foretold {foretold.round(1)}, seed {printed}"
        )
    rms_of = np.sqrt((np.concatenate(runs["length"]) ** 2).mean(axis=0))
    assert rms_of == pytest.approx(foretold, rel=0.05)


def drawn_over_foretold(noise, seed, count):
    """Error of the anchors over what the linear model foretells, and that, of lists of 100 poses."""
    robot, rng = published("laval"), np.random.default_rng(seed)
    squares, foretold = [], []
    for seen, y, t in lists(robot, rng, 100, noise, count):
        found = per_cable(blank(robot), seen, y)
        squares.append(((found.anchors - robot.a) ** 2).mean())
        foretold += [
            ErrorPropagation(robot, one).rms_errors(ErrorPropagation(robot, one).covariance(noise))[0] ** 2
            for one in t[::10]
        ]
    return np.sqrt(np.mean(squares) / np.mean(foretold)), np.sqrt(np.mean(foretold))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "off"),
    [
        (Noise(3e-2), 0.05), (Noise(position=3e-2), 0.05), (Noise(orientation=np.radians(5.0)), 0.05), (Noise(0.1), 0.4),
        (Noise(0.02, 0.02, np.radians(2.0)), 0.05),
    ],
    ids=["30 mm of length", "30 mm of position", "5 deg", "100 mm of length", "all at once"],
)  # fmt: skip
def test_the_linear_model_holds_far_beyond_the_noise_of_any_sensor(noise, off):
    """Annex B ends it at 2.8 mm, 2 mm and 0.4 degrees, where squares begin to be biased. Lengths are foretold within 5 % up to ten times
    that; at 100 mm single lists end elsewhere altogether."""
    ratio, _ = drawn_over_foretold(noise, 0, size(1000, 200))
    print(f"{noise}: drawn over foretold {ratio:.3f}")
    if off > 0.1:
        assert ratio > 1.15
    else:
        assert abs(ratio - 1) < size(off, 0.1)


@pytest.mark.slow
@pytest.mark.parametrize("pair", [("length", "position"), ("position", "orientation"), ("length", "orientation")])
def test_contours_are_met_by_draws(pair):
    """Annex C: calibrations with the noises on a line of equal error have that error, within 5 %."""
    robot, level = published("laval"), 20e-3
    t = listed(robot, np.random.default_rng(5), 100)
    # One line for lists like these: that of the mean of what they are expected to err.
    curves = [
        Requirement(ErrorPropagation(robot, one), Noise(1e-3, 1e-3, 1e-3), "per-cable").contour("anchors", level, pair)
        for one in t[:20]
    ]
    along = np.exp(np.mean(np.log(np.maximum([np.sqrt(np.einsum("ij,ij->i", c, c)) for c in curves], 1e-12)), axis=0))
    way = curves[0] / np.linalg.norm(curves[0], axis=1, keepdims=True)
    for at in (5, len(way) // 2, len(way) - 6):
        one, two = way[at] * along[at]
        noise = Noise(**{"length": 0.0, pair[0]: float(one), pair[1]: float(two)})
        ratio, foretold = drawn_over_foretold(noise, at, size(1000, 200))
        print(f"{pair}: {one:.5f}, {two:.5f}: drawn over foretold {ratio:.3f}, line {foretold / level:.3f}")
        assert abs(ratio - 1) < size(0.05, 0.1) and abs(foretold / level - 1) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("figure", NOISES)
def test_squares_have_a_floor(figure):
    """With ever more poses the squared residual ends where its bias is, the length residual at nothing."""
    robot, noise = published("laval"), NOISES[figure]
    truth = np.column_stack([robot.a, robot.zeros])
    rng = np.random.default_rng(0)
    got = {"length": [], "squared": []}
    laws = []
    for seen, y, t in lists(robot, rng, 1600, noise, size(1000, 100)):
        for residual, errors in got.items():
            found = per_cable(blank(robot), seen, y, residual=residual)
            errors.append(np.concatenate([found.anchors, found.zeros[..., None]], axis=-1) - truth)
        laws.append(np.column_stack(ErrorPropagation(robot, t[0]).bias_of_squares(noise)))
    good, bad = (np.concatenate(got[r]) for r in ("length", "squared"))
    law, ratio = np.mean(laws, axis=0), rms(bad[..., :3], 0)[0] / rms(good[..., :3], 0)[0]
    off = np.linalg.norm(bad.mean(axis=0) - law) / np.linalg.norm(law)
    print(
        f"{figure}, n 1600: squared over length {ratio:.2f}, its bias {1e3 * rms(law[:, :3], 0)[0]:.2f} mm foretold, {off:.1%} off"
    )
    assert ratio > 2.5 and off < 0.08


@pytest.mark.slow
def test_errors_in_variables_and_maximum_likelihood_beat_every_cable_by_itself(shared_data):
    """Figure 3.8: 3 mm, 2 mm, 1 degree, 100 poses; poses as measured stay, the truth is drawn around them."""
    batch = size(1000, 200)
    draws = Draws(shared_data, batch=batch)
    made = draws.problem
    joint, general = least_squares(made, draws.start), generalised_least_squares(made, draws.start)
    assert all(r.converged for r in joint.reasons)
    names = list(made.free)
    truth = made.start[0, made.index]
    e = {"maximum likelihood": joint.x[:, made.index] - truth, "errors in variables": general.x[:, made.index] - truth}
    order = [[names.index(f"c{c}.{s}") for s in ("ax", "ay", "az", "l0")] for c in range(1, 9)]
    rows = made.table
    numbers = np.array(
        [[rows[f"c{c}.{s}"].value for s in ("ax", "ay", "az", "bx", "by", "bz", "l0")] for c in range(1, 9)]
    )
    robot = cable_robot("eight", numbers[:, :3], numbers[:, 3:6], numbers[:, 6])
    t = se3.from_vector(made.families[0].start)
    y = made.terms[0].value.reshape(batch, -1)
    sorted_rows = np.empty((batch, len(t), 8))
    sorted_rows[:, made.terms[0].configuration, made.terms[0].cable] = y
    alone = per_cable(robot, t, sorted_rows)
    each = np.concatenate([alone.anchors, alone.zeros[..., None]], axis=-1) - np.column_stack([robot.a, robot.zeros])
    design = ErrorPropagation(robot, t)
    foretold = np.diag(design.bound(FIGURE_3_8)).reshape(8, 4)
    spread = {k: v[:, order] for k, v in e.items()} | {"every cable by itself": each}
    size_of = {k: np.sqrt((v**2).mean()) for k, v in spread.items()}
    for k, v in size_of.items():
        print(f"{k}: {1e3 * v:.3f} mm, {v / size_of['every cable by itself']:.3f} of every cable by itself")
    print(f"maximum likelihood over foretold {size_of['maximum likelihood'] / np.sqrt(foretold.mean()):.4f}")
    for k in ("maximum likelihood", "errors in variables"):
        assert size_of[k] < 0.85 * size_of["every cable by itself"]
    assert abs(size_of["maximum likelihood"] / size_of["errors in variables"] - 1) < 0.01
    assert abs(size_of["maximum likelihood"] / np.sqrt(foretold.mean()) - 1) < 0.05

"""The RV-2AJ paper (Flitti and Segai): its figures in its own way, and what an honest identification says of the same
data."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocal.arms import catalog
from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem
from robocal.prove.identify import identify
from robocal.remarks.code import Code

FILE = Path(__file__).parents[2] / "examples" / "rv-2aj" / "make_data.py"
# Equation 7 of the paper.
LISTED = (
    *("j1.beta", "j3.beta", "j4.beta", "j1.alpha", "j2.alpha", "j3.alpha"),
    *(f"j{i}.d" for i in range(1, 6)),
    *("j1.theta", "j2.theta", "j3.theta", "j1.r", "j2.r", "j5.r"),
)


def _example():
    spec = importlib.util.spec_from_file_location("rv_2aj_make_data", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


example = _example()
TRUTH = example.real_robot()


def arm(free):
    nominal = catalog.get("rv-2aj")
    return replace(nominal, table=nominal.table.with_free(free))


def distance(a, b, q):
    """Between the wrist centres of two robots, mm."""
    return 1e3 * np.linalg.norm(a.pose(q)[:, :3, 3] - b.pose(q)[:, :3, 3], axis=1)


@pytest.fixture(scope="module")
def exact():
    return example.measured(example.plane(7, 8), seed=None)


@pytest.fixture(scope="module")
def paper(exact):
    """The paper's way: the listed columns, iterated pseudo-inverse at machine tolerance."""
    made = problem(arm(LISTED), exact)
    return made, least_squares(made, method="pinv")


def worst(made, solution):
    return 1e3 * np.linalg.norm(made.residuals(solution.x)[0].value, axis=1).max()


def test_error_before(exact):
    before = distance(arm(LISTED), TRUTH, exact.configurations.joints)
    assert round(before.min(), 2) == 2.11 and round(before.max(), 2) == 4.19


def test_error_by_iteration(exact, paper):
    made, solution = paper
    assert worst(made, least_squares(made, method="pinv", max_iterations=4)) < 5e-5
    assert worst(made, solution) < 1e-11


def test_table_2(paper):
    made, solution = paper
    found = dict(zip(made.table.names, solution.x[0], strict=True))
    nominal = catalog.get("rv-2aj").table
    for name in LISTED:
        error = found[name] - nominal[name].value
        printed = example.ERRORS.get(name, 0.0)
        if name == "j4.d":
            # The paper prints 0.1 and calls the difference rounding; the other parameters' hidden share is in it.
            assert error == pytest.approx(0.1004e-3, abs=5e-9)
        elif printed:
            assert error == pytest.approx(printed, rel=1e-3), name
        else:
            assert abs(error) < 1e-9, name


def test_3600_points_of_the_verification(paper):
    made, solution = paper
    found = catalog.get("rv-2aj").with_values(dict(zip(made.table.names, solution.x[0], strict=True)))
    points = example.plane(60, 60)
    assert len(points) == 3600
    assert distance(arm(LISTED), TRUTH, points).max() > 4
    assert distance(found, TRUTH, points).max() < 1e-9


def test_the_papers_way_stands_on_the_last_digit(exact):
    """Joint values rounded to a millionth of a degree, far below any encoder: the first pseudo-inverse step throws the
    arm by metres."""
    q = np.deg2rad(np.round(np.rad2deg(exact.configurations.joints), 6))
    obs = replace(exact.observations[0], value=TRUTH.pose(q)[:, :3, 3])
    made = problem(
        arm(LISTED), replace(exact, configurations=replace(exact.configurations, joints=q), observations=(obs,))
    )
    assert worst(made, least_squares(made, method="pinv", max_iterations=1)) > 1000
    # Levenberg-Marquardt on the same numbers does not care.
    assert worst(made, least_squares(made, max_iterations=10)) < 1e-3


def test_rank_is_16_in_the_volume_and_less_in_the_plane():
    """17 identifiable is a list, not a rank."""
    full = arm(catalog.get("rv-2aj").geometric)

    def rank(q):
        blank = example.measured(q, seed=None)
        made = problem(full, blank)
        return analyse(made, made.start).structural_rank

    assert len(full.table.free) == 25
    assert rank(example.volume(200)) == 16
    assert rank(example.plane(7, 8)) < 16


@pytest.fixture(scope="module")
def honest():
    full = arm(catalog.get("rv-2aj").geometric)
    data = example.measured(example.plane(7, 8), seed=1)
    sigma = np.full((56, 3), example.NOISE)
    return identify(full, replace(data, observations=(replace(data.observations[0], sigma=sigma),)))


def test_noisy_plane_is_not_overclaimed(honest):
    assert honest.verdict.status == "improved"
    status = {p.name: p.status for p in honest.parameters}
    assert all(status[n] != "identified" for n in ("j2.r", "j2.alpha", "j4.beta")), status
    assert honest.identifiability.rank <= 16
    # Whatever was dropped says what hides it.
    named = {c.name: c for c in honest.identifiability.combinations}
    assert set(named) == set(honest.identifiability.dropped)
    assert any("j2.r" in (c.name, *(n for n, _ in c.partners)) for c in named.values())
    assert any(w.code is Code.ONE_PLANE for w in honest.warnings)


def test_what_is_claimed_is_right(honest):
    """An identified parameter lies within its total bar of the truth, give or take chance."""
    nominal = catalog.get("rv-2aj").table
    z = [
        (p.identified - nominal[p.name].value - example.ERRORS.get(p.name, 0.0)) / p.sigma
        for p in honest.parameters
        if p.status == "identified"
    ]
    assert len(z) >= 8
    assert np.sqrt(np.mean(np.square(z))) < 2


def test_error_elsewhere_lies_in_its_band(honest):
    points = example.volume(2000)
    nominal, found = distance(catalog.get("rv-2aj"), TRUTH, points), distance(honest.corrected, TRUTH, points)
    band = honest.band
    assert band is not None
    rms, predicted = np.sqrt(np.mean(found**2)), 1e3 * band.mean
    print(f"elsewhere: nominal {nominal.mean():.3f} mm, corrected {found.mean():.4f} mm, band {predicted:.4f} mm")
    assert found.mean() < 0.5 * nominal.mean()
    # One robot is one draw: its error may be a few times smaller or larger than one standard deviation.
    assert 0.05 < rms / predicted < 3

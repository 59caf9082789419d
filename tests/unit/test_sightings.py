"""What images show of a target: fits of markers and boards, which are joined, how much is covered."""

from __future__ import annotations

import numpy as np
import pytest
from printed import image_of, paper, places

from robocal.simulation.images import Photograph, render
from robocal.vision.camera import image_of as project_to
from robocal.vision.checker.crossing import fit_saddles
from robocal.vision.marker.edges import fit_edges
from robocal.vision.sheets import Checker, Sheet, inner_corners
from robocal.vision.sightings import METHODS, coverage_of, find_islands, fit_sighting

CELLS = np.pad(np.random.default_rng(4).integers(0, 2, (6, 6)).astype(float), 1)
SIDE = 8 * 7.0
CORNERS = np.array([[0.0, 0], [SIDE, 0], [SIDE, SIDE], [0, SIDE]])
PLAIN = np.array([300.0, 300.0, 59.5, 59.5, 0.0, 0.0, 0.0, 0.0, 0.0])  # a lens that does nothing
TILT = np.array([[1.0, 0.08, 30.3], [-0.05, 1.02, 30.6], [3e-4, 2e-4, 1.0]])


def drawn(seed=0, sheet=None, **how):
    return image_of(sheet or paper(CELLS, 0, 0, 7.0), TILT, 120, 120, seed=seed, **how).astype(float)


def test_edges_find_corners_and_know_how_well():
    true, apart, scaled = places(TILT, CORNERS), [], []
    for seed in range(12):
        start = true + np.random.default_rng(seed).normal(0, 0.5, (4, 2))
        found, covariance = fit_edges(drawn(seed), start)
        apart.append(found - true)
        scaled.append(apart[-1].ravel() @ np.linalg.solve(covariance, apart[-1].ravel()))
    assert np.sqrt(np.mean(np.square(apart))) < 0.08
    assert 0.3 < np.mean(scaled) / 8 < 4
    assert fit_edges(np.full((120, 120), 90.0), true) is None


def test_a_marker_whose_cells_are_hidden_is_fitted_by_its_edges_and_says_so():
    true = places(TILT, CORNERS)
    whole = fit_sighting(drawn(), 7, true + 0.6, CELLS)
    assert whole.method == METHODS[0] and np.abs(whole.place - true).max() < 0.03 and not whole.cut
    covered = drawn(sheet=paper(1 - CELLS[1:-1, 1:-1], 7.0, 7.0, 7.0, paper(CELLS, 0, 0, 7.0)))
    edges = fit_sighting(covered, 7, true + 0.6, CELLS)
    assert edges.method == METHODS[1] and np.abs(edges.place - true).max() < 0.3
    assert fit_sighting(np.full((120, 120), 90.0), 7, true, CELLS) is None


def test_a_marker_at_the_border_says_so():
    image, true = drawn(), places(TILT, CORNERS)
    at = int(true[:, 0].max()) + 4
    cut = fit_sighting(image[:, :at], 7, true, CELLS)
    assert cut.cut and np.abs(cut.place - true).max() < 0.05


@pytest.mark.parametrize(
    ("blur", "noise", "cell", "most"), [(0.5, 2.0, 14, 0.01), (0.8, 5.0, 14, 0.02), (1.5, 5.0, 24, 0.03)]
)
def test_crossings_of_a_checkerboard(blur, noise, cell, most):
    board = (np.indices((6, 8)).sum(axis=0) % 2).astype(float)
    inner = np.array([(i * cell, j * cell) for j in range(1, 6) for i in range(1, 8)], dtype=float)
    h = np.array([[1.0, 0.1, 30.4], [-0.07, 0.9, 40.7], [5e-4, 4e-4, 1.0]])
    size = int(10.5 * cell) + 30, int(8 * cell) + 30
    true, apart, scaled = places(h, inner), [], []
    for seed in range(3):
        image = image_of(paper(board, 0, 0, cell), h, *size, blur=blur, noise=noise, seed=seed).astype(float)
        start = true + np.random.default_rng(seed).normal(0, 0.4, true.shape)
        # A lens that does nothing: without one sigma carries what one may bend.
        found = fit_saddles(image, np.arange(35), start, 7, np.array([300.0, 300, 100, 80, 0, 0, 0, 0, 0]))
        assert found.corner.tolist() == list(range(35)) and found.blur == pytest.approx(blur, rel=0.15)
        apart.append(found.place - true)
        scaled.append(apart[-1] / found.sigma)
    assert np.sqrt(np.mean(np.square(apart))) < most
    assert np.abs(np.mean(apart, axis=(0, 1))).max() < 0.3 * most
    assert 0.7 < np.mean(np.square(scaled)) < 1.6


def test_what_a_lens_bends_is_in_the_sigma_of_crossings():
    """A wide lens that nobody knows, towards the corner of the image, where it bends most."""
    size, lens = (240, 180), np.array([190.0, 190, 119.5, 89.5, -0.3, 0, 0, 0, 0])
    board = Checker(8, 7, 0.02)
    at = np.eye(4)
    at[:3, :3] = np.diag([1.0, -1, -1])
    at[:3, 3] = 0.06, 0.05, 0.28
    image = render(
        [(Sheet("b", 0.2, 0.18, (), (board,)), at)], lens, size, Photograph(noise=0.5), rng=np.random.default_rng(1)
    )
    true = project_to(inner_corners(board).reshape(-1, 3) @ at[:3, :3].T + at[:3, 3], lens)
    inside = ((true > 20) & (true < np.array(size) - 20)).all(axis=1)
    number = np.flatnonzero(inside)
    free, known = (fit_saddles(image.astype(float), number, true[inside], 7, known) for known in (None, lens))
    for found, most in ((free, 2.5), (known, 1.6)):
        apart = found.place - true[found.corner]
        assert np.mean(np.square(apart / found.sigma)) < most
    assert (free.sigma >= 0.999 * known.sigma).mean() > 0.9 and np.median(free.sigma / known.sigma) > 1.2


@pytest.mark.parametrize("at", [(1.0, 1.0), (0.5, 0.1), (0.3, 0.6)])
def test_glare_in_a_marker_costs_no_corner(at):
    """A blob that is cut off, at a corner, on an edge or inside: its pixels are left out."""
    true, image = places(TILT, CORNERS), drawn()
    u, v = places(TILT, np.array([at]) * SIDE)[0]
    far = np.hypot(*(np.indices(image.shape)[::-1] - np.array([u, v])[:, None, None]))
    image = np.clip(np.maximum(image, 400 / (1 + np.exp((far - 6) / 1.5))), 0, 255).round()
    found = fit_sighting(image, 7, true + 0.5, CELLS)
    assert found.method == METHODS[0]
    assert np.abs(found.place - true).max() < 0.06 and np.abs((found.place - true) / found.sigma).max() < 4


@pytest.mark.parametrize("at", [(0.35, 0.7), (0.65, 0.6), (0.75, 0.3)])
def test_glare_on_a_fifth_of_a_marker_costs_no_corner(at):
    """A blob of 24 px across: it raises what the cost tells of noise, but not the median."""
    true, image = places(TILT, CORNERS), drawn()
    u, v = places(TILT, np.array([at]) * SIDE)[0]
    far = np.hypot(*(np.indices(image.shape)[::-1] - np.array([u, v])[:, None, None]))
    bright = np.clip(np.maximum(image, 400 / (1 + np.exp(np.minimum((far - 12) / 1.5, 50)))), 0, 255).round()
    for glare in (bright, np.minimum(bright, 249.0)):  # cut off, or not quite
        found = fit_sighting(glare, 7, true + 0.5, CELLS)
        assert found.method == METHODS[0]
        assert np.abs((found.place - true) / found.sigma).max() < 4.5 and np.abs(found.place - true).max() < 0.25


@pytest.mark.parametrize(("wide", "more"), [(10.0, 60.0), (20.0, 60.0), (20.0, 100.0)])
def test_a_soft_light_is_in_the_covariance(wide, more):
    """A reflection without an edge moves corners by tenths of a pixel. No pixel of it is foreign: parts of the marker are off together."""
    true, scaled = places(TILT, CORNERS), []
    v, u = np.mgrid[:120, :120]
    for k in range(4):
        at = true[k]
        light = more * np.exp(-((u - at[0]) ** 2 + (v - at[1]) ** 2) / (2 * wide**2))
        found = fit_sighting(np.clip(drawn(k) + light, 0, 255).round(), 7, true + 0.5, CELLS, PLAIN)
        e = (found.place - true).ravel()
        scaled.append(e @ np.linalg.solve(found.covariance, e) / 8)
    assert np.mean(scaled) < 1.6


def test_edges_under_glare_know_how_little_they_tell():
    """A blob on an edge moves neighbouring points of its line together."""
    true, scaled = places(TILT, CORNERS), []
    for k, (x, y) in enumerate([(0.2, 0.06), (0.94, 0.7), (0.7, 0.95), (0.05, 0.35)]):
        u, v = places(TILT, np.array([[x, y]]) * SIDE)[0]
        image = drawn(k)
        far = np.hypot(*(np.indices(image.shape)[::-1] - np.array([u, v])[:, None, None]))
        place, covariance = fit_edges(
            np.maximum(image, 250 / (1 + np.exp(np.minimum((far - 5) / 1.5, 50)))), true + 0.3
        )
        scaled.append(np.abs((place - true).ravel() / np.sqrt(np.diag(covariance))).max())
    assert np.median(scaled) < 4 and max(scaled) < 7


@pytest.mark.parametrize("more", [1.5, 2.2])
def test_white_that_is_cut_off_moves_no_corner(more):
    true, apart, scaled = places(TILT, CORNERS), [], []
    for seed in range(4):
        image = np.clip(
            more * image_of(paper(CELLS, 0, 0, 7.0), TILT, 120, 120, bright=160, blur=1.0, seed=seed), 0, 255
        ).round()
        found = fit_sighting(image, 7, true + 0.5, CELLS)
        apart.append(found.place - true)
        scaled.append(apart[-1].ravel() @ np.linalg.solve(found.covariance, apart[-1].ravel()) / 8)
    assert np.sqrt(np.mean(np.square(apart))) < 0.015 and np.mean(scaled) < 2


def test_islands_and_coverage():
    seen = np.zeros((5, 6), dtype=bool)
    seen[0, [0, 2]] = seen[1, [2, 4]] = seen[2, [1, 3]] = True
    seen[3, 5] = True
    assert [i.tolist() for i in find_islands(seen)] == [[0, 2, 4], [1, 3], [5]]
    assert find_islands(np.zeros((2, 0), dtype=bool)) == []
    every = np.stack(np.meshgrid(np.arange(0, 80, 2), np.arange(0, 60, 2)), axis=-1).reshape(-1, 2)
    assert coverage_of([every], 80, 60) == 1.0 and coverage_of([], 80, 60) == 0.0
    assert coverage_of([np.array([[1.0, 1.0], [79.0, 59.0]])], 80, 60) == pytest.approx(2 / 48)

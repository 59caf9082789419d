"""Laws of images: edges lie where the camera projects them, and light, blur, motion and noise are as they were asked for."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.simulation.images import Photograph, irradiance, render, texture
from robocal.vision.camera import image_of
from robocal.vision.sheets import SQUARE, Checker, Marker, Sheet

SIZE = (320, 240)
PLAIN = np.array([800.0, 810, 160.3, 119.6, 0, 0, 0, 0, 0])
BARREL = np.array([420.0, 425, 158.1, 121.3, -0.25, 0.08, 1e-3, -2e-3, 0.01])
CORNERS = SQUARE * 0.03 + [0.002, -0.001, 0]
SHEET = Sheet("one square", 0.4, 0.4, squares=((0.002, -0.001, 0.06),))
WHITE, BLACK = 200.0, 30.0


def pose(turn=0.0, tilt=(0.0, 0.0), z=0.5):
    """T_camera_sheet: the sheet faces the camera, then is tilted and turned in its plane."""
    facing = se3.compose(np.diag([1.0, -1, -1]), [0, 0, z])
    return facing @ se3.from_vector([0, 0, 0, *tilt, 0]) @ se3.from_vector([0, 0, 0, 0, 0, turn])


def light(at, lens=PLAIN, sheet=SHEET, background=110.0, **how):
    return irradiance([(sheet, at)], lens, SIZE, Photograph(**how), background)


def distances(grey, at, lens, scatter=2e-3):
    """How far (px) each side lies from its projection, (4, rows), along the rows or columns that cross it; each from a sum of grey."""
    out = []
    for i in range(4):
        side = CORNERS[i] + (CORNERS[(i + 1) % 4] - CORNERS[i]) * np.linspace(0, 1, 2001)[:, None]
        curve = image_of(side @ at[:3, :3].T + at[:3, 3], lens)
        steep = abs(curve[-1, 1] - curve[0, 1]) > abs(curve[-1, 0] - curve[0, 0])
        image, curve = (grey, curve) if steep else (grey.T, curve[:, ::-1])
        curve = curve[np.argsort(curve[:, 1])]
        low, high = curve[[0, -1], 1]
        rows, far = np.arange(int(low + 0.3 * (high - low)), int(high - 0.3 * (high - low))), 10
        line = np.interp(rows, curve[:, 1], curve[:, 0])
        shares = []
        for row, true in zip(rows, line, strict=True):
            k = round(float(true))
            white = ((image[row, k - far : k + far + 1] - BLACK) / (WHITE - BLACK)).sum()
            rising = image[row, k + far] > image[row, k - far]
            shares.append((k + far + 0.5 - white if rising else k - far - 0.5 + white) - true)
        out.append(np.mean(shares))
        assert np.abs(shares - np.mean(shares)).max() < scatter
    return np.array(out)


@pytest.mark.parametrize("lens", [PLAIN, BARREL], ids=["plain", "barrel"])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.5, -0.4)], ids=["frontal", "tilted"])
@pytest.mark.parametrize("turn", [0.0, 7e-4, 0.01, 0.3649, np.pi / 4, 0.7859, 0.6])
def test_edges_lie_where_the_camera_projects_them(turn, tilt, lens):
    """Also along the grid of samples, nearly so, and across it in the ratios at which points would alias."""
    at = pose(turn, tilt, 0.5 if lens is PLAIN else 0.3)
    for blur in (0.0, 0.5, 1.5):
        # A blur moves an edge that the lens bends by half its variance times the curvature.
        most = 1e-4 if lens is PLAIN else 1e-4 + 1e-3 * blur**2
        assert np.abs(distances(light(at, lens, blur=blur), at, lens)).max() < most


def test_grey_levels_keep_that_place():
    """Rounded, and with noise, the mean of the edges is right to 0.002 px."""
    at, rng = pose(7e-4), np.random.default_rng(1)
    made = [render([(SHEET, at)], PLAIN, SIZE, Photograph(noise=2.0), rng=rng) for _ in range(40)]
    assert np.abs(distances(np.mean(made, axis=0), at, PLAIN, 0.1)).max() < 0.002


def test_light_is_neither_lost_nor_won():
    """What is missing to white is the area of the square, whatever blurs it."""
    at = pose(0.4, (0.3, 0.2))
    u, v = image_of(CORNERS @ at[:3, :3].T + at[:3, 3], PLAIN).T
    area = 0.5 * abs(u @ np.roll(v, 1) - v @ np.roll(u, 1))
    for how in ({"blur": 0.0}, {"blur": 2.0}, {"blur": 0.8, "motion": (3.0, -1.0)}, {"samples": 11}):
        grey = light(at, background=WHITE, **how)
        assert ((WHITE - grey) / (WHITE - BLACK)).sum() == pytest.approx(area, rel=2e-6)


@pytest.mark.parametrize("growth", [0.2, -0.3])
def test_white_grows_by_pixels(growth):
    """Each side moves inwards by so much, across itself."""
    turn = 0.3
    at = pose(turn)
    square = np.array([800.0, 800, 160, 120, 0, 0, 0, 0, 0])
    found = distances(light(at, square, growth=growth), at, square) * np.cos(turn)
    inwards = found * np.array([1, -1, -1, 1])  # top: down the image; right: left
    assert np.allclose(inwards, growth, atol=1e-4)


def test_blur_and_motion_are_second_moments():
    """The profile of an edge has the variance of blur, pixel and motion."""
    at = pose()
    for blur, move in ((0.5, 0.0), (1.5, 0.0), (0.8, 3.0), (0.8, -5.0)):
        density = np.abs(
            np.diff(light(at, blur=blur, motion=(move, 0.0))[120, 90:165])
        )  # which adds a pixel of its own
        k = np.arange(len(density))
        mean = density @ k / density.sum()
        variance = density @ (k - mean) ** 2 / density.sum()
        assert variance == pytest.approx(blur**2 + 2 / 12 + move**2 / 12, abs=0.005)


def test_light_fades_to_the_corners_and_saturates():
    flat = light(pose(z=-0.5), background=100.0, vignette=0.4, blur=0.0)
    assert flat[0, 0] == pytest.approx(60.0) and flat[119:121, 159:161].mean() == pytest.approx(100.0, abs=0.01)
    blank = Sheet("blank", 1.0, 1.0)
    bright = render([(blank, pose())], PLAIN, SIZE, Photograph(exposure=1.4))
    assert (bright == 255).all()
    for gamma in (0.45, 2.2):
        image = render([(blank, pose())], PLAIN, SIZE, Photograph(white=120.0, gamma=gamma))
        assert (image == round(255 * (120 / 255) ** gamma)).all()


def test_noise_is_as_large_as_said_and_follows_its_seed():
    blank, how = Sheet("blank", 1.0, 1.0), Photograph(white=120.0, noise=5.0)
    first, again, other = (
        render([(blank, pose())], PLAIN, SIZE, how, rng=np.random.default_rng(seed)) for seed in (3, 3, 4)
    )
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    assert first.std() == pytest.approx(np.sqrt(25 + 1 / 12), rel=0.01)
    assert first.mean() == pytest.approx(120.0, abs=0.1)
    with pytest.raises(ModelError, match="generator"):
        render([(blank, pose())], PLAIN, SIZE, how)
    assert np.array_equal(texture(SIZE, 5), texture(SIZE, 5)) and texture(SIZE, 5).std() > 20


def test_the_nearer_hides_and_a_back_is_white():
    near, far = Sheet("near", 0.02, 0.02, squares=((0.0, 0.0, 0.02),)), Sheet("far", 0.3, 0.3)
    for order in (1, -1):
        grey = irradiance([(near, pose(z=0.4)), (far, pose(z=0.5))][::order], PLAIN, SIZE, Photograph())
        assert grey[120, 160] == pytest.approx(BLACK) and grey[120, 100] == pytest.approx(WHITE)
    behind = pose() @ se3.from_vector([0, 0, 0, np.pi, 0, 0])
    assert light(behind)[120, 160] == pytest.approx(WHITE)
    disc = light(pose(), discs=((200.0, 100.0, 9.0, 77.0),))
    assert disc[100, 200] == pytest.approx(77.0) and disc[100, 214] != pytest.approx(77.0)
    assert light(pose(z=-0.5))[120, 160] == pytest.approx(110.0)


@pytest.mark.parametrize("focal", [180.0, 60.0, 25.0])
def test_every_cell_is_where_a_plain_look_at_points_has_it(focal):
    """Large, and down to cells of a quarter of a pixel: a marker over a checkerboard, beside 24 x 24 points a pixel, looked up one by one with formulas of this test."""
    rng = np.random.default_rng(2)
    marker = Marker("own", 0, rng.integers(0, 2, (8, 8)).astype(float), 0.004, 0.003, 0.02)
    board = Checker(7, 5, 0.008, 0.001, -0.002)
    sheet, at, fine = Sheet("both", 0.07, 0.06, (marker,), (board,)), pose(0.3, (0.4, 0.5), 0.25), 24
    lens = np.array([focal, 1.03 * focal, 24.3, 19.8, 0, 0, 0, 0, 0])
    grey = irradiance([(sheet, at)], lens, (50, 40), Photograph(blur=0.0, samples=16))
    v, u = (np.indices((40 * fine, 50 * fine)) + 0.5) / fine - 0.5
    rays = np.stack([(u - lens[2]) / lens[0], (v - lens[3]) / lens[1], np.ones_like(u)], axis=-1)
    normal = at[:3, 2]
    points = rays * (normal @ at[:3, 3] / (rays @ normal))[..., None]
    x, y = np.moveaxis((points - at[:3, 3]) @ at[:3, :2], -1, 0)
    value = np.full(x.shape, WHITE)
    column, row = np.floor((x - 0.001) / 0.008 + 3.5), np.floor(2.5 - (y + 0.002) / 0.008)
    on = (column >= 0) & (column < 7) & (row >= 0) & (row < 5)
    value[on & ((column + row) % 2 == 0)] = BLACK
    column, row = np.floor((x - 0.004) / 0.0025 + 4).astype(int), np.floor(4 - (y - 0.003) / 0.0025).astype(int)
    on = (column >= 0) & (column < 8) & (row >= 0) & (row < 8)
    value[on] = np.where(marker.cells[row[on], column[on]] > 0, WHITE, BLACK)
    value[(np.abs(x) > 0.035) | (np.abs(y) > 0.03)] = 110.0
    plain = value.reshape(40, fine, 50, fine).mean(axis=(1, 3))
    left = np.abs(grey - plain)
    assert left.max() < 2.0 and left.mean() < 0.1 and plain.std() > 5


def test_beyond_the_fold_of_a_lens_there_is_nothing():
    lens = np.array([150.0, 150, 160, 120, -0.4, 0, 0, 0, 0])
    grey = light(pose(), lens, Sheet("blank", 30.0, 30.0), blur=0.0)
    reach = 150 * 2 / 3 / np.sqrt(3 * 0.4)  # where the distorted radius is greatest
    u, v = np.arange(320) - 160.0, np.arange(240)[:, None] - 120.0
    r = np.hypot(u, v)
    assert (grey[r < reach - 2] == WHITE).all() and (grey[r > reach + 2] == 110.0).all()


@pytest.mark.parametrize("how", [{"samples": 4}, {"blur": -1.0}, {"noise": -2.0}])
def test_what_cannot_be_is_refused(how):
    with pytest.raises(ModelError):
        render([(SHEET, pose())], PLAIN, SIZE, Photograph(**how))

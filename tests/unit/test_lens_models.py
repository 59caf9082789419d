"""Models of lenses: OpenCV's pixels, derivatives by differences, directions and back, and where a lens folds back."""

from __future__ import annotations

import numpy as np
import pytest
from laws import check_jacobian

from robocal.errors import ModelError
from robocal.vision._kernels import distort, first_direction, ideal_pixels
from robocal.vision.camera import MODELS, fold_mask, fold_radius, image_of, model_of, project, unproject

BROWN = np.array([900.0, 880.0, 320.0, 245.0, -0.2, 0.05, 0.004, -0.003, 0.02])
LENSES = {
    "brown": BROWN,
    "rational": np.array([*BROWN, 0.1, -0.05, 0.03]),
    "fisheye": np.array([400.0, 390.0, 320.0, 240.0, -0.02, 0.01, -0.003, 0.001]),
}
SIZES = np.array([1e3] * 4 + [1.0] * 8)  # of numbers


def points(m=40, reach=0.7):
    rng = np.random.default_rng(5)
    return np.column_stack([rng.uniform(-reach, reach, (m, 2)), rng.uniform(0.7, 2.0, m)])


def opencv(model, p, lens):
    cv2 = pytest.importorskip("cv2")
    k, zero = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]]), np.zeros(3)
    if model == "fisheye":
        return cv2.fisheye.projectPoints(p[:, None], zero, zero, k, lens[4:])[0][:, 0]
    return cv2.projectPoints(p, zero, zero, k, lens[4:])[0][:, 0]


@pytest.mark.parametrize("model", LENSES)
def test_pixels_are_opencvs(model):
    p, lens = points(500), LENSES[model]
    assert model_of(lens).name == model
    np.testing.assert_allclose(project(p, lens)[0], opencv(model, p, lens), atol=1e-9)
    np.testing.assert_array_equal(image_of(p, lens), project(p, lens)[0])


@pytest.mark.parametrize("model", LENSES)
def test_derivatives(model):
    lens = LENSES[model]
    size = SIZES[: len(lens)]
    near = np.array([[1e-3, -2e-3, 1.0], [0.02, 0.0, 1.5]])  # beside the axis a fisheye has series of its own
    for p in [*points(6), *near]:
        check_jacobian(lambda x: project(x, lens)[0], lambda x: project(x, lens)[1], p)
        check_jacobian(
            lambda z, p=p: project(p, z * size)[0], lambda z, p=p: project(p, z * size)[2] * size, lens / size
        )


def test_a_fisheye_on_the_axis_and_behind():
    """On the axis it is a pinhole; at a right angle and behind, the angle still counts."""
    lens, axis = LENSES["fisheye"], np.array([0.0, 0.0, 2.0])
    uv, jp, _ = project(axis, lens)
    np.testing.assert_allclose(uv, lens[2:4])
    np.testing.assert_allclose(jp, [[200, 0, 0], [0, 195, 0]])
    plain = np.append(lens[:4], np.zeros(4))
    at = project(np.array([[1.0, 0, 0], [1.0, 0, -1.0]]), plain)[0]
    np.testing.assert_allclose(at[:, 0], plain[2] + plain[0] * np.pi * np.array([0.5, 0.75]))
    for p in np.array([[0.3, 0.1, 0.0], [0.3, 0.1, -0.2]]):
        check_jacobian(lambda x: project(x, lens)[0], lambda x: project(x, lens)[1], p)


@pytest.mark.parametrize("model", LENSES)
def test_directions_come_back(model):
    p, lens = points(2000, 1.2), LENSES[model]
    p = p[~fold_mask(p, lens)]
    assert len(p) > 1000
    ray = unproject(image_of(p, lens), lens)
    np.testing.assert_allclose(ray, p / np.linalg.norm(p, axis=1, keepdims=True), atol=1e-12)
    assert unproject(image_of(p[3], lens), lens).shape == (3,)


def test_a_wide_fisheye_comes_back():
    p = np.random.default_rng(2).normal(size=(500, 3))
    lens = LENSES["fisheye"]
    p = p[~fold_mask(p, lens)]
    assert (p[:, 2] < 0).sum() > 100
    np.testing.assert_allclose(
        unproject(image_of(p, lens), lens), p / np.linalg.norm(p, axis=1, keepdims=True), atol=1e-10
    )


FOLDS = {
    "barrel": np.array([800.0, 800, 320, 240, -0.3, 0, 0, 0, 0]),
    "moustache": np.array([800.0, 800, 320, 240, -0.2, 0.1, 0, 0, -0.02]),
    "pole": np.array([800.0, 800, 320, 240, 0, 0, 0, 0, 0, -0.5, 0, 0]),
    "quotient": np.array([800.0, 800, 320, 240, -0.1, 0, 0, 0, 0, 0.2, 0.1, 0]),
    "fish": np.array([400.0, 400, 320, 240, -0.1, 0, 0, 0]),
}


@pytest.mark.parametrize("name", FOLDS)
def test_where_a_lens_folds_back(name):
    """Before that radius pixels move outward with the direction and come back; behind it no direction is told."""
    lens = FOLDS[name]
    fold = fold_radius(lens)
    r = np.linspace(0, 1, 4001)[1:] * fold

    def at(r):
        flat = np.column_stack([r, 0 * r, 1 + 0 * r])
        return np.column_stack([np.sin(r), 0 * r, np.cos(r)]) if name == "fish" else flat

    u = image_of(at(r[:-1]), lens)[:, 0]
    assert (np.diff(u) > 0).all() and 0 < fold < 4
    if name != "pole":
        assert image_of(at(np.array([1.001 * fold])), lens)[0, 0] < image_of(at(np.array([fold])), lens)[0, 0]
        most = image_of(at(np.array([fold])), lens)[0]
        assert np.isnan(unproject(most + [1.0, 0.0], lens)).all()
        farthest = unproject(most + [1.0, 0.0], lens, nearest=True)
        np.testing.assert_allclose(farthest, at(np.array([fold]))[0] / np.linalg.norm(at(np.array([fold]))), atol=1e-5)
        inside = unproject(most - [1.0, 0.0], lens)
        assert np.isfinite(inside).all() and not fold_mask(inside, lens)
    assert list(fold_mask(at(np.array([0.999, 1.001]) * fold), lens)) == [False, True]


def test_lenses_that_never_fold():
    assert fold_radius(np.array([800.0, 800, 320, 240, 0, 0, 0, 0, 0])) == np.inf
    assert fold_radius(np.array([800.0, 800, 320, 240, 0.3, 0, 0, 0, 0])) == np.inf
    assert fold_radius(np.array([400.0, 400, 320, 240, 0, 0, 0, 0])) == np.pi
    assert fold_mask(np.array([0.0, 0.1, -1.0]), BROWN)
    assert fold_radius(np.array([800.0, 800, 320, 240, 1e200, 1e200, 0, 0, 1e200, 1e200, 1e200, 1e200])) == 0.0


@pytest.mark.parametrize("model", LENSES)
def test_kernels_have_the_same_lens(model):
    """The lens pixel by pixel, as corner fits and drawn images follow it, is that of the array code."""
    lens = LENSES[model]
    for x, y, _ in points(8) / points(8)[:, 2:]:
        u, v, xx, xy, yy = distort(float(x), float(y), lens)
        uv, jp, _ = project(np.array([x, y, 1.0]), lens)
        np.testing.assert_allclose([lens[0] * u + lens[2], lens[1] * v + lens[3]], uv, rtol=1e-12)
        np.testing.assert_allclose(np.array([[xx, xy], [xy, yy]]) * lens[:2, None], jp[:, :2], atol=1e-9)
    assert first_direction(0.0, 0.0, lens) == (0.0, 0.0)
    ideal, slope = np.empty((600, 2)), np.empty((600, 4))
    for corner in ((0.0, 0.0), (300.0, 220.0), (600.0, 10.0)):
        assert ideal_pixels(*corner, 30, lens, ideal, slope)
        ray = np.column_stack([(ideal - lens[2:4]) / lens[:2], np.ones(600)])
        v, u = np.divmod(np.arange(600), 30)
        uv, jp, _ = project(ray, lens)
        np.testing.assert_allclose(uv, np.column_stack([u, v]) + corner, atol=1e-5)
        by = np.linalg.inv(jp[:, :, :2] / lens[:2])
        np.testing.assert_allclose(slope, by.reshape(600, 4), rtol=1e-6, atol=1e-6)


def test_no_lens_has_so_many_numbers():
    assert [len(m.symbols) for m in MODELS.values()] == [9, 12, 8]
    assert all(len(m.symbols) == len(m.expected) == len(m.units) for m in MODELS.values())
    with pytest.raises(ModelError, match="no lens has so many numbers"):
        project(np.ones(3), np.ones(10))

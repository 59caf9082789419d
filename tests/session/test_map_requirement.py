"""What a map and a camera in it will be off by, predicted: against maps that were made, and against what is known of flat and raised markers."""

from __future__ import annotations

import os

import numpy as np
import pytest
from lens_world import LENS, SIZE, turn
from map_first_order import FirstOrder

from robocal._record import replace
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.geometry.fits import rigid
from robocal.session.vision.map_fit import fit_map
from robocal.session.vision.map_requirement import corner_table, predict_map
from robocal.session.vision.place_views import locate_views
from robocal.vision.camera import image_of
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import move_map, rigid_projector, take_markers
from robocal.vision.map_views import lay_out, project_map
from robocal.vision.maps import MarkerMap

KNOWN = {"fx": 3.0, "fy": 3.0, "cx": 4.0, "cy": 4.0, "k1": 0.01, "k2": 0.01, "p1": 5e-4, "p2": 5e-4}
NOISE = 0.2
FULL = bool(os.environ.get("ROBOCAL_FULL"))


def lens():
    return Lens.of("brown", list(LENS.values()), SIZE, tuple(KNOWN), np.diag(np.square(list(KNOWN.values()))))


def cameras(count, seed=0, field=(1.2, 0.8)):
    """T_map_camera (count, 4, 4) of cameras that look down from 0.6 to 1.1 m, turned by up to 25 degrees."""
    rng = np.random.default_rng(seed)
    out = np.tile(np.eye(4), (count, 1, 1))
    for t in out:
        lean = np.radians(25) * np.sqrt(rng.uniform()) * turn(np.array([0, 0, rng.uniform(-3, 3)]))[0]
        t[:3, :3] = turn(lean) @ turn(np.array([0, 0, rng.uniform(-3, 3)])) @ np.diag([1.0, -1.0, -1.0])
        t[:3, 3] = rng.uniform([-field[0] / 3, -field[1] / 3, 0.6], [field[0] / 3, field[1] / 3, 1.1])
    return out


def plan(size=0.06, height=0.0, tilt=0.0):
    return lay_out(5, 4, (1.0, 0.7), size, height, tilt)


@pytest.mark.parametrize(("size", "height"), [(0.06, 0.0), (0.06, 0.15), (0.12, 0.0)], ids=["flat", "raised", "large"])
def test_what_is_predicted_is_what_first_order_theory_says(size, height):
    """By differences of a camera that are written in the tests: errors of map and lens that were found together move a camera together."""
    views, there = cameras(12), plan(size, height)
    told = predict_map(there, views, lens(), NOISE, SIZE)
    theory = first_order(there, views)
    count = 6 * len(there.names)
    np.testing.assert_allclose(np.diag(told.map.covariance), np.diag(theory.covariance)[:count], rtol=1e-3)
    np.testing.assert_allclose(
        told.camera, theory.camera, rtol=2e-3, atol=2e-3 * np.abs(theory.camera).max(axis=(1, 2)).min()
    )


@pytest.mark.slow
@pytest.mark.parametrize(("size", "height"), [(0.06, 0.0), (0.06, 0.15), (0.12, 0.0)], ids=["flat", "raised", "large"])
def test_maps_and_poses_scatter_as_predicted(size, height):
    """Chi-square of the map, and of the camera in it, by the covariances that were predicted, lens drawn anew each time; and errors of the
    camera are those that theory has of the same noise, so that few rigs tell whether the prediction holds.

    With ROBOCAL_FULL=1 of 200 rigs, and errors along x and y, and along z, within 10 % of what is predicted, chance aside: a lens moves
    all cameras together, so that 200 rigs are 200 numbers, and their rms scatters by 5 %. Theory of the same noise says how far these were off.
    """
    views, there = cameras(12), plan(size, height)
    told, theory = predict_map(there, views, lens(), NOISE, SIZE), first_order(there, views)
    count = 200 if FULL else 3
    map_off, camera_off, map_square, camera_square, expected = [], [], [], [], []
    for seed in range(count):
        rng = np.random.default_rng(300 + seed)
        off_by = np.array([rng.normal() * KNOWN.get(s, 0.0) for s in LENS])
        sights = project_map(there, views, np.array(list(LENS.values())), SIZE)
        seen = seen_through(there, views, sights, np.array(list(LENS.values())) + off_by)
        sights = replace(sights, pixels=seen)
        many = np.bincount(sights.marker, minlength=len(there.names))
        table = corner_table(told.map, views, sights, many, NOISE, SIZE)
        first, second = noisy(table, rng), noisy(table, rng)
        found = fit_map(first, lens(), "none")
        off, moved = error_of(found.map, told.map)
        map_off.append(off)
        map_square.append(off.ravel() @ np.linalg.pinv(told.map.covariance, rcond=1e-9, hermitian=True) @ off.ravel())
        held = locate_views(second, moved, found.lens)
        v, w = se3.displacement(held.poses, views[[int(i) - 1 for i in held.ids]])
        camera_off.append(np.concatenate([v, w], axis=1))
        camera_square.append(
            np.einsum("ui,uij,uj->u", camera_off[-1], np.linalg.inv(told.camera), camera_off[-1]).mean()
        )
        noise = [t.pixels.value - table.pixels.value for t in (first, second)]
        expected.append(-theory.errors(-off_by[: len(KNOWN)], *noise))
    share = np.mean(map_square) / (6 * len(told.map.names) - 6), np.mean(camera_square) / 6
    e, p, c, same = told.errors, np.concatenate(map_off), np.concatenate(camera_off), np.concatenate(expected)
    got = [np.sqrt(np.mean(a**2)) for a in (p[:, :2], p[:, 2], c[:, :2], c[:, 2])]
    ratio = np.array(got) / [e.map_xy, e.map_z, e.camera_xy, e.camera_z]
    chance = np.sqrt([np.mean(same[:, :2] ** 2), np.mean(same[:, 2] ** 2)]) / [e.camera_xy, e.camera_z]
    print("chi2 / dof:", np.round(share, 3), "seen over predicted:", ratio.round(3), "of it chance:", chance.round(3))
    assert 0.85 < share[0] < 1.15 and 0.6 < share[1] < 1.5
    assert np.abs(ratio[2:] / chance - 1).max() < 0.05 and np.corrcoef(same.ravel(), c.ravel())[0, 1] > 0.99
    assert not FULL or (np.abs(ratio[:2] - 1).max() < 0.1 and np.abs(chance - 1).max() < 0.15)


def first_order(there, views):
    """Theory of these markers and cameras."""
    numbers = np.array(list(LENS.values()))
    known = [list(LENS).index(s) for s in KNOWN]
    sights = project_map(there, views, numbers, SIZE)
    return FirstOrder(there, views, sights, numbers, known, NOISE).solve(np.diag(np.square(list(KNOWN.values()))))


def seen_through(there, views, sights, numbers):
    """The same corners through another lens."""
    inward = se3.inverse(views)[sights.view]
    points = np.einsum("kij,kcj->kci", inward[:, :3, :3], there.corners[sights.marker]) + inward[:, None, :3, 3]
    return image_of(points, numbers)


def noisy(table, rng):
    obs = table.pixels
    obs = replace(obs, value=obs.value + rng.normal(0, NOISE, obs.value.shape))
    return replace(table, data=replace(table.data, observations=(obs,)))


def error_of(found: MarkerMap, true: MarkerMap):
    """The errors (M, 6) of a map laid on the truth as well as it goes, and the map there."""
    mine = take_markers(true, found.names)
    laid = move_map(found, rigid(found.corners.reshape(-1, 3), mine.corners.reshape(-1, 3)))
    off = np.concatenate(se3.displacement(laid.poses, mine.poses), axis=1).ravel()
    return (rigid_projector(mine) @ off).reshape(-1, 6), laid


def test_what_helps_is_predicted_to_help():
    """Larger markers make a better map; raised ones tell the camera's height; surveyed ones are no worse than their survey."""
    views = cameras(15)
    flat, large = (predict_map(plan(s), views, lens(), NOISE, SIZE).errors for s in (0.06, 0.12))
    raised = predict_map(plan(height=0.15), views, lens(), NOISE, SIZE).errors
    survey = predict_map(plan(), views, lens(), NOISE, SIZE, survey=1e-4).errors
    assert large.map_xy < 0.9 * flat.map_xy and raised.camera_z < 0.7 * flat.camera_z
    assert survey.map_z < 1e-4 < flat.map_z and survey.camera_xy < flat.camera_xy
    twice = predict_map(plan(), views, lens(), 2 * NOISE, SIZE).errors
    assert 1.5 < twice.map_z / flat.map_z < 2.0  # the lens is as well known as before


def test_a_plan_that_makes_no_map_is_refused():
    away = cameras(4)
    away[:, :3, :3] = away[:, :3, :3] @ np.diag([1.0, -1.0, -1.0])  # looks up
    with pytest.raises(ModelError, match="no pose shows a marker"):
        predict_map(plan(), away, lens(), NOISE, SIZE)
    near = cameras(2)
    near[:, :3, 3] = [(-0.5, 0.35, 0.25), (0.5, -0.35, 0.25)]
    with pytest.raises(ModelError, match="no pose joins some markers"):
        predict_map(plan(), near, lens(), NOISE, SIZE)


def test_a_layout_is_where_it_was_asked():
    there = lay_out(4, 3, (1.2, 0.8), 0.1, 0.3, np.radians(20))
    at = there.vector[:, :3]
    assert len(there.names) == 12 and np.ptp(at, axis=0) == pytest.approx([1.2, 0.8, 0.3])
    assert np.isclose(at[:, 2], 0.3).sum() == 6
    assert np.degrees(np.arccos(there.poses[:, 2, 2])) == pytest.approx(20.0)

"""A map as a prior: what it says of targets, wherever the map as a whole is, and which marker contradicts it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_map_world import draw_room, room, views_of_room
from lens_world import LENS

from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import uncertainty
from robocal.geometry import se3
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Rig
from robocal.parameters import FRAME_SYMBOLS
from robocal.session.vision.map_prior import FIXED, chance_of, find_contradictions, prior_targets
from robocal.vision.map_gauge import move_map, project_covariance, take_markers
from robocal.vision.sheets import SQUARE

AWAY = se3.from_vector([0.3, -0.2, 0.5, 0.2, -0.4, 0.9])


def targets_of(known):
    return tuple(
        Frame(n, tuple(v), (True,) * 6, "tool") for n, v in zip(known.names, known.vector.tolist(), strict=True)
    )


def fit(known, prior, rows, poses):
    """Corners with a prior of the markers: the problem, its solution, and the map that was found."""
    ids = {v: i for i, v in enumerate(dict.fromkeys(r[0] for r in rows))}
    number = {n: i for i, n in enumerate(known.names)}
    at = np.array([ids[r[0]] for r in rows])
    which = np.array([number[r[1]] for r in rows])
    point = SQUARE[[r[2] for r in rows]] * known.size[which, None] / 2
    options = {"camera": "lens", "intrinsics": tuple(LENS.values()), "free": (), "together": prior.together}
    value = np.array([r[3:] for r in rows])
    obs = Observations(
        "pixels", at, value, np.full(value.shape, 0.1), None, prior.targets, which, {"point": point}, options, "corners"
    )
    data = DataSet(Configurations(tuple(ids), start=se3.to_vector(se3.inverse(poses))), (obs,))
    made = problem(Rig("lens"), data)
    x = least_squares(made, made.start).x
    names = [f"{n}.{s}" for n in known.names for s in FRAME_SYMBOLS]
    vector = x[0, [made.table.index[n] for n in names]].reshape(-1, 6)
    at = [made.free.index(n) for n in names]
    return made, x, replace(known, vector=vector, covariance=uncertainty(made, x).covariance[np.ix_(at, at)])


def test_a_prior_stands_where_the_targets_start():
    """The map as a whole may be anywhere; its markers to one another are as it says."""
    known = room(2)
    prior = prior_targets([move_map(known, AWAY)], targets_of(known))
    np.testing.assert_allclose([t.value for t in prior.targets], known.vector, atol=1e-9)
    assert all(t.prior is not None and all(t.free) for t in prior.targets)
    (shared,) = prior.together
    c = np.array(shared.covariance)
    np.testing.assert_allclose(project_covariance(known, c), known.covariance, atol=1e-10)
    assert np.sqrt(np.diag(c)[:3].min()) > 0.2  # m, of the whole


def test_markers_without_a_prior_stay_as_they_were():
    known = room(2)
    prior = prior_targets([take_markers(known, known.names[:3])], targets_of(known))
    assert [t.prior is None for t in prior.targets] == [False] * 3 + [True] * 3
    alone = prior_targets([take_markers(known, known.names[:1])], targets_of(known))
    assert alone.targets == targets_of(known) and not alone.together


def test_what_no_prior_is_refused():
    known = room(2)
    with pytest.raises(ModelError, match="without sigma"):
        prior_targets([replace(known, covariance=None)], targets_of(known))
    with pytest.raises(ModelError, match="two maps have one marker") as error:
        prior_targets([known, take_markers(known, ["2", "3"])], targets_of(known))
    assert error.value.key == "2"


def test_a_prior_makes_the_map_better():
    """With few views of one wall each, only the prior joins the walls; the result is nearer to the truth than the prior was."""
    rng, known = np.random.default_rng(1), room(2, sigma=2e-3)
    gain = []
    for _ in range(5):
        true = draw_room(known, rng)
        rows, poses = views_of_room(true, rng, 3, noise=0.1)
        prior = prior_targets([known], targets_of(known), FIXED, align=False)
        found = fit(known, prior, rows, poses)[2]
        away = [np.linalg.norm(m.vector[:, :3] - true.vector[:, :3]) for m in (found, known)]
        gain.append(away[0] / away[1])
        assert np.trace(found.covariance) < np.trace(known.covariance)
    assert np.mean(gain) < 0.95


@pytest.mark.parametrize("whole", ["fixed", "loose"])
def test_the_marker_that_moved_is_named(whole):
    rng, known = np.random.default_rng(3), room(3)
    options = {"whole": FIXED, "align": False} if whole == "fixed" else {}
    true = draw_room(known, rng)
    rows, poses = views_of_room(true, rng, 9)
    prior = prior_targets([known], targets_of(known), **options)
    assert find_contradictions(prior, fit(known, prior, rows, poses)[2]) == ()
    vector = true.vector.copy()
    vector[3, :3] += [0.004, 0.0, 0.003]
    rows, poses = views_of_room(replace(true, vector=vector), rng, 9)
    moved = find_contradictions(prior, fit(known, prior, rows, poses)[2])
    assert moved[0].name == "3" and moved[0].distance == pytest.approx(0.005, abs=0.002) and moved[0].chance < 1e-6
    # Under a noise that is so many times larger it is no contradiction.
    assert chance_of(moved[0], moved[0].chi2) > 0.5


@pytest.mark.slow
def test_markers_that_stand_where_they_stood_are_not_named():
    """Of 60 maps with six markers each, at most one has a name: the chance is one in a thousand a map."""
    rng, known, named = np.random.default_rng(11), room(2), 0
    prior = prior_targets([known], targets_of(known), FIXED, align=False)
    for _ in range(60):
        rows, poses = views_of_room(draw_room(known, rng), rng, 4)
        named += bool(find_contradictions(prior, fit(known, prior, rows, poses)[2]))
    assert named <= 1

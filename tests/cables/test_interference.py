"""First contacts: against geometry done by hand, against the closed form, and against dense sampling."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED
from cables.crossing_cables import crossings
from cables.motions import anchors, beyond, body_overlap, pair_distances, random_motions, sampled, turns
from sizes import size

from robocal.cables.interference import KINDS, box, distances, first_contact, hull
from robocal.errors import ModelError

STILL = np.eye(4)


def body_of(name, b):
    return box((0.3, 0.1, 0.1)) if name == "laval" else hull(b)


# By hand


def test_two_cables_that_cross_at_a_quarter():
    a = np.array([[0.0, -1, 0], [-1, 0, 0]])
    b = np.array([[0.0, 1, 0], [3, 0, 1]])
    v = [[0.0, 0, 4], [0, 0, -4], [0, 0, 0]]
    found = first_contact(a, b, STILL, v, tolerance=1e-9)
    assert [KINDS[k] for k in found.kind] == ["cable-cable", "none", "none"]
    np.testing.assert_allclose(found.fraction, [0.25, 1, 1], atol=1e-8)
    assert found.names(["left", "right"]) == ["left meets right", "", ""]
    np.testing.assert_allclose(crossings(a, b, v)[0][:, 0], [0.25, np.inf, np.inf], atol=1e-12)
    # With thickness the gap 0.25 - lambda, seen along z across cables that lean by lambda, closes earlier.
    thick = first_contact(a, b, STILL, v, diameter=0.02)
    assert 0.25 - 0.04 < thick.fraction[0] < 0.25 - 0.02


def test_a_cable_that_folds_onto_the_platform_as_it_turns():
    """The cable in the middle of the top face lies in that face when cos(angle) = 0.1, its height over its length to the frame."""
    a, b = np.array([[0.0, 0, 1]]), np.array([[0.0, 0, 0.1]])
    for shape in (box((0.1, 0.1, 0.1)), hull(0.1 * np.array(list(itertools.product((-1, 1), repeat=3))))):
        found = first_contact(a, b, STILL, [[0.0, 0, 0]], [[0, np.pi, 0]], body=shape, tolerance=1e-9)
        assert found.names(["c1"]) == ["c1 meets the platform"]
        np.testing.assert_allclose(found.fraction, np.arccos(0.1) / np.pi, atol=1e-6)
    assert first_contact(a, b, STILL, [[0.0, 0, 0]], [[0, np.pi, 0]]).free.all()  # no body, no contact


def test_thickness_and_relief_set_the_angle_at_the_platform():
    a, b = np.array([[0.0, 0, 1]]), np.array([[0.0, 0, 0.0]])
    found = first_contact(
        a, b, STILL, [[0.0, 0, 0]], [[0, np.pi, 0]], body=box((1, 1, 0)), diameter=0.01, relief=0.05, tolerance=1e-9
    )
    np.testing.assert_allclose(found.fraction * np.pi, np.pi / 2 - np.arcsin(0.005 / 0.05), atol=1e-6)


@pytest.mark.parametrize("at_platform", [True, False])
def test_cables_with_a_common_end_are_told_by_their_angle(at_platform):
    """They meet where they are in line, on the same side of the common end; with thickness, at 2 asin(D / 2 c)."""
    ends = np.array([[2.0, 0, 0], [0, 2, 0]])
    v = np.array([[4.0, -1, 0]])
    if at_platform:
        a, b, way = ends, np.zeros((2, 3)), v
    else:  # the same picture seen from the platform
        a, b, way = np.zeros((2, 3)), ends, -v
    found = first_contact(a, b, STILL, way, tolerance=1e-9)
    np.testing.assert_allclose(found.fraction, 2 / 3, atol=1e-5)
    assert found.kind[0] == 1
    thick = first_contact(a, b, STILL, way, diameter=0.01, relief=0.1, tolerance=1e-9)
    x, y = ends - thick.fraction * v
    angle = np.arccos(x @ y / np.linalg.norm(x) / np.linalg.norm(y))
    np.testing.assert_allclose(angle, 2 * np.arcsin(0.01 / 0.2), atol=1e-6)
    assert first_contact(a, b, STILL, -0.2 * way, diameter=0.01).free.all()


def test_a_start_in_contact_is_told_as_such():
    a, b = np.array([[0.0, -1, 0], [-1, 0, 0.004]]), np.array([[0.0, 1, 0], [1, 0, 0.004]])
    found = first_contact(a, b, STILL, [[0, 0, 1.0]], diameter=0.01)
    assert found.fraction[0] == 0 and found.kind[0] == 1 and found.complete[0]
    np.testing.assert_allclose(found.gap, -0.006, atol=1e-12)


# Distances and bodies


def test_distances_of_segments_in_every_position():
    rng = np.random.default_rng(0)
    p, pe, q, qe = rng.uniform(-1, 1, (4, 300, 3))
    qe[:60] = q[:60] + (pe - p)[:60]  # parallel
    q[60:90], qe[60:90] = p[60:90] + 0.3 * (pe - p)[60:90], p[60:90] + 1.7 * (pe - p)[60:90]  # on each other
    pe[90:110] = p[90:110]  # a point
    pe[110:130], qe[110:130] = p[110:130], q[110:130]  # two points
    qe[130:160] = q[130:160] + (pe - p)[130:160] + 1e-9 * rng.normal(size=(30, 3))  # all but parallel
    found = distances(p, pe, q, qe)
    s = np.linspace(0, 1, 401)
    for i in range(300):
        x = p[i] + s[:, None] * (pe - p)[i]
        d = (qe - q)[i]
        dd = d @ d
        t = np.clip((x - q[i]) @ d / dd, 0, 1) if dd else np.zeros(len(s))
        dense = np.linalg.norm(x - q[i] - t[:, None] * d, axis=1).min()
        half_a_step = np.linalg.norm(pe[i] - p[i]) / 800
        assert dense - half_a_step - 1e-12 <= found[i] <= dense + 1e-9
    assert (found[60:90] < 1e-12).all()


def test_bodies_of_every_rank():
    rng = np.random.default_rng(1)
    axes = turns(np.array([0.3, -0.2, 0.5]), np.ones(1))[0]
    for rank in range(4):
        local = rng.uniform(-1, 1, (9, 3)) * (np.arange(3) < rank)
        points = local @ axes.T + [1.0, 2, 3]
        body = hull(points)
        assert np.abs(np.linalg.norm(body.normals, axis=1) - 1).max() < 1e-12
        assert body.height(points).max() < 1e-12
        inside = rng.dirichlet(np.ones(9), 50) @ points
        assert body.height(inside).max() < 1e-12
        assert (body.height(points + 3 * axes[:, 2]) > 0.5).all()
        # Every face is touched: none stands away from the points.
        assert np.abs((points @ body.normals.T - body.offsets).max(axis=0)).max() < 1e-9
    np.testing.assert_allclose(box((1, 2, 3), (1, 1, 1)).height([[1, 1, 1], [3, 1, 1], [0, 3.5, 1]]), [-1, 1, 0.5])


# Against the closed form


@pytest.mark.parametrize("name", PUBLISHED)
def test_pure_translation_by_the_closed_form(name):
    a, b = anchors(name)
    rng = np.random.default_rng(2)
    start, v, _ = random_motions(a, rng, 200)
    ends = start[:, None, :3, 3] + np.einsum("gij,mj->gmi", start[:, :3, :3], b)
    lam, pairs = crossings(a, ends, v)
    first = lam.min(axis=1)
    found = first_contact(a, b, start, v, tolerance=1e-9)
    # Cables of CoGiRo hardly ever cross on a translation, those of IPAnema 1 never; pairs with a common end are left out.
    together = (np.linalg.norm(a[pairs[:, 0]] - a[pairs[:, 1]], axis=1) < 1e-9) | (
        np.linalg.norm(b[pairs[:, 0]] - b[pairs[:, 1]], axis=1) < 1e-9
    )
    assert not np.isfinite(lam[:, together]).any()
    np.testing.assert_array_equal(np.isfinite(first), ~found.free)
    met = ~found.free
    np.testing.assert_allclose(found.fraction[met], first[met], atol=1e-6)
    np.testing.assert_array_equal(found.who[met], pairs[lam[met].argmin(axis=1)])
    assert met.sum() > {"ipanema_1": -1, "cogiro": 2}.get(name, 20)


def test_a_planar_robot_by_the_closed_form():
    """All cables stay in one plane: contacts begin where an end of one cable lies on another."""
    rng = np.random.default_rng(3)
    count = 0
    for _ in range(100):
        a, b = (np.column_stack([rng.uniform(-s, s, (3, 2)), np.zeros(3)]) for s in (2.0, 0.6))
        v = np.column_stack([rng.uniform(-2, 2, (20, 2)), np.zeros(20)])
        lam, _ = crossings(a, b, v)
        found = first_contact(a, b, STILL, v, tolerance=1e-9)
        expected = np.minimum(lam.min(axis=1), 1)
        np.testing.assert_allclose(found.fraction, expected, atol=1e-6)
        count += ((expected > 0) & (expected < 1)).sum()
    assert count > 200


# Against dense sampling


def held_to_dense_sampling(name, motions, seed, steps=5000, diameter=0.0048, turn=np.pi / 3):
    """No contact of a dense sampling is missed, none is invented; returns motions with contacts, and with two or more."""
    a, b = anchors(name)
    rng = np.random.default_rng(seed)
    body = body_of(name, b)
    start, v, w = random_motions(a, rng, motions, turn)
    relief = 10 * diameter
    thick = first_contact(a, b, start, v, w, diameter=diameter, body=body)
    thin = first_contact(a, b, start, v, w)
    assert thick.complete.all() and thin.complete.all()
    pairs = np.stack(np.triu_indices(len(a), 1), axis=1)
    k, l = pairs.T
    apart = (np.linalg.norm(a[k] - a[l], axis=1) > 1e-9) & (np.linalg.norm(b[k] - b[l], axis=1) > 1e-9)
    several = some = 0
    for g in range(motions):
        lam, r, p, ends = sampled(a, b, start[g], v[g], w[g], steps)
        distance, inside, side = pair_distances(a, ends, pairs[apart])
        near = distance < diameter
        folded = body_overlap(a, b, r, p, body.normals, body.offsets, relief, diameter / 2)
        every = np.concatenate([near, folded], axis=1)
        any_ = every.any(axis=1)
        if any_.any():
            assert thick.fraction[g] <= lam[any_.argmax()], (name, g)
            some += 1
            # Contacts that begin: two of them, anywhere on the path, in one pair or in several.
            several += every[0].sum() + (every[1:] & ~every[:-1]).sum() > 1
        crossed = ((side[1:] * side[:-1] < 0) & inside[1:] & inside[:-1]).any(axis=1)
        if crossed.any():
            assert thin.fraction[g] <= lam[1:][crossed.argmax()], (name, g)
        not_invented(thick, g, a, b, start[g], v[g], w[g], body, relief, diameter)
        not_invented(thin, g, a, b, start[g], v[g], w[g], None, relief, 0.0)
    return some, several


def not_invented(found, g, a, b, start, v, w, body, relief, diameter):
    """At the fraction told, the pair told is as near as told."""
    if found.kind[g] == 0:
        return
    at = found.fraction[g]
    r = turns(w, np.array([at])) @ start[:3, :3]
    p = (start[:3, 3] + at * v)[None]
    k, l = found.who[g]
    if found.kind[g] == 2:
        room = diameter / 2 + found.tolerance + 1e-9
        one = slice(k, k + 1)
        assert body_overlap(a[one], b[one], r, p, body.normals, body.offsets, relief, room)[0, 0]
        return
    ends = p[:, None] + np.einsum("nij,mj->nmi", r, b)
    distance, _, _ = pair_distances(a, ends, np.array([[k, l]]))
    assert distance[0, 0] <= diameter + found.tolerance + 1e-9


@pytest.mark.slow
def test_no_contact_of_a_dense_sampling_is_missed():
    totals = np.sum([held_to_dense_sampling(name, 40, 4, steps=1000) for name in PUBLISHED], axis=0)
    assert totals[0] > 100 and totals[1] > 50


def random_robot(rng, m=4):
    """Anchors anywhere, so that cables cross each other and the platform often."""
    return rng.uniform(-2, 2, (m, 3)), rng.uniform(-0.7, 0.7, (m, 3))


@pytest.mark.slow
def test_no_contact_of_wild_motions_is_missed():
    """Random robots that turn by as much as a whole turn and more: the rotation's bounds are what is tried here."""
    rng = np.random.default_rng(6)
    pairs = np.stack(np.triu_indices(4, 1), axis=1)
    met = np.zeros(3, int)
    for _ in range(60):
        a, b = random_robot(rng)
        body = hull(b)
        start, v, w = random_motions(a, rng, 5, turn=4.0)
        thin = first_contact(a, b, start, v, w)
        thick = first_contact(a, b, start, v, w, diameter=0.02, body=body, relief=0.1)
        assert thin.complete.all() and thick.complete.all()
        for g in range(5):
            lam, r, p, ends = sampled(a, b, start[g], v[g], w[g], 2000)
            distance, inside, side = pair_distances(a, ends, pairs)
            folded = body_overlap(a, b, r, p, body.normals, body.offsets, 0.1, 0.01)
            touch = (distance < 0.02).any(axis=1) | folded.any(axis=1)
            if touch.any():
                assert thick.fraction[g] <= lam[touch.argmax()]
            crossed = ((side[1:] * side[:-1] < 0) & inside[1:] & inside[:-1]).any(axis=1)
            if crossed.any():
                assert thin.fraction[g] <= lam[1:][crossed.argmax()]
            not_invented(thick, g, a, b, start[g], v[g], w[g], body, 0.1, 0.02)
            not_invented(thin, g, a, b, start[g], v[g], w[g], None, 0.1, 0.0)
            met += np.bincount(thick.kind[[g]], minlength=3) * (thick.fraction[g] > 0)
    assert (met[1:] > 30).all()


@pytest.mark.parametrize("at_platform", [True, False])
def test_no_contact_of_cables_with_a_common_end_is_missed(at_platform):
    """What lies beyond the relief of the common end, held to the distance of those two pieces."""
    rng = np.random.default_rng(7)
    relief, diameter = 0.1, 0.03
    met = 0
    for _ in range(150):
        a, b = random_robot(rng, 2)
        shared = b if at_platform else a
        shared[1] = shared[0]
        start, v, w = random_motions(a, rng, 1, turn=1.0)
        # Aim: about half way both cables are nearly in line, on one side of their common end.
        r = turns(w[0], np.array([0.5]))[0] @ start[0, :3, :3]
        if at_platform:
            v[0] = 2 * (a[0] + 0.4 * (a[0] - a[1]) - r @ b[0] - start[0, :3, 3])
        else:
            line = r @ (b[1] - b[0])
            v[0] = 2 * (a[0] + line - r @ b[0] - start[0, :3, 3])
        v += rng.normal(0, 0.05, 3)
        found = first_contact(a, b, start, v, w, diameter=diameter, relief=relief)
        assert found.complete.all()
        lam, _, _, ends = sampled(a, b, start[0], v[0], w[0], 2000)
        near, far = (ends, np.broadcast_to(a, ends.shape)) if at_platform else (np.broadcast_to(a, ends.shape), ends)
        way = far - near
        length = np.linalg.norm(way, axis=-1, keepdims=True)
        cut = near + np.minimum(relief, length) * way / length
        gap = beyond(cut, far)
        touch = gap < diameter
        if touch.any():
            met += found.fraction[0] > 0
            assert found.fraction[0] <= lam[touch.argmax()]
        if not found.free[0]:
            assert np.interp(found.fraction[0], lam, gap) < diameter + 1e-3
    assert met > 50


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_no_contact_of_2000_motions_sampled_5000_times_is_missed(name):
    times = size(5, 1)  # of 400 motions
    some, several = held_to_dense_sampling(name, 400, times)
    if name != "ipanema_1":  # whose cables cannot meet over such motions but at their common ends
        assert some > 20 * times and several > 10 * times


# What is refused


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": np.zeros((2, 2))}, "frame anchors"),
        ({"b": np.zeros((3, 3))}, "one of each per cable"),
        ({"a": np.zeros((2, 3)), "b": np.zeros((2, 3))}, "cables 1 and 2 run between the same two points"),
        ({"diameter": -0.1}, "cable diameter"),
        ({"diameter": [0.1, 0.1, 0.1]}, "cable diameter"),
        ({"relief": 0.0}, "relief"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"start": np.eye(3)}, "start pose"),
        ({"translation": [[0, 0]]}, "translation and rotation"),
        ({"translation": [[0, 0, np.nan]]}, "a number that is none"),
        ({"body": box((0.1, 0.1, 0.1))}, "platform anchor 2 lies 900 mm outside"),
    ],
)
def test_bad_input(change, message):
    given = {"a": np.array([[0.0, -1, 0], [-1, 0, 0]]), "b": np.array([[0.0, 0, 0], [1, 0, 0]]), "start": STILL}
    given = given | {"translation": [[0.0, 0, 1]]} | change
    with pytest.raises(ModelError, match=message):
        first_contact(**given)


@pytest.mark.parametrize("sizes", [(1, 2), (-1, 1, 1), (np.nan, 1, 1)])
def test_bad_bodies(sizes):
    with pytest.raises(ModelError, match="half sizes"):
        box(sizes)
    with pytest.raises(ModelError, match="points of the platform"):
        hull([sizes, sizes] if len(sizes) == 2 else [[np.inf, 0, 0]])

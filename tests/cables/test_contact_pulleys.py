"""First contacts of cables that run over pulleys: by hand, in the limit of no wheel, and against a dense sampling with tangents of its
own."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from cables.motions import anchors, body_overlap, pose, random_motions, sampled
from sizes import size

from robocal.cables.interference import KINDS, box, distances, first_contact
from robocal.cables.pulley import Pulleys, leaving, taut
from robocal.errors import ModelError

UP = np.array([0.0, 0, 1])


def tangents(a, ends, axis, r):
    """Where cables (n, m) leave their wheels: from each end the tangent at the angle arccos(r / |e|) from the centre's ray, on the side to
    which the cable enters; by trigonometry, without the package."""
    d = ends - a
    h = (d * axis).sum(-1)
    side = d - h[..., None] * axis
    s = np.linalg.norm(side, axis=-1)
    side = side / s[..., None]
    across, along = s - r, h  # from the wheel's centre to the end
    ray, half = np.arctan2(along, across), np.arccos(r / np.hypot(across, along))
    # Wound from the entry (angle pi) clockwise, the taut side is the one further round.
    turn = ray + half
    return a + (r + r * np.cos(turn))[..., None] * side + (r * np.sin(turn))[..., None] * axis


def wheels(a, r, rng):
    """Pulleys whose axes are a quarter of a turn about from the vertical, some of them eyelets."""
    axis = np.array([0.0, 0, -1]) + rng.normal(0, 0.1, a.shape)
    radius = np.where(rng.random(len(a)) < 0.2, 0.0, r)
    return Pulleys(radius, axis / np.linalg.norm(axis, axis=1, keepdims=True))


def test_the_sampling_has_the_tangents_of_the_model(rng):
    a, b = anchors("ipanema_3")
    pulleys = wheels(a, 0.1, rng)
    ends = a.mean(0) + rng.normal(0, 1.0, (50, len(a), 3))
    found = a + leaving(ends - a, pulleys)
    np.testing.assert_allclose(found, tangents(a, ends, pulleys.axis, pulleys.radius), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(ends - found, axis=-1), taut(ends - a, pulleys)[0], atol=1e-12)


def test_by_hand():
    """An end at the height of the wheel's radius keeps the cable level and on the ray from the swivel axis; the other cable, straight, has
    that height at (r + 1) / 2 of its way. Both are linear in lambda."""
    r, long, q, before, foot, head = 0.3, 4.0, 1.5, -1.0, 0.2, 0.1
    a = np.array([[0.0, 0, 0], [q, foot, -1]])
    b = np.array([[long, before, r], [q, head, 1]])
    t = (r + 1) / 2
    share = (foot + t * (head - foot) - q * before / long) / (q / long - t)
    v = [[0.0, np.sign(share) * 4.0, 0]]
    found = first_contact(a, b, np.eye(4), v, pulleys=Pulleys(np.array([r, 0.0]), np.tile(UP, (2, 1))), tolerance=1e-9)
    assert KINDS[found.kind[0]] == "cable-cable"
    assert found.fraction[0] * v[0][1] == pytest.approx(share, abs=1e-7)
    # Without the wheel the first cable rises from the anchor, and they meet elsewhere.
    low = (r * q / long + 1) / 2
    straight = (foot + low * (head - foot) - q * before / long) / (q / long - low)
    plain = first_contact(a, b, np.eye(4), v, tolerance=1e-9)
    assert plain.fraction[0] * v[0][1] == pytest.approx(straight, abs=1e-7) and abs(straight - share) > 0.05


@pytest.mark.parametrize("name", ["cogiro", "ipanema_3"])
def test_no_wheel_is_the_straight_cable(name, rng):
    a, b = anchors(name)
    start, v, w = random_motions(a, rng, 40)
    plain = first_contact(a, b, start, v, w, diameter=0.005, body=box((2.0, 2.0, 2.0)))
    for radius, near in ((0.0, 0.0), (1e-9, 1e-6)):
        over = Pulleys(np.full(len(a), radius), np.tile(-UP, (len(a), 1)))
        found = first_contact(a, b, start, v, w, diameter=0.005, pulleys=over, body=box((2.0, 2.0, 2.0)))
        np.testing.assert_allclose(found.fraction, plain.fraction, atol=near)
        np.testing.assert_array_equal(found.kind, plain.kind)


@pytest.mark.parametrize("name", ["cogiro", "ipanema_3", "laval"])
def test_no_contact_is_missed_and_none_is_early(name, rng):
    """Against 4000 places of each motion; where the answer ends, the pair that it names is as near as it says."""
    a, b = anchors(name)
    thick, count, steps = 0.005, size(120, 12), 4000
    pulleys = wheels(a, 0.08, rng)
    start, v, w = random_motions(a, rng, count)
    start = np.array(start)
    found = first_contact(a, b, start, v, w, diameter=thick, pulleys=pulleys, tolerance=1e-7)
    assert found.complete.all()
    straight = first_contact(a, b, start, v, w, diameter=thick, tolerance=1e-7)
    assert (np.abs(found.fraction - straight.fraction) > 1e-3).any()  # the wheels matter
    pairs = [
        (k, l)
        for k, l in combinations(range(len(a)), 2)
        if min(np.linalg.norm(a[k] - a[l]), np.linalg.norm(b[k] - b[l])) > 1e-9
    ]
    for i in range(count):
        lam, _, _, ends = sampled(a, b, start[i], v[i], w[i], steps)
        near = tangents(a, ends, pulleys.axis, pulleys.radius)
        gap = np.min([distances(near[:, k], ends[:, k], near[:, l], ends[:, l]) for k, l in pairs], axis=0) - thick
        touched = np.flatnonzero(gap <= 0)
        if len(touched):  # never late
            assert found.fraction[i] <= lam[touched[0]] + 1e-9, (i, found.fraction[i], lam[touched[0]])
        if found.kind[i] == KINDS.index("cable-cable"):
            k, l = found.who[i]
            if (k, l) not in pairs:
                continue
            f = found.fraction[i]
            at = sampled(a, b, start[i], f * v[i], f * w[i], 1)[3][1:]
            there = tangents(a, at, pulleys.axis, pulleys.radius)
            left = distances(there[:, k], at[:, k], there[:, l], at[:, l])[0] - thick
            assert left == pytest.approx(found.gap[i], abs=1e-7) and left <= 1e-7 + 1e-9
        elif found.free[i]:
            assert gap.min() > 0


def test_a_cable_over_a_wheel_meets_its_platform(rng):
    """Against half-spaces clipped at 4000 places; a cable that leaves a wheel lies elsewhere than one from the anchor."""
    a, b = anchors("ipanema_3")
    body, thick = box(1.02 * np.ptp(b, axis=0) + 0.02, b.min(0) / 2 + b.max(0) / 2), 0.005
    pulleys = wheels(a, 0.15, rng)
    start, v, w = random_motions(a, rng, 30, turn=2.5)
    found = first_contact(a, b, start, v, w, diameter=thick, pulleys=pulleys, body=body, relief=0.1)
    met = np.flatnonzero(found.kind == KINDS.index("cable-platform"))
    assert len(met) > 5
    for i in met:
        lam, r, p, ends = sampled(a, b, start[i], v[i], w[i], 4000)
        near = tangents(a, ends, pulleys.axis, pulleys.radius)
        inside = np.array([
            body_overlap(near[j], b, r[j : j + 1], p[j : j + 1], body.normals, body.offsets, 0.1, thick / 2)[0] for j in range(0, 4001, 10)
        ])  # fmt: skip
        touched = inside[:, found.who[i, 0]].argmax() * 10
        assert inside[:, found.who[i, 0]].any() and 0 <= lam[touched] - found.fraction[i] + 1e-9 <= 10 / 4000 + 1e-6


def test_an_anchor_ends_at_its_own_wheel():
    """Level with the entry the wheel reaches to twice its radius."""
    a, b = np.array([[0.0, 0, 0]]), np.array([[1.0, 0, 0]])
    over = Pulleys(np.array([0.1]), UP[None])
    found = first_contact(a, b, np.eye(4), [[-1.0, 0, 0]], pulleys=over)
    assert found.names(["c1"]) == ["c1 meets its pulley"] and found.fraction[0] == pytest.approx(0.8, abs=1e-5)
    inside = first_contact(a, b, pose([-0.9, 0, 0]), [[-1.0, 0, 0]], pulleys=over)
    assert inside.fraction[0] == 0 and not inside.free[0] and inside.gap[0] < 0


def test_two_cables_over_wheels_at_one_anchor(rng):
    """From `relief` on they are two cables like any others."""
    a = np.array([[0.0, 0, 3], [0.0, 0, 3]])
    b = np.array([[0.4, -0.3, 0], [0.4, 0.3, 0]])
    over = Pulleys(np.full(2, 0.05), np.tile(-UP, (2, 1)))
    turned = first_contact(
        a, b, pose([1.0, 0, 0]), [[0, 0, 0]], [[np.pi, 0, 0]], diameter=0.01, pulleys=over, relief=0.1
    )
    assert turned.names(["c1", "c2"]) == ["c1 meets c2"] and 0.3 < turned.fraction[0] < 0.5
    assert first_contact(a, b, pose([1.0, 0, 0]), [[0, 0, 0.5]], diameter=0.01, pulleys=over, relief=0.1).free.all()


def test_wheels_that_do_not_fit():
    with pytest.raises(ModelError, match="pulleys"):
        first_contact(
            np.zeros((2, 3)) + [[0], [1]],
            np.ones((2, 3)),
            np.eye(4),
            [[1.0, 0, 0]],
            pulleys=Pulleys(np.zeros(1), UP[None]),
        )


def test_a_cable_that_winds_past_half_a_turn_is_followed():
    """An end that comes nearer to the swivel axis than the wheel is wide, behind it: the cable goes on winding, and nothing is met."""
    a = np.array([[0.0, 0, 3], [2, 2, 3]])
    b = np.array([[0.0, 0, 0], [0.1, 0.1, 0]])
    over = Pulleys(np.full(2, 0.05), np.tile(UP, (2, 1)))
    starts = np.array([pose([-1.0, y, 1.0]) for y in (0.05, 0.01, 1e-3)])
    found = first_contact(a, b, starts, np.tile([2.0, 0, 0], (3, 1)), diameter=0.005, pulleys=over)
    assert found.free.all() and (found.fraction == 1.0).all()


def test_where_a_pulley_turns_over_at_once_nothing_is_said_to_meet():
    a = np.array([[0.0, 0, 3], [2, 2, 3]])
    b = np.array([[0.0, 0, 0], [0.1, 0.1, 0]])
    over = Pulleys(np.full(2, 0.05), np.tile(UP, (2, 1)))
    found = first_contact(a, b, pose([-1.0, 0, 1]), [[2.0, 0, 0]], diameter=0.005, pulleys=over)
    assert not found.complete[0] and found.fraction[0] == pytest.approx(0.5, abs=1e-6)
    assert found.names(["c1", "c2"]) == ["c1 may meet c2"]

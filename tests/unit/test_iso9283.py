"""The figures of ISO 9283 against loops that follow the standard's text, and against what was put in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocal.apply.validate import Visits, visits
from robocal.arms import catalog
from robocal.geometry import se3, so3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

FRAME = (0.9, -0.6, 0.4, 0.02, -0.03, 2.1)
NAMES = ("x", "y", "z", "rx", "ry", "rz")


def cycles(rng, *, places=5, n=30, scatter=2e-5, kind="pose", directions=None, frame=FRAME):
    """A data set of n cycles over a few places by a robot whose error is known, and the truth behind it."""
    nominal = catalog.get("irb-120")
    real = nominal.with_values(
        {"j2.theta": nominal.table["j2.theta"].value + 1e-3, "j3.d": nominal.table["j3.d"].value}
    )
    at = rng.uniform(-1.0, 1.0, (places, 6))
    q = np.tile(at, (n, 1))
    width = 6 if kind == "pose" else 3
    obs = Observations(
        kind, np.arange(len(q)), np.zeros((len(q), width)), np.full((len(q), width), scatter), Frame("tracker", frame)
    )
    columns = {} if directions is None else {"direction": np.repeat(np.arange(n) % directions, places).astype(float)}
    data = synthesise(real, DataSet(Configurations(tuple(map(str, range(len(q)))), q, columns), (obs,)), rng)
    values = {p.name: p.value for p in nominal.table.rows} | {
        f"tracker.{s}": v for s, v in zip(NAMES, frame, strict=True)
    }
    return nominal, real, at, data, values


def test_figures_are_those_of_the_standard(rng):
    nominal, _, at, data, values = cycles(rng)
    found = visits(nominal, data, values)
    assert found is not None and list(found.count) == [30] * 5
    got = found.pose_figures()
    to_base = np.linalg.inv(se3.from_vector(np.array(FRAME)))
    for i in range(5):
        rows = np.arange(i, 150, 5)
        measured = to_base @ se3.from_vector(data.observations[0].value[rows])
        command = nominal.pose(at[i])[0]
        p = measured[:, :3, 3]
        m = p.mean(axis=0)
        length = [np.linalg.norm(x - m) for x in p]
        s = np.sqrt(sum((v - np.mean(length)) ** 2 for v in length) / 29)
        assert got.ap[i] == pytest.approx(np.linalg.norm(m - command[:3, 3]), rel=1e-9)
        np.testing.assert_allclose(got.ap_xyz[i], m - command[:3, 3], rtol=1e-9)
        assert got.rp[i] == pytest.approx(np.mean(length) + 3 * s, rel=1e-9)
        angles = np.array([so3.log(r @ command[:3, :3].T) for r in measured[:, :3, :3]])
        np.testing.assert_allclose(got.ap_abc[i], angles.mean(axis=0), atol=2e-8)
        np.testing.assert_allclose(got.rp_abc[i], 3 * angles.std(axis=0, ddof=1), rtol=1e-4)


def test_the_size_of_the_scatter_comes_out(rng):
    """RP of normal scatter s per axis: l is s times a chi variable with three degrees of freedom."""
    nominal, _, _, data, values = cycles(rng, places=100, n=200, scatter=3e-5)
    got = visits(nominal, data, values).pose_figures()
    mean, deviation = np.sqrt(8 / np.pi), np.sqrt(3 - 8 / np.pi)
    # The standard error of this mean is 0.3 % (six other seeds: 3.588 to 3.622 for 3.616).
    assert got.rp.mean() == pytest.approx(3e-5 * (mean + 3 * deviation), rel=0.0125)
    assert got.rp_abc.mean() == pytest.approx(9e-5, rel=0.01)
    assert got.ap.max() < 1e-3 and got.ap.mean() > 1e-4


def test_calibration_changes_accuracy_and_never_repeatability(rng):
    nominal, real, _, data, values = cycles(rng)
    true = values | {p.name: p.value for p in real.table.rows}
    before, after = visits(nominal, data, values).pose_figures(), visits(real, data, true).pose_figures()
    assert after.ap.max() < 2e-5 < 2e-4 < before.ap.mean()
    np.testing.assert_array_equal(before.rp, after.rp)
    np.testing.assert_allclose(before.rp_abc, after.rp_abc, rtol=1e-9)


def test_single_visits_have_no_repeatability(rng):
    nominal, _, _, data, values = cycles(rng, n=1, kind="position")
    got = visits(nominal, data, values).pose_figures()
    assert np.isnan(got.ap).all() and np.isnan(got.rp).all() and np.isnan(got.vap).all() and got.rp_abc is None
    some = visits(nominal, data + data.take(np.array([2])), values).pose_figures()
    assert list(np.isfinite(some.rp)) != [True] * 5


def test_directions(rng):
    """Backlash: the place is another one from every direction."""
    nominal, _, _, data, values = cycles(rng, n=30, scatter=1e-9, directions=3)
    obs = data.observations[0]
    shift = np.zeros_like(obs.value)
    shift[:, 0] = np.array([0.0, 1e-4, 3e-4])[data.configurations.columns["direction"].astype(int)]
    moved = replace(data, observations=(replace(obs, value=obs.value + shift),))
    got = visits(nominal, moved, values).pose_figures()
    np.testing.assert_allclose(got.vap, 3e-4, rtol=1e-3)
    assert (got.directions == 3).all()


def test_a_column_numbers_places_where_encoders_jitter(rng):
    nominal, _, _, data, values = cycles(rng, places=4, n=5)
    c = data.configurations
    shaken = replace(c, joints=c.joints + rng.normal(0, 1e-4, c.joints.shape))
    assert (visits(nominal, replace(data, configurations=shaken), values).count == 1).all()
    marked = replace(shaken, columns={"place": np.tile([7.0, 2.0, 9.0, 4.0], 5)})
    found = visits(nominal, replace(data, configurations=marked), values)
    assert list(found.count) == [5] * 4 and list(found.place[:4]) == [0, 1, 2, 3]


def test_distances(rng):
    nominal, _, at, data, values = cycles(rng, places=4)
    found = visits(nominal, data, values)
    assert found.next_pairs().tolist() == [[0, 1], [1, 2], [2, 3]] and len(found.every_pair()) == 6
    assert found.every_pair(np.array([0, 1, 0, 1])).tolist() == [[0, 2], [1, 3]]
    got = found.distance_figures(found.every_pair())
    asked = nominal.pose(at)[:, :3, 3]
    for k, (i, j) in enumerate(got.pair):
        a, b = (data.observations[0].value[np.arange(p, 120, 4), :3] for p in (i, j))
        run = np.linalg.norm(a - b, axis=1)
        want = np.linalg.norm(asked[i] - asked[j])
        assert got.command[k] == pytest.approx(want) and got.n[k] == 30
        assert got.ad[k] == pytest.approx(run.mean() - want, abs=1e-12)
        assert got.rd[k] == pytest.approx(3 * run.std(ddof=1), rel=1e-9)


def test_distances_need_no_frame(rng):
    """Another place of the tracker changes nothing, as long as it is believed consistently."""
    nominal, _, _, data, values = cycles(rng)
    wrong = values | {"tracker.x": 5.0, "tracker.rz": 0.3}
    a, b = (f.distance_figures(f.every_pair()) for f in (visits(nominal, data, v) for v in (values, wrong)))
    np.testing.assert_allclose(a.ad, b.ad, atol=1e-12)


def test_visits_of_unequal_number():
    p = np.array([[0.0, 0, 0], [1, 0, 0], [0.1, 0, 0], [1.2, 0, 0], [0.2, 0, 0]])
    found = Visits(p, p, None, None, np.array([0, 1, 0, 1, 0]), np.array([0, 0]), np.arange(5))
    got = found.distance_figures(found.next_pairs())
    assert got.n.tolist() == [2] and got.rd[0] == pytest.approx(3 * np.std([1.0, 1.1], ddof=1))


def test_a_camera_on_the_hand_tells_nothing_in_base_coordinates(rng):
    nominal, _, _, data, values = cycles(rng, n=2)
    obs = replace(data.observations[0], frame=Frame("camera", FRAME, mount="tool"))
    assert visits(nominal, replace(data, observations=(obs,)), values) is None

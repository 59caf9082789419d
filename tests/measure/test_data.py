"""Data sets: taking, joining, and the mistakes that must be named rather than fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measure.scenarios import BALL, EYE, HAND, TAGS, TRACKER, arm, configurations, made, observations, pixels, platform

from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import kind_of, problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations


def positions(rng, m=5, frame=TRACKER, targets=(BALL,), **columns):
    where = replace(configurations(arm(), rng, m), columns=columns)
    return synthesise(arm(), DataSet(where, (observations("position", m, 1e-4, frame, targets),)), rng)


def bar(m=1):
    ends = (Frame("s0", (0, 0, 0, 0, 0, 0), (True,) * 3 + (False,) * 3), Frame("s1", (0.1, 0, 0, 0, 0, 0)))
    obs = Observations(
        "distance", np.arange(m), np.full((m, 1), 0.1), np.full((m, 1), 1e-5), options={"ends": ends}, group="bar"
    )
    return DataSet(Configurations(tuple(f"bar{i}" for i in range(m))), (obs,))


def test_take_keeps_rows_with_their_configurations(rng):
    data = positions(rng, temperature=np.arange(5.0))
    data = DataSet(
        data.configurations, (*data.observations, replace(data.observations[0].take(np.array([4])), rows=np.array([9])))
    )
    part = data.take(np.array([3, 1]))
    assert part.configurations.ids == ("c3", "c1") and len(part.observations) == 1, (
        "an instrument that saw nothing is gone"
    )
    np.testing.assert_array_equal(part.configurations.columns["temperature"], [3, 1])
    np.testing.assert_array_equal(part.observations[0].configuration, [1, 0])
    np.testing.assert_array_equal(part.observations[0].value, data.observations[0].value[[1, 3]])
    whole = problem(arm(), data).residuals(problem(arm(), data).start)[0].value
    np.testing.assert_allclose(
        problem(arm(), part).residuals(problem(arm(), part).start)[0].value, whole[[1, 3]], atol=1e-15
    )


def test_join_keeps_configurations_apart_and_marks_what_is_missing(rng):
    a, b = positions(rng, temperature=np.arange(5.0)), positions(rng, 3, payload=np.ones(3))
    both = a + b
    assert len(both.configurations) == 8 and len(both.observations) == 2
    np.testing.assert_array_equal(both.observations[1].configuration, [5, 6, 7])
    assert (
        np.isnan(both.configurations.columns["temperature"][5:]).all()
        and np.isnan(both.configurations.columns["payload"][:5]).all()
    )
    x = problem(arm(), both).start
    parts = [r.value for d in (a, b) for r in problem(arm(), d).residuals(x)]
    for r, expected in zip(problem(arm(), both).residuals(x), parts, strict=True):
        np.testing.assert_array_equal(r.value, expected)


def test_join_with_data_that_has_no_joints(rng):
    """Two sockets a known distance apart: the arm's joint values must survive."""
    for both in (positions(rng) + bar(2), bar(2) + positions(rng)):
        p = problem(arm(), both)
        assert np.isfinite(p.normal(p.start).cost).all() and sum(t.scale.size for t in p.terms) == 17
        assert np.isnan(both.configurations.joints).all(axis=1).sum() == 2
    assert (bar() + bar()).configurations.joints is None


def test_join_of_free_poses(rng):
    """What has no start begins at the identity, not nowhere."""
    where = configurations(platform(), rng, 2)
    plain = DataSet(replace(where, start=None), (observations("pose", 2, 1e-3),))
    both = DataSet(where, plain.observations) + plain
    np.testing.assert_array_equal(both.configurations.start, np.vstack([where.start, np.zeros((2, 6))]))


def test_join_of_different_arms_is_refused(rng):
    a = positions(rng)
    b = replace(a, configurations=replace(a.configurations, joints=a.configurations.joints[:, :3]))
    with pytest.raises(ModelError, match="numbers of joints"):
        _ = a + b


def test_a_missing_joint_value_is_named(rng):
    data = positions(rng)
    q = data.configurations.joints.copy()
    q[3, 1] = np.nan
    with pytest.raises(ModelError, match="lacks a value") as e:
        problem(arm(), replace(data, configurations=replace(data.configurations, joints=q)))
    assert e.value.key == "j2" and e.value.found == "c3"
    with pytest.raises(ModelError, match="joint values"):
        problem(arm(), replace(data, configurations=replace(data.configurations, joints=None)))


def test_an_instrument_may_not_take_the_name_of_the_machine(rng):
    for name in ("tool", "base"):
        obs = observations("position", 2, 1e-3, replace(TRACKER, name=name))
        with pytest.raises(ModelError, match="part of the machine") as e:
            problem(arm(), DataSet(configurations(arm(), rng, 2), (obs,)))
        assert e.value.key == name


def test_one_name_is_one_frame(rng):
    """Two files whose target `ball` lies at two places: fitting one number to both would be silently wrong."""
    a, b = positions(rng), positions(rng, targets=(replace(BALL, value=(0.0, 0, 0.2, 0, 0, 0)),))
    with pytest.raises(ModelError, match="one name") as e:
        problem(arm(), a + b)
    assert e.value.key == "ball"
    with pytest.raises(ModelError, match="one name"):
        problem(arm(), a + positions(rng, frame=replace(TRACKER, free=(False,) * 6)))
    shared = problem(arm(), a + positions(rng))
    assert sum(n.startswith("tracker.") for n in shared.table.names) == 6, "the same frame in two files is one frame"


def test_an_instrument_is_no_place(rng):
    """An instrument on the base stores where the base stands in it, a socket where it stands itself."""
    data = positions(rng)
    place = Observations("point", np.arange(5), np.zeros((5, 3)), options={"place": TRACKER})
    with pytest.raises(ModelError, match="one name"):
        problem(arm(), DataSet(data.configurations, (*data.observations, place)))


def test_a_shared_frame_is_fitted_to_both_files(rng):
    frame = replace(TRACKER, value=(0.0,) * 6)
    both = positions(rng, 8, targets=()) + positions(rng, 8, targets=())
    start = DataSet(both.configurations, tuple(replace(o, frame=frame) for o in both.observations))
    p = problem(arm(), start, free=[f"tracker.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")])
    s = least_squares(p)
    np.testing.assert_allclose(s.x[0, p.index], TRACKER.value, atol=1e-3)


def test_unknown_kinds_targets_cables_names(rng):
    data = positions(rng)
    with pytest.raises(ModelError, match="did you mean 'position'"):
        problem(arm(), DataSet(data.configurations, (replace(data.observations[0], kind="positon"),)))
    with pytest.raises(ModelError, match="not listed"):
        problem(arm(), DataSet(data.configurations, (replace(data.observations[0], target=np.full(5, 1)),)))
    with pytest.raises(ModelError, match="did you mean 'tracker.x'"):
        problem(arm(), data, free=["traker.x"])
    with pytest.raises(ModelError, match="two ends"):
        problem(arm(), DataSet(bar().configurations, (replace(bar().observations[0], options={}),)))
    with pytest.raises(ModelError, match="cable robot"):
        problem(arm(), DataSet(data.configurations, (observations("lengths", 5, 1e-3, extra={"cable": np.zeros(5)}),)))
    plain = observations("displacement", 5, 1e-3)
    with pytest.raises(ModelError, match="compares two configurations"):
        problem(arm(), DataSet(data.configurations, (plain,)))
    for kind in ("point", "plane", "sphere", "range"):
        with pytest.raises(ModelError, match="needs a place"):
            problem(arm(), DataSet(data.configurations, (observations(kind, 5, 1e-3, options={"radius": "r"}),)))
    where = configurations(platform(), rng, 2)
    for kind in ("displacement", "relative_pose", "distance"):
        with pytest.raises(ModelError, match="between two free poses"):
            problem(platform(), DataSet(where, (replace(observations(kind, 2, 1e-3), second=np.array([1, 0])),)))
    with pytest.raises(ModelError, match="no such cable"):
        problem(platform(), DataSet(where, (observations("lengths", 2, 1e-3, extra={"cable": np.array([0, 4])}),)))


def test_numbers_of_a_kind(rng):
    """Stated is held, unstated is free, `free` decides where it is given; a wrong symbol is named."""
    socket = Frame("socket", (0.3, 0.1, 0.2, 0, 0, 0), (True,) * 3 + (False,) * 3)
    where = configurations(arm(), rng, 4)

    def numbers(**options):
        obs = observations("range", 4, 1e-3, options={"place": socket, "medium": "air", "speed": 340.0, **options})
        table = problem(arm(), DataSet(where, (obs,))).table
        return [(table[n].value, table[n].free, table[n].prior) for n in ("air.speed", "air.delay")]

    assert numbers() == [(340.0, True, None), (0.0, True, None)]
    assert numbers(values={"speed": 345.0}) == [(345.0, False, None), (0.0, True, None)]
    assert numbers(free=("speed",), priors={"speed": 2.0}) == [(340.0, True, 2.0), (0.0, False, None)]
    with pytest.raises(ModelError, match="did you mean 'speed'"):
        numbers(values={"sped": 345.0})
    with pytest.raises(ModelError, match="above 0"):
        numbers(speed=0.0)
    with pytest.raises(ModelError, match="needs a radius"):
        problem(arm(), DataSet(where, (observations("sphere", 4, 1e-3, options={"place": socket}),)))
    two = [
        observations("range", 4, 1e-3, group=str(i), options={"place": socket, "medium": "air", "speed": 340.0 + i})
        for i in range(2)
    ]
    with pytest.raises(ModelError, match="two different numbers"):
        problem(arm(), DataSet(where, tuple(two)))


def test_two_sockets_in_one_place_are_parted_not_lost():
    ends = tuple(Frame(f"s{i}", (0.0,) * 6, (True,) * 3 + (False,) * 3) for i in range(2))
    obs = replace(bar().observations[0], options={"ends": ends})
    p = problem(arm(), DataSet(bar().configurations, (obs,)))
    assert np.isfinite(p.normal(p.start).cost).all() and np.isfinite(p.linearize(p.start).j).all()


def test_synthesise_adds_the_stated_noise_and_only_that(rng):
    clean = positions(rng, 400)
    exact = synthesise(arm(), clean)
    p = problem(arm(), exact)
    assert p.normal(p.start).cost[0] < 1e-18
    noisy = synthesise(arm(), exact, rng, noise=2.0)
    z = (noisy.observations[0].value - exact.observations[0].value) / exact.observations[0].sigma
    assert z.std() == pytest.approx(2.0, rel=0.1)
    silent = DataSet(exact.configurations, (replace(exact.observations[0], sigma=None),))
    np.testing.assert_array_equal(synthesise(arm(), silent, rng).observations[0].value, exact.observations[0].value)
    x = p.start.copy()
    x[0, p.table.index["tracker.x"]] += 0.5
    moved = synthesise(arm(), exact, x=x)
    np.testing.assert_allclose(
        moved.observations[0].value - exact.observations[0].value, [[0.5, 0, 0]] * 400, atol=1e-12
    )


def test_pose_noise_turns_about_the_instruments_axes(rng):
    value, noise = np.array([[0.1, 0.2, 0.3, 2.0, 1.0, -0.5]]), np.array([[1e-3, 0, 0, 0, 0, 1e-2]])
    from robocal.geometry import so3

    out = kind_of(observations("pose", 1, 1e-3)).disturb(value, noise)
    np.testing.assert_allclose(out[0, :3], [0.101, 0.2, 0.3])
    np.testing.assert_allclose(so3.exp(out[0, 3:]), so3.exp([0, 0, 0.01]) @ so3.exp(value[0, 3:]), atol=1e-14)


@pytest.mark.parametrize("local", [False, True])
def test_truth_is_found_with_shared_and_eliminated_targets(rng, local):
    names = ("tag0", "tag1") if local else ()
    where = configurations(arm(), rng, 12)
    truth = arm().with_values({"j3.d": 0.252, "j2.alpha": -np.pi / 2 + 0.003})
    data = synthesise(truth, DataSet(where, (pixels(12, HAND, TAGS),)))
    free = [
        "j3.d",
        "j2.alpha",
        *([] if local else [f"tag{i}.{s}" for i in range(2) for s in ("x", "y", "z", "rx", "ry", "rz")]),
    ]
    p = problem(arm(), data, free=free, local_targets=names)
    s = least_squares(p)
    assert s.x[0, p.table.index["j3.d"]] == pytest.approx(0.252, abs=1e-7)
    assert s.x[0, p.table.index["j2.alpha"]] == pytest.approx(-np.pi / 2 + 0.003, abs=1e-7)


def test_labels_and_lengths(rng):
    obs = observations("position", 3, 1e-3, TRACKER)
    assert (
        obs.label == "tracker"
        and replace(obs, group="smr").label == "smr"
        and replace(obs, frame=None).label == "position"
    )
    assert len(obs) == 3 and len(made(arm(), [obs, pixels(3, EYE, (BALL,))], rng, 3).terms) == 2

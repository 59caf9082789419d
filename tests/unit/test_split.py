"""Splits with rounds: shares, blocks, groups; what shares a place with held-out rows is fitted by nobody."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocal.errors import ModelError
from robocal.fit.repeats import places
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.split import groups_of, leave_one_out_rounds, make_split


def points(q, *, second=None, configuration=None, groups=None, columns=None, source=""):
    """Rows at some joint values; `second` makes them pairs."""
    where = Configurations(tuple(map(str, range(len(q)))), q, columns or {}, groups=groups)
    at = np.arange(len(q)) if configuration is None else np.asarray(configuration)
    other = None if second is None else np.asarray(second)
    kind = "position" if second is None else "displacement"
    return DataSet(where, (Observations(kind, at, np.zeros((len(at), 3)), second=other, source=source),))


def scattered(m, seed=0, **more):
    return points(np.random.default_rng(seed).uniform(-1, 2, (m, 3)), **more)


def no_leak(data, split):
    """No row that a round fits touches a place that a held-out row of that round touches."""
    label = places(data.configurations)
    for k in range(len(split)):
        fitted, held = set(), set()
        for obs in data.observations:
            ends = [obs.configuration, *([] if obs.second is None else [obs.second])]
            for mask, found in ((split.fit[k], fitted), (split.held_out[k], held)):
                found.update(int(v) for end in ends for v in label[end[mask[obs.configuration]]])
        assert not fitted & held, f"round {k} has seen {fitted & held}"


@given(st.integers(2, 60), st.integers(2, 9), st.integers(0, 3))
def test_folds_hold_out_everything_once_and_equally(m, folds, seed):
    data = scattered(m)
    if folds > m:
        with pytest.raises(ModelError, match="number of folds"):
            make_split(data, 0.0, folds=folds)
        return
    split = make_split(data, 0.0, folds=folds, seed=seed)
    assert split.held_out.shape == (folds, m) and (split.held_out.sum(axis=0) == 1).all()
    assert np.ptp(split.held_out.sum(axis=1)) <= 1
    np.testing.assert_array_equal(split.fit, ~split.held_out)
    np.testing.assert_array_equal(split.held_out[split.round_of, np.arange(m)], True)


def test_every_fold_covers_the_whole_space():
    """Eight corners of a cube, ten places at each: five folds take two of each corner."""
    rng = np.random.default_rng(0)
    corner = np.repeat(np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]), 10, axis=0).astype(float)
    split = make_split(points(corner + 0.1 * rng.normal(size=(80, 3))), 0.0, folds=5)
    for held in split.held_out:
        assert np.bincount(np.flatnonzero(held) // 10, minlength=8).tolist() == [2] * 8


def test_blocks_are_runs_of_rows_in_time():
    data = scattered(50)
    one = make_split(data, "blocks", blocks=10, seed=4)
    (held,) = one.held_out
    assert held.sum() == 10 and one.how == "blocks held out"
    assert np.diff(np.flatnonzero(np.diff(np.r_[0, held.astype(int), 0])))[::2].tolist() in ([5, 5], [10])
    assert {tuple(make_split(data, "blocks", seed=s).held_out[0]) for s in range(9)} != {tuple(held)}
    split = make_split(data, "blocks", folds=5)
    np.testing.assert_array_equal(split.round_of, np.repeat(np.arange(5), 10))
    backwards = replace(data.configurations, columns={"time": np.arange(50.0)[::-1]})
    split = make_split(DataSet(backwards, data.observations), "blocks", folds=5)
    np.testing.assert_array_equal(split.round_of, np.repeat(np.arange(5), 10)[::-1])


def test_groups_are_held_out_whole():
    labels = np.repeat(["front", "right", "high", "low", "left"], 7)
    data = scattered(35, groups=tuple(labels))
    split = make_split(data, "group", folds=5)
    assert split.names == ("front", "high", "left", "low", "right")
    for name, held in zip(split.names, split.held_out, strict=True):
        np.testing.assert_array_equal(held, labels == name)
    one = make_split(data, "group", seed=2)
    assert len(one) == 1 and len(set(labels[one.held_out[0]])) == 1 and one.held_out.sum() == 7
    two = make_split(data, "group", folds=2)
    assert (two.held_out.sum(axis=0) == 1).all() and all(
        len(set(labels[h]) & set(labels[~h])) == 0 for h in two.held_out
    )


def test_what_belongs_to_no_group_is_always_fitted():
    split = make_split(scattered(9, groups=("a",) * 3 + ("",) * 3 + ("b",) * 3), "group", folds=2)
    assert split.names == ("a", "b") and not split.held_out[:, 3:6].any() and split.fit[:, 3:6].all()
    np.testing.assert_array_equal(split.round_of, [0, 0, 0, -1, -1, -1, 1, 1, 1])


def test_without_labels_every_data_file_is_a_group():
    both = scattered(6, source="a.csv") + scattered(8, 1, source="b.csv")
    assert groups_of(both) == ("a.csv",) * 6 + ("b.csv",) * 8
    with pytest.raises(ModelError, match="no groups"):
        make_split(scattered(6, source="a.csv"), "group")


@pytest.mark.parametrize(
    ("how", "more", "words"),
    [
        ("blocks", {"folds": 1}, "number of blocks"),
        ("blocks", {"blocks": 21}, "number of blocks"),
        ("group", {"folds": 3}, "number of folds"),
        ("grop", {}, "unknown way"),
        (0.6, {}, "between 0 and 0.5"),
    ],
)
def test_what_cannot_be_held_out_is_refused(how, more, words):
    with pytest.raises(ModelError, match=words):
        make_split(scattered(20, groups=("a", "b") * 10), how, **more)


@pytest.mark.parametrize(
    ("how", "folds"), [(0.2, None), (0.0, 5), ("blocks", None), ("blocks", 4), ("group", 3), ("loo", None)]
)
@pytest.mark.parametrize("seed", range(3))
def test_no_place_is_both_fitted_and_held_out(how, folds, seed):
    """Pairs from one pose to the next, places visited again later: nothing that is held out is seen from the other end."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1, 1, (40, 3))
    q[30:] = q[rng.integers(0, 20, 10)] + 1e-5 * rng.normal(size=(10, 3))
    chain = np.arange(39)
    data = points(q, configuration=chain, second=chain + 1, groups=tuple(f"g{i // 14}" for i in range(40)))
    split = leave_one_out_rounds(data) if how == "loo" else make_split(data, how, folds=folds, seed=seed)
    no_leak(data, split)
    assert split.fit.any(axis=1).all() and split.held_out.any(axis=1).all()
    # The embargo takes no more than it must: a unit far from all held-out rows is fitted.
    label = places(data.configurations)
    ends = np.stack([label, np.r_[label[1:], -1]])
    for k in range(len(split)):
        touched = set(ends[:, split.held_out[k]].ravel())
        free = [u for u in range(40) if not split.held_out[k, u] and not set(ends[:, u]) & touched]
        assert split.fit[k, free].all()


def test_a_leak_would_be_seen():
    """The law above can fail: without the embargo neighbours share a place."""
    chain = np.arange(9)
    data = points(np.random.default_rng(0).uniform(-1, 1, (10, 3)), configuration=chain, second=chain + 1)
    split = leave_one_out_rounds(data)
    with pytest.raises(AssertionError, match="has seen"):
        no_leak(data, replace(split, fit=~split.held_out))


def test_a_hub_ties_nothing():
    """All displacements measured from one home: the others would otherwise all be embargoed."""
    q = np.random.default_rng(0).uniform(-1, 1, (21, 3))
    data = points(q, configuration=np.arange(1, 21), second=np.zeros(20, dtype=int))
    split = leave_one_out_rounds(data)
    assert len(split) == 20 and (split.fit.sum(axis=1) == 20).all()


def test_leave_one_out_skips_places_without_a_measurement():
    data = scattered(12)
    part = DataSet(data.configurations, (data.observations[0].take(np.arange(5)),))
    split = leave_one_out_rounds(part)
    assert len(split) == 5 and split.held_out[:, 5:].sum() == 0

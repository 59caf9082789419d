"""Half turns of a target are undone in every view that asks for it, whichever of camera and target is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from view_worlds import MACHINES, exchange, pixels, with_seen

from robocal.diagnose.camera_changes import half_turn, turn_views
from robocal.diagnose.half_turns import undo_half_turns
from robocal.diagnose.view_causes import VIEW_EXCHANGED
from robocal.fit.options import Options
from robocal.measure.pixels import HALF_TURNS
from robocal.prove.identify import identify

M = 30
OPEN = {HALF_TURNS: True}


def with_labels(data, shares, rng, *, known=False):
    """The data where a share of the views of each camera is turned, and which; the target is `known`, or free."""
    out = []
    for own, share in zip(pixels(data), shares, strict=True):
        obs = data.observations[own]
        views = rng.random(M) < share
        targets = tuple(replace(t, free=(not known,) * 6) for t in obs.targets)
        turned = turn_views(obs, half_turn(obs), views)
        data = with_seen(data, own, extra=turned.extra, options={**obs.options, **OPEN}, targets=targets)
        out.append(views)
    return data, out


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("shares", [(0.4, 0.3), (0.7, 0.2), (0.9, 0.0), (1.0, 0.6)])
def test_labels_are_those_of_a_board_that_is_known_or_stated_roughly(shares, known, rng):
    """Most views of a camera may be turned: what is stated of the board says so, where it is free as where it is known."""
    model, _, data = MACHINES["arm"](rng, M)
    spoiled, views = with_labels(data, shares, rng, known=known)
    made, turned = undo_half_turns(model, spoiled)
    for own, mine in zip(pixels(data), views, strict=True):
        assert (turned[own] == mine).all()
        assert np.allclose(made.observations[own].extra["point"], data.observations[own].extra["point"])


def test_a_board_of_which_nothing_is_stated_is_the_same_for_all_cameras(rng):
    model, _, data = MACHINES["arm"](rng, M)
    for own in pixels(data):
        nowhere = tuple(replace(t, value=(0.0,) * 6) for t in data.observations[own].targets)
        data = with_seen(data, own, targets=nowhere)
    spoiled, views = with_labels(data, (0.3, 0.8), rng)
    _, turned = undo_half_turns(model, spoiled)
    one, other = ((turned[own] ^ mine) for own, mine in zip(pixels(data), views, strict=True))
    assert one.all() == one.any() and (one == other).all()


def test_nothing_is_turned_unasked(rng):
    model, _, data = MACHINES["arm"](rng, M)
    same, turned = undo_half_turns(model, data)
    assert not turned and same is data


def test_exchanged_views_are_named_whichever_label_they_were_given(rng):
    model, _, data = MACHINES["arm"](rng, M)
    own = pixels(data)[1]
    obs = exchange(data, own, 4, 17).observations[own]
    views = np.isin(np.arange(M), [4])
    spoiled = with_seen(
        data, own, configuration=obs.configuration, options={**obs.options, **OPEN},
        extra=turn_views(obs, half_turn(obs), views).extra,
    )  # fmt: skip
    found = identify(model, spoiled, Options(hold_out=0.0, leave_one_out=False)).outliers
    assert {(o.configuration, o.cause.code) for o in found} == {("p4", VIEW_EXCHANGED), ("p17", VIEW_EXCHANGED)}

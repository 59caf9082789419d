"""A view is one finding: what is wrong with all of an image is said once, left out once, and named by its configuration and camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cli.runs import robocal
from view_worlds import GRID, MACHINES, camera, exchange, names, pixels, recorded, with_seen

from robocal.diagnose.view_causes import VIEW_ALONE, VIEW_ELSEWHERE, VIEW_EXCHANGED
from robocal.files.datawrite import data_text, table_text
from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations
from robocal.prove.identify import identify

FAST = Options(hold_out=0.0, leave_one_out=False)
SLOW = dict.fromkeys(("cable", "rig"), pytest.mark.slow)
EACH = pytest.mark.parametrize("machine", ["arm", *(pytest.param(m, marks=k) for m, k in SLOW.items())])


def strange(model, data):
    return identify(model, data, FAST).outliers


# obeys: view-alone
@EACH
def test_a_view_that_is_off_is_one_finding_and_a_corner_stays_a_row(machine, rng):
    model, _, data = MACHINES[machine](rng, 30)
    own = pixels(data)[1]
    obs = data.observations[own]
    value = np.array(obs.value)
    value[obs.configuration == 12] += [31.0, -17.0]
    lone = np.flatnonzero(obs.configuration == 20)[30]
    value[lone] += [9.0, 4.0]
    found = strange(model, with_seen(data, own, value=value))
    assert {(o.configuration, o.group, o.rows, o.row) for o in found} == {
        ("p12", "cam1", len(GRID), 12 * len(GRID) + 2),
        ("p20", "cam1", 1, lone + 2),
    }
    assert all(o.set_aside for o in found)
    (view,) = (o for o in found if o.view)
    assert view.cause.code == VIEW_ALONE and "view p12 of cam1" in view.cause.sentence
    left = without(with_seen(data, own, value=value), own, 12)
    assert [o.configuration for o in strange(model, left)] == ["p20"]


def without(data, own, view):
    """The data where a view is left out."""
    seen = list(data.observations)
    seen[own] = seen[own].take(np.flatnonzero(seen[own].configuration != view))
    return replace(data, observations=tuple(seen))


@EACH
def test_nothing_is_said_of_good_views(machine, rng):
    model, _, data = MACHINES[machine](rng, 30)
    assert not strange(model, data)


@EACH
def test_two_views_that_are_exchanged_are_named(machine, rng):
    model, _, data = MACHINES[machine](rng, 30)
    own = pixels(data)[-1]
    found = identify(model, exchange(data, own, 4, 17), FAST)
    assert {(o.configuration, o.group, o.rows, o.cause.code) for o in found.outliers} == {
        (c, data.observations[own].label, len(GRID), VIEW_EXCHANGED) for c in ("p4", "p17")
    }
    assert all(o.set_aside for o in found.outliers)
    (said,) = (r for r in found.warnings if r.code == "views-exchanged")
    assert "views p4 and p17" in said.sentence and "joint values" not in said.sentence
    # A view has rows enough for a step of its own: beside the others it is none.
    assert not [r for r in found.verdict.reasons if r.code.startswith("segment")]


def test_check_tells_the_same_of_exchanged_views(tmp_path, rng):
    """Without a fit they are set aside as well: no part of a view is a step, and nothing moved."""
    model, _, data = MACHINES["arm"](rng, 30, 1)
    data = exchange(data, 0, 4, 17)
    (tmp_path / "data.csv").write_text(table_text(data, model), encoding="utf-8")
    (tmp_path / "data.yaml").write_text(data_text(data, model, "data.csv"), encoding="utf-8")
    found = robocal("check", "ur10", tmp_path / "data.yaml", "--json").document
    codes = [r["code"] for r in found["remarks"]]
    assert "views-exchanged" in codes and not [c for c in codes if c.startswith("segment")], codes


@pytest.mark.parametrize("partner", [5, 9])
def test_what_moved_is_told_from_views_that_are_exchanged(partner, rng):
    """Two views that lie beside each other or apart are no place that changed; six one after another are."""
    model, truth, data = MACHINES["arm"](rng, 14, 1)
    found = identify(model, exchange(data, 0, 4, partner), FAST)
    assert [r.code for r in found.warnings if r.code == "views-exchanged"]
    assert not [r for r in found.verdict.reasons if r.code.startswith("segment")]
    obs = data.observations[0]
    nudged = with_seen(data, 0, targets=tuple(replace(t, value=tuple(np.add(t.value, 0.004))) for t in obs.targets))
    step = synthesise(truth, nudged, rng).observations[0].value - synthesise(truth, data, rng).observations[0].value
    moved = with_seen(data, 0, value=obs.value + step * (obs.configuration >= 8)[:, None])
    assert [r for r in identify(model, moved, FAST).verdict.reasons if r.code.startswith("segment")]


# obeys: view-exchanged
# obeys: views-exchanged
def test_two_joint_rows_that_are_exchanged_are_told_from_two_images(rng):
    model, _, data = MACHINES["arm"](rng, 30)
    for own in pixels(data):
        data = exchange(data, own, 4, 17)
    (said,) = (r for r in identify(model, data, FAST).warnings if r.code == "views-exchanged")
    assert "views p4 and p17 of cam0, cam1 are exchanged, of all 2" in said.sentence and "joint values" in said.sentence
    joints = data.configurations.joints.copy()
    joints[[4, 17]] = joints[[17, 4]]
    assert not strange(model, replace(data, configurations=replace(data.configurations, joints=joints)))


def test_views_of_poses_that_are_visited_again_are_exchanged_with_each_other(rng):
    """Every pose is measured twice, so each of the two views fits two places."""
    model, truth, once = MACHINES["arm"](rng, 15, 1)
    where = Configurations(names(30), np.repeat(once.configurations.joints, 2, axis=0))
    obs = once.observations[0]
    seen = camera(0, se3.inverse(se3.from_vector(obs.frame.value)), np.arange(30))
    data = recorded(truth, where, [seen], rng)
    for a, b in ((4, 17), (5, 16)):
        data = exchange(data, 0, a, b)
    causes = [o.cause for o in strange(model, data)]
    assert {c.code for c in causes} == {VIEW_EXCHANGED} and len(causes) == 4
    pairs = {frozenset((dict(c.items)["view"], dict(c.items)["partner"])) for c in causes}
    assert len(pairs) == 2 and all(len(p & {"p4", "p5"}) == 1 for p in pairs)


# obeys: view-elsewhere
@EACH
def test_a_view_that_is_of_another_configuration_is_named(machine, rng):
    model, _, data = MACHINES[machine](rng, 30)
    own = pixels(data)[-1]
    obs = data.observations[own]
    value = np.array(obs.value)
    value[obs.configuration == 4] = value[obs.configuration == 17] + rng.normal(0, 0.2, (len(GRID), 2))
    found = strange(model, with_seen(data, own, value=value))
    (view,) = (o for o in found if o.view)
    assert view.configuration == "p4" and view.cause.code == VIEW_ELSEWHERE and "of view p17" in view.cause.sentence
    assert not strange(model, without(with_seen(data, own, value=value), own, 4))


@EACH
def test_a_wrong_marker_is_left_out_of_a_good_view(machine, rng):
    """Four targets on what moves: all corners of one in one view are off."""
    model, _, data = MACHINES[machine](rng, 30)
    own = pixels(data)[0]
    obs = data.observations[own]
    part = np.tile(np.arange(len(GRID)) % 4, len(np.unique(obs.configuration)))
    targets = tuple(replace(obs.targets[0], name=f"board{k}") for k in range(4))
    value = np.array(obs.value)
    value[(obs.configuration == 7) & (part == 2)] += [12.0, 8.0]
    found = strange(model, with_seen(data, own, value=value, target=part, targets=targets))
    (view,) = found
    assert (view.configuration, view.target, view.rows) == ("p7", "board2", np.count_nonzero(part == 2) / 30)

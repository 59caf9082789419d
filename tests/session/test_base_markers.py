"""Markers on the base whose places nobody states, before a camera that the machine carries: where they start."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cables.thesis_rig import SIX, specification, thesis_rig

from robocal.fit.starts.camera_targets import place_camera_targets
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3, so3
from robocal.measure.data import DataSet
from robocal.session.base_markers import leave_lone_targets, place_targets
from robocal.session.inputs import read_inputs
from robocal.vision.camera import SYMBOLS
from robocal.vision.sightings import find_islands

NEAR = 0.08, 0.08  # m, rad: far less than markers are apart, and near enough for any fit

ISLAND = 0.3  # m: anchors are off by 30 mm, which tilts the platform by a tenth of a radian and more


@pytest.fixture(scope="module")
def rig(shared_data):
    return thesis_rig(specification(shared_data), 5, poses=25, grid=(5, 4))


def unplaced(rig, known):
    """The data without places of the markers, but of the first where it is `known`; the lens is the true one."""
    pixels, lengths = rig.data.observations
    lens = tuple(float(rig.truth[rig.problem.table.index[f"lens.{s}"]]) for s in SYMBOLS)
    pixels = replace(pixels, options={**pixels.options, "intrinsics": lens})
    targets = tuple(
        t if known and i == 0 else replace(t, value=(0.0,) * 6, free=SIX) for i, t in enumerate(pixels.targets)
    )
    return DataSet(rig.data.configurations, (replace(pixels, targets=targets), lengths))


def true_places(rig):
    table = rig.problem.table
    names = [t.name for t in rig.data.observations[0].targets]
    rows = [[table.index[f"{n}.{s}"] for s in ("x", "y", "z", "rx", "ry", "rz")] for n in names]
    return se3.from_vector(rig.truth[np.array(rows)])


@pytest.mark.parametrize("known", [True, False])
def test_they_start_near_where_they_are(rig, known):
    placed = place_targets(rig.robot, unplaced(rig, known))
    pixels = placed.observations[0]
    seen = np.unique(pixels.target)
    found, true = se3.from_vector([t.value for t in pixels.targets])[seen], true_places(rig)[seen]
    assert np.linalg.norm(found[:, :3, 3] - true[:, :3, 3], axis=1).max() < NEAR[0]
    turn = np.linalg.norm(so3.log(found[:, :3, :3] @ np.swapaxes(true[:, :3, :3], 1, 2)), axis=1)
    assert turn.max() < NEAR[1]
    assert place_targets(rig.robot, placed).observations[0].targets == pixels.targets  # nothing is done twice


def test_what_is_stated_stays(rig):
    assert place_targets(rig.robot, rig.data) is rig.data


def test_a_marker_that_one_view_shows_is_left_out(rig):
    data = unplaced(rig, known=True)
    pixels, lengths = data.observations
    where = pixels.configuration[pixels.target == 7]
    alone = pixels.take(np.flatnonzero((pixels.target != 7) | (pixels.configuration == where[0])))
    less, left = leave_lone_targets(replace(data, observations=(alone, lengths)))
    assert "m7" in left and "m0" not in left
    kept = less.observations[0]
    assert not set(left) & {t.name for t in kept.targets} and less.observations[1] is lengths
    # Every row that stays shows what it showed.
    names = [t.name for t in kept.targets]
    shown = [pixels.targets[i].name for i in alone.target if pixels.targets[i].name not in left]
    assert [names[i] for i in kept.target] == shown


@pytest.mark.parametrize("measured", [True, False])
def test_what_alone_says_where_a_view_is_stays(rig, measured):
    """A view that shows nothing else would lose its place, unless lengths tell it."""
    data = unplaced(rig, known=True)
    pixels, lengths = data.observations
    view = pixels.configuration[pixels.target == 7][0]
    some = pixels.take(np.flatnonzero((pixels.target == 7) == (pixels.configuration == view)))
    known = replace(data, observations=(some, lengths) if measured else (some,))
    less, left = leave_lone_targets(known)
    assert ("m7" in left) == ("m7" not in {t.name for t in less.observations[0].targets}) == measured
    assert leave_lone_targets(rig.data) == (rig.data, ())


def test_markers_that_no_view_joins_to_the_others_stand_where_the_machine_says(rig):
    data = unplaced(rig, known=True)
    pixels, lengths = data.observations
    views = np.unique(pixels.configuration[pixels.target == 7])[:2]
    some = pixels.take(np.flatnonzero((pixels.target == 7) == np.isin(pixels.configuration, views)))
    placed = place_targets(rig.robot, replace(data, observations=(some, lengths))).observations[0]
    shows = np.zeros((len(data.configurations), len(placed.targets)), dtype=bool)
    shows[placed.configuration, placed.target] = True
    joined = find_islands(shows)[0]
    assert len(joined) > 10 and 7 not in joined
    off = se3.from_vector([t.value for t in placed.targets])[joined, :3, 3] - true_places(rig)[joined, :3, 3]
    assert np.linalg.norm(off, axis=1).max() < NEAR[0]
    off = np.array(placed.targets[7].value[:3]) - true_places(rig)[7, :3, 3]
    assert np.linalg.norm(off) < ISLAND


def test_a_marker_that_another_camera_sees_as_well_stays(rig):
    data = unplaced(rig, known=True)
    pixels, lengths = data.observations
    where = pixels.configuration[pixels.target == 7]
    alone = pixels.take(np.flatnonzero((pixels.target != 7) | (pixels.configuration == where[0])))
    assert pixels.frame is not None
    other = replace(pixels, frame=replace(pixels.frame, name="other"))
    less, left = leave_lone_targets(replace(data, observations=(alone, other, lengths)))
    assert "m7" not in left and "m7" in {t.name for t in less.observations[0].targets}


def test_reading_the_files_of_a_robot_places_its_markers():
    folder = Path(__file__).parents[2] / "examples" / "cable-camera"
    read = read_inputs(folder / "robot.yaml", [folder / "lengths.yaml", folder / "pixels.yaml"])
    (pixels,) = (o for o in read.data.observations if o.kind == "pixels")
    assert len(pixels.targets) > 5 and all(any(t.value) for t in pixels.targets[1:])
    shown = np.unique(pixels.configuration)
    assert np.linalg.norm(read.data.configurations.start[shown][:, :3], axis=1).min() > 0.1


def test_a_map_from_a_size_in_another_unit_starts_anew_once_the_size_is_right(rig):
    """Poses from the lengths, targets from what the images show there: a map 39 times too large is left behind."""
    placed = place_targets(rig.robot, unplaced(rig, True))
    pixels, lengths = placed.observations
    far = tuple(replace(t, value=tuple(39.37 * np.array(t.value[:3])) + t.value[3:]) for t in pixels.targets)
    begun = DataSet(replace(placed.configurations, start=None), (replace(pixels, targets=far), lengths))
    begun = place_configurations(rig.robot, begun)
    again = place_camera_targets(begun, 0, np.arange(len(begun.configurations))).observations[0]
    seen = np.setdiff1d(np.unique(pixels.target), [i for i, t in enumerate(again.targets) if not any(t.free)])
    found, true = se3.from_vector([t.value for t in again.targets])[seen], true_places(rig)[seen]
    off = np.linalg.norm(found[:, :3, 3] - true[:, :3, 3], axis=1)
    assert off.max() < ISLAND
    assert all(t.value == f.value for t, f in zip(again.targets, far, strict=True) if not any(t.free))

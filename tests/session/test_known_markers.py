"""`vision map --prior`: what is known of markers makes a map of few views better, and a marker that moved since is named, not believed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_map_world import draw_room, lens_known
from lens_world import write
from map_world import EDGE, cameras, map_rows, room, sightings

from robocal.errors import ModelError
from robocal.files.lens import lens_text
from robocal.files.map import map_covariance_text, map_text
from robocal.geometry import se3
from robocal.verbs.vision.map import Options, run
from robocal.vision.map_comparison import compare_maps
from robocal.vision.map_gauge import project_covariance, rigid_projector, take_markers
from robocal.vision.maps import MarkerMap

SIGMA = 2e-4


@pytest.fixture
def known():
    poses = room(np.random.default_rng(3))
    bare = MarkerMap(
        tuple(map(str, range(len(poses)))), np.full(len(poses), EDGE), se3.to_vector(poses), None, "6x6_250", ""
    )
    return replace(bare, covariance=project_covariance(bare, SIGMA**2 * np.eye(6 * len(poses))))


def find(folder, known, true, *, prior=True, count=5, text=None, **how):
    """The outcome of a map of a room, with what is known of it in a file."""
    views = cameras(np.random.default_rng(5), count)
    rows = map_rows(sightings(true.poses, views, np.full(len(true.names), EDGE)), 0.1, np.random.default_rng(6))
    write(folder / "corners.csv", rows)
    (folder / "lens.yaml").write_text(lens_text(lens_known()))
    (folder / "before.yaml").write_text(map_text(known, "robocal", "before.csv") if text is None else text)
    if known.covariance is not None:
        (folder / "before.csv").write_text(map_covariance_text(known))
    before = folder / "before.yaml" if prior else None
    return run(
        Options(corners=folder / "corners.csv", lens=folder / "lens.yaml", **{"size": ("60",), "prior": before} | how)
    )


def distance(found, true):
    """How far the middles are from the truth (rms, m), both maps aligned."""
    scatter = compare_maps([replace(m, covariance=None) for m in (found, true)]).scatter
    return 2 * float(np.sqrt(np.mean(np.sum(scatter[0].mean(axis=1) ** 2, axis=-1))))


@pytest.mark.slow
def test_a_map_of_few_views_is_better(tmp_path, known):
    """Nearer to the truth than what was known before and than what the views alone say, and its sigma holds."""
    true = draw_room(known, np.random.default_rng(4))
    alone, both = (find(tmp_path, known, true, prior=p).result.map for p in (False, True))
    assert distance(both, true) < 0.6 * min(distance(alone, true), distance(known, true))
    seen = take_markers(true, both.names)
    origin = int(np.abs(both.vector).sum(axis=1).argmin())
    there = se3.inverse(seen.poses[origin]) @ seen.poses
    off = rigid_projector(both) @ np.concatenate(se3.displacement(both.poses, there), axis=1).ravel()
    sigma = np.sqrt(np.diag(both.covariance))
    assert np.abs(off / sigma).max() < 4.5 and sigma.reshape(-1, 6)[:, :3].mean() < SIGMA


# obeys: marker-moved-since
@pytest.mark.slow
def test_a_marker_that_moved_since_is_named_and_not_believed(tmp_path, known):
    true = draw_room(known, np.random.default_rng(4))
    vector = true.vector.copy()
    vector[3, :3] += [0.0, 0.004, 0.0]
    moved = replace(true, vector=vector)
    made = find(tmp_path, known, moved, count=12)
    assert [r.code for r in made.remarks] == ["marker-moved-since"] and made.trusted
    (named,) = made.result.fit.displaced
    assert named.change.name == "3" and named.change.distance == pytest.approx(0.004, abs=0.001)
    assert distance(made.result.map, moved) < SIGMA
    with_it = replace(known, vector=moved.vector)
    assert not find(tmp_path, with_it, moved, count=12).remarks


def test_a_prior_that_many_markers_contradict_is_refused(tmp_path, known):
    """Single markers are named and let go; of more it is the prior that is wrong, and none of them is believed."""
    vector = known.vector.copy()
    vector[2:7, :3] += np.random.default_rng(5).uniform(-0.01, 0.01, (5, 3))
    with pytest.raises(ModelError, match="more than single markers contradict the prior") as error:
        find(tmp_path, known, replace(known, vector=vector), count=12)
    assert error.value.key == "--prior"


def test_a_slip_of_the_comma_is_one_marker(tmp_path, known):
    """It is no unit of the whole file, and how far off it is is no small step."""
    vector = known.vector.copy()
    vector[0, 0] *= 10
    made = find(tmp_path, replace(known, vector=vector), known, count=12)
    (named,) = made.result.fit.displaced
    away = float(np.linalg.norm(vector[0, :3] - known.vector[0, :3]))
    assert named.change.name == "0" and named.change.distance == pytest.approx(away, rel=0.01)


def test_a_place_that_is_a_hundred_times_off_is_one_marker(tmp_path, known):
    """No fit begins beside it, and the others are not blamed; two such are two."""
    for slips in ({0: 100.0}, {2: 100.0}, {4: -50.0, 9: 1000.0}):
        vector = known.vector.copy()
        for k, factor in slips.items():
            vector[k, :3] *= factor
        made = find(tmp_path, replace(known, vector=vector), known, count=12)
        assert sorted(m.change.name for m in made.result.fit.displaced) == sorted(map(str, slips))
        assert made.trusted and {r.code for r in made.remarks} == {"marker-moved-since"}
        assert distance(made.result.map, known) < SIGMA


@pytest.mark.parametrize(
    ("how", "words", "key"),
    [
        ({"size": (), "size_sigma": 60.0}, "the size of the markers is not stated.*--size-sigma 60", "--size"),
        ({"size_sigma": 60.0}, "no marker is known as badly", "--size-sigma"),
        ({"size_scatter": 60.0}, "no markers differ as much", "--size-scatter"),
        ({"size": ("60", "77=120")}, "a size of a marker that no view shows", "--size"),
    ],
)
def test_a_size_at_the_wrong_option_is_named(tmp_path, known, how, words, key):
    with pytest.raises(ModelError, match=words) as error:
        find(tmp_path, known, known, **how)
    assert error.value.key == key


def test_boards_of_tagslam_are_a_prior(tmp_path, known):
    """Markers 0 and 1 are a board of two rows, as printed, and so is nothing else; the board has no pose in the world."""
    poses = known.poses.copy()
    poses[1] = poses[0] @ se3.from_vector([0, 0.09, 0, 0, 0, 0])
    true = replace(known, vector=se3.to_vector(poses))
    board = (
        "bodies:\n - wall:\n     is_static: true\n     type: board\n     board: {tag_start_id: 0, tag_size: 0.06, tag_bits: 6, "
        "tag_spacing: 0.5, tag_rows: 2, tag_columns: 1, tag_rotation_noise: 0.0001, tag_position_noise: 0.00001}\n"
    )
    found = {p: find(tmp_path, known, true, prior=p, text=board).result.map for p in (False, True)}
    apart = {}
    for p, m in found.items():
        i, j = m.names.index("0"), m.names.index("1")
        apart[p] = se3.inverse(m.poses[i]) @ m.poses[j]
    off = {p: np.linalg.norm(t[:3, 3] - [0, 0.09, 0]) for p, t in apart.items()}
    assert off[True] < 3e-5 < off[False]


@pytest.mark.parametrize(("factor", "right"), [(1000.0, "mm"), (1 / 25.4, "inch"), (1 / 304.8, "ft")])
def test_a_prior_in_another_unit_is_named(tmp_path, known, factor, right):
    vector = known.vector * np.repeat([factor, 1.0], 3)
    with pytest.raises(ModelError, match="another unit") as error:
        find(tmp_path, replace(known, vector=vector, size=factor * known.size), known)
    assert error.value.key == "--prior" and f"length: {right}" in str(error.value)


def test_a_prior_of_another_scale_is_told_and_no_marker_blamed(tmp_path, known):
    """Distances that are 3 % too large are not the fault of single edges."""
    vector = known.vector * np.repeat([1.03, 1.0], 3)
    made = find(tmp_path, replace(known, vector=vector), known, count=12)
    codes = [r.code for r in made.result.reasons]
    assert not made.trusted and "map-prior-scaled" in codes, codes
    assert not {"marker-size-contradicted", "marker-sizes-scatter"} & set(codes)
    made = find(tmp_path, known, known, count=12)
    codes = [r.code for r in made.result.reasons]
    assert made.trusted and "map-prior-scaled" not in codes  # obeys: map-prior-scaled


def test_known_distances_tell_the_scale(tmp_path, known):
    """The map as a whole does not turn, which would pass for a scale: it is as large as the file says, not as edges do."""
    true = draw_room(known, np.random.default_rng(4))
    found = find(tmp_path, known, true).result.map
    middle, mine = (v - v.mean(axis=0) for v in (take_markers(known, found.names).vector[:, :3], found.vector[:, :3]))
    assert abs(np.linalg.norm(mine) / np.linalg.norm(middle) - 1) < 3e-4


def test_what_no_prior_is_refused(tmp_path, known):
    with pytest.raises(ModelError, match="none of the markers that are seen") as error:
        find(tmp_path, replace(known, names=tuple(f"9{n}" for n in known.names)), known)
    assert error.value.key == "--prior"
    with pytest.raises(ModelError, match="a prior without sigma"):
        find(tmp_path, replace(known, covariance=None), known)
    with pytest.raises(ModelError, match="another size than that of the prior") as error:
        find(tmp_path, replace(known, size=known.size * 2), known)
    assert error.value.key == "--size" and "marker 0" in error.value.found

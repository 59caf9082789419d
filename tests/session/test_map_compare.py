"""Maps of the same markers: they scatter as their sigma says, wherever each of them is, and what moved is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_map_world import draw_room, room

from robocal.errors import FormatError, InputError, ModelError
from robocal.files.map import map_covariance_text, map_text
from robocal.geometry import se3
from robocal.verbs.vision.compare import Options, run
from robocal.vision.map_comparison import compare_maps, find_shifts
from robocal.vision.map_gauge import move_map, take_markers


def maps_of(known, rng, count):
    """Maps that differ by their covariance, each somewhere else."""
    drawn = [replace(draw_room(known, rng), covariance=known.covariance, family=known.family) for _ in range(count)]
    return [move_map(m, se3.from_vector(rng.normal(size=6))) for m in drawn]


def write(folder, maps):
    names = []
    for k, m in enumerate(maps):
        names.append(folder / f"map{k}.yaml")
        table = f"map{k}.covariance.csv"
        if m.covariance is not None:
            (folder / table).write_text(map_covariance_text(m))
        names[-1].write_text(map_text(m, "robocal", table if m.covariance is not None else ""))
    return tuple(names)


def codes(made):
    return [r.code for r in made.remarks]


def test_repeated_maps_scatter_as_predicted():
    """chi2 over its degrees of freedom has the mean 1 (its own error 0.03 of 20 comparisons), and a shift of a marker that did not move
    that of six numbers."""
    rng, known = np.random.default_rng(2), room()
    found = [compare_maps(maps_of(known, rng, 3)) for _ in range(20)]
    assert np.mean([f.chi2 / f.dof for f in found]) == pytest.approx(1, abs=0.1)
    assert found[0].dof == 2 * (6 * 12 - 6)
    assert np.mean([t.chi2 for f in found for t in find_shifts(*f.maps[:2])]) == pytest.approx(6, abs=0.6)
    ratio = np.sqrt(np.mean([np.square(f.deviation / f.predicted) for f in found]))
    assert ratio == pytest.approx(1, abs=0.15)


def test_where_a_map_stands_is_no_scatter():
    known, rng = room(), np.random.default_rng(1)
    same = [move_map(known, se3.from_vector(rng.normal(size=6))) for _ in range(3)]
    found = compare_maps(same, "5")
    assert np.abs(found.scatter).max() < 1e-12 and found.chi2 < 1e-6 and np.abs(found.scale).max() < 1e-12
    apart = np.linalg.norm(known.vector[:, :3] - known.vector[5, :3], axis=1)
    np.testing.assert_allclose(found.distance, apart, atol=1e-9)
    # Axes are those of the reference marker: its own corners lie in its plane, the first at the top left.
    np.testing.assert_allclose(
        found.mean[5], [[-0.06, 0.06, 0], [0.06, 0.06, 0], [0.06, -0.06, 0], [-0.06, -0.06, 0]], atol=1e-9
    )


def test_scatter_is_along_the_axes_of_the_reference():
    """A marker of the same wall that is off along the wall's normal scatters in z."""
    known = room()
    vector = known.vector.copy()
    vector[3, 0] += 0.006  # the first wall looks along x
    found = compare_maps([known, replace(known, vector=vector)], "0")
    size = np.abs(found.scatter[0, 3]).max(axis=0)
    assert size[2] > 0.002 and size[:2].max() < 0.4 * size[2]
    anchored, aligned = found.pair_distances[1][0, 3], found.pair_distances[0][0, 3]
    assert anchored == pytest.approx(0.006, rel=1e-6) and aligned < anchored


def test_the_folder_has_table_pictures_and_page(tmp_path):
    maps = write(tmp_path, maps_of(room(), np.random.default_rng(4), 3))
    made = run(Options(maps=maps, output=tmp_path / "out"))
    assert made.trusted and not codes(made)
    assert {p.name for p in made.written} == {"maps.json", "markers.csv", "distance.svg", "axes.svg", "report.html"}
    table = (tmp_path / "out" / "markers.csv").read_text().splitlines()
    assert len(table) == 13 and table[0].startswith("marker,distance [mm],sd_x [mm]") and "predicted_z [mm]" in table[0]
    for name in ("distance.svg", "axes.svg"):
        assert (tmp_path / "out" / name).read_text().startswith("<svg")
    assert made.document()["dof"] == 132 and made.document()["reference"] == "0"


# obeys: marker-moved-between
def test_a_marker_that_moved_is_named(tmp_path):
    maps = maps_of(room(), np.random.default_rng(5), 3)
    vector = maps[2].vector.copy()
    vector[7, :3] += [0.003, 0.0, -0.004]
    made = run(Options(maps=write(tmp_path, [*maps[:2], replace(maps[2], vector=vector)])))
    assert codes(made) == ["marker-moved-between"]
    (moved,) = made.result.moved
    assert (
        moved.test.name == "7" and moved.file == "map2.yaml" and moved.test.distance == pytest.approx(0.005, abs=0.001)
    )
    assert not codes(run(Options(maps=write(tmp_path, maps))))
    left_out = [take_markers(m, [n for n in m.names if n != "7"]) for m in (*maps[:2], replace(maps[2], vector=vector))]
    assert not codes(run(Options(maps=write(tmp_path, left_out))))


# obeys: maps-apart
def test_maps_that_scatter_more_than_their_sigma(tmp_path):
    known = room()
    maps = maps_of(known, np.random.default_rng(6), 3)
    sure = [replace(m, covariance=m.covariance / 9) for m in maps]
    made = run(Options(maps=write(tmp_path, sure)))
    assert codes(made) == ["maps-apart"] and made.remarks[0].numbers["times"] == pytest.approx(3, rel=0.2)
    assert not codes(run(Options(maps=write(tmp_path, maps))))
    assert not codes(run(Options(maps=write(tmp_path, [replace(m, covariance=None) for m in maps]))))


# obeys: maps-scaled
def test_another_size_of_the_markers_is_named(tmp_path):
    maps = [replace(m, covariance=None) for m in maps_of(room(), np.random.default_rng(7), 2)]
    larger = maps[1].vector * [1.01, 1.01, 1.01, 1, 1, 1]
    made = run(Options(maps=write(tmp_path, [maps[0], replace(maps[1], vector=larger, size=maps[1].size * 1.01)])))
    assert codes(made) == ["maps-scaled"] * 2
    assert "map1.yaml is 0.5 % larger" in made.remarks[1].sentence
    assert not codes(run(Options(maps=write(tmp_path, maps))))


# obeys: maps-of-other-markers
def test_markers_that_are_not_in_all_maps(tmp_path):
    maps = maps_of(room(), np.random.default_rng(8), 2)
    made = run(Options(maps=write(tmp_path, [maps[0], take_markers(maps[1], maps[1].names[2:])])))
    assert codes(made) == ["maps-of-other-markers"] and made.remarks[0].numbers["names"] == ("0", "1")
    assert made.result.comparison.reference == "2"
    assert not codes(run(Options(maps=write(tmp_path, maps))))


def test_bad_input_is_named(tmp_path):
    known = room(2)
    maps = write(tmp_path, [known, known])
    with pytest.raises(ModelError, match="nothing to be compared with"):
        run(Options(maps=maps[:1]))
    with pytest.raises(ModelError, match="no such marker in all maps") as error:
        run(Options(maps=maps, reference="99"))
    assert error.value.key == "--reference"
    other = write(tmp_path, [known, take_markers(known, ["0", "1"])])
    with pytest.raises(ModelError, match="too few markers in all maps"):
        run(Options(maps=other))
    (tmp_path / "no.yaml").write_text("robocal: 1\nkind: lens\n")
    with pytest.raises(FormatError, match="no map"):
        run(Options(maps=(maps[0], tmp_path / "no.yaml")))
    with pytest.raises(InputError):
        run(Options(maps=(maps[0], tmp_path / "absent.yaml")))

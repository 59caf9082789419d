"""Photographs in a map: poses are met as their sigma says, what contradicts the map is named, and two poses are never one."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from held_map_world import draw_room, eye, lens_known, room, views_of_room, write_room
from lens_world import LENS

from robocal.errors import InputError
from robocal.geometry import se3, so3
from robocal.verbs.verify import Options as Verify
from robocal.verbs.verify import run as verify
from robocal.verbs.vision.map import Options, run
from robocal.vision.lenses import Lens


def place(folder, **options):
    return run(Options(corners=folder / "corners.csv", held=folder / "map.yaml", lens=folder / "lens.yaml", **options))


def codes(made):
    return [r.code for r in made.remarks]


def errors(views, where):
    """Small motions (V, 6) from the poses that were found to the true ones."""
    return np.hstack(se3.displacement(views.poses, where))


def test_a_map_whose_sizes_are_not_those_of_its_distances_is_not_trusted(tmp_path):
    """Distances that are 2 % too large put every camera as far off; in one scale with the sizes they are a matter of --size."""
    rng, known = np.random.default_rng(2), room()
    rows, _ = views_of_room(known, rng, 4)
    vector = known.vector * np.repeat([1.02, 1.0], 3)
    made = place(write_room(tmp_path, replace(known, vector=vector), rows))
    assert not made.trusted and "map-sizes-unlike" in [r.code for r in made.result.reasons]
    assert " 122." in made.result.reasons[0].sentence or " 117." in made.result.reasons[0].sentence
    scaled = replace(known, vector=vector, size=1.02 * known.size)
    made = place(write_room(tmp_path, scaled, rows))
    assert made.trusted  # nobody says how large the markers are
    told = {"corners": {}, "image": list(lens_known().size), "target": {"kind": "markers", "dictionary": "36h11"}}
    told["target"]["size"] = {"value": 120.0, "unit": "mm"}
    (tmp_path / "corners.json").write_text(json.dumps(told))
    made = place(tmp_path)
    assert not made.trusted and [r.code for r in made.result.reasons] == ["map-of-other-size"]
    made = place(write_room(tmp_path, known, rows))
    said = [r.code for r in made.remarks]
    assert made.trusted and "map-of-other-size" not in said  # obeys: map-of-other-size
    assert "map-sizes-unlike" not in said  # obeys: map-sizes-unlike


@pytest.mark.slow
def test_poses_are_met_as_their_sigma_says(tmp_path):
    """Over draws of map, lens and noise, one view of each: chi2 of six numbers has the mean 6 (its own error 0.6 of 36 draws)."""
    rng, known, found = np.random.default_rng(5), room(2), []
    for k in range(36):
        lens = dict(zip(LENS, np.array(list(LENS.values())) + [*rng.normal(0, 0.5, 4), *[0] * 5], strict=True))
        rows, where = views_of_room(draw_room(known, rng), rng, 2, lens=lens)
        views = place(write_room(tmp_path, known, rows)).result.views
        e, c = errors(views, where)[k % 2], views.covariance[k % 2]
        found.append(e @ np.linalg.solve(c, e))
    assert 4.0 < np.mean(found) < 8.0, np.mean(found)


def test_sigma_holds_map_and_lens(tmp_path):
    """Each makes it larger; a map and a lens that state none are named, and count as exact."""
    rng, known = np.random.default_rng(2), room()
    rows, where = views_of_room(known, rng, 4)
    whole = place(write_room(tmp_path, known, rows))
    assert not codes(whole) and whole.trusted
    exact = Lens.of("brown", list(LENS.values()), lens_known().size)
    sizes = {}
    for name, given, lens, told in (
        ("both", known, lens_known(), []),
        ("map", known, exact, ["lens-without-sigma"]),
        ("lens", replace(known, covariance=None), lens_known(), ["map-without-sigma"]),
        ("none", replace(known, covariance=None), exact, ["map-without-sigma", "lens-without-sigma"]),
    ):
        made = place(write_room(tmp_path, given, rows, lens=lens))
        assert codes(made) == told, name
        sizes[name] = np.trace(made.result.views.covariance, axis1=1, axis2=2).mean()
        assert np.linalg.norm(errors(made.result.views, where)[:, :3], axis=1).max() < 0.01
    assert sizes["both"] > sizes["map"] > sizes["none"] and sizes["both"] > sizes["lens"] > sizes["none"]


# obeys: map-without-sigma
# obeys: lens-without-sigma
def test_a_map_and_a_lens_with_sigma_are_not_named(tmp_path):
    rows, _ = views_of_room(room(), np.random.default_rng(2), 2)
    bare = replace(room(), covariance=None)
    exact = Lens.of("brown", list(LENS.values()), lens_known().size)
    assert set(codes(place(write_room(tmp_path, bare, rows, lens=exact)))) == {
        "map-without-sigma",
        "lens-without-sigma",
    }
    assert not codes(place(write_room(tmp_path, room(), rows)))


def test_straight_into_verify(tmp_path):
    """One chain of commands: the list is read without a remark, and the errors are those of the poses."""
    rng, known = np.random.default_rng(3), room()
    rows, where = views_of_room(known, rng, 6)
    made = place(write_room(tmp_path, known, rows), output=tmp_path / "poses.csv")
    assert {p.name for p in made.written} == {"poses.csv", "poses.json", "poses.html"}
    head = "id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]\n"
    vectors = se3.to_vector(where)
    lines = [
        ",".join([f"v{k}", *(f"{x:.9g}" for x in [*1e3 * v[:3], *np.degrees(v[3:])])]) for k, v in enumerate(vectors)
    ]
    (tmp_path / "tracker.csv").write_text(head + "\n".join(lines) + "\n")
    compared = verify(Verify(str(tmp_path / "tracker.csv"), (str(tmp_path / "poses.csv"),)))
    assert compared.trusted and not codes(compared)
    spread = compared.result.spreads["poses"]["as measured"]
    away = 1e3 * np.linalg.norm(errors(made.result.views, where)[:, :3], axis=1)
    assert spread.position.mean == pytest.approx(away.mean(), rel=1e-6) and away.mean() < 8.0
    page = (tmp_path / "poses.html").read_text()
    assert "Images in the map" in page and 'class="camera"' in page


# obeys: view-has-two-poses
def test_one_marker_from_the_front_has_two_poses(tmp_path):
    """Both are told, one of them is the true one, and neither is in the list; more markers decide."""
    known, rng = room(), np.random.default_rng(10)
    eyes = [eye((-1, 0.12, 0.1), (1.0, -0.2, 0.9), rng, 0.02), eye((-1, -0.9, 0.1), (0.6, 0.7, 0.9), rng, 0.02)]
    rows, where = views_of_room(known, rng, 2, noise=0.4, only=("0",), eyes=eyes)
    made = place(write_room(tmp_path, known, rows, sigma=0.4), output=tmp_path / "poses.csv")
    assert codes(made) == ["view-has-two-poses"] and [r.view for r in made.result.views.rivals] == [0]
    assert [line.split(",")[0] for line in (tmp_path / "poses.csv").read_text().splitlines()] == ["id", "v1"]
    two = [made.result.views.poses[0], made.result.views.rivals[0].pose]
    apart = [np.linalg.norm(se3.displacement(t, where[0])[1]) for t in two]
    assert min(apart) < 0.2 and np.linalg.norm(so3.log(two[0][:3, :3].T @ two[1][:3, :3])) > 0.1
    rivals = made.document()["rivals"]["columns"]
    assert rivals[0]["values"] == ["v0", "v0"] and sum(rivals[2]["values"]) == pytest.approx(1)
    rows, _ = views_of_room(known, rng, 2, noise=0.4, eyes=eyes)
    assert not codes(place(write_room(tmp_path, known, rows, sigma=0.4)))


# obeys: map-marker-moved
def test_a_marker_that_moved_is_named_with_millimetres(tmp_path):
    known, rng = room(), np.random.default_rng(4)
    vector = known.vector.copy()
    vector[1, :3] += [0.0, 0.012, 0.005]
    there = replace(known, vector=vector, covariance=None)
    rows, where = views_of_room(there, rng, 8)
    made = place(write_room(tmp_path, known, rows))
    (moved,) = made.result.views.moved
    assert moved.name == "1" and moved.distance == pytest.approx(0.013, abs=0.003) and moved.aside == moved.corners
    assert codes(made) == ["map-marker-moved"] and "marker 1 " in made.remarks[0].sentence
    assert np.linalg.norm(errors(made.result.views, where)[:, :3], axis=1).max() < 0.01
    assert not codes(place(write_room(tmp_path, replace(known, vector=vector), rows)))
    # A map that states no sigma is exact: the corners themselves are set aside.
    bare = place(write_room(tmp_path, replace(known, covariance=None), rows))
    assert [m.name for m in bare.result.views.moved] == ["1"]


# obeys: view-without-map
# obeys: markers-not-in-map
def test_what_the_map_does_not_have_is_named(tmp_path):
    known, rng = room(), np.random.default_rng(6)
    rows, _ = views_of_room(known, rng, 3)
    more = [*rows, ("v9", "0", 0, 300.0, 300.0), *(("v0", "77", j, 10.0 * j, 5.0) for j in range(4))]
    made = place(write_room(tmp_path, known, more))
    assert codes(made) == ["view-without-map", "markers-not-in-map"]
    assert made.result.views.lacking == ("v9",) and made.result.views.strangers == ("77",)
    assert not codes(place(write_room(tmp_path, known, rows)))


# obeys: map-unlike-views
# obeys: map-corners-excluded
def test_another_lens_or_room_is_not_trusted(tmp_path):
    known, rng = room(), np.random.default_rng(7)
    rows, _ = views_of_room(known, rng, 4)
    wide = Lens.of("brown", [700.0, 700, 640, 480, 0, 0, 0, 0, 0], lens_known().size)
    exact = replace(known, covariance=None)
    made = place(write_room(tmp_path, exact, rows, lens=wide))
    assert not made.trusted and made.result.reasons[0].code in ("map-unlike-views", "map-corners-excluded")
    vector = known.vector.copy()
    vector[[1, 5, 9], :3] += 0.05
    made = place(write_room(tmp_path, replace(known, vector=vector), rows))
    assert not made.trusted and "map-corners-excluded" in [r.code for r in made.result.reasons]
    assert [m.name for m in made.result.views.moved] == ["1", "5", "9"]
    # Markers 8 and 9 are seen in one view, and no other: nobody can tell which of them moved.
    assert [m.other for m in made.result.views.moved] == ["", "", "8"]
    assert place(write_room(tmp_path, known, rows)).trusted


@pytest.mark.parametrize(
    ("change", "words", "key"),
    [
        (lambda f: {"lens": None}, "this option needs a value", "--lens"),
        (lambda f: {"size": ("60",)}, "the map stays as it is", "--size"),
        (lambda f: {"image": "640x480"}, "images of another size", "--lens"),
        (lambda f: {"output": f / "poses.yaml"}, "has its own suffix", "--output"),
        (lambda f: {"held": f / "other.yaml"}, "no view shows a marker of the map", "marker"),
        (lambda f: {"corners": f / "lens.yaml"}, "not an image", None),
    ],
)
def test_bad_input_is_named(tmp_path, change, words, key):
    rows, _ = views_of_room(room(), np.random.default_rng(1), 2)
    folder = write_room(tmp_path, room(), rows)
    (folder / "other.yaml").write_text(
        "robocal: 1\nkind: map\nunits: {length: mm, angle: deg}\nmarkers:\n"
        "  - {id: 500, size: 120, xyz: [0, 0, 0], rotation_vector: [0, 0, 0]}\n"
    )
    options = {"corners": folder / "corners.csv", "held": folder / "map.yaml", "lens": folder / "lens.yaml"}
    before = sorted(p.name for p in folder.iterdir())
    with pytest.raises(InputError, match=words) as error:
        run(Options(**options | change(folder)))
    assert key is None or error.value.key == key
    assert sorted(p.name for p in folder.iterdir()) == before

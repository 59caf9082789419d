"""`vision map --sheet`: printed sheets that lie about, whose files say where their markers are; and corners fitted again in their images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal as run
from held_map_world import lens_known
from lens_world import LENS, SIZE, turn, write
from map_world import cameras, map_rows

import robocal as rc
from robocal.errors import ModelError
from robocal.files.lens import lens_text
from robocal.files.map import map_covariance_text, map_text
from robocal.files.sheet import read_sheet
from robocal.geometry import se3
from robocal.simulation.images import render
from robocal.vision.camera import image_of
from robocal.vision.sheets import marker_corners

PLACES = [
    se3.compose(turn(np.array([0.0, 0, 0.4])), [-0.2, 0.0, 0.0]),
    se3.compose(turn(np.array([0.3, 0, -1.0])), [0.15, 0.1, 0.05]),
]


def world(folder, *, scale=1.0, count=10, bend=None):
    """Two sheets at places in a room, corners of views of them, the lens; the sheets and T_camera_room."""
    (folder / "lens.yaml").write_text(lens_text(lens_known()))
    sheets = []
    for name, first in (("a", 0), ("b", 50)):
        words = f"--columns 3 --rows 4 --size 40 --first {first} -o {folder / name}.pdf"
        ran = run("vision", "sheet", *words.split())
        assert ran.status == 0, ran.err
        sheets.append(read_sheet(folder / f"{name}.yaml"))
    views, seen, names = cameras(np.random.default_rng(1), count), [], []
    for sheet in sheets:
        names += [m.id for m in sheet.markers]
    at = {n: i for i, n in enumerate(names)}
    for v, view in enumerate(views):
        for sheet, t in zip(sheets, PLACES, strict=True):
            for m in sheet.markers:
                corners = scale * marker_corners(m)
                if bend is not None and m.id == bend:
                    corners = corners + [0.02, 0, 0]
                there = corners @ t[:3, :3].T + t[:3, 3]
                uv = image_of(there @ view[:3, :3].T + view[:3, 3], np.array(list(LENS.values())))
                if (uv > 2).all() and (uv < np.array(SIZE) - 3).all():
                    seen.append((v, at[m.id], uv))
    rows = map_rows(seen, 0.1, np.random.default_rng(2), names)
    write(folder / "corners.csv", rows)
    return sheets, views


def find(folder, *sheets, **how):
    return rc.camera.map(
        folder / "corners.csv", lens=folder / "lens.yaml", sheet=[folder / f"{s}.yaml" for s in sheets], **how
    )


def distance(made, one, other):
    known = made.result.map
    return float(np.linalg.norm(known.vector[known.names.index(one), :3] - known.vector[known.names.index(other), :3]))


def test_two_sheets_are_one_map(tmp_path):
    """Sizes come from the sheets; places on them help; the edge as measured tells the scale of all."""
    sheets, _ = world(tmp_path, scale=1.02)
    made = find(tmp_path, "a", "b", size="40.8")
    assert [Path(i.file).name for i in made.result.inputs][-2:] == ["a.yaml", "b.yaml"]
    assert made.result.trusted and not made.result.fit.displaced
    a = {str(m.id): m for m in sheets[0].markers}
    one, other = (np.array([a[n].x, a[n].y]) for n in ("0", "11"))
    apart = 1.02 * np.linalg.norm(other - one)
    sigma = 0.2 / 40.8 * apart
    assert abs(distance(made, "0", "11") - apart) < 3 * sigma
    loose = rc.camera.map(tmp_path / "corners.csv", lens=tmp_path / "lens.yaml", size="40.8")
    both = [np.sqrt(np.diag(m.result.map.covariance).reshape(-1, 6)[:, 3:].mean()) for m in (made, loose)]
    assert both[0] < both[1]
    plain = find(tmp_path, "a", "b")
    assert plain.result.map.size.mean() == pytest.approx(0.04, rel=2e-3)


# obeys: marker-moved-since
def test_a_marker_that_is_not_where_its_sheet_has_it_is_named(tmp_path):
    world(tmp_path, bend=52)
    made = find(tmp_path, "a", "b")
    (named,) = (r for r in made.remarks if r.code == "marker-moved-since")
    assert "b.yaml" in str(named) and "52" in str(named)


@pytest.mark.parametrize(
    ("how", "words", "key"),
    [
        ({"sheets": ("a", "a")}, "two sheets have one marker", "--sheet"),
        ({"sheets": ("a",)}, "markers without a size", "--size"),
        ({"sheets": ("a", "b"), "size": "60"}, "another size than that of the sheet", "--size"),
        ({"sheets": ("a", "b"), "size": "777=40"}, "a size of a marker that no view shows", "--size"),
        ({"sheets": ("a", "b", "c")}, "the sheet has none of the markers", "--sheet"),
        ({"sheets": ("d",)}, "a sheet without markers", "--sheet"),
    ],
)
def test_what_no_sheets_are_is_named(tmp_path, how, words, key):
    world(tmp_path, count=4)
    for name, rest in (
        ("c", "grid --columns 3 --rows 4 --size 40 --first 100"),
        ("d", "checkerboard --columns 8 --rows 6 --square 20"),
    ):
        ran = run("vision", "sheet", "--pattern", *rest.split(), "-o", str(tmp_path / f"{name}.pdf"))
        assert ran.status == 0, ran.err
    with pytest.raises(ModelError, match=words) as error:
        find(tmp_path, *how.pop("sheets"), **how)
    assert error.value.argument == key.lstrip("-")


@pytest.mark.slow
def test_corners_of_a_list_are_fitted_again_in_its_images(tmp_path):
    """Corners that were found without the lens are bent by it; `--images` finds them with the lens of the map, a held map too."""
    cv2 = pytest.importorskip("cv2")
    sheets, views = world(tmp_path, count=6)
    (tmp_path / "images").mkdir()
    numbers = np.array(list(LENS.values()))
    for v, view in enumerate(views):
        image = render([(s, view @ t) for s, t in zip(sheets, PLACES, strict=True)], numbers, SIZE)
        cv2.imwrite(str(tmp_path / "images" / f"v{v}.png"), image)
    words = f"{tmp_path}/images --dictionary 6x6_250 -o {tmp_path}/corners.csv --force"
    assert run("vision", "detect", *words.split()).status == 0
    before, after = (find(tmp_path, "a", "b", **how) for how in ({}, {"images": str(tmp_path / "images")}))
    assert after.result.trusted and after.result.errors.every < 0.5 * before.result.errors.every
    with pytest.raises(ModelError, match="images twice"):
        rc.camera.map(tmp_path / "images", lens=tmp_path / "lens.yaml", size="40", images=str(tmp_path / "images"))
    (tmp_path / "map.yaml").write_text(map_text(after.result.map, "robocal", "map.csv"))
    (tmp_path / "map.csv").write_text(map_covariance_text(after.result.map))
    places = [
        rc.camera.map(
            tmp_path / "corners.csv", lens=tmp_path / "lens.yaml", held=tmp_path / "map.yaml", **how
        ).result.views.left
        for how in ({}, {"images": str(tmp_path / "images")})
    ]
    assert places[1] < 0.5 * places[0]

"""`vision export`: maps and lenses in every format and back, and what a format cannot hold is said."""

from __future__ import annotations

import numpy as np
import pytest
from held_map_world import lens_known, room

from robocal.errors import InputError, ModelError
from robocal.files.lens import FORMS, lens_text, read_lens
from robocal.files.map import MAP_FORMS, map_covariance_text, map_text, read_map
from robocal.verbs.vision.export import Options, run

LACKS = {
    "markermapper": "sigma",
    "ply": "sigma",
    "tagslam": "correlations",
    "opencv": "sigma",
    "ros": "sigma",
    "kalibr": "sigma",
}


@pytest.fixture
def place(tmp_path):
    (tmp_path / "map.yaml").write_text(map_text(room(), "robocal", "map.covariance.csv"))
    (tmp_path / "map.covariance.csv").write_text(map_covariance_text(room()))
    (tmp_path / "lens.yaml").write_text(lens_text(lens_known()))
    return tmp_path


def lacks(made):
    return [r.numbers["what"] for r in made.remarks]


@pytest.mark.parametrize("form", MAP_FORMS)
def test_a_map_in_every_format(place, form):
    name = {"ply": "out.ply", "json": "out.json"}.get(form, "out.yaml")
    given = None if form in ("ply", "json", "robocal") else form
    made = run(Options(place / "map.yaml", form=given, output=place / name))
    wanted = {name, "out.covariance.csv"} if form == "robocal" else {name}
    assert {p.name for p in made.written} == wanted and made.trusted
    found = read_map(place / name)
    assert found.form == form and lacks(made) == ([LACKS[form]] if form in LACKS else [])
    np.testing.assert_allclose(found.map.corners, room().corners, atol=2e-9)
    back = run(Options(place / name, output=place / "back.yaml"))
    assert read_map(place / "back.yaml").map.names == room().names
    assert ("back.covariance.csv" in {p.name for p in back.written}) == (form in ("robocal", "json", "tagslam"))


@pytest.mark.parametrize("form", [f for f in FORMS if f != "kalibr"])
def test_a_lens_in_every_format(place, form):
    name = "lens.yml" if form == "opencv" else "out.yaml"
    made = run(Options(place / "lens.yaml", form=form, output=place / name))
    found = read_lens(place / name)
    assert found.form == form and found.lens.numbers == lens_known().numbers
    assert lacks(made) == ([LACKS[form]] if form in LACKS else [])
    shown = run(Options(place / "lens.yaml", form=form))
    assert shown.text == (place / name).read_text() and shown.document()["text"] == shown.text
    again = run(Options(place / name, form="robocal", output=place / "again.yaml"))
    assert read_lens(place / "again.yaml").lens.numbers == lens_known().numbers and not lacks(again)


def test_bad_input_is_named(place):
    before = sorted(p.name for p in place.iterdir())
    for options, words, key in (
        ({"form": "plyy"}, "no such format", "--form"),
        ({"form": "ros"}, "no such format", "--form"),
        ({"output": place / "map.txt"}, "no such format", "--form"),
        ({"form": "robocal"}, "two files", "--output"),
    ):
        with pytest.raises(ModelError, match=words) as error:
            run(Options(place / "map.yaml", **options))
        assert error.value.key == key
    (place / "robot.yaml").write_text("joints: []\n")
    for name in ("robot.yaml", "absent.yaml", "map.covariance.csv"):
        with pytest.raises(InputError):
            run(Options(place / name, form="ply"))
    (place / "robot.yaml").unlink()
    with pytest.raises(InputError, match="exists"):
        run(Options(place / "map.yaml", form="json", output=place / "lens.yaml"))
    assert sorted(p.name for p in place.iterdir()) == before

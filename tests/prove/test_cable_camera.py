"""A platform on cables with a camera that looks at markers: one estimate through the files of the example."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from cli.runs import shared

EXAMPLE = Path(__file__).parents[2] / "examples" / "cable-camera"
CODE = "prior-contradicted"


def identify(folder, change=lambda text: text, lengths=lambda text: text):
    """The example with another pixels.yaml, or other lengths."""
    for name in ("robot.yaml", "lengths.yaml", "pixels.csv"):
        (folder / name).write_text((EXAMPLE / name).read_text())
    (folder / "lengths.csv").write_text(lengths((EXAMPLE / "lengths.csv").read_text()))
    (folder / "pixels.yaml").write_text(change((EXAMPLE / "pixels.yaml").read_text()))
    files = [folder / n for n in ("robot.yaml", "lengths.yaml", "pixels.yaml")]
    return shared("identify", *files, "--no-leave-one-out", "--json")


def lens_within(sigma):
    """The distortion stated to `sigma`."""
    return lambda text: re.sub(r"(k1|k2|p1|p2): 0\.05", rf"\1: {sigma}", text)


def codes(ran):
    return [r["code"] for r in ran.document["remarks"]]


@pytest.mark.slow
def test_a_wrong_k1_is_found_beside_the_robot(tmp_path):
    ran = identify(tmp_path)
    assert ran.status == 0 and ran.document["verdict"]["status"] == "improved" and CODE not in codes(ran)
    found = {p["name"]: p for p in ran.document["parameters"]}
    for name, true in (("lens.k1", -0.18), ("lens.fx", 900.0), ("eye.z", -0.25)):
        assert abs(found[name]["identified"] - true) < max(4 * found[name]["sigma"], 8e-3), name
    # The print is 0.3 % off, to one side or the other, and the cables tell which.
    assert abs(abs(found["print.size"]["identified"] - 1) - 3e-3) < 4 * found["print.size"]["sigma"]
    for group in ran.document["fit"]["groups"]:
        assert group["chi2"] < 1.3 * group["dof"]
    said = {(g["name"], g["kind"]): g for g in ran.document["fit"]["agreement"]}
    assert [k[1] for k in said] == ["lengths", "pixels", "place", "lens", "size"]
    assert all(g["chi2"] < 3 * g["dof"] for g in said.values())
    # 0.3 px of 900 px a radian, seen from 1 to 2 m.
    assert 0.2 < said["eye", "pixels"]["length"] < 0.8 and said["lens", "lens"]["length"] is None


# obeys: prior-contradicted
@pytest.mark.slow
def test_a_lens_that_is_stated_too_well_names_the_camera(tmp_path):
    ran = identify(tmp_path, lens_within("0.0005"))
    (said,) = [r for r in ran.document["remarks"] if r["code"] == CODE]
    assert "the camera (lens)" in said["sentence"] and said["numbers"]["z"] > 5
    worst = max((g for g in ran.document["fit"]["agreement"] if g["z"]), key=lambda g: g["z"])
    assert (
        worst["name"] == "lens"
        and worst["z"] == pytest.approx(said["numbers"]["z"])
        and worst["chi2"] > 25 * worst["dof"]
    )
    again = identify(tmp_path, lens_within("0.05"))
    assert CODE not in codes(again) and again.status == 0


def slip(text, cable=3, size=0.02):
    """A cable 20 mm longer from the sixteenth pose on."""
    head, *rows = [line.split(",") for line in text.splitlines()]
    for row in rows[15:]:
        row[cable] = f"{float(row[cable]) + size:.6f}"
    return "\n".join(map(",".join, [head, *rows])) + "\n"


@pytest.mark.slow
def test_a_cable_that_slipped_is_named_beside_a_camera(tmp_path):
    """Views have more or fewer pixels: that must not keep anybody from looking for a step."""
    ran = identify(tmp_path, lengths=slip)
    (said,) = [r for r in ran.document["verdict"]["reasons"] if "slipped" in r]
    assert ran.status == 3 and "from row 17 to row 31 c3.l0" in said
    assert 18 < float(re.search(r"off by ([\d.]+) mm", said)[1]) < 22


@pytest.mark.slow
@pytest.mark.parametrize(("cable", "size"), [(1, 0.02), (4, 0.02), (4, 0.05)])
def test_a_cable_that_slipped_where_poses_follow_it_is_named(tmp_path, cable, size):
    """What rows leave shows little of it: a score beside the frames that may have moved does."""
    ran = identify(tmp_path, lengths=lambda text: slip(text, cable, size))
    (said,) = [r for r in ran.document["verdict"]["reasons"] if "slipped" in r]
    assert ran.status == 3 and f"from row 17 to row 31 c{cable}.l0" in said
    assert float(re.search(r"off by ([\d.]+) mm", said)[1]) == pytest.approx(1e3 * size, rel=0.1)


@pytest.mark.slow
def test_a_place_that_its_prior_holds_back_is_named(tmp_path):
    """30 mm off with a sigma of 2 mm: the data move it by 9 mm only, farther than they should."""
    ran = identify(tmp_path, lambda text: text.replace("0.010000, -0.25", "0.040000, -0.25"))
    (said,) = [r for r in ran.document["remarks"] if r["code"] == CODE]
    assert "the place of eye" in said["sentence"] and said["numbers"]["name"] == "eye.y"

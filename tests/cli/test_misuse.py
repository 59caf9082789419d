"""What people get wrong with each kind of measurement, and what the command line makes of it: never a quiet `improved`."""

from __future__ import annotations

import csv
import math
import re
import shutil

import pytest
from cli.runs import robocal
from cli.test_kinds import simulated


def changed(sim, folder, columns=None, change=None, keep=None, settings=None):
    """A copy of simulated data with a function of some columns, and other lines of data.yaml."""
    shutil.copytree(sim, folder)
    remarks, rows = [], []
    for line in (folder / "data.csv").read_text(encoding="utf-8").splitlines():
        (remarks if line.startswith("#") else rows).append(line)
    table = list(csv.reader(rows))
    bare = [re.sub(r"\s*\[.*", "", name) for name in table[0]]
    for row in table[1:]:
        at = [bare.index(c) for c in columns or ()]
        for i, value in zip(at, change(*(float(row[i]) for i in at)) if at else (), strict=True):
            row[i] = repr(value)
    body = table[1:] if keep is None else keep(table[1:])
    (folder / "data.csv").write_text("\n".join(map(",".join, [table[0], *body])) + "\n", encoding="utf-8")
    text = (folder / "data.yaml").read_text(encoding="utf-8")
    if settings is not None:
        assert settings(text) != text
        (folder / "data.yaml").write_text(settings(text), encoding="utf-8")
    return "identify", folder / "robot.yaml", folder / "data.yaml", "--json"


@pytest.mark.parametrize(
    ("kind", "section", "columns"),
    [
        ("spherical", "range", ["range"]),
        ("range", "range", ["range"]),
        ("distance", "distance", ["distance"]),
        ("displacement", "displacement", ["dx", "dy", "dz"]),
        ("relative_pose", "position", ["x", "y", "z"]),
    ],
)
def test_metres_where_millimetres_are_stated(tmp_path, kind, section, columns):
    """Taken at their word they are met by an arm without links."""
    sim = simulated(tmp_path, kind)
    ran = robocal(*changed(sim, tmp_path / "m", columns, lambda *v: [x / 1000 for x in v]))
    assert ran.status == 2 and f"{section}.unit" in ran.err and "probably in m:" in ran.err, ran.err


def test_transposed_rotations_are_named(tmp_path):
    """The lengths alone would carry the verdict."""
    sim = simulated(tmp_path, "pose")
    ran = robocal(*changed(sim, tmp_path / "wrong", ["rx", "ry", "rz"], lambda *v: [-x for x in v]))
    assert ran.status == 2 and "the rotations are transposed" in ran.err


def test_an_azimuth_that_counts_the_other_way_is_named(tmp_path):
    sim = simulated(tmp_path, "spherical")
    ran = robocal(*changed(sim, tmp_path / "wrong", ["azimuth"], lambda a: [-a]))
    assert ran.status == 2 and "azimuth" in ran.err and "clockwise" in ran.err, ran.err


def test_angles_that_are_not_explained(tmp_path):
    """The lengths alone would carry the verdict."""
    sim, columns = simulated(tmp_path, "relative_pose"), ["rx", "ry", "rz"]
    ran = robocal(*changed(sim, tmp_path / "wrong", columns, lambda *v: [math.radians(x) for x in v]))
    assert ran.status == 3 and ran.document["verdict"]["status"] != "improved", ran.document["verdict"]


@pytest.mark.parametrize("kind", ["position", "distance", "point", "pixels"])
def test_one_row_again_and_again(tmp_path, kind):
    """Met exactly in any unit: no proof that another one was meant. Copies are refused; what differs in a digit is no copy."""
    sim = simulated(tmp_path, kind)

    def again(rows, differ):
        return [[f"c{i}", repr(float(rows[0][1]) + differ * i), *rows[0][2:]] for i in range(30)]

    ran = robocal(*changed(sim, tmp_path / "same", keep=lambda rows: again(rows, 0.0)))
    assert ran.status == 2 and "29 of 30 rows" in ran.document["error"]["found"], ran.err
    ran = robocal(*changed(sim, tmp_path / "near", keep=lambda rows: again(rows, 1e-6)))
    assert ran.status == 3 and ran.document["verdict"]["status"] != "improved", ran.err


def test_two_rows_prove_no_unit(tmp_path):
    sim = simulated(tmp_path, "point")
    assert robocal(*changed(sim, tmp_path / "two", keep=lambda rows: rows[:2])).status == 3


@pytest.fixture(scope="module")
def sockets(tmp_path_factory):
    """A UR10 with two sockets a known distance apart."""
    folder = tmp_path_factory.mktemp("sockets") / "sim"
    made = robocal("simulate", "ur10", "--kind", "point", "-n", 60, "-o", folder)
    assert made.status == 0, made.err
    return folder


def test_the_distance_that_gives_the_scale(sockets, tmp_path):
    """Nothing else knows the scale, so nobody may call it an outlier; five millimetres too much is said by the lengths."""
    right = robocal("identify", sockets / "robot.yaml", sockets / "data.yaml", "--json").document
    assert right["outliers"] == [] and not any("lengths all change" in w for w in right["warnings"])

    def longer(text):
        return re.sub(r"distance: ([\d.]+)", lambda found: f"distance: {float(found[1]) + 5}", text)

    wrong = robocal(*changed(sockets, tmp_path / "far", settings=longer)).document
    assert wrong["verdict"]["status"] == "refused" and wrong["verdict"]["remarks"][0]["code"] == "scale-wrong"
    assert wrong["scale"]["factor"] == pytest.approx(5 / 300, rel=0.15)


def test_what_is_proven_is_what_is_handed_back(tmp_path):
    """A joint a quarter turn off: the fit without the unseen rows finds it, the fit to everything does not."""
    folder = tmp_path / "sim"
    assert robocal("simulate", "ur10", "--kind", "distance", "-n", 60, "-o", folder).status == 0
    ran = robocal(*changed(folder, tmp_path / "turned", ["j2"], lambda a: [a + 90]))
    found = ran.document
    left = max(g["rms"] for g in found["fit"]["groups"])
    assert found["verdict"]["status"] != "improved" or left < 1.0, (left, found["verdict"])


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("kind", "unit"), [("bearing", "deg"), ("pixels", "px"), ("position", "mm")])
def test_residuals_and_report_in_the_unit_of_the_kind(tmp_path, kind, unit):
    sim = simulated(tmp_path, kind)
    run = tmp_path / "run"
    ran = robocal("identify", sim / "robot.yaml", sim / "data.yaml", "-o", run, "--json")
    quantity = "angle_" if unit == "deg" else ""
    with (run / "residuals.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    held = [float(r[f"{quantity}held_out_{unit}"]) for r in rows if r["set"] == "held_out"]
    assert sum(held) / len(held) == pytest.approx(ran.document["residuals"]["held_out"]["mean"])
    report = (run / "report.html").read_text(encoding="utf-8")
    assert "Largest remaining errors" in report and "How large the errors are" in report
    assert "The same for orientation" not in report


def test_an_arm_that_shrinks_to_nothing_is_refused(tmp_path):
    """Planes are met by it, those held out too: the errors alone would call it the best arm of all."""
    sim = tmp_path / "sim"
    assert robocal("simulate", "ur10", "--kind", "plane", "-n", 60, "-o", sim).status == 0
    free = ("--free", "j2,j3,j4,j5,tool", "--keep-all", "--iterations", 2000)
    ran = robocal("identify", sim / "robot.yaml", sim / "data.yaml", *free, "--json")
    assert ran.document["residuals"]["held_out"]["mean"] < 1e-6
    assert ran.status == 3 and ran.document["verdict"]["remarks"][0]["code"] == "scale-wrong"


@pytest.mark.parametrize("value", ["0", "-15"])
def test_a_sphere_has_a_radius(tmp_path, value):
    sim = simulated(tmp_path, "sphere")
    ran = robocal(*changed(sim, tmp_path / "r", settings=lambda t: re.sub(r"value: [\d.]+", f"value: {value}", t)))
    assert ran.status == 2 and "radius.value" in ran.err and "not a radius" in ran.err


def test_directions_validate_no_lengths(tmp_path):
    sim = simulated(tmp_path, "bearing")
    ran = robocal("validate", sim / "truth.yaml", sim / "data.yaml", "--json")
    assert ran.status == 3 and ran.document["reasons"] == [
        "no lengths were measured, and a model is validated in lengths"
    ]


def test_copied_rows_are_noticed(tmp_path):
    sim = simulated(tmp_path, "position")
    command = changed(sim, tmp_path / "twice", keep=lambda rows: rows + rows[:3])
    said = [w for w in robocal(*command).document["warnings"] if "count twice" in w]
    assert len(said) == 1 and "3 measurements equal another" in said[0]
    clean = robocal("identify", sim / "robot.yaml", sim / "data.yaml", "--json").document["warnings"]
    assert not any("count twice" in w for w in clean)


def test_pixels_that_the_camera_does_not_explain_are_named(tmp_path):
    sim = simulated(tmp_path, "pixels")
    command = changed(
        sim, tmp_path / "lens", settings=lambda text: re.sub(r"fx: \d+, fy: \d+", "fx: 1000, fy: 1000", text)
    )
    said = robocal(*command).document["warnings"]
    assert any(re.search(r" px per axis, the stated noise [\d.e+-]+ px;", w) for w in said), said

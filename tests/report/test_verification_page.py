"""Figures of a verification: what is drawn is what the document says, and a page is drawn again from its folder."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from cli.runs import robocal
from cli.test_verify import shaken, text

from robocal.arms import catalog
from robocal.report.numbers import significant

SVG = "{http://www.w3.org/2000/svg}"
TEN = Path(__file__).parents[2] / "examples" / "cable-calibration" / "ten"


def cable(folder: Path) -> list[Path]:
    """The ten poses of the example: an external instrument, the platform by its cables, a camera."""
    return [Path(shutil.copy(TEN / f"{name}.csv", folder)) for name in ("tracker", "robot", "camera")]


def arm(folder: Path) -> list[Path]:
    """Poses of an arm in two lists, and those of an instrument."""
    rng = np.random.default_rng(4)
    chain = catalog.get("rv-2aj")
    poses = chain.pose(rng.uniform(*chain.limits.T, (30, 5)))
    ids = [f"p{i}" for i in range(30)]
    head, *rows = text(ids, poses).splitlines()
    grouped = [f"{head},group", *(f"{row},{'AB'[i % 2]}" for i, row in enumerate(rows))]
    (folder / "tracker.csv").write_text("\n".join(grouped) + "\n")
    (folder / "arm.csv").write_text(text(ids, shaken(poses, rng, 1e-3)))
    return [folder / "tracker.csv", folder / "arm.csv"]


def picture(page: str, key: str) -> tuple[list[str], list[float], list[tuple[float, float]]]:
    """The texts of a picture, where its dots stand, and the ends of its bars."""
    svg = ElementTree.fromstring(re.findall(rf'<svg[^>]*aria-labelledby="{key}-t.*?</svg>', page, re.S)[0])
    texts = ["".join(t.itertext()) for t in svg.iter(f"{SVG}text")]
    paths = {str(p.get("class")): str(p.get("d")) for p in svg.iter(f"{SVG}path")}
    dots = [float(x) + 3.6 for x in re.findall(r"M(-?[\d.]+) -?[\d.]+a", paths["mark after"])]
    bars = [str(p.get("d")) for p in svg.iter(f"{SVG}path") if p.get("class") == "scatter"]
    return texts, dots, [(float(e[1]), float(e[2])) for d in bars if (e := re.match(r"M([\d.]+) [\d.]+H([\d.]+)", d))]


def assert_drawn(page: str, key: str, told: dict[str, dict[str, dict]], what: str) -> None:
    """Every mean and deviation, in numbers and where it is drawn."""
    views = dict.fromkeys(v for of in told.values() for v in of)
    every = [(name, of[v][what]) for v in views for name, of in told.items() if v in of]
    texts, dots, bars = picture(page, key)
    for name, s in every:
        assert name in texts and f"{significant(s['mean'])} ± {significant(s['sd'], 2)}" in texts
    assert len(dots) == len(bars) == len(every)
    mean, sd = (np.array([s[k] for _, s in every]) for k in ("mean", "sd"))
    scale = np.log if any("logarithmic" in t for t in texts) else np.asarray
    slope, start = np.polyfit(scale(mean), dots, 1)
    assert slope > 0 and np.abs(start + slope * scale(mean) - dots).max() < 0.15
    assert np.abs(start + slope * scale(mean + sd) - [b for _, b in bars]).max() < 0.3


@pytest.mark.sampled(1)
@pytest.mark.parametrize("made", [cable, arm])
def test_what_is_drawn_stands_in_the_document(made, tmp_path: Path) -> None:
    files, folder = made(tmp_path), tmp_path / "v"
    assert robocal("verify", *files, "-o", folder).status == 0
    document, page = json.loads((folder / "verify.json").read_text()), (folder / "report.html").read_text()
    for what in ("position", "orientation"):
        assert_drawn(page, f"views-{what}", document["sources"] | document["between"], what)
    if made is arm:
        assert (
            set(document["lists"]) == {"A", "B"} and document["lists"]["A"]["arm"]["as measured"]["position"]["n"] == 15
        )
        # Of the first pose, which is of list A, there is no motion.
        relative = [document["lists"][g]["arm"]["relative to the first"]["position"]["n"] for g in "AB"]
        assert relative == [14, 15]
        for what in ("position", "orientation"):
            assert_drawn(page, f"list-0-{what}", {k: of["arm"] for k, of in document["lists"].items()}, what)
    else:
        between = document["between"]["robot - camera"]["as measured"]["position"]
        places = [np.loadtxt(f, delimiter=",", skiprows=1, usecols=(1, 2, 3)) for f in files[1:]]
        assert between["mean"] == pytest.approx(np.linalg.norm(places[0] - places[1], axis=1).mean(), rel=1e-6)
        assert document["lists"] == {}
    # Arrows: from the reference to each source, of at most two dozen poses; the picture turns, and has the same numbers.
    columns = {c["name"]: np.array(c["values"]) for c in document["places"]["columns"]}
    drawn = json.loads(re.findall(r'id="arrow-data">(.*?)</script>', page, re.S)[0])
    panels = dict.fromkeys(zip(columns["source"].tolist(), columns["view"].tolist(), strict=True))
    assert len(panels) == len(drawn["panels"]) == 2 * (len(files) - 1)
    reference = np.loadtxt(files[0], delimiter=",", skiprows=1, usecols=(1, 2, 3))
    for key, (source, view) in zip(drawn["panels"], panels, strict=True):
        mine = (columns["source"] == source) & (columns["view"] == view)
        ids = columns["id"][mine].tolist()
        assert drawn["names"] == ids and len(ids) == min(24, len(document["poses"]))
        error = np.array([columns[f"d{a}"][mine] for a in "xyz"], float).T
        assert np.allclose(drawn[key], error, rtol=1e-4, atol=1e-9)
        at = np.array([columns[a][mine] for a in "xyz"], float).T
        assert np.allclose(at, reference[[document["poses"].index(i) for i in ids]], atol=1e-6)
        assert np.abs(np.diff(np.array(drawn["at"]) / drawn["scale"] - at, axis=0)).max() < 0.5
        if len(ids) == len(document["poses"]):
            sizes = np.linalg.norm(error, axis=1)
            assert document["sources"][source][view]["position"]["mean"] == pytest.approx(sizes.mean(), rel=1e-6)
    (folder / "report.html").unlink()
    assert robocal("report", folder).status == 0 and (folder / "report.html").read_text() == page


def test_groups_by_their_means_are_drawn_and_drawn_again(tmp_path: Path) -> None:
    rows = [
        "group,n,pos_mean [mm],pos_sd [m],ori_mean,ori_sd",
        "camera,10,25.8,0.0078,1.3,0.9",
        "encoders,10,28.6,0.0112,2.9,2.0",
    ]
    (tmp_path / "groups.csv").write_text("\n".join(rows) + "\n")
    assert robocal("verify", tmp_path / "groups.csv", "--summary", "-o", tmp_path / "v").status == 0
    columns = {
        (c["name"], c["unit"]): c["values"]
        for c in json.loads((tmp_path / "v" / "verify.json").read_text())["means"]["columns"]
    }
    assert columns["pos_mean", "mm"] == [25.8, 28.6] and columns["pos_sd", "mm"] == pytest.approx([7.8, 11.2])
    page = (tmp_path / "v" / "report.html").read_text()
    for k, numbers in enumerate((["25.8 ± 7.8", "28.6 ± 11"], ["1.30 ± 0.90", "2.90 ± 2.0"])):
        assert set(numbers) <= set(picture(page, f"group-{k}")[0])
    (tmp_path / "v" / "report.html").unlink()
    assert robocal("report", tmp_path / "v", "-o", tmp_path / "again.html").status == 0
    assert (tmp_path / "again.html").read_text() == page


def test_two_poses_are_drawn_too(tmp_path: Path) -> None:
    """Too few to be aligned; one error relative to the first has no deviation."""
    for file in cable(tmp_path):
        file.write_text("\n".join(file.read_text().splitlines()[:3]) + "\n")
    ran = robocal("verify", *(tmp_path / f"{n}.csv" for n in ("tracker", "robot", "camera")), "-o", tmp_path / "v")
    assert ran.status == 0, ran.err
    page = (tmp_path / "v" / "report.html").read_text()
    assert '"panels":["source-0","source-1"]' in page
    assert robocal("report", tmp_path / "v", "-o", tmp_path / "again.html").status == 0
    assert (tmp_path / "again.html").read_text() == page

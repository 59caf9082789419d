"""Maps of measured errors: what is drawn is what the document says, of arms and cable robots, in planes and in volumes."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from cables.cable_robots import box
from cli.runs import robocal

from robocal.files.cable.write import describe_cable
from robocal.report.error_map import ErrorMap, mean_by_place
from robocal.report.heat import COLOURS

EXAMPLE = Path(__file__).parents[2] / "examples" / "rv-2aj"


def plane(folder: Path) -> tuple[object, ...]:
    """A grid of the example's plane, where its robot really is."""
    spec = importlib.util.spec_from_file_location("rv_2aj_map", EXAMPLE / "make_data.py")
    assert spec and spec.loader
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    units = made.Units(made.UNITS["mm"], made.UNITS["deg"])
    grid = made.measured(made.fine_plane(9, 14), seed=None)
    (folder / "verification.csv").write_text(made.table_text(grid, made.catalog.get("rv-2aj"), units))
    shutil.copy(EXAMPLE / "verification.yaml", folder)
    return "rv-2aj", folder / "verification.yaml", "--against", EXAMPLE / "robot-paper.yaml"


def volume(folder: Path) -> tuple[object, ...]:
    robocal("simulate", "rv-2aj", "-n", 40, "--seed", 2, "-o", folder / "sim")
    return folder / "sim" / "truth.yaml", folder / "sim" / "data.yaml", "--against", folder / "sim" / "robot.yaml"


def cables(folder: Path) -> tuple[object, ...]:
    """Eight lengths and a pose at every place."""
    (folder / "robot.yaml").write_text(describe_cable(box()) + "calibrate: {free: [ax, ay, az, l0]}\n")
    sim = folder / "sim"
    robocal("simulate", folder / "robot.yaml", "-n", 40, "--frame", "none", "--seed", 3, "-o", sim)
    data = (sim / "lengths.yaml", sim / "pose.yaml")
    return sim / "truth.yaml", *data, "--against", sim / "robot.yaml"


def pictures(page: str) -> dict[str, ElementTree.Element]:
    """The maps by the column that they draw."""
    found = (ElementTree.fromstring(svg) for svg in re.findall(r'<svg[^>]*aria-labelledby="map-.*?</svg>', page, re.S))
    return {re.findall(r"map-(\w+)-t", str(svg.get("aria-labelledby")))[0]: svg for svg in found}


def dots(svg: ElementTree.Element) -> tuple[np.ndarray, np.ndarray]:
    """Where dots are drawn (n, 2), and the number of their colour (n,)."""
    at, step = [], []
    for path in svg.iter("{http://www.w3.org/2000/svg}path"):
        if path.get("stroke") in COLOURS:
            here = re.findall(r"M(-?[\d.]+) (-?[\d.]+)h0", str(path.get("d")))
            at += here
            step += [COLOURS.index(str(path.get("stroke")))] * len(here)
    return np.array(at, float), np.array(step)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("made", "layers"), [(plane, 1), (cables, 3), (volume, 3)])
def test_what_is_drawn_stands_in_the_document(made, layers, tmp_path: Path) -> None:
    ran = robocal("validate", *made(tmp_path), "-o", tmp_path / "v")
    assert ran.status == 0, ran.err
    document = json.loads((tmp_path / "v" / "validation.json").read_text())
    columns = {c["name"]: c["values"] for c in document["poses"]["columns"]}
    page = (tmp_path / "v" / "validation.html").read_text()
    drawn = pictures(page)
    assert set(drawn) == {"against", "error"}
    at = np.array([columns[a] for a in "xyz"]).T
    # Where instruments read the same coordinates: within the error of what was read there.
    file = {plane: "verification.csv", volume: None, cables: "sim/pose.csv"}[made]
    if file is not None:
        rows = [line.split(",") for line in (tmp_path / file).read_text().splitlines() if not line.startswith("#")]
        x = next(i for i, title in enumerate(rows[0]) if title.startswith("x "))
        unit = 1e3 if "[m]" in rows[0][x] else 1.0
        read = {r[0]: unit * np.array(r[x : x + 3], float) for r in rows[1:]}
        apart = np.linalg.norm(at - [read[i] for i in columns["configuration"]], axis=1)
        assert made is plane or apart.max() < 5
        assert made is cables or np.allclose(apart, columns["error"], atol=1e-4)
    places, row = np.unique(at.round(3), axis=0, return_inverse=True)
    assert len(places) == {plane: 126, volume: 40, cables: 40}[made]
    for name, svg in drawn.items():
        mean = np.array([np.mean(np.array(columns[name])[row.ravel() == k]) for k in range(len(places))])
        here, step = dots(svg)
        # Colours on a logarithmic scale of a decade and a half at most, each picture on its own.
        low = mean[mean > mean.max() / 10**1.5].min()
        share = np.log(np.maximum(mean, low) / low) / np.log(max(mean.max() / low, 1.2))
        told = np.minimum((10 * share).astype(int), 9)
        assert sorted(step) == sorted(told) and len(here) == len(places)
        # Each dot stands where its place is: on paper both axes are the base's, to the right or left, and up.
        titles = [str(t.text) for t in svg.iter("{http://www.w3.org/2000/svg}text")]
        heads = [t for t in titles if t.endswith(" places")]
        assert len(heads) == layers and sum(int(t.split(": ")[1].split()[0]) for t in heads) == len(places)
        axes = re.fullmatch(r"([xyz]) to the (right|left), ([xyz]) up, mm", next(t for t in titles if " up, mm" in t))
        assert axes
        sign = 1.0 if axes[2] == "right" else -1.0
        for colour in set(step.tolist()):
            across = sign * np.sort(sign * places[told == colour, "xyz".index(axes[1])])
            fit = np.polyfit(across, np.sort(here[step == colour, 0]), 1) if np.ptp(across) > 1 else None
            assert fit is None or (sign * fit[0] > 0)
            if fit is not None:
                assert np.abs(np.polyval(fit, across) - np.sort(here[step == colour, 0])).max() < 0.2
        said = str(next(svg.iter("{http://www.w3.org/2000/svg}desc")).text).replace("\u00a0", " ")
        assert said.startswith(f"{len(places)} places")
    # The page is drawn again from the document alone.
    (tmp_path / "v" / "validation.html").unlink()
    assert robocal("report", tmp_path / "v").status == 0
    assert (tmp_path / "v" / "validation.html").read_text() == page


def test_a_plane_is_seen_along_its_normal_and_a_volume_in_layers() -> None:
    rng = np.random.default_rng(1)
    flat = np.column_stack([rng.uniform(-200, 200, (50, 2)), np.zeros(50)])
    for along in range(3):
        turned = np.roll(flat, along - 2, axis=1) + [0, 0, 500]
        tilted = turned + 0.3 * np.roll(turned, 1, axis=1) * (np.arange(3) == along)
        for places in (turned, tilted):
            found = ErrorMap.of(places)
            assert found.along == along and len(found.ends) == 2
    found = ErrorMap.of(rng.uniform(-200, 200, (50, 3)))
    assert found.along == 2 and len(found.ends) == 4 and set(found.layer.tolist()) == {0, 1, 2}


@pytest.mark.parametrize("places", [np.zeros((5, 3)), np.outer(np.arange(5.0), [1, 2, 0]), np.eye(3).repeat(2, axis=0)])
@pytest.mark.parametrize("size", [0.0, 1e-12, 1e12])
def test_any_places_and_errors_can_be_drawn(places, size) -> None:
    ElementTree.fromstring(ErrorMap.of(1.0 * places).picture(np.full(len(places), size), "k", "t"))


def test_places_are_told_apart_and_rows_without_one_are_not_drawn() -> None:
    at = np.array([[0, 0, 0], [0, 0, 1e-5], [1, 0, 0], [np.nan, 0, 0], [2, 0, 0]])
    places, mean = mean_by_place(at, np.array([1.0, 3.0, 5.0, 7.0, np.nan]))
    assert places.tolist() == [[0, 0, 0], [1, 0, 0]] and mean.tolist() == [2.0, 5.0]


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d["poses"]["columns"][4]["values"].pop(), ("does not hold what its page draws",)),
        (lambda d: d["poses"]["columns"][4]["values"].__setitem__(0, "far"), ("does not hold what its page draws",)),
        (lambda d: d.pop("errors"), ("missing", "errors")),
        (lambda d: d.update(robocal=7), ("another schema",)),
        (lambda d: d["poses"].update(columns=3), ("columns",)),
    ],
)
def test_a_document_that_was_changed_is_refused(change, words, tmp_path: Path) -> None:
    old = Path(__file__).parents[1] / "files" / "old"
    names = old / "sim" / "truth.yaml", old / "sim" / "data.yaml", "--against", old / "sim" / "robot.yaml"
    robocal("validate", *names, "-o", tmp_path)
    document = json.loads((tmp_path / "validation.json").read_text())
    change(document)
    (tmp_path / "validation.json").write_text(json.dumps(document))
    robocal("report", tmp_path).assert_refused(*words)

"""A cell of a notebook is one screen with one figure; the page, every figure, and columns for data frames are one call away."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from cli.runs import small
from cli.worlds import CABLE, PLACES

import robocal as rc
from robocal.errors import FileError, ModelError

BREAKS = {"p", "tr", "li", "h2", "h3", "dt", "dd", "caption", "figcaption", "summary", "div"}


class Lines(HTMLParser):
    """The lines of text that a cell shows, and its figures."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.lines, self.figures, self.hidden = [""], 0, 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.figures += tag == "figure"
        self.hidden += tag in ("style", "svg")
        self.lines += [""] * (tag in BREAKS)

    def handle_endtag(self, tag: str) -> None:
        self.hidden -= tag in ("style", "svg")

    def handle_data(self, data: str) -> None:
        if not self.hidden:
            first, *others = data.split("\n")
            self.lines[-1] += first
            self.lines += others

    @property
    def shown(self) -> list[str]:
        return [line for line in self.lines if line.strip()]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> rc.Identified:
    folder = tmp_path_factory.mktemp("cell")
    small(folder)
    return rc.identify(folder / "robot.yaml", folder / "data.yaml")


def cells(found: rc.Identified, folder: Path) -> dict[str, rc.Found]:
    (folder / "cable.yaml").write_text(CABLE)
    (folder / "places.csv").write_text(PLACES)
    many = rc.table(
        {"x [m]": np.linspace(0, 0.2, 300), "y [m]": np.zeros(300), "z [m]": np.ones(300)}
        | {f"r{a} [rad]": np.zeros(300) for a in "xyz"}
    )
    return {
        "identify": found,
        "workspace": rc.cable.workspace(folder / "cable.yaml", cells=7, rays=100),
        "tension": rc.cable.tension(folder / "cable.yaml", folder / "places.csv"),
        "many": rc.cable.inverse(folder / "cable.yaml", many),
        "new": rc.new(listing=True),
    }


def test_a_cell_is_one_screen(found: rc.Identified, tmp_path: Path) -> None:
    for name, one in cells(found, tmp_path).items():
        read = Lines(one._repr_html_())
        assert 1 < len(read.shown) <= 60, (name, read.shown)
        assert read.figures <= 1, name
        assert len(one._repr_markdown_().splitlines()) <= 24
    read = Lines(found._repr_html_())
    assert read.figures == 1 and any(found.verdict.replace("_", " ") in line.lower() for line in read.shown)
    assert any("j2.d" in line or "identified" in line for line in read.shown), read.shown


def test_figures_stand_alone(found: rc.Identified, tmp_path: Path) -> None:
    assert {"errors", "correlation"} <= set(found.plots) and len(set(found.plots)) == len(found.plots)
    for name in found.plots:
        made = found.plot(name)
        ElementTree.fromstring(made.svg)
        assert made.name == name and made._repr_svg_() == made.svg and ":root" not in made.svg
        for used in re.findall(r"var\((--[a-z-]+)\)", made.svg):
            assert f"{used}:" in made.svg.replace(" :", ":"), used
    place = found.plot().save(tmp_path / "one.svg")
    assert place.read_text() == found.plot().svg
    with pytest.raises(ModelError, match=r"argument file: .*\.svg"):
        found.plot().save(tmp_path / "one.png")
    with pytest.raises(ModelError, match="argument name: .*did you mean 'errors'"):
        found.plot("erors")
    with pytest.raises(ModelError, match="argument name: this result has no figure"):
        rc.new(listing=True).plot()


def test_every_result_has_a_page(found: rc.Identified, tmp_path: Path) -> None:
    for name, one in cells(found, tmp_path).items():
        page = one.report(tmp_path / f"{name}.html").read_text()
        assert page.startswith("<!DOCTYPE html>") and page.count('class="picture') >= len(one.plots)


def test_columns_are_those_of_a_data_frame(found: rc.Identified) -> None:
    table, left = found.parameters, found.residuals
    assert {len(v) for v in table.values()} == {len(found.result.parameters)}
    row = table["name"].index("j2.d")
    known = next(p for p in found.result.parameters if p.name == "j2.d")
    assert (table["identified"][row], table["sigma"][row]) == (known.identified, known.sigma)
    assert len({len(v) for v in left.values()}) == 1 and "before_px" not in left
    assert all(isinstance(v, float) for v in left["after_mm"]) and not all(map(math.isnan, left["held_out_mm"]))
    for library in ("pandas", "polars"):
        frames = pytest.importorskip(library)
        assert list(frames.DataFrame(left).columns) == list(left)


def test_the_covariance_is_that_of_the_run_folder(found: rc.Identified, tmp_path: Path) -> None:
    import json

    found.save(tmp_path / "run")
    kept = json.loads((tmp_path / "run" / "covariance.json").read_text())
    had = found.covariance
    assert list(had.names) == kept["names"] and np.allclose(had.matrix, kept["covariance"], rtol=1e-12)
    assert had.of("j2.d")[0, 0] == pytest.approx(had.sigma["j2.d"] ** 2)
    row = next(p for p in found.result.parameters if p.name == "j2.d")
    assert row.sigma == pytest.approx(had.sigma["j2.d"] * (1e3 if row.unit == "mm" else 1.0), rel=1e-9)
    with pytest.raises(ModelError, match="argument names: .*did you mean 'j2.d'"):
        had.of("j2.dd")


def test_a_method_without_covariance_says_so(tmp_path: Path) -> None:
    small(tmp_path)
    blind = rc.identify(tmp_path / "robot.yaml", tmp_path / "data.yaml", method="pinv")
    with pytest.raises(ModelError, match="argument method: this method has no covariance"):
        _ = blind.covariance
    assert blind.parameters["name"]


def test_a_page_is_not_written_over_a_folder(found: rc.Identified, tmp_path: Path) -> None:
    with pytest.raises(FileError):
        found.report(tmp_path)

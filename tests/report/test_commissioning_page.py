"""The pictures of a commissioning: what is drawn is what the lists say, beside the thesis' own; what no camera saw is left out."""

from __future__ import annotations

from report.test_verification_page import picture

from robocal.report.cable.commissioning import thesis_figures
from robocal.report.html import html
from robocal.report.sections import Section

PARTS = {"position_first": 3.95, "orientation_first": 0.525, "camera_position": 2.17, "camera_orientation": 0.284,
         "between_position": 2.92, "between_orientation": 0.443}  # fmt: skip


def drawn(**other: float) -> str:
    """The figures of one list."""
    said = {**PARTS, **other}
    columns = {"list": ["A"], **{k: [v] for k, v in said.items()}, **{f"{k}_sd": [v / 2] for k, v in said.items()}}
    return html([Section.of("", *thesis_figures(columns), title="Figures", key="figures")])


def test_this_run_stands_beside_the_thesis():
    page = drawn()
    texts, dots, bars = picture(page, "figure-3-22")
    assert {"A, this run", "A, thesis", "C, thesis"} <= set(texts) and len(dots) == len(bars) == 4
    assert "3.95 ± 2.0" in texts and "25.8 ± 7.8" in texts and "30.5 ± 11" in texts
    texts, *_ = picture(page, "figure-3-23")
    assert "0.525 ± 0.26" in texts and "1.60 ± 1.2" in texts
    texts, dots, _ = picture(page, "figure-3-24")
    assert {"camera and instrument", "camera and robot", "61.5 ± 12", "32.2 ± 10"} <= set(texts) and len(dots) == 8
    texts, *_ = picture(page, "figure-3-25")
    assert "0.443 ± 0.22" in texts and "2.30 ± 0.50" in texts


def test_a_camera_that_saw_nothing_has_no_mark():
    nothing = float("nan")
    page = drawn(
        camera_position=nothing, camera_orientation=nothing, between_position=nothing, between_orientation=nothing
    )
    texts, dots, _ = picture(page, "figure-3-24")
    assert "A, this run" not in texts and len(dots) == 6
    assert "nan" not in page.lower().replace("nano", "")

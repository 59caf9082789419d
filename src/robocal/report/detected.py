"""The page of a detection: the target, what each view shows of it, and pictures with the corners."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from robocal.diagnose.vision_limits import IMAGE_SMEAR
from robocal.remarks.remark import percent
from robocal.report.lens_page import further_section
from robocal.report.sections import Cell, Detail, Figure, Section, Style, Text, ends, figure, quiet, table
from robocal.report.svg import crosses, drawing, num

__all__ = ["detect_pictures", "detect_sections"]

BRIEF = 12  # views that a terminal lists


def detect_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """The target, how much of the images it covers, and view by view what they show."""
    views = [v.summary for v in found.views]
    width, height = found.size
    corners, with_some = sum(v.corners for v in views), sum(v.corners > 0 for v in views)
    ways = ", ".join(f"{count} by {name}" for name, count in found.methods.items())
    yield Section.of(
        "",
        Text.of(
            (found.target.text, "strong"), f"   {with_some} of {len(views)} images show it, {width} x {height} pixels"
        ),
        *quiet(f"{corners} corners in {percent(found.coverage)} of the image" + (f"; fitted: {ways}" if ways else "")),
    )
    rows = [_row(v) for v in views]
    styles: list[Style] = ["quiet" if not v.corners else "" for v in views]
    heads = ("view", "markers", "corners", "share", "blur [px]", "smear [px]", "white cut off", "of the image")
    yield Section.of(
        "",
        table(*heads, right=tuple(range(1, 8)), rows=rows, styles=styles, brief=BRIEF),
        title="View by view",
        key="views",
    )
    if len(found.islands) > 1:
        lines = (" ".join(map(str, island)) for island in found.islands)
        yield Section.of(
            "", table("markers that views join", rows=((line,) for line in lines)), title="Groups", key="groups"
        )
    if found.further is not None:
        yield further_section(found.further)
    yield from ends(found.remarks, written)


def _row(v: Any) -> tuple[Cell, ...]:
    if not v.corners:
        return (v.view, "0", "0", "", "", "", "", "")
    smear = figure(v.motion, 2) if v.motion >= IMAGE_SMEAR else ""
    counts = (v.view, str(v.markers), str(v.corners), percent(v.share))
    return (*counts, figure(v.blur, 2), smear, percent(v.white), percent(v.coverage))


def detect_pictures(found: Any) -> Iterator[Section]:
    """Small images with the outlines and corners that were found."""
    some = [(k, v) for k, v in enumerate(found.views) if v.picture]
    if not some:
        return
    left = len(found.views) - len(some)
    text = "Outlines join the corners of a marker; crosses are corners of a board."
    more = f" {left} other images have no picture." if left else ""
    figures = (Figure(_picture(k, v), f"{v.summary.view}: {v.summary.corners} corners") for k, v in some)
    yield Section.of("", Text.of(text + more), Detail(lambda: figures), title="Pictures", key="pictures")


def _picture(number: int, view: Any) -> str:
    summary, wide = view.summary, min(420.0, view.summary.width)
    scale = wide / summary.width
    tall = summary.height * scale
    data = base64.b64encode(view.picture).decode()
    parts = [f'<image href="data:image/jpeg;base64,{data}" width="{num(wide)}" height="{num(tall)}"/>']
    for s in view.sightings:
        places = ((s.place + 0.5) * scale).tolist()
        if s.marker < 0:
            parts.append(f'<path d="{crosses(places, 3)}" fill="none" stroke="#e8590c"/>')
        else:
            way = "M" + "L".join(f"{num(u)} {num(v)}" for u, v in places) + "Z"
            parts.append(f'<path d="{way}" fill="none" stroke="#e8590c" stroke-width="1.5"/>')
            u, v = places[0]
            parts.append(f'<circle cx="{num(u)}" cy="{num(v)}" r="2" fill="#e8590c"/>')
    title = f"{summary.view} with its corners"
    return drawing(
        wide,
        tall,
        parts,
        title=title,
        text=f"{summary.markers} markers, {summary.corners} corners",
        key=f"view{number}",
    )

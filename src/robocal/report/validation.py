"""What a page says of the figures of ISO 9283 beside their summary: place by place, distance by distance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from robocal.report.sections import Block, Figure, Mark, figure, quiet, table
from robocal.report.svg import AxisScale, axes, drawing, points, span

__all__ = ["standing"]

Document = Mapping[str, Any]
MOST = 60  # rows of a table in the page; validation.json has all


def standing(iso: Document, compared: bool) -> Iterator[Block | None]:
    """Tables of places and of distances, and a picture of these."""
    places, distances = (((iso.get(part) or {}).get("rows") or ()) for part in ("pose", "distance"))
    yield from _table(places, "Place by place, in mm and degrees")
    pairs = (iso.get("distance") or {}).get("pairs", "")
    if svg := _picture(distances):
        legend: tuple[tuple[Mark, str], ...] = (("after", "this robot"),)
        legend += (("before", "compared with"),) if compared else ()
        yield Figure(svg, f"Pairs: {pairs}.", "Distance accuracy", legend)
    yield from _table(distances, f"Distances with the largest errors, in mm: {pairs}")


def _table(rows: Sequence[Document], title: str) -> Iterator[Block]:
    """Rows whose keys may differ; what another robot has stands behind."""
    if not rows:
        return
    flat = [
        {k: v for k, v in row.items() if not isinstance(v, Mapping)}
        | {f"{k} against": v for k, v in (row.get("against") or {}).items() if k == "AP"}
        for row in rows[:MOST]
    ]
    header = tuple(dict.fromkeys(k for row in flat for k in row))
    words = [i for i, k in enumerate(header) if any(isinstance(row.get(k), str) for row in flat)]
    cells = [[_cell(row.get(k)) for k in header] for row in flat]
    yield table(*header, right=[i for i in range(len(header)) if i not in words], title=title, rows=cells)
    if len(rows) > MOST:
        yield from quiet(f"{len(rows) - MOST} more rows are in validation.json")


def _cell(value: object) -> str:
    if isinstance(value, str):
        return value
    return figure(value) if isinstance(value, float) else "" if value is None else str(value)


def _picture(rows: Sequence[Document]) -> str:
    """|AD| against the commanded distance, of both robots; empty text for less than three."""
    at = {
        key: [(row["commanded"], abs(row[name])) for row in rows if row.get(name) is not None]
        for key, name in (("after", "AD"), ("before", "AD_against"))
    }
    across, up = span(x for p in at.values() for x, _ in p), span(y for p in at.values() for _, y in p)
    if across is None or up is None or len(at["after"]) < 3:
        return ""
    x, y = AxisScale(0.0, across[1], 58, 630), AxisScale(0.0, up[1], 216, 30)
    parts = [axes(x, y, "commanded distance, mm", "|AD|, mm")]
    parts += [points([(x(u), y(v)) for u, v in at[key]], key) for key in ("before", "after")]
    said = "; ".join(f"{key}: {len(p)} pairs" for key, p in at.items() if p)
    return drawing(640, 260, parts, title="Distance accuracy", text=said, key="distance")

"""The page of a validation, from its document: how large the errors are, where they were measured, the figures of ISO 9283."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from robocal.report import sections as blocks
from robocal.report.error_map import error_map, mean_by_place
from robocal.report.sections import (
    OWN_FITTED,
    SPREAD,
    Block,
    Detail,
    Figure,
    Mark,
    Pair,
    Section,
    Text,
    ends,
    figure,
    messages,
    quiet,
    spread,
    table,
)  # fmt: skip
from robocal.report.svg import AxisScale, axes, drawing, points, span

__all__ = ["validation_head", "validation_sections"]

Document = Mapping[str, Any]
MOST = 60  # rows of a table in the page; validation.json has all
FIGURES = {
    "AP": ("pose accuracy", "from the commanded position to the barycentre"),
    "RP": ("pose repeatability", "mean distance to the barycentre plus three standard deviations"),
    "vAP": ("multi-directional variation", "largest distance between barycentres"),
    "AD": ("distance accuracy", "mean measured distance minus the commanded one"),
    "RD": ("distance repeatability", "three standard deviations"),
}
MAP = (
    "Each dot is a place of the tool or platform in base coordinates. Its colour is the mean error of what was measured there, in each "
    "picture on its own logarithmic scale; the first colour also has whatever is smaller. Numbers: poses in validation.json."
)


def validation_head(found: Any) -> dict[str, Any]:
    """The robot, and what it was compared with, as `report.page.page` takes it."""
    return {"title": found.robot, "kind": "Validation report", "facts": (("Compared with", found.against or ""),)}


def validation_sections(found: Any) -> Iterator[Section]:
    """The errors of a model, and of another one, from a `ValidationDocument`."""
    torque = found.torque.this if found.torque is not None else None
    much = f"{torque.n} torques of joints" if torque and not len(found.poses) else f"{len(found.poses)} readings"
    head: list[Block] = [Text.of((found.robot, "strong"), f"   {much}")]
    if found.offsets is not None:
        head += quiet(f"judged: the nominal robot with the joint offsets of {found.offsets}")
    if found.reasons:
        advice = tuple(dict.fromkeys(m.advice for m in messages(found, found.reasons) if m.advice))
        head.append(blocks.VerdictBlock("not to be trusted", "bad", tuple(found.reasons), advice))
    told = list(_frame_blocks(found))
    worst = sorted(found.poses.rows, key=lambda p: -p["error"])[:3]
    if len(found.poses) > 3:
        told += quiet("worst: " + ", ".join(f"{p['configuration']} {figure(p['error'], 3)} mm" for p in worst))
    yield Section.of("", *head, *told)
    yield Section.of("", *_errors(found), title="Errors of single measurements", key="errors")
    yield Section.of("", Detail(lambda: _map(found)), title="Where the errors are", key="map", brief=())
    if found.iso_9283:
        name = str(found.iso_9283["standard"])
        yield Section.of("", *_standard(found.iso_9283), title=name, key="standard")
        more = Detail(lambda: _standing(found.iso_9283, found.against is not None))
        yield Section.of("", more, title=f"{name}: place by place", key="places", brief=(), folded=True)
    yield from ends(messages(found, found.warnings), key="warnings")


def _map(found: Any) -> Iterator[Block]:
    """Before beside after, or what there is of them."""
    columns = {c.name: np.array(c.values, float) for c in found.poses.columns if c.name != "configuration"}
    both = {"against": "Before (against)", "error": "After (this robot)"}
    names = [name for name in both if name in columns]
    if not {"x", "y", "z"} <= set(columns):
        return  # a document of an earlier version
    at, *errors = mean_by_place(np.stack([columns[a] for a in "xyz"], axis=1), *(columns[n] for n in names))
    made = error_map(at)
    if made is None:
        return
    titles = [both[n] if len(names) > 1 else "This robot" for n in names]
    drawn = [made.picture(e, f"map-{n}", t) for n, e, t in zip(names, errors, titles, strict=True)]
    figures = [Figure(svg, "", t) for svg, t in zip(drawn, titles, strict=True)]
    yield Pair(tuple(figures))
    fitted = found.errors.this is not None and found.errors.this.profiled
    rest = (
        " Frames were fitted to these data: the table above enlarges errors for it, the pictures do not."
        if fitted
        else ""
    )
    yield from quiet(MAP + rest)


def _errors(found: Any) -> Iterator[Block]:
    """A table of lengths, one of angles and one of torques; where lengths tell poses, first what these are off by."""
    from_lengths = found.position_from_lengths is not None
    parts = (
        ("position from lengths", found.position_from_lengths),
        ("orientation from lengths", found.orientation_from_lengths),
        ("all readings" if from_lengths else "error", found.errors),
        ("angle, poses from all rows" if from_lengths else "error", found.angle),
        ("error", found.torque),
    )
    for title, part in parts:
        if part is None or part.this is None:
            continue
        both = {"this robot": part.this, "against": part.against}
        rows = [(label, *spread(s), OWN_FITTED if s.profiled else "") for label, s in both.items() if s is not None]
        if (
            found.predicting_the_mean is not None
            and part is found.errors
            and part.unit == found.predicting_the_mean.unit
        ):
            rows.append(("predicting the mean", figure(found.predicting_the_mean.value), "", "", "", "", ""))
        yield table(f"{title} [{part.unit}]", *SPREAD, "", right=(1, 2, 3, 4, 5), rows=rows)


def _frame_blocks(found: Any) -> Iterator[Block]:
    """What was fitted to these data, and by how much one robot is better."""
    if found.profiled:
        fitted = f"{len(found.profiled)} parameters of frames were fitted to these data"
        yield from quiet(f"{OWN_FITTED}: {fitted}; the errors are enlarged by what that took away")
    if tool := [n for n in dict.fromkeys((*found.profiled, *found.profiled_against)) if n.startswith("tool.")]:
        yield from quiet(f"{', '.join(tool)} were fitted to these data for both robots")
    if found.gain is not None and found.gain.low == found.gain.high == 0:
        yield Text.of("no difference between the two robots")
    elif found.gain is not None:
        gain = found.gain
        word, low, high = ("smaller", gain.low, gain.high) if gain.mean >= 0 else ("larger", -gain.high, -gain.low)
        span = f"{figure(low)} to {figure(high)} mm"
        yield Text.of(f"mean error {word} by {figure(abs(gain.mean))} mm, 95 % interval {span}")


def _standard(iso: Mapping[str, Any]) -> Iterator[Block]:
    """AP, RP, vAP, AD, RD: mean and largest over the places or pairs; what cannot be computed, and why."""
    compared = any("against" in (iso.get(part) or {}).get("summary", {}) for part in ("pose", "distance"))
    columns = ("ISO 9283", "mean", "max", *(("against: mean", "max") if compared else ()), "n", "")
    rows = []
    for found in filter(None, (iso.get("pose"), iso.get("distance"))):
        for name, s in found["summary"]["this"].items():
            other = found["summary"].get("against", {}).get(name, {})
            unit = found.get("angle_unit", "") if "_" in name else found["unit"]
            # Of repeatability there is only one: no model enters.
            there = (figure(other.get("mean")), figure(other.get("max"))) if name.startswith("A") else ("", "")
            what, how = FIGURES.get(name, ("", ""))
            note = what + (f", {found['pairs']}" if name == "AD" else "")
            cells = (figure(s["mean"]), figure(s["max"]), *(there if compared else ()), str(s["n"]))
            rows.append((blocks.Noted(f"{name} [{unit}]", how), *cells, (note, "quiet")))
    yield table(*columns, right=tuple(range(1, len(columns) - 1)), rows=rows)
    yield from quiet(*(f"{name}: not computable: {why}" for name, why in iso.get("not_computable", {}).items()))
    yield from quiet(*iso.get("notes", ()))


def _standing(iso: Document, compared: bool) -> Iterator[Block | None]:
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
    return drawing(640, 260, parts, title="Distance accuracy", text=said, key="distance", cls="wide")

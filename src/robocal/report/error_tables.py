"""Errors before, after and on what was not used for fitting: tables, and for pages their pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robocal.diagnose.view_causes import VIEW_EXCHANGED
from robocal.report import pictures
from robocal.report import sections as blocks
from robocal.report.numbers import ranges
from robocal.report.proof import PRAISED, PROOFS, proof_of, times_smaller
from robocal.report.sections import Block, Cell, Detail, Figure, Mark, Section, Style, Table, Text, figure, quiet, table
from robocal.report.series import Series, column, is_aside, is_held_out, numbers, three

__all__ = ["errors", "errors_table", "outlier_blocks", "tiles"]

Columns = Mapping[str, Sequence[object]]
ErrorRow = tuple[str, str, str, Mark]
STAGES: tuple[ErrorRow, ...] = (
    ("before", "before", "nominal model, frames fitted", "before"),
    ("after", "after", "as fitted", "after"),
    ("held_out_before", "held out, before", "nominal model", "before"),
    ("held_out", "held out, after", "not used to fit", "held"),
    ("k_fold_before", "every fold, before", "nominal model", "before"),
    ("k_fold", "every fold, after", "held out in turn", "held"),
    ("leave_one_out_before", "leave-one-out, before", "nominal model, frames fitted", "before"),
    ("leave_one_out", "leave-one-out", "one by one", "held"),
    ("constant", "predicting the mean", "no model at all", ""),
)
SEEN = {
    "held_out": "held out",
    "k_fold": "every fold",
    "leave_one_out": "one by one",
    "": "seen by the fit, so no proof",
}
TEN, WORST, NAMED = 10, 8, 4
MEANS: dict[str, tuple[Cell, ...]] = {
    "held_out": (
        ("Held out", "term"),
        " means: set aside before the fit, and predicted by it afterwards. Only these numbers show how well the corrected model "
        "predicts what it has not seen.",
    ),
    "k_fold": (
        ("Every fold", "term"),
        " means: the measurements were cut into folds, and each fold was set aside and predicted by a model fitted to the "
        "others. Only these numbers show how well such a model predicts what it has not seen.",
    ),
    "leave_one_out": (
        ("Leave one out", "term"),
        " means: each configuration in turn was set aside and predicted by a model fitted to all the others. Only these numbers "
        "show how well such a model predicts what it has not seen.",
    ),
    "": (
        "Nothing was ", ("held out", "term"),
        ", that is, set aside before the fit to be predicted afterwards. The error after calibration is therefore no proof: a "
        "model with many parameters can bend to its own data and still predict badly.",
    ),
}  # fmt: skip
PROFILED = Text.of(
    (blocks.OWN_FITTED.capitalize(), "term"),
    ": a pose or marker met only in these measurements was fitted to them, and its degrees of freedom were subtracted, which enlarges "
    "these errors; all shared parameters stayed as identified. Errors before calibration in pictures, and the list of the largest errors, "
    "are not enlarged.",
)  # fmt: skip
TREND = "A trend over the configurations would point at drift, warming or a moved instrument; single high points at a slipped target."


def unseen(result: Any) -> Table | None:
    """Mean errors before and after on measurements that nothing was fitted to, one row for each quantity; None without errors."""
    posed, of_rows = result.pose_from_lengths, result.residuals
    shown = [(of_rows, "error"), (of_rows.angle, "angle")]
    if posed is not None:
        shown = [
            (posed, "position from lengths"),
            (posed.angle, "orientation from lengths"),
            (posed.lengths, "lengths"),
        ]
    proof = next((p for found, _ in shown if found is not None and (p := proof_of(found))), "")
    rows: list[tuple[Cell, ...]] = []
    for found, name in shown:
        after = None if found is None else getattr(found, proof or "after")
        if after is not None:
            before = getattr(found, f"{proof}_before" if proof else "before")
            old = figure(None if before is None else before.mean, 3)
            new = tuple(figure(v, 3) for v in (after.mean, after.p95, after.max))
            rows.append((f"{name} [{found.unit}]", old, (new[0], "strong"), *new[1:], str(after.n)))
    alone = result.offsets
    if (
        alone is not None
        and alone.after is not None
        and alone.before is not None
        and result.verdict.status != "refused"
    ):
        ends = (figure(alone.before, 3), figure(alone.after, 3))
        how = "" if alone.how == SEEN[proof] else f", {alone.how}"
        rows.append((f"joint offsets alone{how} [{alone.unit}]", *ends, "", "", str(alone.n)))
    return table(SEEN[proof], "before", "after", "95 %", "max", "n", right=range(1, 6), rows=rows) if rows else None


def errors(result: Any, rows: Columns | None) -> Section:
    """Errors at every stage; `rows` are the columns of residuals.csv, for the pictures."""
    residuals = result.residuals
    tables: list[Block | None] = []
    posed, shown = result.pose_from_lengths, [(residuals, "error"), (residuals.angle, "angle")]
    if posed is not None:
        own = [(posed, "position from lengths"), (posed.angle, "orientation from lengths"), (posed.lengths, "lengths")]
        shown = [*own, (residuals, "all rows, poses from them"), (residuals.angle, "angle, poses from all rows")]
    for found, title in shown:
        if found is not None:
            tables += [errors_table(found, title), _folds(found)]
    meaning, drawn = Detail(lambda: _meaning(result)), Detail(lambda: _pictures(residuals, rows))
    less = (unseen(result),)
    return Section.of(
        "", meaning, *tables, drawn, title="Errors before, after and held out", key="errors", brief=less, folded=True
    )


def _meaning(result: Any) -> Iterator[Block]:
    """What the table shows, and which configurations it is about."""
    split, kind = result.split, proof_of(result.residuals)
    every = len(split.held_out) + len(split.fit)
    words = ""
    if split.held_out:
        share = "" if split.held_out_fraction is None else f" ({100 * split.held_out_fraction:.0f}\u00a0%)"
        seed = "" if split.seed is None else f", chosen with seed {split.seed}"
        words += f" {len(split.held_out)} of {every} configurations{share} were held out{seed}."
    if split.embargoed:
        words += f" Left out altogether, because they share a place with held-out ones: {ranges(split.embargoed)}."
    yield Text.of(*MEANS[kind], words)


def errors_table(residuals: Any, title: str) -> Table | None:
    """Errors at every stage in one unit; None when there are none."""
    rows: list[tuple[Style, tuple[Cell, ...]]] = []
    for name, label, note, mark in STAGES:
        if (s := getattr(residuals, name)) is None:
            continue
        words = ", ".join(w for w in (note, blocks.OWN_FITTED if s.profiled else "") if w)
        style: Style = "strong" if name in PROOFS else "quiet" if name == "constant" else ""
        rows.append((style, (blocks.Noted(label, mark=mark), *blocks.spread(s), (words, "quiet"))))
        every = getattr(residuals.all_rows, name, None)
        if every is not None and every.n != s.n:
            rows.append(("quiet", (blocks.Noted("  with gross rows"), *blocks.spread(every), ("all rows", "quiet"))))
    columns = (f"{title} [{residuals.unit}]", *blocks.SPREAD, "")
    styles, cells = [style for style, _ in rows], [row for _, row in rows]
    return table(*columns, right=(1, 2, 3, 4, 5), rows=cells, styles=styles) if rows else None


def _folds(residuals: Any) -> Table | None:
    """The mean error of every fold; None when there are none."""
    if not residuals.folds:
        return None
    rows: list[tuple[Cell, ...]] = [
        (f.name, figure(f.before), figure(f.after), str(f.n), (blocks.OWN_FITTED if f.profiled else "", "quiet"))
        for f in residuals.folds
    ]
    columns, caption = ("before", "after", "n", ""), "Mean error of each fold while it was held out."
    return table(f"held out [{residuals.unit}]", *columns, right=(1, 2, 3), rows=rows, caption=caption)


def tiles(result: Any) -> blocks.Tiles:
    """The big numbers: before and after of the same measurements where nothing was fitted to them, and what joint offsets alone
    would leave, else what the fit left."""
    residuals = result.pose_from_lengths or result.residuals
    proof = proof_of(residuals)
    name, before = PROOFS.get(proof, ""), f"{proof}_before"
    known = bool(proof) and getattr(residuals, before) is not None
    first = _tile(residuals, before if known else "before", f"{name}, before" if known else "Before", "before")
    lacks = proof and not known and residuals.before is None  # nothing said where frames are before they were found
    second = _tile(residuals, proof, f"{name}{'' if lacks else ', after'}" if proof else "Held out", "held")
    if known and result.verdict.status in PRAISED:
        factor = times_smaller(getattr(residuals, before).mean, getattr(residuals, proof).mean)
        second = replace(second, lines=(*second.lines, *filter(None, [factor])))
    alone = result.offsets
    if alone is not None and alone.after is not None:
        told = f"mean error of {alone.n} unseen measurements"
        each = "each predicted from all others" if alone.how == "leave-one-out" else alone.how
        lines = (f"{told}, {each}", f"{figure(alone.before, 3)} {alone.unit} before, of the same")
        third = blocks.Tile("Joint offsets alone", "", figure(alone.after, 3), alone.unit, lines)
        return blocks.Tiles((first, second, third))
    if residuals is not result.residuals and residuals.lengths is not None:
        third, old = _tile(residuals.lengths, proof, f"{name}, lengths", ""), getattr(residuals.lengths, before)
        if old is not None:
            third = replace(third, lines=(*third.lines, f"{figure(old.mean, 3)} {residuals.lengths.unit} before"))
        return blocks.Tiles((first, second, third))
    if not known and residuals.before is None:
        second = (
            replace(second, lines=(*second.lines, "no error before: nothing said where the frames are"))
            if lacks
            else second
        )
        return blocks.Tiles((second, _tile(residuals, "after", "Seen by the fit", "after")))
    return blocks.Tiles((first, second, _tile(residuals, "after", "After, seen by the fit", "after")))


def _tile(residuals: Any, key: str, name: str, mark: Mark) -> blocks.Tile:
    s = getattr(residuals, key) if key else None
    if s is None or not math.isfinite(s.mean):
        none = "Nothing was held out: no proof on unseen measurements." if mark == "held" else "Not recorded."
        return blocks.Tile(name, mark, "", "", (none,))
    turn = getattr(getattr(residuals, "angle", None), key, None)
    angle = "" if turn is None else f", and {figure(turn.mean, 3)} {residuals.angle.unit}"
    whose = " of the position from lengths" if hasattr(residuals, "lengths") else ""
    more = (("rms", s.rms), ("95 %", s.p95), ("max", s.max))
    count = f" of {s.n} unseen {'poses' if whose else 'measurements'}" if key.removesuffix("_before") in PROOFS else ""
    lines = (
        f"mean error{whose}{count}{angle}{f', {blocks.OWN_FITTED}' if s.profiled else ''}",
        " · ".join(f"{k} {figure(v, 3)}" for k, v in more if math.isfinite(v)),
    )
    return blocks.Tile(name, mark, figure(s.mean, 3), residuals.unit, lines)


def _pictures(residuals: Any, rows: Columns | None) -> Iterator[Block | None]:
    """How large the errors are, one by one, and where they point."""
    stages = (residuals, residuals.angle)
    if any(getattr(getattr(found, name, None), "profiled", False) for found in stages for name, *_ in STAGES):
        yield PROFILED
    if rows is None or not any(len(c) for c in rows.values()):
        yield Text.of(("No residuals were given, so there are no pictures of them.", "quiet"))
        return
    # What the verdict is told in comes first: angles and pixels where no lengths were measured.
    unit = residuals.unit
    main = ("angle_" if unit == "deg" else "", unit)
    series, turns = three(rows, *main), three(rows, "angle_", "deg") if unit != "deg" else []
    bars, worst = _bars(series, "How large the errors are", *main), _worst(rows, *main)
    if turns:
        yield blocks.Pair(
            tuple(b for b in (bars, _bars(turns, "The same for orientation", "angle_", "deg")) if b is not None)
        )
    elif bars is not None and worst is not None:
        yield blocks.Pair((bars, worst))
    else:
        yield bars
    yield _row(series, "Every configuration", *main)
    yield _row(turns, "Orientation of every configuration", "angle_", "deg")
    yield worst if turns else None


def _bars(series: Sequence[Series], title: str, quantity: str, unit: str) -> Figure | None:
    caption = "How many errors have which size. Every step of ten on the axis is equally wide; dashed lines are means."
    return Figure(svg, caption, title) if (svg := pictures.histogram(series, quantity, unit)) else None


def _row(series: Sequence[Series], title: str, quantity: str, unit: str) -> Figure | None:
    if not (svg := pictures.per_pose(series, quantity, unit)):
        return None
    share = pictures.drawn_of(series)[1]
    return Figure(svg, f"{TREND} {share}".rstrip(), title, tuple((s.key, s.name) for s in series))


def _worst(rows: Columns, quantity: str, unit: str) -> Table | None:
    """The rows with the largest error after calibration: where to look for a slipped target."""
    before, after = (numbers(rows, f"{quantity}{stage}_{unit}") for stage in ("before", "after"))
    known, aside, out = ~np.isnan(after), is_aside(rows), is_held_out(rows)
    first = np.flatnonzero(known)[np.argsort(-after[known], kind="stable")][:WORST]
    if not len(first):
        return None
    ids, group, target = (column(rows, k) for k in ("configuration", "group", "target"))
    counted = after[known & ~aside]
    mean = math.fsum(counted) / len(counted) if len(counted) else 0.0
    cells = []
    for i in first:
        sensor = " · ".join(str(v) for v in (group[i], target[i]) if v not in (None, ""))
        state = "set aside" if aside[i] else "held out" if out[i] else "fit"
        ratio = f"{figure(after[i] / mean, 2)} ×" if mean > 0 else "-"
        cells.append((str(ids[i]), sensor, state, figure(before[i], 3), figure(after[i], 3), ratio))
    return table(
        "configuration", "sensor", "set", "before", "after", "of mean", right=(3, 4, 5), rows=cells,
        title=f"Largest remaining errors [{unit}]",
        caption="Where to look first for a slipped target or a wrong row; residuals.csv has all rows.",
    )  # fmt: skip


def outlier_blocks(rows: Sequence[Any]) -> Section:
    """Rows that do not belong to the others, by name: the first ten, on pages all of them."""
    cells = []
    for o in rows:
        where = o.group + (f", {o.target}" if o.target else "")
        value = f"{', '.join(figure(v) for v in o.value)} {'/'.join(dict.fromkeys(o.units))}"
        value = value if o.rows == 1 else f"{o.rows} rows"
        told = "used" if not o.set_aside else "not fitted, counted" if o.counted else "set aside"
        why = "" if o.cause is None else o.cause.sentence
        size, chance = f"{figure(o.distance, 3)} sigma", _chance(o.p_value)
        cells.append(
            (
                o.configuration if o.rows == 1 else f"view {o.configuration}",
                where,
                o.source,
                str(o.row or "-"),
                value,
                size,
                chance,
                told,
                why,
            )
        )
    columns = ("strange row", "instrument", "file", "row", "value", "distance", "chance", "", "likely cause")
    caption = (
        "Distance from a fit without them, in standard deviations, and how often chance alone would show a farthest row like it "
        "anywhere in the table. What was set aside and is not counted is in no mean that decides."
    )
    shown = table(*columns, right=(3, 5), rows=cells, caption=caption, detail=(6,), brief=TEN)
    less = quiet(f"the first {TEN} of {len(rows)}; result.json has all") if len(rows) > TEN else ()
    first = ", ".join(map(_outlier_name, rows[:NAMED]))
    more = f" and {len(rows) - NAMED} more" if len(rows) > NAMED else ""
    brief = quiet(f"rows that do not belong to the others: {first}{more}")
    title = "Rows that do not belong to the others"
    return Section.of("", shown, *less, title=title, key="outliers", brief=brief, folded=True)


def _outlier_name(o: Any) -> str:
    """The file and the row; of a view its name, the instrument, and how many rows from which on."""
    if o.rows == 1:
        return f"{o.source or o.group} row {o.row or o.configuration}"
    part = f" ({o.target})" if o.target else ""
    rows = f"{o.rows} rows of {o.source}{f' from {o.row}' if o.row else ''}"
    exchanged = o.cause is not None and o.cause.code == VIEW_EXCHANGED
    partner = f", exchanged with {o.cause.numbers['partner']}" if exchanged else ""
    return f"view {o.configuration} of {o.group}{part} ({rows}{partner})"


def _chance(p: float | None) -> str:
    return "-" if p is None else "< 1e-12" if p < 1e-12 else f"{p:.1g}"

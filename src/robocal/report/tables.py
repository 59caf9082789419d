"""The rows of every table, as texts ready to print."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

import numpy as np

from robocal.report.numbers import (
    MISSING,
    align,
    decimals,
    entries,
    finite,
    fixed,
    instrument_frames,
    plain,
    section,
    significant,
    unit_text,
)
from robocal.report.series import column, is_aside, is_held_out, numbers
from robocal.report.svg import num
from robocal.report.words import chi2_word

__all__ = [
    "coverage",
    "groups",
    "mappings",
    "options",
    "outliers",
    "parameter_rows",
    "rounds",
    "statistics",
    "worst",
]

Row = dict[str, object]
NAMES = {
    "before": ("Before", "nominal model, with instrument frames and tool fitted", "before"),
    "after": ("After, seen by the fit", "corrected model, on the measurements that it was fitted to", "after"),
    "held_out_before": ("Held out, before", "nominal model, on the held-out measurements", "before"),
    "held_out": (
        "Held out, after",
        "corrected model, on measurements that it never saw: the number that counts",
        "held",
    ),
    "k_fold_before": ("Every fold, before", "nominal model, on the measurements of each fold in turn", "before"),
    "k_fold": (
        "Every fold, after",
        "every measurement predicted by a model that was fitted to the other folds: the number that counts",
        "held",
    ),
    "leave_one_out_before": (
        "Leave one out, before",
        "nominal model, its frames and tool fitted to all the others",
        "before",
    ),
    "leave_one_out": ("Leave one out", "each configuration predicted by a model fitted to all the others", "held"),
    "constant": ("Mean position only", "no model at all: always predict the mean; any model must beat this", "none"),
}
STATUS = {"identified": "●", "prior": "◐", "dropped": "○", "fixed": "▪"}
ORDER = {"identified": 0, "prior": 1, "dropped": 2, "fixed": 3}


def mappings(value: object) -> list[Mapping[str, object]]:
    """The objects of a list."""
    return [v for v in entries(value) if isinstance(v, Mapping)]


def statistics(residuals: Mapping[str, object]) -> list[Row]:
    """One row per known statistic, each with three digits of its mean; decimal points stand below one another."""
    found = {key: section(residuals, key) for key in NAMES if section(residuals, key)}
    rows: list[Row] = []
    cells: list[list[str]] = []
    for key, s in found.items():
        name, meaning, klass = NAMES[key]
        n = finite(s.get("n"))
        size = finite(s.get("mean")) or finite(s.get("rms"))
        values = [
            fixed(s.get(k), decimals(size, 3)) if size else significant(s.get(k)) for k in ("mean", "rms", "p95", "max")
        ]
        rows.append(
            {
                "key": klass,
                "name": name,
                "meaning": meaning,
                "n": MISSING if n is None else f"{n:.0f}",
                "profiled": s.get("profiled") is True,
            }
        )
        cells.append(values)
        every = section(section(residuals, "all_rows"), key)
        if every and every.get("n") != s.get("n"):
            digits = decimals(finite(every.get("mean")) or 0.0, 3)
            cells.append([fixed(every.get(k), digits) for k in ("mean", "rms", "p95", "max")])
            told = {
                "n": f"{every['n']:.0f}",
                "profiled": False,
                "meaning": "the same with the rows that were set aside",
            }
            rows.append({"key": "none", "name": f"{name}, all rows"} | told)
    columns = [align([row[i] for row in cells]) for i in range(4)]
    for i, row in enumerate(rows):
        row["values"] = [texts[i] for texts in columns]
    return rows


def rounds(residuals: Mapping[str, object]) -> list[Row]:
    """One row per fold: mean error of baseline and identified model."""
    rows: list[Row] = []
    for f in mappings(residuals.get("folds")):
        n = finite(f.get("n"))
        row: Row = {k: significant(f.get(k)) for k in ("before", "after")}
        row |= {"name": str(f.get("name") or MISSING), "n": MISSING if n is None else f"{n:.0f}"}
        rows.append(row | {"profiled": f.get("profiled") is True})
    return rows


def parameter_rows(parameters: Sequence[Mapping[str, object]]) -> list[Row]:
    """The parameter table: free ones first, sigma (as fitted) giving the digits of its row; `bar` draws the change
    with two sigma, on one scale for each unit, frames of instruments apart."""
    ordered = sorted(parameters, key=lambda p: ORDER.get(str(p.get("status")), 2) >= 2)
    # A tracker stands metres away from where nobody said it stands; beside it every joint would be a dot on zero.
    frames = instrument_frames(str(p.get("name", "")) for p in ordered)
    scale = [(str(p.get("unit")), str(p.get("name", "")).rpartition(".")[0] in frames) for p in ordered]
    reach: dict[tuple[str, bool], float] = {}
    for p, own in zip(ordered, scale, strict=True):
        delta, sigma = finite(p.get("delta")), finite(p.get("sigma")) or 0.0
        if delta is not None and p.get("status") in ("identified", "prior"):
            reach[own] = max(reach.get(own, 0.0), abs(delta) + 2 * sigma)
    rows = [_parameter(p, reach.get(own, 0.0)) for p, own in zip(ordered, scale, strict=True)]
    for key in ("nominal", "identified", "delta", "sigma", "half", "instrument"):
        for row, text in zip(rows, align([str(r[key]) for r in rows]), strict=True):
            row[key] = text
    return rows


def _parameter(p: Mapping[str, object], reach: float) -> Row:
    sigma, instrument, delta = (finite(p.get(k)) for k in ("sigma", "sigma_instrument", "delta"))
    status = str(p.get("status") or "")
    smallest = sigma or instrument
    share = finite(p.get("data_share"))
    moved = status in ("identified", "prior")
    ends = [finite(v) for v in entries(p.get("interval"))]
    half = (ends[1] - ends[0]) / 2 if len(ends) == 2 and ends[0] is not None and ends[1] is not None else None

    def show(value: object) -> str:
        return fixed(value, decimals(smallest)) if smallest else plain(value)

    return {
        "name": str(p.get("name", "")),
        "unit": unit_text(p.get("unit")),
        "nominal": show(p.get("nominal")),
        "identified": show(p.get("identified")) if moved or p.get("identified") != p.get("nominal") else MISSING,
        "delta": (("+" if delta and delta > 0 else "") + show(delta)) if moved or delta else MISSING,
        "sigma": show(sigma) if sigma is not None else MISSING,
        "half": MISSING if half is None else fixed(half, decimals(half)),
        "instrument": fixed(instrument, max(decimals(instrument), decimals(smallest or 1))) if instrument else MISSING,
        "status": status or MISSING,
        "sign": STATUS.get(status, ""),
        "share": MISSING if share is None else f"{100 * min(max(share, 0), 1):.0f}\u00a0%",
        "note": str(p.get("note") or ""),
        "bar": _bar(delta, sigma or 0.0, reach) if moved and delta is not None and reach > 0 else None,
    }


def _bar(delta: float, sigma: float, reach: float) -> dict[str, str]:
    """Coordinates of a whisker of two sigma and a dot at the change, in a field 96 wide with zero in the middle."""
    at, arm = 48 + 44 * delta / reach, 44 * 2 * sigma / reach
    return {"at": num(at), "low": num(at - arm), "high": num(at + arm)}


def groups(fit: Mapping[str, object]) -> list[Row]:
    """Sensor groups with chi2 and where their sigma comes from."""
    rows: list[Row] = []
    for g in mappings(fit.get("groups")):
        chi2, dof = finite(g.get("chi2")), finite(g.get("dof"))
        unit = unit_text(g.get("unit"))
        ratio = chi2 / dof if chi2 is not None and dof else None
        row: Row = {"name": str(g.get("name") or MISSING), "kind": str(g.get("kind") or MISSING), "unit": unit}
        row |= {k: significant(g.get(k), 3) for k in ("rms", "sigma")} | {
            "chi2": significant(chi2, 4),
            "ratio": significant(ratio, 3),
        }
        row |= {k: MISSING if v is None else plain(round(v, 1)) for k, v in (("n", finite(g.get("n"))), ("dof", dof))}
        rows.append(
            row | {"source": str(g.get("sigma_source") or MISSING), "word": chi2_word(chi2, dof, g.get("sigma_source"))}
        )
    return rows


def options(provenance: Mapping[str, object]) -> list[tuple[str, str]]:
    """Options as name and text."""
    found = section(provenance, "options")
    return [(str(k), _option(found[k])) for k in sorted(found)]


def _option(value: object) -> str:
    if isinstance(value, str):
        return value
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)


def worst(residuals: Mapping[str, Sequence[object]], quantity: str = "", unit: str = "mm", most: int = 8) -> list[Row]:
    """The rows with the largest error after calibration, told as `series.three` does: where to look for a slipped
    target."""
    before, after = (numbers(residuals, f"{quantity}{stage}_{unit}") for stage in ("before", "after"))
    known, aside, out = ~np.isnan(after), is_aside(residuals), is_held_out(residuals)
    first = np.flatnonzero(known)[np.argsort(-after[known], kind="stable")][:most]
    told = [column(residuals, k) for k in ("configuration", "group", "target")]
    shown = [
        (float(after[i]), *(c[i] for c in told), "set aside" if aside[i] else "held out" if out[i] else "fit",
         None if np.isnan(before[i]) else float(before[i]))
        for i in first
    ]  # fmt: skip
    places = decimals(shown[-1][0], 3) if shown and shown[-1][0] > 0 else 3
    counted = after[known & ~aside]
    mean = math.fsum(counted) / len(counted) if len(counted) else 0.0
    return [
        {
            "configuration": str(c),
            "where": " · ".join(str(v) for v in (g, t) if v not in (None, "")),
            "set": s,
            "before": fixed(b, places),
            "after": fixed(a, places),
            "times": significant(a / mean, 2) if mean > 0 else MISSING,
        }
        for a, c, g, t, s, b in shown
    ]


def coverage(prediction: Mapping[str, object]) -> list[str]:
    """One sentence per quantity: how many held-out measurements lay in their bands."""
    out = []
    for c in mappings(prediction.get("coverage")):
        whole, level, n = finite(c.get("whole")), finite(c.get("level")), finite(c.get("n"))
        if whole is not None and level is not None and n is not None:
            out.append(
                f"Of {n:.0f} held-out measurements ({c.get('quantity')}), {100 * whole:.0f}\u00a0% lie in their "
                f"{100 * level:.0f}\u00a0% region as fitted."
            )
    return out


def outliers(result: Mapping[str, object]) -> list[Row]:
    """Rows that do not belong to the others, the farthest first."""
    rows: list[Row] = []
    for o in mappings(result.get("outliers")):
        size, p = finite(o.get("distance")), finite(o.get("p_value"))
        rows.append(
            {
                "configuration": str(o.get("configuration") or MISSING),
                "where": " · ".join(str(o[k]) for k in ("group", "target") if o.get(k)),
                "file": " ".join(str(o[k]) for k in ("source",) if o.get(k)),
                "row": MISSING if o.get("row") is None else str(o["row"]),
                "distance": significant(size, 3),
                "p": MISSING if p is None else ("< 1e-12" if p < 1e-12 else f"{p:.1g}"),
                "value": _value(o),
                "told": "used"
                if not o.get("set_aside")
                else "not fitted, counted"
                if o.get("counted")
                else "set aside",
                "cause": str(section(o, "cause").get("sentence") or ""),
            }
        )
    return rows


def _value(o: Mapping[str, object]) -> str:
    units = list(dict.fromkeys(map(str, entries(o.get("units")))))
    return " ".join((", ".join(significant(v, 4) for v in entries(o.get("value"))), "/".join(units))).strip() or MISSING

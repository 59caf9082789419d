"""How linear the fit was, and other estimators on the same data: the texts of their sections."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robocal.report.numbers import align, finite, section, significant, unit_text, with_unit
from robocal.report.tables import mappings

__all__ = ["beside"]

ERRORS = (("after", "fitted"), ("held_out", "held out"), ("k_fold", "every fold"), ("leave_one_out", "leave one out"))
BEFORE = {
    "after": "before",
    "held_out": "held_out_before",
    "k_fold": "k_fold_before",
    "leave_one_out": "leave_one_out_before",
}


def beside(result: Mapping[str, object]) -> dict[str, Any]:
    """What the template needs of `linearity` and `comparison`; empty where there is none."""
    return {
        "linearity": _linearity(section(result, "linearity")),
        "comparison": _comparison(section(result, "comparison")),
    }


def _linearity(found: Mapping[str, object]) -> dict[str, Any]:
    rows = []
    for key, name in (("fitted", "the fitted parameters"), ("everything", "everything that is free, without priors")):
        s = section(found, key)
        if s:
            rows.append((name, [significant(s.get(k)) for k in ("before", "promised", "left", "neglected")]))
    if not rows:
        return {}
    bend = finite(found.get("curvature"))
    return {
        "unit": unit_text(found.get("unit")),
        "rows": rows,
        "misleads": found.get("misleads") is True,
        "ruins": found.get("ruins") is True,
        "curvature": significant(bend, 2) if bend is not None else "",
        "parameter": str(found.get("curvature_parameter") or ""),
    }


def _comparison(found: Mapping[str, object]) -> dict[str, Any]:
    methods = mappings(found.get("methods"))
    if not methods:
        return {}
    keys = [(k, name) for k, name in ERRORS if any(finite(m.get(k)) is not None for m in methods)]
    rows: list[dict[str, Any]] = []
    for m in methods:
        failed = str(m.get("failed") or "")
        sigmas = finite(m.get("sigmas"))
        reference = m.get("method") == found.get("reference")
        rows.append(
            {
                "method": str(m.get("method") or ""),
                "title": str(m.get("title") or ""),
                "errors": [significant(m.get(k), 4) for k, _ in keys],
                "away": "reference"
                if reference
                else f"{significant(sigmas, 2)} σ, {m.get('farthest')}"
                if sigmas is not None
                else "",
                "seconds": with_unit(significant(m.get("seconds"), 2), "s")
                if finite(m.get("seconds")) is not None
                else "",
                "verdict": str(m.get("verdict") or "").replace("_", " "),
                "note": failed or (str(m.get("reason") or "") if m.get("stopped") is True else ""),
            }
        )
    for name, values in (
        ("Frames only", BEFORE),
        ("Mean position only", dict.fromkeys([k for k, _ in keys if k != "after"][:1], "constant")),
    ):
        told = [significant(found.get(values[k])) if k in values else "" for k, _ in keys]
        if any(t not in ("", "–") for t in told):
            rows.append(
                {"method": name, "title": "", "errors": told, "away": "", "seconds": "", "verdict": "", "note": ""}
            )
    for i in range(len(keys)):
        for row, text in zip(rows, align([r["errors"][i] for r in rows]), strict=True):
            row["errors"][i] = text
    return {"unit": unit_text(found.get("unit")), "columns": [name for _, name in keys], "rows": rows}

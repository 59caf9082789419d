"""report.html from a result and its residuals: gathers texts, tables and pictures, and fills the template, which
escapes every one of them.

The page needs nothing from outside. Its content security policy allows one script, by the hash of its text, and no
connection at all.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from robocal.errors import MissingExtra
from robocal.report import matrix, pictures, tables, words
from robocal.report.arrows import arrows
from robocal.report.diagnostics import beside
from robocal.report.heat import heat
from robocal.report.nongeometric import beyond
from robocal.report.numbers import entries, finite, plain, ranges, section, significant, unit_text, with_unit
from robocal.report.series import three

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["jinja", "render", "style"]

Result = Mapping[str, object]
Columns = Mapping[str, Sequence[object]]
# What no page may hold: control characters but line feeds and tabs.
UNSEEN_CHARACTERS = re.compile("[\x00-\x08\x0b-\x1f]")
UNSEEN = {"held_out": "Held out", "k_fold": "Every fold", "leave_one_out": "Leave one out"}
INDICES = {
    "O1": "size of the region of likely parameters: geometric mean of the singular values",
    "O2": "smallest over largest singular value",
    "O3": "smallest singular value: how well the worst combination is seen",
    "O4": "O3 times O2: noise amplification",
    "O5": "reciprocal of the summed reciprocal singular values",
}


def jinja() -> Environment:
    """The only boundary to jinja2."""
    try:
        from jinja2 import Environment, FunctionLoader, StrictUndefined
    except ImportError as error:
        raise MissingExtra("report", "jinja2") from error
    return Environment(
        loader=FunctionLoader(_asset), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


def _asset(name: str) -> str:
    return files("robocal.report").joinpath(name).read_text(encoding="utf-8")


def style() -> str:
    """The style sheet of every page."""
    return _asset("style.css")


def render(result: Result, residuals: Columns, accuracy: Columns | None = None) -> str:
    """The text of report.html.

    `result` is the parsed result.json, `residuals` the columns of residuals.csv (None for empty cells), `accuracy` those
    of accuracy_map.csv. Whatever is
    missing or null is said to be missing. The same input gives the same text. Raises MissingExtra without jinja2.
    """
    environment = jinja()
    script = _asset("viewer.js")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    page = environment.get_template("template.html").render(
        style=_asset("style.css"),
        script=script,
        digest=digest,
        **_head(result),
        **_errors(result, residuals),
        **_parameters(result),
        **_fit(result),
        **beside(result),
        **beyond(result),
        **_recipe(result),
        **_trust(result, accuracy),
    )
    # What no browser may see in a page, and what no file can hold: control characters and halves of surrogate pairs.
    clean = UNSEEN_CHARACTERS.sub("\ufffd", page)
    return clean.encode("utf-8", "replace").decode("utf-8")


def _head(result: Result) -> dict[str, Any]:
    robot, provenance = section(result, "robot"), section(result, "provenance")
    joints = robot.get("joints")
    count = len(joints) if isinstance(joints, list | tuple) else finite(joints)
    facts = [
        ("Convention", robot.get("convention")),
        ("Joints", f"{count:.0f}" if count else None),
        ("Nominal values from", robot.get("source")),
        ("Method", result.get("method")),
        ("Computed", _moment(provenance.get("started"))),
        ("robocal", provenance.get("version")),
    ]
    verdict = words.verdict(result)
    warnings = [*words.advised(result), *words.advised(section(result, "identifiability"))]
    return {
        "robot": str(robot.get("name") or "Unnamed robot"),
        "facts": [(name, str(value)) for name, value in facts if value not in (None, "")],
        "verdict": verdict,
        "reasons": words.reasons(result),
        "hints": words.hints(result),
        "proof": words.proof(section(result, "residuals")),
        "warnings": list(dict.fromkeys(warnings)),
    }


def _moment(value: object) -> object:
    """A time stamp without its seconds, or as it was given."""
    try:
        return datetime.fromisoformat(str(value)).strftime("%Y-%m-%d %H:%M %Z").strip()
    except ValueError:
        return value


def _errors(result: Result, residuals: Columns) -> dict[str, Any]:
    distances = section(result, "residuals")
    angle = section(distances, "angle")
    # What the verdict is told in comes first: angles and pixels where no lengths were measured.
    unit = str(distances.get("unit") or "mm")
    main = ("angle_" if unit == "deg" else "", unit)
    turns = three(residuals, "angle_", "deg") if unit != "deg" else []
    drawn, series = arrows(residuals), three(residuals, *main)
    split = section(result, "split")
    held = next((key for key in UNSEEN if section(distances, key)), "")
    return {
        "tiles": _tiles(distances, angle),
        "unit": unit_text(distances.get("unit")),
        "statistics": tables.statistics(distances),
        "rounds": tables.rounds(distances),
        "angle_rounds": tables.rounds(angle),
        "angle_unit": unit_text(angle.get("unit")),
        "angle_statistics": tables.statistics(angle),
        "series": series,
        "share": pictures.drawn_of(series)[1],
        "histogram": pictures.histogram(series, *main),
        "per_pose": pictures.per_pose(series, *main),
        "angle_histogram": pictures.histogram(turns, "angle_", "deg"),
        "angle_per_pose": pictures.per_pose(turns, "angle_", "deg"),
        "arrows": drawn,
        "worst": tables.worst(residuals, *main),
        "held": held,
        "split": {
            "fraction": _percent(split.get("held_out_fraction")),
            "seed": split.get("seed"),
            "fit": ranges(entries(split.get("fit"))),
            "held_out": ranges(entries(split.get("held_out"))),
            "embargoed": ranges(entries(split.get("embargoed"))),
            "n_fit": len(entries(split.get("fit"))),
            "n_held_out": len(entries(split.get("held_out"))),
        },
    }


def _percent(value: object) -> str:
    share = finite(value)
    return "" if share is None else f"{100 * share:.0f}\u00a0%"


def _tiles(distances: Mapping[str, object], angle: Mapping[str, object]) -> list[dict[str, Any]]:
    """The big numbers: before, after, and the one that nothing was fitted to."""
    proof = next((key for key in UNSEEN if section(distances, key)), "held_out")
    keys = {"before": "Before", "after": "After, seen by the fit", proof: UNSEEN[proof]}
    out = []
    for key, name in keys.items():
        s, turn = section(distances, key), section(angle, key)
        mean = finite(s.get("mean"))
        number = significant(mean)
        small = [(k, significant(s.get(k))) for k in ("rms", "p95", "max") if finite(s.get(k)) is not None]
        out.append(
            {
                "key": "held" if key in UNSEEN else key,
                "name": name,
                "number": number if mean is not None else "",
                "unit": unit_text(distances.get("unit")),
                "small": [("95 %" if k == "p95" else k, text) for k, text in small],
                "angle": with_unit(significant(turn.get("mean")), angle.get("unit"))
                if finite(turn.get("mean")) is not None
                else "",
                "profiled": s.get("profiled") is True,
            }
        )
    return out


def _parameters(result: Result) -> dict[str, Any]:
    parameters = tables.mappings(result.get("parameters"))
    what = section(result, "identifiability")
    rows = tables.parameter_rows(parameters)
    free = [r for r in rows if r["status"] != "fixed"]
    picture, left_out = matrix.correlation(section(result, "correlation"))
    combinations = [
        {
            "text": str(c.get("text") or ""),
            "terms": [
                (str(t.get("name", "")), significant(t.get("coefficient")))
                for t in tables.mappings(c.get("terms"))
                if finite(t.get("coefficient")) is not None
            ],
        }
        for c in tables.mappings(what.get("combinations"))
    ]
    indices = section(what, "observability")
    return {
        "free": free,
        "fixed": [r for r in rows if r["status"] == "fixed"],
        "has": {
            key: any(str(row[key]).strip() not in ("–", "") for row in rows)
            for key in ("instrument", "share", "note", "sigma", "half")
        },
        "counts": [
            (s, sum(r["status"] == s for r in rows)) for s in tables.STATUS if any(r["status"] == s for r in rows)
        ],
        "signs": tables.STATUS,
        "dropped": words.dropped_names(what, parameters),
        "combinations": combinations,
        "rank": finite(what.get("rank")),
        "n_free": finite(what.get("n_free")),
        "condition": significant(what.get("condition")) if finite(what.get("condition")) is not None else "",
        "observability": [
            (k, significant(indices.get(k)), INDICES[k]) for k in INDICES if finite(indices.get(k)) is not None
        ],
        "correlation": picture,
        "correlation_left_out": left_out,
        "strongest": [
            (a, b, f"{v:+.3f}".replace("-", "\u2212")) for a, b, v in matrix.strongest(section(result, "correlation"))
        ],
    }


def _fit(result: Result) -> dict[str, Any]:
    fit = section(result, "fit")
    history = [
        finite(h.get("cost", h.get("chi2"))) if isinstance(h, Mapping) else finite(h)
        for h in entries(fit.get("history"))
    ]
    costs = [h for h in history if h is not None]
    chi2, dof = finite(fit.get("chi2")), finite(fit.get("dof"))
    ratio = chi2 / dof if chi2 is not None and dof else None
    return {
        "iterations": finite(fit.get("iterations")),
        "reason": str(fit.get("reason") or ""),
        "convergence": pictures.convergence(costs),
        "costs": [plain(c) for c in costs[-5:]],
        "chi2": significant(chi2, 4) if chi2 is not None else "",
        "dof": f"{dof:.0f}" if dof is not None else "",
        "ratio": significant(ratio) if ratio is not None else "",
        "chi2_word": words.chi2_word(chi2, dof, fit.get("sigma_source")),
        "sigma_source": str(fit.get("sigma_source") or ""),
        "groups": tables.groups(fit),
    }


def _trust(result: Result, accuracy: Columns | None) -> dict[str, Any]:
    """How far predictions can be trusted, and which rows cannot."""
    prediction = section(result, "prediction")
    return {
        "heat": heat(accuracy) if accuracy else "",
        "coverage": [*tables.coverage(prediction), *words.trust(result)],
        "outliers": tables.outliers(result),
    }


def _recipe(result: Result) -> dict[str, Any]:
    provenance = section(result, "provenance")
    seconds = finite(provenance.get("seconds"))
    return {
        "version": str(provenance.get("version") or ""),
        "command": str(provenance.get("command") or ""),
        "seed": provenance.get("seed"),
        "started": str(provenance.get("started") or ""),
        "seconds": with_unit(significant(seconds, 2), "s") if seconds is not None else "",
        "inputs": [
            (str(i.get("file") or ""), str(i.get("sha256") or "")) for i in tables.mappings(provenance.get("inputs"))
        ],
        "options": tables.options(provenance),
        "schema": result.get("robocal"),
    }

"""Made-up results as the report sees them: a good calibration, a refused one, an almost empty one, and a large one. They are
documents; `result` reads one as result.json is read."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from robocal.files.result import Result, read_result
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

COLUMNS = (
    "configuration set group kind target x_mm y_mm z_mm before_mm after_mm held_out_mm dx_before_mm dy_before_mm dz_before_mm "
    "dx_after_mm dy_after_mm dz_after_mm angle_before_deg angle_after_deg angle_held_out_deg"
).split()
EMPTY_ANGLE = ("angle_before_deg", "angle_after_deg", "angle_held_out_deg")
Case = tuple[dict[str, Any], dict[str, list[Any]]]
GAIN = {"gain": Quantity(2.83e-3), "low": Quantity(2.61e-3), "high": Quantity(3.05e-3), "how": "held out"}


def result(document: dict[str, Any]) -> Result:
    """A document as result.json is read."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "result.json"
        place.write_text(json.dumps(document), encoding="utf-8")
        return read_result(place)


def said(document: dict[str, Any], *sentences: str) -> None:
    """Puts what is worth knowing into a document."""
    document["warnings"] = list(sentences)
    document["remarks"] = [{"code": "made-up", "sentence": s} for s in sentences]


def verdict(status: str, *reasons: Remark) -> dict[str, Any]:
    """A verdict as result.json has it: sentences, and the same as data."""
    return {"status": status, "reasons": [r.sentence for r in reasons], "remarks": [r.document for r in reasons]}


def statistic(values: Any, profiled: bool = False) -> dict[str, Any] | None:
    """Mean, rms, 95th percentile and maximum, as result.json keeps them."""
    v = np.asarray([x for x in values if x is not None], dtype=float)
    if not len(v):
        return None
    p95 = float(np.quantile(v, 0.95))
    rms = float(np.sqrt((v**2).mean()))
    return {"mean": float(v.mean()), "rms": rms, "p95": p95, "max": float(v.max()), "n": len(v), "profiled": profiled}


def errors(
    rng: np.random.Generator, m: int, held: int, before: float, after: float, angle: bool
) -> dict[str, list[Any]]:
    """Columns of residuals.csv: smooth errors of the nominal model, noise after it, the last `held` rows in a random
    order held out."""
    at = np.column_stack([rng.uniform(-250, 420, m), rng.uniform(-380, 380, m), rng.uniform(120, 760, m)])
    u = at / 400
    swirl = np.column_stack(
        [np.sin(2 * u[:, 1]) + 0.6, np.cos(1.7 * u[:, 0]) - 0.2 * u[:, 2], 0.9 * u[:, 0] * u[:, 2] - 0.4]
    )
    first = swirl + rng.normal(0, 0.12, (m, 3))
    first *= before / np.linalg.norm(first, axis=1).mean()
    last = rng.normal(0, 1, (m, 3))
    last *= after / np.linalg.norm(last, axis=1).mean()
    out = np.zeros(m, dtype=bool)
    out[rng.permutation(m)[:held]] = True
    last[out] *= 1.12
    after_mm = np.linalg.norm(last, axis=1)
    rows: dict[str, list[Any]] = {
        "configuration": [f"p{i + 1:03d}" for i in range(m)],
        "set": ["held_out" if o else "fit" for o in out],
        "group": ["tracker"] * m,
        "kind": ["pose" if angle else "position"] * m,
        "target": ["smr1"] * m,
        "before_mm": np.linalg.norm(first, axis=1).tolist(),
        "after_mm": after_mm.tolist(),
        "held_out_mm": [float(a) if o else None for a, o in zip(after_mm, out, strict=True)],
    }
    for i, axis in enumerate("xyz"):
        rows[f"{axis}_mm"] = at[:, i].tolist()
        rows[f"d{axis}_before_mm"] = first[:, i].tolist()
        rows[f"d{axis}_after_mm"] = last[:, i].tolist()
    turn = np.abs(rng.normal(0.31, 0.09, m)) if angle else np.full(m, np.nan)
    rows["angle_before_deg"] = turn.tolist() if angle else [None] * m
    rows["angle_after_deg"] = (turn * 0.03).tolist() if angle else [None] * m
    rows["angle_held_out_deg"] = [float(t) * 0.034 if angle and o else None for t, o in zip(turn, out, strict=True)]
    return {name: rows[name] for name in COLUMNS}


def pick(rows: dict[str, list[Any]], column: str, which: str | None = None) -> list[Any]:
    """The values of one column, of one set or of both."""
    return [v for v, s in zip(rows[column], rows["set"], strict=True) if which in (None, s)]


def parameters(rng: np.random.Generator) -> list[dict[str, Any]]:
    """A five-joint arm's table, with every status."""
    found: list[dict[str, Any]] = []
    for joint in range(1, 6):
        for symbol, unit, sigma, nominal in (
            ("alpha", "deg", 0.0021, -90.0 if joint % 2 == 0 else 0.0),
            ("d", "mm", 0.011, (0.0, 0.0, 250.0, 160.0, 0.0)[joint - 1]),
            ("theta", "deg", 0.0034, 0.0),
            ("r", "mm", 0.017, (300.0, 0.0, 0.0, 0.0, 72.0)[joint - 1]),
        ):
            s = sigma * float(rng.uniform(0.5, 1.8))
            delta = float(rng.normal(0, 0.4))
            status, share, note = "identified", float(rng.uniform(0.985, 1.0)), ""
            if (joint, symbol) in ((1, "r"), (3, "r"), (5, "r")):
                status, share, delta, note = "dropped", 0.0, 0.0, "kept at its nominal value"
            elif joint == 1 and symbol in ("alpha", "d", "theta"):
                status, share, delta, note = "fixed", None, 0.0, "fixed in the robot file"
            elif (joint, symbol) == (5, "alpha"):
                status, share, s, note = "prior", 0.31, 0.083, "the data add little to the stated prior"
            known = status in ("identified", "prior")
            row = {
                "name": f"j{joint}.{symbol}",
                "unit": unit,
                "nominal": nominal,
                "identified": nominal + delta,
                "delta": delta,
            }
            row |= {"sigma": s if known else None, "sigma_instrument": s / 3.1 if known else None}
            found.append(row | {"status": status, "data_share": share, "note": note})
    for i, axis in enumerate(("x", "y", "z", "rx", "ry", "rz")):
        unit, s = ("mm", 0.009) if i < 3 else ("deg", 0.0015)
        delta = float(rng.normal(0, 0.3))
        row = {
            "name": f"tracker.{axis}",
            "unit": unit,
            "nominal": 1234.5 if i == 0 else 0.0,
            "delta": delta,
            "sigma": s,
        }
        row["identified"] = row["nominal"] + delta
        found.append(row | {"sigma_instrument": s / 3.1, "status": "identified", "data_share": 1.0, "note": ""})
    return found


def improved(m: int = 150, held: int = 40, angle: bool = False, seed: int = 4) -> Case:
    """A good calibration: 2.9 mm before, about 0.06 mm on held-out configurations."""
    rng = np.random.default_rng(seed)
    rows = errors(rng, m, held, 2.9, 0.058, angle)
    table = parameters(rng)
    names = [p["name"] for p in table if p["status"] in ("identified", "prior")]
    a = rng.normal(0, 1, (len(names), 30)) + 0.8 * np.sin(np.arange(30) * np.arange(1, len(names) + 1)[:, None] / 9)
    a[1] = a[9] * 0.98 + 0.1 * a[1]
    c = np.corrcoef(a)
    ids = rows["configuration"]
    held_ids = pick(rows, "configuration", "held_out")
    residuals = {
        "unit": "mm",
        "before": statistic(rows["before_mm"]),
        "after": statistic(pick(rows, "after_mm", "fit")),
        "held_out": statistic(rows["held_out_mm"]),
        "held_out_before": statistic(pick(rows, "before_mm", "held_out")),
        "leave_one_out": None,
        "constant": statistic([v * 62 for v in rows["before_mm"]]),
        "angle": {
            "unit": "deg",
            "before": statistic(rows["angle_before_deg"]),
            "after": statistic(pick(rows, "angle_after_deg", "fit")),
            "held_out": statistic(rows["angle_held_out_deg"]),
            "held_out_before": statistic(pick(rows, "angle_before_deg", "held_out")),
        }
        if angle
        else None,
    }
    dof = 3 * (m - held) - len(names)
    group = {
        "name": "tracker",
        "kind": "position",
        "n": 3 * (m - held),
        "dof": dof,
        "chi2": dof * 9.6,
        "rms": 0.034,
        "unit": "mm",
    }
    result = {
        "robocal": 1,
        "robot": {
            "name": "Mitsubishi RV-2AJ",
            "convention": "khalil-hayati",
            "joints": 5,
            "source": "data sheet, page 12",
        },
        "method": "Levenberg-Marquardt, positions of a laser tracker",
        "verdict": verdict("improved", Remark.of(Code.GAIN_PROVEN, **GAIN)),
        "parameters": table,
        "identifiability": {
            "rank": 23,
            "n_free": 26,
            "condition": 48.3,
            "dropped": ["j1.r", "j3.r", "j5.r"],
            "combinations": [
                {
                    "text": "j1.r cannot be separated from tracker.z",
                    "terms": [{"name": "tracker.z", "coefficient": 1.0}],
                },
                {
                    "text": "j3.r cannot be separated from j2.r",
                    "terms": [{"name": "j2.r", "coefficient": 1.0}, {"name": "j4.r", "coefficient": -0.031}],
                },
                {"text": "j5.r has no effect on these measurements", "terms": []},
            ],
            "observability": {"O1": 0.41, "O2": 0.0207, "O3": 2.31, "O4": 0.0478, "O5": 0.61},
            "warnings": ["j5.alpha is held by its prior"],
        },
        "residuals": residuals,
        "fit": {
            "iterations": 5,
            "reason": "converged: no further decrease",
            "history": [4.1e7, 9.2e4, 2210.0, 1462.5, 1461.93, 1461.93],
            "chi2": dof * 9.6,
            "dof": dof,
            "groups": [group | {"sigma": 0.01, "sigma_source": "stated"}],
            "sigma_source": "stated",
        },
        "split": {
            "held_out_fraction": held / m,
            "seed": 7,
            "fit": [i for i in ids if i not in held_ids],
            "held_out": held_ids,
        },
        "correlation": {"names": names, "matrix": c.tolist()},
        "provenance": {
            "version": "0.1.0",
            "command": "robocal identify rv2aj.yaml tracker.yaml --seed 7 -o run",
            "inputs": [
                {"file": "rv2aj.yaml", "sha256": "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"},
                {"file": "tracker.csv", "sha256": "2c26b46b68ffc68ff99b453c1d30413413422d706483bfa0f98a5e886266e7ae"},
            ],
            "seed": 7,
            "started": "2025-03-04T09:12:44+00:00",
            "seconds": 0.83,
            "options": {
                "hold_out": held / m,
                "loss": "none",
                "free": ["alpha", "d", "theta", "r"],
                "prior": {"length": 1.0},
            },
        },
    }
    said(
        result,
        "chi2/dof is 9.6: the geometry does not explain everything that the tracker sees; sigmas are scaled by 3.1",
    )
    return result, rows


def refused(m: int = 14) -> Case:
    """Centimetre errors that no parameter set mends, judged by leave-one-out."""
    rng = np.random.default_rng(11)
    rows = errors(rng, m, 0, 41.0, 29.0, False)
    rows["held_out_mm"] = [v * 1.6 for v in rows["after_mm"]]
    rows["configuration"] = [str(i) for i in range(1, m + 1)]
    result, _ = improved()
    result["robot"] = {"name": "Workshop arm", "convention": "dh", "joints": 6, "source": ""}
    result["method"] = "Levenberg-Marquardt"
    result["verdict"] = verdict(
        "refused",
        Remark.of(Code.NO_BETTER_THAN_MEAN, after=Quantity(0.0464), constant=Quantity(0.044)),
        Remark.of(Code.UNEXPLAINED, explained=0.1, rms=Quantity(0.029), stated=Quantity(1e-4)),
        Remark.of(Code.FEW_NUMBERS, noun="configuration", left=24, sought=26),
    )
    result["residuals"] = {
        "unit": "mm",
        "before": statistic(rows["before_mm"]),
        "after": statistic(rows["after_mm"]),
        "held_out": None,
        "held_out_before": None,
        "leave_one_out": statistic(rows["held_out_mm"], profiled=True),
        "constant": statistic([44.0 + v / 9 for v in rows["before_mm"]]),
        "angle": None,
    }
    result["split"] = {"held_out_fraction": 0.0, "seed": None, "fit": rows["configuration"], "held_out": []}
    said(result, "the configurations lie almost in a single plane", "the tool angle moves by less than 5 deg")
    for row in result["parameters"]:
        for key in ("delta", "sigma", "sigma_instrument"):
            row[key] = None if row[key] is None else row[key] * 60
        row["identified"] = row["nominal"] + row["delta"]
    return result, rows


def empty() -> Case:
    """Everything that may be missing is missing."""
    result: dict[str, Any] = {
        "robot": {"name": "", "convention": "", "joints": 0},
        "method": "",
        "verdict": {"status": "not_improved"},
        "parameters": [
            {"name": "a.b", "unit": "", "nominal": None, "identified": None, "delta": None, "status": "fixed"},
            {"name": "a.c", "unit": "mm", "nominal": 1.0, "identified": None, "delta": 0.0, "sigma": 0.0, "status": "identified"},
        ],
        "identifiability": {"rank": 0, "n_free": 0},
        "residuals": {"unit": "mm"},
        "fit": {"iterations": 0, "reason": ""},
        "provenance": {"version": ""},
    }  # fmt: skip
    return result | {"robocal": 1}, {name: [] for name in COLUMNS}

"""A document of schema 2 as schema 1 said it, for a reference that was written before: one table of what changed.

Schema 2 has no unit in a key: `{"value": 0.3, "unit": "m"}` was a key that ended in `_m`, and a listing, `{"columns": [{"name", "unit",
"values"}, ...]}`, was a list of mappings. What was more than that stands in RULES; `docs/files.md` says the same for people.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

__all__ = ["schema_1"]

UNITS = {"m/s2": "m_s2", "1/N": "1_N", "N/m": "N_m", "": ""}
NULL = {
    "centre": "m",
    "extent": "m",
    "margin": "N",
    "acceleration": "m_s2",
    "predicting_the_mean": "",
}  # null has no unit
POSE = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")
Data = dict[str, Any]


def schema_1(document: Any) -> Any:
    """The document as it was; whatever is no document of schema 2 as it is."""
    if not isinstance(document, dict) or document.get("robocal") != 2:
        return document
    made: Data = {**_plain(document), "robocal": 1}
    for fits, rule in RULES:
        if fits <= set(document):
            rule(made)
    return made


def _key(name: str, unit: str) -> str:
    suffix = UNITS.get(unit, unit)
    return f"{name}_{suffix}" if suffix else name


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(v) for v in value]
    if not isinstance(value, dict):
        return value
    out: Data = {}
    for key, part in value.items():
        if isinstance(part, dict) and set(part) == {"value", "unit"}:
            out[_key(key, part["unit"])] = part["value"]
        elif isinstance(part, dict) and set(part) == {"columns"}:
            out[key] = _rows(part["columns"])
        elif isinstance(part, dict) and {"unit", "least"} <= set(part):  # over all cells
            out[_key(key, part["unit"])] = {k: v for k, v in part.items() if k != "unit"}
        else:
            out[_key(key, NULL[key]) if part is None and key in NULL else key] = _plain(part)
    return out


def _rows(columns: list[Data]) -> list[Data]:
    """One mapping per row; the columns of a pose as a matrix, those of several cables or axes as a list."""
    names = [_key(c["name"], c["unit"]) for c in columns]
    rows = [dict(zip(names, row, strict=True)) for row in zip(*(c["values"] for c in columns), strict=True)]
    return [_gathered(row) for row in rows]


def _gathered(row: Data) -> Data:
    out: Data = {}
    for key, value in row.items():
        group = re.fullmatch(r"(?:.*\.(tension)_N|(missing|wrench)\.\w+_Nm?)", key)
        if group is not None:
            name = "tension_N" if group[1] else group[2]
            out[name] = [*out.get(name, []), value]
        elif key not in POSE:
            out["name" if key == "id" else key] = value
    if set(POSE) <= set(row):
        import numpy as np  # not before its threads are counted

        from robocal.geometry import se3

        vector = np.array([np.nan if row[k] is None else row[k] for k in POSE])
        pose = se3.from_vector(np.nan_to_num(vector))
        out["T_base_platform"] = (pose if np.isfinite(vector).all() else np.full((4, 4), None)).tolist()
    for name in ("tension_N", "missing"):
        if None in out.get(name, []):
            out[name] = None
    return out


def _lengths(made: Data) -> None:
    made["lengths_m"] = {r["name"]: [v for k, v in r.items() if k.endswith("_m")] for r in made.pop("poses")}


def _tension(made: Data) -> None:
    cables = made.pop("tensions")
    made["limits_N"] = [c["limits_N"] for c in cables]
    spread = {k: [c.get(f"{k}_N") for c in cables] for k in ("least", "mean", "greatest")}
    made["tensions_N"] = {k: v for k, v in spread.items() if None not in v}


def _workspace(made: Data) -> None:
    for part in (made["box"], made["grid"]):
        part[part.pop("unit")] = part.pop("sides")
    for part in (made["grid"], made["rays"] or {}):
        for unit, word in (("m3", "volume"), ("m2", "area")):
            if f"size_{unit}" in part:
                part[f"{word}_{unit}"] = part.pop(f"size_{unit}")
    for unit, word in (("m3", "volume"), ("m2", "area")):
        for name in ("parts", "holes"):
            if f"{name}_{unit}" in made:
                made[f"{name}_{word}_{unit}"] = made.pop(f"{name}_{unit}")
    if made["rays"] is not None:
        made["rays"]["start"] = made["rays"].pop("why")
    made["home"].pop("acceleration_m_s2")
    if made["best"] is not None:
        made["best"].pop("held")
    if "wrenches" in made["demand"]:
        made["demand"]["wrenches"] = made["demand"]["wrenches"]["values"]


def _list(made: Data) -> None:
    made["box"]["half_rad"] = made["box"].pop("half_turn_rad")
    cables = [f"{c}_m" for c in made["cables"]]
    for row in made["poses"]:
        row["lengths_m"] = [row.pop(c) for c in cables]
        row.pop("rank", None)
    if made["choice"] is not None:
        sigma, expected = made["choice"].pop("sigma"), made["choice"].pop("expected_rms")
        made["choice"] |= {
            "sigma_m": sigma["length_m"], "sigma_position_m": sigma["position_m"], "sigma_orientation_rad": sigma["orientation_rad"],
            "expected_rms_m": {who: of for who, of in expected.items() if who != "unit"},
        }  # fmt: skip


def _check(made: Data) -> None:
    made.pop("robocal")
    for i in made["instruments"]:
        known = {s["unit"]: s["value"] for s in i.pop("sigma")}
        i |= {f"sigma_{unit}": known.get(unit) for unit in ("m", "rad", "px")}
    error = made.pop("baseline_error") or {}
    made["baseline_mean_error_mm"] = error.get("mean")
    made["baseline_mean_error_of_all_rows_mm"] = error.get("mean_of_all_rows")
    for name in ("cables", "cable_robot"):
        if made["robot"][name] is None:
            made["robot"].pop(name)
    for joint in made["robot"]["joints"]:
        joint.pop("unit")
    if "cable_robot" in made["robot"]:
        facts = made["robot"]["cable_robot"]
        facts["cables"] = {row["cable"]: _cable(row) for row in facts["cables"]}


def _cable(row: Data) -> Data:
    known = {k.replace(" ", "_"): v for k, v in row.items() if k != "cable"}
    if not known.get("pulley_m"):
        known = {k: v for k, v in known.items() if k not in ("pulley_m", "pulley_axis")}
    named = {"tension_N": "limits_N", "pulley_m": "pulley_radius_m"}
    return {named.get(k, k): v for k, v in known.items()}


def _verify(made: Data) -> None:
    def both(part: Data) -> Data:
        named = {"position": "position_mm", "orientation": "orientation_deg"}
        return {named[k]: {n: x for n, x in v.items() if n != "unit"} for k, v in part.items()}

    made["sources"] = {s: {view: both(e) for view, e in of.items()} for s, of in made["sources"].items()}
    if made["agreement"] is not None:
        made["agreement"] = both(made["agreement"])
    for later in ("between", "lists", "places"):
        made.pop(later, None)


def _require(made: Data) -> None:
    moves = {"ax": "x", "ay": "y", "az": "z", "l0": "zero"}
    made["sigma_m"] = {
        row["cable"]: {moves[k.removesuffix("_m")]: v for k, v in row.items() if k != "cable"}
        for row in made.pop("sigma")
    }
    if made["accuracy"] is not None:
        made["accuracy"]["alone"] = {k.rpartition("_")[0] or k: v for k, v in made["accuracy"]["alone"].items()}
        made["accuracy"]["value"] = made["accuracy"].pop("value")
        made["accuracy"].pop("unit", None)


def _path(made: Data) -> None:
    for row in made["motions"]:
        row["ends_by"] = row.pop("ends by")


def _plan(made: Data) -> None:
    made.pop("robocal")
    accuracy = made.pop("accuracy")
    made["asked_accuracy_mm"] = accuracy.pop("asked")
    made["accuracy"] = {f"{k}_mm": v for k, v in accuracy.items() if k != "unit"}
    made["travel_rad"] = {k: v for k, v in made.pop("travel").items() if k != "unit"}
    own = ("name", "rank", "candidate")
    made["program"] = [
        {"id": r["name"], **{k: r[k] for k in own[1:]}, "joints_si": [v for k, v in r.items() if k not in own]}
        for r in made["program"]
    ]


def _validation(made: Data) -> None:
    (made["gain"] or {}).pop("unit", None)
    for key in [k for k in made if k.startswith("predicting_the_mean_")]:
        made["predicting_the_mean"] = made.pop(key)
    for row in made["poses"]:
        for axis in "xyz":
            row.pop(f"{axis}_mm", None)


def _compensation(made: Data) -> None:
    made["rows"] = [{k: r[k] for k in ("target", "status", "after_mm", "note", "code")} for r in made["rows"]]


# What a document of schema 2 has, and what was else about it.
RULES: tuple[tuple[set[str], Callable[[Data], None]], ...] = (
    ({"cables", "lengths", "poses", "provenance"}, lambda made: None if "steps" in made else _lengths(made)),
    ({"tensions", "poses"}, _tension),
    ({"grid", "rays", "home"}, _workspace),
    ({"poses", "stopped_by"}, _list),
    ({"instruments", "identifiability"}, _check),
    ({"forecast", "program"}, _plan),
    ({"sources", "agreement"}, _verify),
    ({"sigma", "estimator"}, _require),
    ({"motions", "whole"}, _path),
    ({"predicting_the_mean"}, _validation),
    ({"verdict_of_the_calibration"}, _compensation),
    ({"simulated", "largest_error"}, lambda made: made.pop("robocal")),
)  # fmt: skip

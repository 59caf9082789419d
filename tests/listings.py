"""Listings of documents, row by row."""

from __future__ import annotations

from typing import Any

import numpy as np

from robocal.geometry import se3

NUMBERS = ("rms", "mean", "scatter", "foretold", "lost")
POSE = ("x", "y", "z", "rx", "ry", "rz")


def rows_of(listing: dict[str, Any]) -> list[dict[str, Any]]:
    """Every row by the names of its columns; beside them its pose as a matrix (None where there is none), and what stands in a column
    for each cable or axis as one list: tension, missing, wrench."""
    columns = listing["columns"]
    assert {frozenset(c) for c in columns} <= {frozenset(("name", "unit", "values"))}
    names = [c["name"] for c in columns]
    return [_gathered(dict(zip(names, row, strict=True))) for row in zip(*(c["values"] for c in columns), strict=True)]


def units_of(listing: dict[str, Any]) -> dict[str, str]:
    """The unit of every column."""
    return {c["name"]: c["unit"] for c in listing["columns"]}


def lengths_of(document: dict[str, Any]) -> dict[str, list[float]]:
    """The lengths of `cable inverse` by the names of the poses."""
    return {
        r["id"]: [r.get(c, r.get(f"{c}.geometric")) for c in document["cables"]] for r in rows_of(document["poses"])
    }


def _gathered(row: dict[str, Any]) -> dict[str, Any]:
    out = dict(row)
    if set(POSE) <= set(row):
        vector = [row[k] for k in POSE]
        out["T_base_platform"] = None if None in vector else se3.from_vector(np.array(vector)).tolist()
    for name, own in (
        ("tension", [v for k, v in row.items() if k.endswith(".tension")]),
        ("missing", [v for k, v in row.items() if k.startswith("missing.")]),
        ("wrench", [v for k, v in row.items() if k.startswith("wrench.")]),
    ):
        if own:
            out[name] = None if None in own else own
    return out


def points_of(document: dict[str, Any]) -> list[dict[str, dict[str, Any]]]:
    """What a study says of every point: the row of each output by its name."""
    outputs = {name: rows_of(listing) for name, listing in document["outputs"].items()}
    points = [dict(zip(outputs, point, strict=True)) for point in zip(*outputs.values(), strict=True)]
    # What was varied stands before the numbers of every output.
    varied = [{k: v for k, v in next(iter(p.values())).items() if k not in NUMBERS} for p in points]
    return [{**p, "varied": v} for p, v in zip(points, varied, strict=True)]

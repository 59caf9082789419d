"""covariance.json: what the parameters of a run may be off by, in SI, for predictions and for comparing two runs.

`covariance` is that of estimate minus truth: `noise` (from measurement noise) plus `response` diag(expected^2)
response^T (what the fit makes of parameters that were not seen). Components of rotation vectors are turns about the
axes of the parent frame. `joints` is the range in which each joint was measured, `conditions` the mean of the other
recorded columns, `measurement` the standard deviation of a new measurement as fitted. `placed` says that no instrument
frame was free, so that the base itself was measured.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import FiniteFloat

from robocal.errors import FormatError
from robocal.estimate.uncertainty import Total
from robocal.files.schema import Model, validate
from robocal.files.text import read_text
from robocal.files.yamlio import Document

__all__ = ["COVARIANCE", "Knowledge", "covariance_text", "read_covariance"]

Array = NDArray[np.float64]
COVARIANCE = "covariance.json"


@dataclass(frozen=True)
class Knowledge:
    """What a run knows of its parameters: how far they may be off, their values and nominal values (SI), the measured
    range of every joint (n, 2), where joints were measured, the mean of every other recorded column, and the standard
    deviation of a new measurement as fitted, by SI unit. `placed`: the base stood still in the instrument's frame."""

    total: Total
    values: Mapping[str, float]
    nominal: Mapping[str, float]
    joints: Array | None = None
    conditions: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    placed: bool = False


class CovarianceModel(Model):
    """covariance.json as it is written."""

    robocal: Literal[1]
    names: list[str]
    units: list[str]
    values: list[FiniteFloat]
    nominal: list[FiniteFloat]
    expected: list[FiniteFloat]
    dof: FiniteFloat | None
    joints: list[list[FiniteFloat]] | None
    conditions: dict[str, FiniteFloat]
    measurement: dict[str, FiniteFloat]
    placed: bool
    covariance: list[list[FiniteFloat]]
    noise: list[list[FiniteFloat]]
    response: list[list[FiniteFloat]]


def covariance_text(known: Knowledge, units: Mapping[str, str]) -> str:
    """The text of covariance.json; `units` are the SI units by name."""
    total = known.total
    parts = {
        "robocal": 1,
        "names": list(total.names),
        "units": [units[n] for n in total.names],
        "values": [float(known.values[n]) for n in total.names],
        "nominal": [float(known.nominal[n]) for n in total.names],
        "expected": total.expected.tolist(),
        "dof": total.dof if np.isfinite(total.dof) else None,
        "joints": None if known.joints is None else known.joints.tolist(),
        "conditions": dict(known.conditions),
        "measurement": dict(known.noise),
        "placed": known.placed,
        "covariance": total.covariance.tolist(),
        "noise": total.noise.tolist(),
        "response": total.response.tolist(),
    }
    # One row of a matrix per line: short to read, and lines differ where numbers do.
    lines = [
        f' "{k}": ' + ("[\n  " + ",\n  ".join(_plain(row) for row in v) + "\n ]" if _matrix(v) else _plain(v))
        for k, v in parts.items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _matrix(value: object) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], list)


def _plain(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def read_covariance(path: str | os.PathLike[str]) -> Knowledge:
    """Reads a covariance.json. Raises FileError, or FormatError naming line or key."""
    source = read_text(path)
    try:
        data = json.loads(source.text)
    except json.JSONDecodeError as error:
        raise FormatError(f"not valid JSON: {error.msg}", file=source.path, row=error.lineno) from None
    except (RecursionError, ValueError):
        raise FormatError("not valid JSON", file=source.path) from None
    if not isinstance(data, dict):
        raise FormatError("not a covariance", file=source.path, found=type(data).__name__, expected="an object")
    model = validate(CovarianceModel, Document(source.path, source.text, source.sha256, data))
    n = len(model.names)
    for key in ("units", "values", "nominal", "expected"):
        _length(source.path, key, len(getattr(model, key)), n)
    matrices = {}
    for key in ("noise", "response"):
        rows = getattr(model, key)
        _length(source.path, key, len(rows), n)
        for row in rows:
            _length(source.path, key, len(row), n)
        matrices[key] = np.array(rows, dtype=float).reshape(n, n)
    total = Total(
        tuple(model.names), matrices["noise"], matrices["response"], np.array(model.expected),
        float("inf") if model.dof is None else model.dof,
    )  # fmt: skip
    for pair in model.joints or ():
        _length(source.path, "joints", len(pair), 2)
    joints = None if model.joints is None else np.array(model.joints, dtype=float).reshape(-1, 2)
    values, nominal = (dict(zip(model.names, v, strict=True)) for v in (model.values, model.nominal))
    return Knowledge(total, values, nominal, joints, model.conditions, model.measurement, model.placed)


def _length(path: Path, key: str, found: int, expected: int) -> None:
    if found != expected:
        raise FormatError(
            "wrong number of values", file=path, key=key, found=found, expected=f"{expected}, as in names"
        )

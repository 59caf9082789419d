"""covariance.json: what the parameters of a run may be off by, in SI, for predictions and for comparing two runs.

`covariance` is that of estimate minus truth: `noise` (from measurement noise) plus `response` diag(expected^2)
response^T (what the fit makes of parameters that were not seen). Where several share a prior, `root` is S of their covariance S S^T, and
stands in the place of diag(expected). Components of rotation vectors are turns about the
axes of the parent frame. `joints` is the range in which each joint was measured, `conditions` the mean of the other
recorded columns, `measurement` the standard deviation of a new measurement as fitted. `placed` says that no instrument
frame was free, so that the base itself was measured. `rows` are those of the fit at its solution, whitened, over the
names that were fitted: residuals, Jacobian, and of each the place (an index into its joint values), no more at one place than say
something; `drift` asks them how far errors follow places and time. They are absent where rows have unknowns of their own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sized
from typing import Any, Literal

import numpy as np
from pydantic import FiniteFloat

from robocal._record import field, record
from robocal._types import Array
from robocal.diagnose.scatter import WhitenedRows
from robocal.estimate.uncertainty import Total
from robocal.files.plain import plain
from robocal.files.schema import FileModel, validate
from robocal.files.yamlio import YamlDocument, read_json

__all__ = ["COVARIANCE", "Knowledge", "covariance_text", "read_covariance"]

COVARIANCE = "covariance.json"
CLOSE, TINY = 1e-6, 1e-30  # rounding: of sigmas, and beside nothing


@record
class Knowledge:
    """What a run knows of its parameters: how far they may be off, their values and nominal values (SI), the measured
    range of every joint (n, 2), where joints were measured, the mean of every other recorded column, and the standard
    deviation of a new measurement as fitted, by SI unit. `placed`: the base stood still in the instrument's frame. `rows`:
    those of the fit, for a comparison with another run."""

    total: Total
    values: Mapping[str, float]
    nominal: Mapping[str, float]
    joints: Array | None = None
    conditions: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    placed: bool = False
    rows: WhitenedRows | None = None


class RowsModel(FileModel):
    """The rows of the fit as they are written."""

    names: list[str]
    spread: FiniteFloat
    enlarged: FiniteFloat
    thinned: FiniteFloat
    joints: list[list[FiniteFloat]]
    place: list[int]
    residual: list[FiniteFloat]
    jacobian: list[list[FiniteFloat]]


class CovarianceModel(FileModel):
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
    root: list[list[FiniteFloat]] | None = None
    rows: RowsModel | None = None


def covariance_text(known: Knowledge, units: Mapping[str, str]) -> str:
    """The text of covariance.json; `units` are the SI units by name."""
    total = known.total
    parts: dict[str, Any] = {
        "robocal": 1,
        "names": total.names,
        "units": [units[n] for n in total.names],
        "values": [known.values[n] for n in total.names],
        "nominal": [known.nominal[n] for n in total.names],
        "expected": total.expected,
        "dof": total.dof,
        "joints": known.joints,
        "conditions": known.conditions,
        "measurement": known.noise,
        "placed": known.placed,
        "covariance": total.covariance,
        "noise": total.noise,
        "response": total.response,
    }
    if total.root is not None:
        parts["root"] = total.root
    if known.rows is not None:
        short = {name: _short(getattr(known.rows, name)) for name in ("residual", "jacobian")}
        parts["rows"] = {name: getattr(known.rows, name) for name in RowsModel.model_fields} | short
    return _object(plain(parts)) + "\n"


def _short(values: Array) -> Array:
    """Six digits: a comparison of scatter needs no more."""
    size = np.abs(values)
    digits = 5 - np.floor(np.log10(np.where(size > 0, size, 1.0))).astype(np.int64)
    # A whole number over a power of ten up to 1e22 is the double that those six digits mean; what is smaller than 1e-22 is none.
    power = 10.0 ** np.minimum(np.abs(digits), 22)
    return np.where(digits > 0, np.rint(values * power) / power, np.rint(values / power) * power)


def _object(parts: Mapping[str, object]) -> str:
    # One row of a matrix per line: short to read, and lines differ where numbers do.
    lines = [f' "{k}": ' + _text(v) for k, v in parts.items()]
    return "{\n" + ",\n".join(lines) + "\n}"


def _text(value: object) -> str:
    if isinstance(value, dict) and any(_matrix(v) for v in value.values()):
        return _object(value)
    if isinstance(value, list) and _matrix(value):
        return "[\n  " + ",\n  ".join(_plain(row) for row in value) + "\n ]"
    return _plain(value)


def _matrix(value: object) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], list)


_plain = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode


def read_covariance(path: str | os.PathLike[str]) -> Knowledge:
    """Reads a covariance.json. Raises FileError, or FormatError naming line or key."""
    document = read_json(path, "not a covariance", "an object")
    model = validate(CovarianceModel, document)
    n = len(model.names)
    for key in ("units", "values", "nominal", "expected", "noise", "response"):
        _length(document, key, [getattr(model, key)], n)
    matrices = {}
    for key in ("noise", "response", "root"):
        if (rows := getattr(model, key)) is not None:
            _length(document, key, [rows], n)
            _length(document, key, rows, n)
            matrices[key] = np.array(rows, dtype=float).reshape(n, n)
    _sound(document, model, matrices)
    total = Total(
        tuple(model.names), matrices["noise"], matrices["response"], np.array(model.expected),
        float("inf") if model.dof is None else model.dof, matrices.get("root"),
    )  # fmt: skip
    _length(document, "joints", model.joints or (), 2)
    joints = None if model.joints is None else np.array(model.joints, dtype=float).reshape(-1, 2)
    values, nominal = (dict(zip(model.names, v, strict=True)) for v in (model.values, model.nominal))
    whitened = None if model.rows is None else _read_rows(document, model.rows, model.names)
    return Knowledge(total, values, nominal, joints, model.conditions, model.measurement, model.placed, whitened)


def _sound(document: YamlDocument, model: CovarianceModel, matrices: Mapping[str, Array]) -> None:
    """Raises FormatError for what no covariance is: names twice, a matrix that is not symmetric, a variance below 0, a whole that
    is not the sum of its parts."""
    if len(set(model.names)) < len(model.names):
        twice = next(n for n in model.names if model.names.count(n) > 1)
        document.fail("a name is given twice", ("names",), found=twice)
    good = model.dof is None or model.dof > 0
    document.insist(good, "not a number of degrees of freedom", ("dof",), found=model.dof, expected="above 0")
    for name, sigmas in (("expected", model.expected), ("measurement", model.measurement.values())):
        low = min(sigmas, default=0.0)
        document.insist(low >= 0, "a standard deviation below 0", (name,), found=low)
    n = len(model.names)
    rows = [row for row in model.covariance if len(row) == n]
    _length(document, "covariance", [rows], n)
    whole = np.array(rows, dtype=float).reshape(n, n)
    root, response = matrices.get("root"), matrices["response"]
    hidden = response * np.array(model.expected) if root is None else response @ root
    made = matrices["noise"] + hidden @ hidden.T

    def beyond(matrix: Array, share: float, of: Array) -> bool:
        size = np.sqrt(np.abs(np.diag(of)))
        return bool((abs(matrix) > share * np.outer(size, size) + TINY).any())

    for name, matrix in (("noise", matrices["noise"]), ("covariance", whole)):
        if (np.diag(matrix) < 0).any():
            document.fail("a variance below 0", (name,), found=model.names[int(np.argmin(np.diag(matrix)))])
        document.insist(not beyond(matrix - matrix.T, CLOSE, matrix), "the matrix is not symmetric", (name,))
        document.insist(not beyond(matrix, 1 + CLOSE, matrix), "a correlation beyond 1", (name,))
    message = "the covariance is not that of noise and response"
    document.insist(not beyond(whole - made, CLOSE, made), message, ("covariance",))


def _read_rows(document: YamlDocument, rows: RowsModel, names: list[str]) -> WhitenedRows:
    count, wide = len(rows.residual), len(rows.joints[0]) if rows.joints else 0
    _length(document, "rows.place", [rows.place], count)
    _length(document, "rows.jacobian", [rows.jacobian], count)
    _length(document, "rows.jacobian", rows.jacobian, len(rows.names))
    _length(document, "rows.joints", rows.joints, wide)
    unknown = [n for n in rows.names if n not in names]
    good = not unknown and all(0 <= p < len(rows.joints) for p in rows.place) and min(rows.spread, rows.enlarged) > 0
    document.insist(good, "rows that do not belong to these names", ("rows",), found=unknown[:3] or "a place")
    return WhitenedRows(
        tuple(rows.names), np.array(rows.joints, dtype=float), np.array(rows.place, dtype=np.int64),
        np.array(rows.jacobian, dtype=float), np.array(rows.residual, dtype=float), rows.spread, rows.enlarged,
        rows.thinned,
    )  # fmt: skip


def _length(document: YamlDocument, key: str, lists: Iterable[Sized], size: int) -> None:
    """Raises FormatError for the first of some lists that is not of this size."""
    for found in map(len, lists):
        document.insist(found == size, "wrong number of values", (key,), found=found, expected=f"{size}, as in names")

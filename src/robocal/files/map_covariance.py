"""The covariance of a map of markers, read and written: a table beside map.yaml, or rows in it.

One row and one column for each of x y z rx ry rz of every marker, and behind them one for the edge of each, where sizes were found; m and
rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import FormatError, ModelError
from robocal.files.csvtable import read_csv
from robocal.files.csvtext import csv_columns
from robocal.files.yamlio import YamlDocument
from robocal.parameters import FRAME_SYMBOLS
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.vision.maps import MarkerMap

__all__ = ["map_covariance_text", "read_map_covariance"]

SAME_SIGMA = 1e-3  # tolerance: of a sigma as map.yaml has it, with six digits, and as its covariance has it
ROUNDING = 1e-6  # tolerance: of the halves of a covariance, and below 0, of its largest


def read_map_covariance(
    document: YamlDocument, given: str | list[list[float]] | None, names: Sequence[str], sigma: Array | None
) -> tuple[Array | None, tuple[Remark, ...]]:
    """The covariance that a map states, of its table where that is there, else of its sigmas alone."""
    if given is None:
        return None if sigma is None else np.diag(sigma**2), ()
    if isinstance(given, str):
        plain = given and Path(given).name == given
        document.insist(plain, "not the name of a file beside this one", ("covariance",), found=given)
        document.insist(sigma is not None, "a covariance, but markers without sigma", ("covariance",))
        assert sigma is not None
        place = document.path.parent / given
        if not place.exists():
            facts = {"file": str(document.path), "table": given}
            return np.diag(sigma**2), (Remark.of(Code.MAP_COVARIANCE_MISSING, **facts),)
        matrix = _read_table(place, names)
        where: dict[str, Any] = {"file": place}
    else:
        for i, row in enumerate(given):
            if len(row) != len(given) or len(given) not in (6 * len(names), 7 * len(names)):
                expected = f"{6 * len(names)}, six for each marker, or {7 * len(names)} with edges"
                document.fail("wrong number of values", ("covariance", i), found=len(row), expected=expected)
        document.insist(given, "wrong number of rows", ("covariance",), found=0)
        matrix = np.array(given, dtype=float)
        where = {"file": document.path, "key": "covariance"}
    _check_matrix(matrix, names, where)
    own = np.sqrt(np.diag(matrix)[: 6 * len(names)])
    if sigma is not None and (np.abs(own - sigma) > SAME_SIGMA * np.maximum(own, sigma)).any():
        i = int(np.argmax(np.abs(own - sigma) / np.maximum(own, sigma).clip(1e-30)))
        raise FormatError(
            f"the covariance is of another map than {document.path.name}", found=f"{own[i]:.4g} for {_titles(names)[i]}",
            expected=f"sigma as the map has it, {sigma[i]:.4g}", **where,
        )  # fmt: skip
    return (matrix + matrix.T) / 2, ()


def _check_matrix(matrix: Array, names: Sequence[str], where: dict[str, Any]) -> None:
    """Raises FormatError for what no covariance is. No motion of the whole map is counted in it, so it has directions of variance 0."""
    least = int(np.argmin(np.diag(matrix)))
    if matrix[least, least] < 0:
        raise FormatError("a variance below 0", found=_titles(names)[least], **where)
    size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    uneven = np.abs(matrix - matrix.T) > ROUNDING * size
    if uneven.any():
        i, j = np.argwhere(uneven)[0]
        titles = _titles(names)
        raise FormatError("the covariance is not symmetric", found=f"{titles[i]} with {titles[j]}", **where)
    # Of equal units: each row over its standard deviation.
    root = np.sqrt(np.where(np.diag(matrix) > 0, np.diag(matrix), 1.0))
    values = np.linalg.eigvalsh(matrix / np.outer(root, root))
    if values[0] < -ROUNDING * max(values[-1], 1.0):
        raise FormatError("not a covariance: a variance below 0 in some direction", found=float(values[0]), **where)


def _titles(names: Sequence[str]) -> list[str]:
    """Of places, and behind them of edges, where these are."""
    return [*(f"{n}.{s}" for n in names for s in FRAME_SYMBOLS), *(f"{n}.edge" for n in names)]


def _unit(i: int, names: Sequence[str]) -> str:
    return "rad" if i % 6 > 2 and i < 6 * len(names) else "m"


def _read_table(place: Path, names: Sequence[str]) -> Array:
    table = read_csv(place)
    wanted = _titles(names)
    if len(table.names) == 6 * len(names):
        wanted = wanted[: 6 * len(names)]
    if list(table.names) != wanted or len(table) != len(wanted):
        wrong = next((a for a, b in zip(table.names, wanted, strict=False) if a != b), f"{len(table)} rows")
        expected = f"{len(wanted)} columns and rows, {wanted[0]} to {wanted[-1]}, as the map has its markers"
        raise FormatError("the covariance is of other markers than the map", file=place, found=wrong, expected=expected)
    for i, title in enumerate(wanted):
        si = _unit(i, names)
        if table.units[i] != si:
            raise FormatError("another unit", file=place, column=title, found=table.units[i], expected=si)
    return table.numbers(wanted)


def map_covariance_text(known: MarkerMap) -> str:
    """The table of a map's covariance, m and rad. Raises ModelError where it states none."""
    if known.covariance is None:
        raise ModelError("this map states no covariance", expected="one that was found from images")
    joint = known.joint
    assert joint is not None
    heads = [f"{t} [{_unit(i, known.names)}]" for i, t in enumerate(_titles(known.names)[: len(joint)])]
    return csv_columns(heads, [[f"{v:.12g}" for v in column] for column in joint.T.tolist()])

"""The covariance of a map of markers, read and written: a table beside map.yaml, or rows in it.

One row and one column for each of x y z rx ry rz of every marker, behind them one for the edge of each, where sizes were found, and one for
each number of the lens that was free, where the map names its lens; m, rad, px.
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
from robocal.vision.lenses import SPREAD
from robocal.vision.maps import MarkerMap

__all__ = ["map_covariance_text", "read_map_covariance"]

SAME_SIGMA = 1e-3  # tolerance: of a sigma as map.yaml has it, with six digits, and as its covariance has it
ROUNDING = 1e-6  # tolerance: of the halves of a covariance, and below 0, of its largest


def read_map_covariance(
    document: YamlDocument,
    given: str | list[list[float]] | None,
    names: Sequence[str],
    sigma: Array | None,
    lens: Sequence[str] = (),
) -> tuple[Array | None, tuple[Remark, ...]]:
    """The covariance that a map states, of its table where that is there, else of its sigmas alone; `lens` are numbers that it has too."""
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
        matrix = _read_table(place, names, lens)
        where: dict[str, Any] = {"file": place}
    else:
        for i, row in enumerate(given):
            if len(row) != len(given) or len(given) - len(lens) not in (6 * len(names), 7 * len(names)):
                few, many = (n * len(names) + len(lens) for n in (6, 7))
                beside = f", and {len(lens)} of the lens" if lens else ""
                expected = f"{few}, six for each marker{beside}, or {many} with edges"
                document.fail("wrong number of values", ("covariance", i), found=len(row), expected=expected)
        document.insist(given, "wrong number of rows", ("covariance",), found=0)
        matrix = np.array(given, dtype=float)
        where = {"file": document.path, "key": "covariance"}
    _check_matrix(matrix, _titles(names, len(matrix) - len(lens) > 6 * len(names), lens), where)
    own = np.sqrt(np.diag(matrix)[: 6 * len(names)])
    if sigma is not None and (np.abs(own - sigma) > SAME_SIGMA * np.maximum(own, sigma)).any():
        i = int(np.argmax(np.abs(own - sigma) / np.maximum(own, sigma).clip(1e-30)))
        raise FormatError(
            f"the covariance is of another map than {document.path.name}", found=f"{own[i]:.4g} for {_titles(names)[i][0]}",
            expected=f"sigma as the map has it, {sigma[i]:.4g}", **where,
        )  # fmt: skip
    return (matrix + matrix.T) / 2, ()


def _check_matrix(matrix: Array, titles: Sequence[tuple[str, str]], where: dict[str, Any]) -> None:
    """Raises FormatError for what no covariance is. No motion of the whole map is counted in it, so it has directions of variance 0."""
    least = int(np.argmin(np.diag(matrix)))
    if matrix[least, least] < 0:
        raise FormatError("a variance below 0", found=titles[least][0], **where)
    size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    uneven = np.abs(matrix - matrix.T) > ROUNDING * size
    if uneven.any():
        i, j = np.argwhere(uneven)[0]
        found = f"{titles[i][0]} with {titles[j][0]}"
        raise FormatError("the covariance is not symmetric", found=found, **where)
    # Of equal units: each row over its standard deviation.
    root = np.sqrt(np.where(np.diag(matrix) > 0, np.diag(matrix), 1.0))
    values = np.linalg.eigvalsh(matrix / np.outer(root, root))
    if values[0] < -ROUNDING * max(values[-1], 1.0):
        raise FormatError("not a covariance: a variance below 0 in some direction", found=float(values[0]), **where)


def _titles(names: Sequence[str], edges: bool = True, lens: Sequence[str] = ()) -> list[tuple[str, str]]:
    """Names and units: of places, behind them of edges where these are, and of numbers of the lens."""
    places = [(f"{n}.{s}", "rad" if k > 2 else "m") for n in names for k, s in enumerate(FRAME_SYMBOLS)]
    return [*places, *((f"{n}.edge", "m") for n in names if edges), *((f"lens.{s}", _unit_of(s)) for s in lens)]


def _unit_of(symbol: str) -> str:
    return "px" if symbol in SPREAD else "1"


def _read_table(place: Path, names: Sequence[str], lens: Sequence[str]) -> Array:
    table = read_csv(place)
    wanted = _titles(names, len(table.names) - len(lens) > 6 * len(names), lens)
    heads = [n for n, _ in wanted]
    if list(table.names) != heads or len(table) != len(wanted):
        wrong = next((a for a, b in zip(table.names, heads, strict=False) if a != b), f"{len(table)} rows")
        expected = f"{len(heads)} columns and rows, {heads[0]} to {heads[-1]}, as the map has its markers"
        raise FormatError("the covariance is of other markers than the map", file=place, found=wrong, expected=expected)
    for i, (title, si) in enumerate(wanted):
        if table.units[i] != si:
            raise FormatError("another unit", file=place, column=title, found=table.units[i], expected=si)
    return table.numbers(heads)


def map_covariance_text(known: MarkerMap) -> str:
    """The table of a map's covariance, m, rad, and px or 1 of a lens. Raises ModelError where it states none."""
    joint = known.joint
    if joint is None:
        raise ModelError("this map states no covariance", expected="one that was found from images")
    lens = () if known.lens is None else known.lens.known
    titles = _titles(known.names, known.size_covariance is not None, lens)
    heads = [f"{name} [{unit}]" for name, unit in titles]
    return csv_columns(heads, [[f"{v:.12g}" for v in column] for column in joint.T.tolist()])

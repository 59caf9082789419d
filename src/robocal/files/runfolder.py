"""A run folder is one thing: result.json records what the other files were when it was written, and whoever reads one of them
reads all of them as they were. They are written all, or none.

report.html is not recorded, for `report` writes it again. Files with other names are nobody's business here.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from robocal._record import record, replace
from robocal.errors import FileError, InputError, nearest
from robocal.files.covariance import COVARIANCE
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.csvtext import csv_columns
from robocal.files.encoding import encode
from robocal.files.plain import plain
from robocal.files.result import Result, read_result
from robocal.files.schema import FileModel, validate
from robocal.files.text import FORBIDDEN, forbidden_part, harmless, read_bytes
from robocal.files.writing import JOURNAL, LEFT, write_files
from robocal.files.yamlio import read_json
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.apply.accuracy import AccuracyMap
    from robocal.prove.nongeometric.layer import Layer

__all__ = [
    "ACCURACY",
    "COMPARISON",
    "LAYER",
    "PARTS",
    "REPORT",
    "RESIDUALS",
    "RESIDUAL_COLUMNS",
    "RESULT",
    "ROBOTS",
    "Run",
    "accuracy_columns",
    "accuracy_text",
    "comparison_text",
    "find_run",
    "layer_text",
    "obstacle",
    "open_run",
    "read_accuracy",
    "read_comparison",
    "read_layer",
    "read_residuals",
    "write_run",
]

RESULT, RESIDUALS, REPORT, ACCURACY = "result.json", "residuals.csv", "report.html", "accuracy_map.csv"
ROBOTS, LAYER, COMPARISON = ("calibrated.yaml", "calibrated.urdf"), "layer.json", "comparison.csv"
PARTS = (*ROBOTS, RESIDUALS, COVARIANCE, ACCURACY, LAYER, COMPARISON)  # what result.json records


@record
class Run:
    """A run folder whose files are those that its run wrote; `recorded` is their SHA-256 by name, None in folders of earlier
    versions, where nobody can tell."""

    folder: Path
    result: Result
    recorded: Mapping[str, str] | None

    def part(self, name: str) -> Path | None:
        """One of its files; None where the run has none of that name."""
        place = self.folder / name
        return place if place.is_file() else None

    @property
    def robot(self) -> Path | None:
        """The calibrated robot."""
        return next((place for name in ROBOTS if (place := self.part(name))), None)

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What is to be said of the folder."""
        return () if self.recorded is not None else (Remark.of(Code.RUN_UNRECORDED, run=str(self.folder)),)


def open_run(folder: str | os.PathLike[str]) -> Run:
    """Opens a run folder. Raises FileError where there is none, or where a file is missing, was changed or comes from
    another run, and FormatError for a broken result.json."""
    home = Path(folder)
    place = home / RESULT
    if not place.is_file():
        expected = f"a folder with {RESULT}, as robocal identify -o writes it"
        raise FileError("this is not a run folder", file=home, expected=expected)
    result = read_result(place)
    run = Run(home, result, result.files)
    if run.recorded is not None:
        for name in PARTS:
            _check(home / name, run.recorded.get(name))
    return run


def find_run(path: str | os.PathLike[str]) -> Run | None:
    """The run of a folder, or of one of its files; None where there is no run. Raises as `open_run` does."""
    place = Path(path)
    folder = place if place.is_dir() else place.parent if place.name in PARTS else None
    return open_run(folder) if folder is not None and (folder / RESULT).is_file() else None


def obstacle(folder: Path) -> FileError | None:
    """None where a run may be written without a question: an empty folder, a run as it was written, or one that was interrupted;
    otherwise what is in the way."""
    if not folder.is_dir():
        return None
    own = {RESULT, REPORT, *PARTS, JOURNAL, f"{JOURNAL}.new"}
    for entry in sorted(folder.iterdir()):
        left = LEFT.fullmatch(entry.name)
        if entry.name not in own and not (left and left["name"] in own):
            return _in_the_way("the folder holds other files", entry)
    if (folder / JOURNAL).is_file():
        return None
    there = [name for name in (RESULT, *PARTS) if (folder / name).exists()]
    if not there:
        return None
    try:
        run = open_run(folder)
    except InputError as error:
        return _in_the_way(f"the folder holds no untouched run: {error.message}", error.file or folder)
    return None if run.recorded is not None else _in_the_way("nobody can tell whether this run was changed", folder)


def _in_the_way(message: str, place: object) -> FileError:
    return FileError(message, file=place, expected="--force to write the run there all the same, or a new name")


def _check(place: Path, recorded: str | None) -> None:
    """Raises FileError where a file is not what its run wrote."""
    there, expected = place.is_file(), f"what its {RESULT} records"
    if recorded is None and there:
        raise FileError("this file does not belong to the run beside it", file=place, expected=expected)
    if recorded is not None and not there:
        raise FileError("a file of this run is missing", file=place, expected=expected)
    if recorded is not None and hashlib.sha256(read_bytes(place)).hexdigest() != recorded:
        expected += "; a copy outside of the folder may be edited"
        raise FileError("this file was changed, or belongs to another run", file=place, expected=expected)


# --- residuals.csv ---

RESIDUAL_COLUMNS = (
    "configuration", "set", "set_aside", "group", "kind", "target",
    "x_mm", "y_mm", "z_mm",
    "before_mm", "after_mm", "held_out_mm",
    "dx_before_mm", "dy_before_mm", "dz_before_mm",
    "dx_after_mm", "dy_after_mm", "dz_after_mm",
    "angle_before_deg", "angle_after_deg", "angle_held_out_deg",
    "before_px", "after_px", "held_out_px",
    "fingerprint",
)  # fmt: skip
TEXTS = ("configuration", "set", "set_aside", "group", "kind", "target", "fingerprint")
LATER = ("set_aside", "fingerprint")  # columns that older folders do not have
INFINITE = float("inf")


def residual_text(columns: Mapping[str, Sequence[Any]]) -> str:
    """residuals.csv: one row per observation; columns that are not given, None and NaN are empty cells."""
    for name in columns:
        if name not in RESIDUAL_COLUMNS:
            raise ValueError(f"residuals.csv has no column {name!r}; did you mean {nearest(name, RESIDUAL_COLUMNS)!r}?")
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        raise ValueError(f"columns of different length: {sorted(lengths)}")
    count = max(lengths, default=0)
    cells = [_cells(columns[name]) if name in columns else [""] * count for name in RESIDUAL_COLUMNS]
    return csv_columns(RESIDUAL_COLUMNS, cells)


def _cells(values: Sequence[Any]) -> list[str]:
    """A column as it is written: texts that a spreadsheet takes for texts, numbers with nine digits."""
    with suppress(TypeError, OverflowError):  # of what is no number
        told = " %.9g" * len(values) % tuple(values)
        if "n" not in told:  # neither nan nor inf
            return told.split()
    distinct = set(values)
    if all(type(v) is str for v in distinct):  # many rows say the same few words
        words = {v: str(harmless(v)) for v in distinct}
        return [words[v] for v in values]
    if distinct == {None}:
        return [""] * len(values)
    return [
        str(harmless(v)) if isinstance(v, str) else f"{v:.9g}" if v is not None and -INFINITE < v < INFINITE else ""
        for v in values
    ]


def write_run(
    folder: str | os.PathLike[str],
    result: Result,
    robot_text: str | None,
    residuals: Mapping[str, Sequence[Any]] | None,
    report: str | None,
    *,
    robot_name: str = ROBOTS[0],
    more: Mapping[str, str] | None = None,
) -> tuple[Path, ...]:
    """Writes a run folder, with `more` texts by file name; files of an earlier run that this one does not have are
    removed. result.json records what the others are. Raises FileError, and then nothing changed."""
    files = dict(more or {})
    if robot_text is not None:
        files[robot_name] = robot_text
    if residuals is not None:
        files[RESIDUALS] = residual_text(residuals)
    recorded = {name: hashlib.sha256(encode(text)).hexdigest() for name, text in files.items()}
    if report is not None:
        files[REPORT] = report
    texts = {RESULT: replace(result, files=recorded).to_json(), **files}
    return write_files(folder, texts, remove=(REPORT, *PARTS))


def read_residuals(path: Path) -> dict[str, list[Any]]:
    """The columns of residuals.csv, None for empty cells. Raises FileError or FormatError."""
    table = read_csv(path, separator=",")
    out: dict[str, list[Any]] = {}
    for name in RESIDUAL_COLUMNS:
        if name in LATER and name not in table.names:
            continue
        at = table.find(name)
        cells = table.strip(at)
        out[name] = cells if name in TEXTS else [_number(c, table, row, name) for row, c in enumerate(cells)]
    return out


def _number(cell: str, table: CsvTable, row: int, column: str) -> float | None:
    if not cell:
        return None
    try:
        return float(cell)
    except ValueError:
        raise table.fail("not a number", row, column, found=cell, expected="a number") from None


# --- accuracy_map.csv: one row per cell of a slice through the workspace, in mm ---

MAP_COLUMNS = ("slice", "x_mm", "y_mm", "z_mm", "side_mm", "nominal_error_mm", "band_mm", "n")


def accuracy_columns(found: AccuracyMap) -> dict[str, list[Any]]:
    """The columns of accuracy_map.csv."""
    out: dict[str, list[Any]] = {name: [] for name in MAP_COLUMNS}
    for s in found.slices:
        many = len(s.centre)
        numbers = 1e3 * np.column_stack([s.centre, np.full(many, s.side), s.error, s.band])
        for column, values in zip(out.values(), ([s.name] * many, *numbers.T.tolist(), s.count.tolist()), strict=True):
            column += values
    return out


def accuracy_text(columns: dict[str, list[Any]]) -> str:
    """The text of accuracy_map.csv."""
    each = ([f"{v:.6g}" if isinstance(v, float) else str(v) for v in columns[name]] for name in MAP_COLUMNS)
    return csv_columns(MAP_COLUMNS, list(each))


def read_accuracy(path: str | os.PathLike[str]) -> dict[str, list[Any]]:
    """The columns of an accuracy_map.csv. Raises FileError or FormatError."""
    table = read_csv(path, separator=",")
    numbers = {name: table.numbers([name])[:, 0].tolist() for name in MAP_COLUMNS[1:]}
    return {"slice": list(table.texts("slice")), **numbers}


# --- comparison.csv: one row per component of an observation, what is left of it by every estimator ---

COMPONENT = ("configuration", "set", "group", "kind", "target", "component", "unit")  # then a column for each estimator


def comparison_text(columns: Mapping[str, Sequence[Any]]) -> str:
    """The text of comparison.csv."""
    return csv_columns(tuple(columns), [_cells(values) for values in columns.values()])


def read_comparison(path: str | os.PathLike[str]) -> dict[str, list[Any]]:
    """The columns of a comparison.csv, None for empty cells. Raises FileError or FormatError."""
    table = read_csv(path, separator=",")
    words: dict[str, list[Any]] = {name: list(table.strip(table.find(name))) for name in COMPONENT}
    methods = [name for name in table.names if name not in COMPONENT]
    return words | {m: [_number(c, table, row, m) for row, c in enumerate(table.strip(table.find(m)))] for m in methods}


# --- layer.json: a residual layer as plain numbers, in SI, angles in rad ---


class LayerModel(FileModel):
    """layer.json as it is written: `points` are joint values, `weights` what each adds: correction = k(q, points) weights, in base axes;
    see `prove.nongeometric.layer` for k. The first three columns are in m, the others, where there are any, a rotation vector."""

    robocal: Literal[1]
    frame: Literal["base"]
    joints: list[str]
    turning: list[bool]
    lengths: list[Annotated[FiniteFloat, Field(gt=0)]]
    size: list[Annotated[FiniteFloat, Field(gt=0)]]
    noise: FiniteFloat = Field(gt=0)
    points: list[list[FiniteFloat]]
    weights: list[list[FiniteFloat]]


def layer_text(layer: Layer) -> str:
    """The text of layer.json."""
    told = plain({name: getattr(layer, name) for name in LayerModel.model_fields if hasattr(layer, name)})
    return json.dumps({"robocal": 1, "frame": "base", **told}, allow_nan=False) + "\n"


def read_layer(path: str | os.PathLike[str]) -> Layer:
    """Reads a layer.json. Raises FileError or FormatError."""
    from robocal.prove.nongeometric.layer import Layer

    document = read_json(path, "this is not a residual layer", "an object with the key robocal")
    if (strange := forbidden_part(document.data)) is not None:
        document.fail(FORBIDDEN, (strange[0],), found=strange[1])
    model = validate(LayerModel, document)
    n, d = len(model.joints), len(model.size)
    shapes = {len(model.turning), len(model.lengths), *(len(p) for p in model.points)}
    document.insist(d in (3, 6), "a correction has 3 numbers or 6", ("size",), found=d)
    whole = shapes == {n} and {len(w) for w in model.weights} == {d} and len(model.points) == len(model.weights)
    document.insist(whole, "numbers are missing", expected=f"{n} per point and {d} per weight")
    return Layer(
        tuple(model.joints), tuple(model.turning), np.array(model.points), np.array(model.weights),
        np.array(model.size), np.array(model.lengths), model.noise,
    )  # fmt: skip

"""What a data.yaml may say: the keys that every kind of measurement shares."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, PositiveFloat, model_validator

from robocal.errors import FormatError, one_of
from robocal.files.orientation import FORMS
from robocal.files.schema import Columns, FileModel, FrameModel, Name, UnitsModel, Version, refuse
from robocal.files.units import parse_quantity
from robocal.files.unread import split_list

__all__ = [
    "TINIEST",
    "TOO_SMALL",
    "ColumnModel",
    "CsvModel",
    "DataModel",
    "FramedModel",
    "InstrumentModel",
    "JointsModel",
    "OrientationModel",
    "PlacePriorModel",
    "PlaceValuesModel",
    "PosedModel",
    "ScalarModel",
    "SecondModel",
    "Sigma",
    "SigmaModel",
    "TargetModel",
    "ValueModel",
    "column_model",
]


def _separator(value: Any) -> Any:
    value = {"tab": "\t", "\\t": "\t", "space": " "}.get(value, value) if isinstance(value, str) else value
    if not isinstance(value, str) or len(value) != 1 or value in "\"'.\n\r#" or value.isalnum():
        refuse("not a separator", found=value, expected="one character such as ';' or ',' or tab")
    return value


class CsvModel(FileModel):
    """How the CSV is written; what is not stated, the table says itself (`files.dialect`)."""

    separator: Annotated[Any, BeforeValidator(_separator)] = None
    decimal: Literal[".", ","] | None = None
    thousands: Literal["", ".", ",", "'", " "] | None = None
    header: bool = True
    missing: Literal["refuse", "skip"] = "refuse"  # rows where a cell that is needed is empty or not a number

    @model_validator(mode="after")
    def _two_signs(self) -> CsvModel:
        if self.thousands and self.thousands == self.decimal:
            refuse(
                "one sign cannot be decimal and between thousands", found=self.thousands, expected="two different ones"
            )
        return self

    @property
    def style(self) -> dict[str, Any]:
        """The options of `read_csv`."""
        return self.model_dump(include={"separator", "decimal", "thousands", "header"})


TINIEST, TOO_SMALL = 1e-30, "so small a standard deviation is none"  # its inverse squared still is a number


class SigmaModel(FileModel):
    """Standard deviations in columns."""

    columns: Columns


def _sigma(value: Any) -> Any:
    if value is None or isinstance(value, dict):
        return value if value is None else SigmaModel.model_validate(value)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        refuse("not a standard deviation", found=value, expected="a number above 0, or {columns: [...]}")
    if value <= 0:
        expected = "a number above 0; leave it out to have it estimated"
        refuse("a standard deviation must be above 0", found=value, expected=expected)
    if value <= TINIEST:
        refuse(TOO_SMALL, found=value, expected=f"above {TINIEST:g}")
    return float(value)


Sigma = Annotated[Any, BeforeValidator(_sigma)]


class ValueModel(FileModel):
    """Numbers in columns, their unit, and their standard deviation (absent: estimated)."""

    columns: Columns = None
    unit: str | None = None
    sigma: Sigma = None


def _order(value: Any) -> Any:
    letters = value.upper() if isinstance(value, str) else ""
    if len(letters) != 3 or set(letters) - set("XYZ") or letters[0] == letters[1] or letters[1] == letters[2]:
        refuse("not an order of axes", found=value, expected="three of X, Y, Z such as XYZ or ZYX")
    return letters


def _form(value: Any) -> Any:
    if not isinstance(value, str) or value not in FORMS:
        refuse("unknown form", found=value, **one_of(value, FORMS))
    return value


class OrientationModel(ValueModel):
    """An orientation: its form, and for Euler angles the order of axes and whether they turn along (intrinsic) or not
    (extrinsic)."""

    form: Annotated[str, BeforeValidator(_form)]
    order: Annotated[Any, BeforeValidator(_order)] = None
    frame: Literal["intrinsic", "extrinsic"] | None = None


def _joint_unit(value: Any) -> Any:
    if value is None or isinstance(value, str) or (isinstance(value, list) and all(isinstance(v, str) for v in value)):
        return value
    refuse("not a unit", found=value, expected="one unit, or a list with one for every joint")


def _signs(value: Any) -> Any:
    if value is not None and (
        not isinstance(value, list) or any(isinstance(v, bool) or v not in (1, -1) for v in value)
    ):
        refuse("not a list of signs", found=value, expected="one for each column, 1 or -1, such as [1, -1, 1]")
    return value


class PlaceValuesModel(ValueModel):
    """Coordinates: one unit or one for each column, and the sign with which each column counts (1 or -1)."""

    unit: Annotated[Any, BeforeValidator(_joint_unit)] = None
    sign: Annotated[Any, BeforeValidator(_signs)] = None


class JointsModel(FileModel):
    """Joint values: one column per joint from base to tool; one unit, or one for each."""

    columns: Columns = None
    unit: Annotated[Any, BeforeValidator(_joint_unit)] = None


class ScalarModel(FileModel):
    """A number of the instrument: a ball's radius, a bar's length. With a name it is one parameter, shared by all files
    that use the name; free, it is identified."""

    name: Name | None = None
    value: FiniteFloat | None = None
    unit: str | None = None
    free: bool | None = None


class InstrumentModel(FrameModel):
    """The instrument's own frame."""

    name: Name | None = None
    mount: Literal["base", "tool"] = "base"


class PlacePriorModel(FileModel):
    """How well the place of a thing is known, as standard deviations in the units of the file."""

    length: PositiveFloat
    angle: PositiveFloat


class TargetModel(FrameModel):
    """A thing that the instrument sees; on the tool unless mounted on the base. Under a prior it is free."""

    mount: Literal["tool", "base"] = "tool"
    prior: PlacePriorModel | None = None


class ColumnModel(FileModel):
    """A column and its unit."""

    column: str | int
    unit: str | None = None


def column_model(value: Any) -> Any:
    """A column by its name or number, or a mapping that says its unit too."""
    if isinstance(value, str | int) and not isinstance(value, bool):
        return ColumnModel(column=value)
    if isinstance(value, dict):
        return ColumnModel.model_validate(value)
    refuse("not a column", found=value, expected="a column, or {column: ..., unit: ...}")


class SecondModel(JointsModel):
    """The other configuration of a row: its joint columns, or the column with the id of another row; both where rows
    share it."""

    id: Annotated[Any, BeforeValidator(column_model)] = None


def _several(value: Any) -> Any:
    """A column of a configuration, or several: one per joint."""
    if isinstance(value, dict) and "columns" in value:
        return ValueModel.model_validate(value)
    return column_model(value)


def _files(value: Any) -> Any:
    parts = value if isinstance(value, list) else [value]
    if not parts or any(not isinstance(p, str) or not p for p in parts):
        refuse("not a file name", found=value, expected="a file name, or a list of them")
    return parts


def _words(value: Any) -> Any:
    parts = value if isinstance(value, list) else [value]
    if any(isinstance(p, bool) or not isinstance(p, str | int) for p in parts):
        refuse("not rows", found=value, expected="ids, row numbers, ranges such as 10-20, or a list of them")
    return split_list(parts)


SCALE_MOST = 0.5  # of a length: beyond, nobody means the scale of an instrument


def _scale(value: Any) -> Any:
    """The standard deviation of the scale as a factor: 0 where it is known."""
    expected = "known, or {sigma: 0.1 %}"
    if value is None or value == "known":
        return None if value is None else 0.0
    if not isinstance(value, dict) or set(value) != {"sigma"} or isinstance(value["sigma"], bool):
        refuse("not the scale of an instrument", found=value, expected=expected)
    sigma = value["sigma"]
    try:
        found = float(sigma) if isinstance(sigma, int | float) else parse_quantity(str(sigma), "1", key="scale.sigma")
    except FormatError:
        refuse(
            "not the standard deviation of a scale",
            found=sigma,
            expected="a share with its unit, such as 0.1 %, or 0.001",
        )
    if not 0 < found < SCALE_MOST:
        refuse(
            "not the standard deviation of a scale", found=sigma, expected="above 0 and below 50 %; known where it is 0"
        )
    return found


class DataModel(FileModel):
    """data.yaml; a kind of measurement adds its own keys."""

    robocal: Version
    kind: str
    file: Annotated[Any, BeforeValidator(_files)]
    csv: CsvModel = CsvModel.model_construct()
    units: UnitsModel | None = None
    joints: JointsModel = JointsModel.model_construct()
    targets: dict[Name, TargetModel] = Field(default_factory=dict)
    target: Annotated[Any, BeforeValidator(column_model)] = None
    configuration: dict[str, Annotated[Any, BeforeValidator(_several)]] = Field(default_factory=dict)
    group: Name | None = None  # whose noise these are; by default the instrument's, or the file's
    scale: Annotated[Any, BeforeValidator(_scale)] = (
        None  # of the instrument's lengths; by default as is usual for the kind
    )
    exclude: Annotated[Any, BeforeValidator(_words)] = ()  # rows that are left out
    source: str | None = None


class FramedModel(DataModel):
    """Data of an instrument with a frame of its own."""

    frame: InstrumentModel = InstrumentModel.model_construct()


class PosedModel(FramedModel):
    """The same of an instrument on a rig whose poses are known: T_base_rig of every row."""

    position: PlaceValuesModel | None = None
    orientation: OrientationModel | None = None

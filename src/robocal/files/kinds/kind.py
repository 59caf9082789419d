"""What every kind of measurement in files shares: values read, parts of a table, what is written, units and sigmas."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np

from robocal._types import Array, Ints
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, ScalarModel, SigmaModel, ValueModel
from robocal.files.onething import UNSAID
from robocal.files.units import Unit, Units, number, parse_unit
from robocal.files.yamlio import Path_, YamlDocument, quote
from robocal.measure.data import Observations

__all__ = [
    "DEVIATIONS",
    "SPREADS",
    "Around",
    "KindFile",
    "KindOutput",
    "Part",
    "Values",
    "agree_unit",
    "column_units",
    "columns",
    "contact",
    "quantity",
    "refuse_one_sigma",
    "scalar",
    "section",
    "show_scalar",
    "sigmas",
    "whole",
    "yaml_names",
]

Column = tuple[str, Unit, Array]
FULL = (True,) * 6
# The columns of what a contact leaves, and of their standard deviations, by how many numbers that is.
DEVIATIONS = {1: ("deviation",), 3: ("dx", "dy", "dz")}
SPREADS = {1: ("s_contact",), 3: ("sdx", "sdy", "sdz")}


@dataclass(frozen=True)
class Values:
    """One kind's numbers in SI: value (k, d), sigma (k, d) or None; the unit of lengths and angles in the file, for
    frames and reports."""

    value: Array
    sigma: Array | None
    length: Unit | None = None
    angle: Unit | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    options: Mapping[str, object] = field(default_factory=dict)
    digits: Array | None = None  # (k, d) what one unit in the last digit means, where the file says the value itself


@dataclass(frozen=True)
class Part:
    """Observations of one thing, such as one place: rows of the table with their values, and what the kind must
    know."""

    rows: Ints
    value: Array
    sigma: Array | None
    extra: Mapping[str, Array] = field(default_factory=dict)
    options: Mapping[str, object] = field(default_factory=dict)
    group: str = ""  # default: the file's
    kind: str = ""  # default: the file's
    targeted: bool = True  # whether a thing on the tool is measured
    digits: Array | None = None
    nowhere: bool = False  # known without the machine: no row of the table is where it stood


@dataclass(frozen=True)
class Around:
    """What surrounds a kind's columns: the table and its document, the units of frames, the file's own name, and names
    that are taken."""

    table: CsvTable
    document: YamlDocument
    units: Units
    name: str
    owners: frozenset[str]

    def refuse_taken(self, name: str, at: Path_) -> None:
        """Raises FormatError at a key path for the name of something that another thing has."""
        if name in self.owners:
            taken = ", ".join(sorted(self.owners))
            self.document.fail("this name is taken", at, found=name, expected=f"a name other than {taken}")


@dataclass(frozen=True)
class KindOutput:
    """A kind's own part of what is written: columns (header, unit, values (k,) in SI), and its lines of data.yaml."""

    columns: tuple[Column, ...]
    lines: tuple[str, ...] = ()


def whole(model: Any, values: Values, around: Around) -> Sequence[Part]:
    """All rows are observations of one instrument."""
    rows = np.arange(len(values.value))
    return [Part(rows, values.value, values.sigma, values.extra, values.options, digits=values.digits)]


@dataclass(frozen=True)
class KindFile:
    """A kind of measurement in files: the model of its data.yaml, how its columns are read and written, and which parts
    of a target it can see; `free` says what of its place is free unless stated, `located` whether its first three
    values are where the tool is, and `lengths` is the section whose readings are lengths."""

    name: str
    model: type[DataModel]
    read: Callable[[Any, CsvTable, YamlDocument], Values]
    write: Callable[[Observations, Units], KindOutput]
    template: str
    sees: tuple[bool, ...] = FULL
    parts: Callable[[Any, Values, Around], Sequence[Part]] = whole
    free: tuple[bool, ...] = FULL
    located: bool = False
    lengths: str = ""


def quantity(
    model: ValueModel | None,
    table: CsvTable,
    document: YamlDocument,
    at: Path_,
    si: Sequence[str],
    names: Sequence[str],
) -> tuple[Array, Array | None, list[Unit]]:
    """The numbers of some columns in SI (k, d), their standard deviations, and units; `si` is the quantity of each,
    `names` are the columns where none are stated. Raises FormatError."""
    model = model or ValueModel()
    columns = list(names) if model.columns is None else model.columns
    if len(columns) != len(si):
        found, expected = len(columns), f"{len(si)}: {', '.join(names)}"
        document.fail("wrong number of columns", (*at, "columns"), found=found, expected=expected)
    units = column_units(table, columns, model.unit, si, document, at)
    numbers = table.numbers(columns) * np.array([u.factor for u in units])
    return numbers, sigmas(model, table, units, si[0], document, at), units


def contact(
    model: ValueModel | None, table: CsvTable, document: YamlDocument, key: str, width: int
) -> tuple[Array, Array | None, Unit | None]:
    """Deviations (k, width) in m that are 0 unless columns are named, their standard deviations, and the unit. Raises
    FormatError."""
    if model is None:
        return np.zeros((len(table), width)), None, None
    if model.columns is not None:
        value, sigma, units = quantity(model, table, document, (key,), ("m",) * width, DEVIATIONS[width])
        return value, sigma, units[0]
    stated = model.unit
    if stated is None and isinstance(model.sigma, SigmaModel):
        stated = next((u for u in map(table.unit, model.sigma.columns) if u is not None), None)
    if stated is None and model.sigma is not None:
        document.fail("the unit is missing", (key, "unit"), expected="mm, m, ... in which sigma is stated")
    if stated is None:
        return np.zeros((len(table), width)), None, None
    unit = document.unit(stated, "m", (key, "unit"))
    return np.zeros((len(table), width)), sigmas(model, table, [unit] * width, "m", document, (key,)), unit


def scalar(model: ScalarModel | None, si: str, option: str, symbol: str, around: Around) -> dict[str, object]:
    """The options of one number of the instrument: `option` names its owner, its value in SI and whether it is free are
    said of `symbol`. Without a value it is free. Raises FormatError."""
    if model is None:
        return {option: around.name}
    out: dict[str, object] = {option: model.name or around.name}
    document = around.document
    if model.value is not None:
        unit = around.units.of(si)
        if model.unit is not None:
            unit = document.unit(model.unit, si, (option, "unit"))
        out["values"] = {symbol: unit.to_si(model.value)}
    elif model.unit is not None or model.free is False:
        document.fail("a key is missing", (option, "value"), expected="a number, or free: true")
    if not model.model_fields_set - {"name"}:
        out[UNSAID] = True
    free = model.value is None if model.free is None else model.free
    return {**out, "free": (symbol,) if free else ()}


def show_scalar(key: str, options: Mapping[str, object], symbol: str, unit: Unit) -> tuple[str, ...]:
    """The line of data.yaml that `scalar` reads back; none where nobody owns the number."""
    if not options.get(key):
        return ()
    values, free = options.get("values", {}), options.get("free")
    words = [f"name: {quote(str(options[key]))}"]
    if isinstance(values, Mapping) and symbol in values:
        words += [f"value: {number(unit.from_si(values[symbol]))}", f"unit: {unit.name}"]
    if isinstance(free, tuple):
        words.append(f"free: {str(symbol in free).lower()}")
    return (f"{key}: {{{', '.join(words)}}}",)


def refuse_one_sigma(missing: str, document: YamlDocument) -> NoReturn:
    """Raises FormatError where one of two quantities states a standard deviation and the other, `missing`, does not."""
    expected = "both, or neither (then estimated)"
    document.fail("only one of two standard deviations is stated", (missing, "sigma"), expected=expected)


def section(key: str, names: Sequence[str], sigmas: Sequence[str], obs: Observations, more: str = "") -> str:
    """The line of data.yaml that names the columns of a quantity and those of its standard deviation."""
    stated = f", sigma: {{columns: {yaml_names(sigmas)}}}" if obs.sigma is not None else ""
    return f"{key}: {{columns: {yaml_names(names)}{more}{stated}}}"


def columns(
    names: Sequence[str], sigmas: Sequence[str], units: Sequence[Unit], obs: Observations, first: int = 0
) -> tuple[Column, ...]:
    """Columns of values from the `first` on, and of their standard deviations."""
    made = [(n, u, obs.value[:, first + i]) for i, (n, u) in enumerate(zip(names, units, strict=True))]
    if obs.sigma is not None:
        made += [(n, u, obs.sigma[:, first + i]) for i, (n, u) in enumerate(zip(sigmas, units, strict=True))]
    return tuple(made)


def yaml_names(names: Sequence[str]) -> str:
    """A list of names as YAML."""
    return f"[{', '.join(quote(n) for n in names)}]"


def column_units(
    table: CsvTable,
    columns: Sequence[str | int],
    stated: str | Sequence[str] | None,
    si: Sequence[str],
    document: YamlDocument,
    at: Path_,
) -> list[Unit]:
    """The unit of every column, from its header or as stated; `si` is the quantity of each. Raises FormatError when
    it is missing or said twice and differently.
    """
    out = []
    for i, column in enumerate(columns):
        index = table.find(column)
        label, header = table.label(index), table.units[index]
        said = stated if stated is None or isinstance(stated, str) else stated[i]
        if header is None and said is None:
            # A direction cosine or a part of a quaternion has none.
            if si[i] == "1":
                out.append(parse_unit("1"))
                continue
            word = {"m": "mm", "rad": "deg", "N m": "Nm"}.get(si[i], si[i])
            hint = f"`unit` in the data file, or a header such as {label} [{word}]"
            if not document.text:
                raise table.fail("the unit is missing", None, label, expected=f"a header such as {label} [{word}]")
            document.fail("the unit is missing", (*at, "unit"), column=label, expected=hint)
        found = None if said is None else document.unit(said, si[i], (*at, "unit"), f"{at[0]}.unit")
        out.append(agree_unit(found, header, si[i], table, label))
    return out


def agree_unit(found: Unit | None, header: str | None, si: str | None, table: CsvTable, label: str | int) -> Unit:
    """The unit of a column: the one in its header, which must be the one `found` in the data file where both say it."""
    named = None if header is None else parse_unit(header, si, file=table.path, column=label)
    if found is not None and named not in (None, found):
        message = "the header states another unit than the data file"
        raise table.fail(message, None, label, found=header, expected=found.name)
    unit = named or found
    assert unit is not None
    return unit


def sigmas(
    model: ValueModel, table: CsvTable, units: Sequence[Unit], si: str, document: YamlDocument, at: Path_
) -> Array | None:
    """Standard deviations (k, d) in SI of d columns: a number, one column for all, or one column each; None when not
    stated."""
    width = len(units)
    if model.sigma is None:
        return None
    if not isinstance(model.sigma, SigmaModel):
        return np.full((len(table), width), model.sigma * units[0].factor)
    columns = model.sigma.columns
    if len(columns) not in (1, width):
        expected = "1" if width == 1 else f"1 or {width}"
        document.fail("wrong number of columns", (*at, "sigma", "columns"), found=len(columns), expected=expected)
    numbers = table.numbers(columns)
    table.insist(numbers > 0, columns, "a standard deviation must be above 0", numbers, expected="a number above 0")
    stated = [table.unit(c) for c in columns]
    factors = [u.factor if s is None else parse_unit(s, si, file=table.path, column=str(c)).factor
               for u, s, c in zip(units, stated, columns, strict=False)]  # fmt: skip
    return np.broadcast_to(numbers * np.array(factors), (len(table), width)).copy()

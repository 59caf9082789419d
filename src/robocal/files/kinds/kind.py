"""What every kind of measurement in files shares: values read, parts of a table, what is written, units and sigmas."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Ints
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import TINIEST, TOO_SMALL, DataModel, ScalarModel, SigmaModel, ValueModel
from robocal.files.onething import UNSAID
from robocal.files.text import InputFile
from robocal.files.units import Unit, Units, number, parse_unit
from robocal.files.yamlio import Path_, YamlDocument, quote
from robocal.measure.data import Observations

__all__ = [
    "FULL",
    "XYZ",
    "Around",
    "KindFile",
    "KindOutput",
    "Part",
    "QuantityColumns",
    "Values",
    "agree_unit",
    "column_units",
    "refuse_one_sigma",
    "scalar",
    "show_scalar",
    "sigmas",
    "unit_rows",
    "whole",
    "yaml_names",
]  # fmt: skip

Column = tuple[str, Unit, Array]
FULL = (True,) * 6  # of a frame: where it is and how it is turned
XYZ: tuple[bool, ...] = (True, True, True, False, False, False)


@record
class Values:
    """One kind's numbers in SI: value (k, d), sigma (k, d) or None; the unit of lengths and angles in the file, for
    frames and reports."""

    value: Array
    sigma: Array | None
    length: Unit | None = None
    angle: Unit | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    options: Mapping[str, object] = field(default_factory=dict)  # what the kind must know
    files: tuple[InputFile, ...] = ()  # that were read beside the table
    digits: Array | None = None  # (k, d) what one unit in the last digit means, where the file says the value itself

    def take(self, rows: Ints) -> Values:
        """The same of these rows alone."""
        sigma, digits = (None if v is None else v[rows] for v in (self.sigma, self.digits))
        extra = {k: v[rows] for k, v in self.extra.items()}
        return replace(self, value=self.value[rows], sigma=sigma, extra=extra, digits=digits)

    def with_options(self, options: Mapping[str, object]) -> Values:
        """The same with more options."""
        return replace(self, options={**self.options, **options})


@record
class Part:
    """Observations of one thing, such as one place: rows of the table with their values."""

    rows: Ints
    values: Values
    group: str = ""  # default: the file's
    kind: str = ""  # default: the file's
    targeted: bool = True  # whether a thing on the tool is measured
    nowhere: bool = False  # known without the machine: no row of the table is where it stood


@record
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


@record
class KindOutput:
    """A kind's own part of what is written: columns (header, unit, values (k,) in SI), and its lines of data.yaml."""

    columns: tuple[Column, ...]
    lines: tuple[str, ...] = ()


def whole(model: Any, values: Values, around: Around) -> Sequence[Part]:
    """All rows are observations of one instrument."""
    return [Part(np.arange(len(values.value)), values)]


@record
class KindFile:
    """A kind of measurement in files: the model of its data.yaml, how its columns are read and written, and which parts
    of a target it can see; `free` says what of its place is free unless stated, `located` whether its first three
    values are where the tool is, `lengths` is the section whose readings are lengths, and `silent` are columns that belong there and that
    nobody need read; its `name` is told by the registry."""

    model: type[DataModel]
    read: Callable[[Any, CsvTable, YamlDocument], Values]
    write: Callable[[Observations, Units], KindOutput]
    template: str
    sees: tuple[bool, ...] = FULL
    parts: Callable[[Any, Values, Around], Sequence[Part]] = whole
    free: tuple[bool, ...] = FULL
    located: bool = False
    lengths: str = ""
    silent: tuple[str, ...] = ()
    name: str = ""


@record
class QuantityColumns:
    """A quantity in columns: its key in data.yaml, what its columns and those of their standard deviations are called where nobody
    says, and its SI unit."""

    key: str
    names: tuple[str, ...]
    sigmas: tuple[str, ...]
    si: str = "m"

    def numbers(
        self, given: ValueModel | None, table: CsvTable, document: YamlDocument
    ) -> tuple[Array, Array | None, list[Unit]]:
        """The numbers in SI (k, d), their standard deviations, and units. Raises FormatError."""
        model, si = given or ValueModel(), (self.si,) * len(self.names)
        columns = list(self.names) if model.columns is None else model.columns
        if len(columns) != len(si):
            found, expected = len(columns), f"{len(si)}: {', '.join(self.names)}"
            document.fail("wrong number of columns", (self.key, "columns"), found=found, expected=expected)
        units = column_units(table, columns, model.unit, si, document, (self.key,))
        numbers = table.numbers(columns) * np.array([u.factor for u in units])
        return numbers, sigmas(model, table, units, self.si, document, self.key), units

    def values(self, given: ValueModel | None, table: CsvTable, document: YamlDocument) -> Values:
        """The same as values of a kind."""
        value, sigma, units = self.numbers(given, table, document)
        length, angle = (units[0] if self.si == si else None for si in ("m", "rad"))
        return Values(value, sigma, length, angle)

    def read(self, model: DataModel, table: CsvTable, document: YamlDocument) -> Values:
        """The values of a kind that has this quantity alone."""
        return self.values(getattr(model, self.key), table, document)

    def deviations(self, given: ValueModel | None, table: CsvTable, document: YamlDocument) -> Values:
        """Deviations (k, d) in m that are 0 unless columns are named. Raises FormatError."""
        model = given or ValueModel()
        if model.columns is not None:
            return self.values(model, table, document)
        zero, stated = np.zeros((len(table), len(self.names))), model.unit
        if stated is None and isinstance(model.sigma, SigmaModel):
            stated = next((u for u in map(table.unit, model.sigma.columns) if u is not None), None)
        if stated is None and model.sigma is not None:
            document.fail("the unit is missing", (self.key, "unit"), expected="mm, m, ... in which sigma is stated")
        if stated is None:
            return Values(zero, None)
        unit = document.unit(stated, "m", (self.key, "unit"))
        return Values(zero, sigmas(model, table, [unit] * len(self.names), "m", document, self.key), unit)

    def columns(self, obs: Observations, units: Units, first: int = 0) -> tuple[Column, ...]:
        """Columns of values from the `first` on, and of their standard deviations."""
        unit = units.of(self.si)
        made = [(name, unit, obs.value[:, first + i]) for i, name in enumerate(self.names)]
        if obs.sigma is not None:
            made += [(name, unit, obs.sigma[:, first + i]) for i, name in enumerate(self.sigmas)]
        return tuple(made)

    def line(self, obs: Observations, stated: str = "") -> str:
        """The line of data.yaml that names the columns, or says what is `stated` in their place."""
        stated = stated or f"columns: {yaml_names(self.names)}"
        sigma = f", sigma: {{columns: {yaml_names(self.sigmas)}}}" if obs.sigma is not None else ""
        return f"{self.key}: {{{stated}{sigma}}}"

    def write(self, obs: Observations, units: Units) -> KindOutput:
        """What is written of a kind that has this quantity alone."""
        return KindOutput(self.columns(obs, units), (self.line(obs),))


def scalar(model: ScalarModel | None, si: str, option: str, around: Around, symbol: str = "") -> dict[str, object]:
    """The options of one number of the instrument, none where nobody speaks of it: `option` names its owner, its value in SI and
    whether it is free are said of `symbol`, by default the same. Without a value it is free. Raises FormatError."""
    if model is None:
        return {}
    symbol = symbol or option
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


def show_scalar(key: str, options: Mapping[str, object], unit: Unit) -> tuple[str, ...]:
    """The line of data.yaml that `scalar` reads back; none where nobody owns the number."""
    if not options.get(key):
        return ()
    values, free = options.get("values", {}), options.get("free")
    words = [f"name: {quote(str(options[key]))}"]
    if isinstance(values, Mapping) and key in values:
        words += [f"value: {number(unit.from_si(values[key]))}", f"unit: {unit.name}"]
    if isinstance(free, tuple):
        words.append(f"free: {str(key in free).lower()}")
    return (f"{key}: {{{', '.join(words)}}}",)


def unit_rows(numbers: Array, table: CsvTable, columns: Sequence[str | int], what: str) -> Array:
    """Vectors (k, n) of length 1 without what rounding left of them. Raises FormatError for others."""
    size = np.linalg.norm(numbers, axis=1)
    table.insist(np.abs(size - 1) < 2e-2, columns, f"not a unit {what}", size, expected="a length of 1")
    return np.asarray(numbers / size[:, None])


def refuse_one_sigma(missing: str, document: YamlDocument) -> NoReturn:
    """Raises FormatError where one of two quantities states a standard deviation and the other, `missing`, does not."""
    expected = "both, or neither (then estimated)"
    document.fail("only one of two standard deviations is stated", (missing, "sigma"), expected=expected)


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
    model: ValueModel, table: CsvTable, units: Sequence[Unit], si: str, document: YamlDocument, key: str
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
        document.fail("wrong number of columns", (key, "sigma", "columns"), found=len(columns), expected=expected)
    numbers = table.numbers(columns)
    table.insist(numbers > 0, columns, "a standard deviation must be above 0", numbers, expected="a number above 0")
    table.insist(numbers > TINIEST, columns, TOO_SMALL, numbers, expected=f"above {TINIEST:g}")
    stated = [table.unit(c) for c in columns]
    factors = [u.factor if s is None else parse_unit(s, si, file=table.path, column=str(c)).factor
               for u, s, c in zip(units, stated, columns, strict=False)]  # fmt: skip
    return np.broadcast_to(numbers * np.array(factors), (len(table), width)).copy()

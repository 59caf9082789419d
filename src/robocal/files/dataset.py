"""Measurements as files hold them, a data.yaml beside any CSV or a CSV that describes itself, to a data set in SI.

One wide CSV is read as both: configurations (rows with one id are one configuration) and observations made at them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from robocal._types import Ints
from robocal.diagnose.check_registry import ROWS, When, run
from robocal.diagnose.hypotheses.reading import OtherUnit
from robocal.diagnose.rows.table import TableContext
from robocal.errors import FormatError, one_of
from robocal.files.configurations import nowhere, read_configurations, remarks_on_columns
from robocal.files.csvtable import CsvTable, MissingCells, read_csv
from robocal.files.data_checks import alternatives, suspicions
from robocal.files.datamodel import ColumnModel, DataModel, FramedModel, InstrumentModel, TargetModel
from robocal.files.frame_block import frame_vector
from robocal.files.headers import self_description, vocabulary
from robocal.files.kinds.kind import Around, KindFile, Values
from robocal.files.kinds.registry import readers_of
from robocal.files.leaving import Excluded, LeftOut, split_list
from robocal.files.names import meant
from robocal.files.notation import TableNotation, table_notation
from robocal.files.onething import new_distances, one_thing, refuse_again, target_remarks
from robocal.files.outside import discreet
from robocal.files.robot import read_units
from robocal.files.schema import FrameModel, validate
from robocal.files.text import InputFile
from robocal.files.units import UNITS, Unit, Units
from robocal.files.unread import Unread, left_over, unread_remarks
from robocal.files.yamlio import YamlDocument, load
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Model
from robocal.remarks.remark import Remark

__all__ = ["Reading", "read_dataset", "read_datasets"]


@dataclass(frozen=True)
class Reading:
    """A data set with what a person should know of it; `units` are those in which the file speaks."""

    dataset: DataSet
    path: Path
    files: tuple[InputFile, ...]
    warnings: tuple[Remark, ...] = ()
    suspicions: tuple[OtherUnit, ...] = ()
    units: Units = field(default_factory=Units)
    alternatives: tuple[OtherUnit, ...] = ()  # of units, to be tried when nothing fits
    notations: tuple[TableNotation, ...] = ()  # how each table speaks
    left_out: tuple[LeftOut, ...] = ()  # rows that were not read
    unread: tuple[Unread, ...] = ()  # columns that were not read
    described: Mapping[str, Path] = field(default_factory=dict)  # places and targets, and the file that describes them

    def __add__(self, other: Reading) -> Reading:
        """Two readings as one; the units are the first one's."""
        return replace(
            self,
            dataset=self.dataset + other.dataset,
            files=(*self.files, *(f for f in other.files if f not in self.files)),
            warnings=self.warnings + other.warnings,
            suspicions=self.suspicions + other.suspicions,
            alternatives=self.alternatives + other.alternatives,
            notations=self.notations + other.notations,
            left_out=self.left_out + other.left_out,
            unread=self.unread + other.unread,
            described={**other.described, **self.described},
        )


def read_datasets(
    paths: Sequence[str | os.PathLike[str]],
    chain: Model,
    *,
    kind: str | None = None,
    group: str | None = None,
    exclude: Sequence[str] = (),
) -> Reading:
    """Several data files for one identification; instruments that nobody named are kept apart. `exclude` names rows that
    are left out (`files.leaving`). Raises as `read_dataset`."""
    if not paths:
        raise FormatError("no data files are given", expected="at least one")
    total: Reading | None = None
    taken: set[str] = set()
    known: dict[tuple[object, ...], Path] = {}
    asked = Excluded(split_list(exclude), "--exclude")
    for path in paths:
        made = read_dataset(path, chain, kind=kind, taken=taken, group=group, exclude=asked)
        refuse_again(made.dataset, {str(f.file): f.sha256 for f in made.files}, known)
        taken |= {o.frame.name for o in made.dataset.observations if o.frame}
        total = made if total is None else total + made
    assert total is not None
    asked.finish()
    said = one_thing(total.dataset)
    warnings = total.warnings + unread_remarks(total.unread) + target_remarks(said, total.described)
    return replace(total, dataset=new_distances(said), warnings=warnings)


@discreet
def read_dataset(
    path: str | os.PathLike[str],
    chain: Model,
    *,
    kind: str | None = None,
    taken: set[str] | frozenset[str] = frozenset(),
    group: str | None = None,
    exclude: Excluded | None = None,
) -> Reading:
    """Reads a data.yaml with its CSV files, or a CSV with units in its headers, for this arm.

    `kind` overrides the file's (positions only, of a file of poses); `taken` are instrument names that a default must
    avoid; `group` is a column with a label for each row, whatever the file says of groups; `exclude` are rows to leave
    out beside those that the file excludes. Raises FileError or
    FormatError naming file, row and column or key.
    """
    place = path if isinstance(path, Path) else Path(path)
    if place.suffix.lower() in (".yaml", ".yml"):
        document = load(place)
        reader = _reader(kind or document.data.get("kind"), document, chain)
        model = validate(reader.model, document)
        tables = [read_csv(place.parent / name, **model.csv.style) for name in model.file]
        files = [InputFile(place, document.sha256)]
    else:
        tables, files = [read_csv(place)], []
        document = YamlDocument(place, "", "", self_description(tables[0], chain, kind))
        reader = _reader(document.data["kind"], document, chain)
        model = validate(reader.model, document)
    if group is not None:
        given = {**model.configuration, "group": ColumnModel(column=int(group) if group.isdecimal() else group)}
        model = model.model_copy(update={"configuration": given})
    files += [InputFile(t.path, t.sha256) for t in tables]
    name = _frame_name(model, place, tables[0].path, chain, taken, document)
    own = Excluded(model.exclude, "exclude", place)
    parts = [_read_rows(model, table, chain, reader, document, name, (own, exclude)) for table in tables]
    own.finish()
    total = sum(parts[1:], start=parts[0])
    described = dict.fromkeys((*model.targets, *getattr(model, "places", ())), place)
    return replace(total, path=place, files=tuple(files), described=described)


def _read_rows(
    model: DataModel, table: CsvTable, chain: Model, kind: KindFile, document: YamlDocument, name: str,
    exclude: Sequence[Excluded | None],
) -> Reading:  # fmt: skip
    """A table without the rows that are left out: those that were named, and where the file says so, those that lack
    something."""
    table = replace(table, skip=model.csv.missing == "skip")
    given = model.configuration.get("id")
    at = None if given is None else table.find(given.column)

    def ids() -> list[str] | None:
        return None if at is None else [meant(row[at].strip()) for row in table.cells]

    out = np.zeros(len(table), dtype=bool)
    for some in exclude:
        if some is not None:
            out |= some.rows(table, ids())
    left = []
    if out.any():
        left.append(LeftOut(table.path, tuple(map(int, table.lines[out])), "excluded"))
        table = table.without(out, ids())
    missing: list[int] = []
    while True:
        try:
            made = _read_table(model, table, chain, kind, document, name)
            break
        except MissingCells as lacking:
            rows = np.zeros(len(table), dtype=bool)
            rows[lacking.rows] = True
            missing += map(int, table.lines[rows])
            table = table.without(rows, ids())
    if missing:
        left.append(LeftOut(table.path, tuple(sorted(missing)), "missing"))
    said = (*(o.remark for o in left), *made.warnings)
    return replace(made, left_out=tuple(left), warnings=said, unread=(left_over(table, vocabulary(chain)),))


def _reader(kind: object, document: YamlDocument, machine: Model) -> KindFile:
    known = readers_of(machine)
    if kind is None:
        document.fail("a key is missing", ("kind",), expected=", ".join(known))
    if not isinstance(kind, str) or kind not in known:
        document.fail("unknown kind", ("kind",), found=kind, **one_of(kind, known))
    return known[kind]


def _read_table(
    model: DataModel, table: CsvTable, chain: Model, kind: KindFile, document: YamlDocument, name: str
) -> Reading:
    values = kind.read(model, table, document)
    places = read_configurations(model, table, chain, document)
    units = _units(model, values, places.angle, document)
    targets, target = _targets(model, table, kind, chain, name, units, document)
    owners = _owners(chain) | {t.name for t in targets}
    frame = _instrument(model.frame, name, units) if isinstance(model, FramedModel) else None
    around = Around(table, document, units, name, frozenset(owners | ({name} if frame else set())))
    observations = []
    parts = kind.parts(model, values, around)
    known = [p for p in parts if p.nowhere]
    beside = places.first[np.array([p.rows[0] for p in known], dtype=np.int64)]
    configurations = nowhere(places.configurations, tuple(p.group for p in known), beside)
    alone = iter(range(len(places.configurations), len(configurations)))
    for part in parts:
        kept = np.flatnonzero(np.isin(part.rows, places.measuring)) if part.targeted else np.arange(len(part.rows))
        rows, read = part.rows[kept], part.values.take(kept)
        second = None if part.kind or places.second is None else places.second[rows]
        observations.append(
            Observations(
                part.kind or kind.name,
                np.array([next(alone)]) if part.nowhere else places.first[rows],
                read.value,
                read.sigma,
                frame,
                targets if part.targeted else (),
                target[rows] if part.targeted and target is not None else None,
                read.extra,
                read.options,
                model.group or part.group or ("" if frame else name),
                source=str(table.path),
                rows=None if part.nowhere else table.lines[rows],
                second=second,
                digits=read.digits,
            )
        )
    warnings = remarks_on_columns(model, document)
    data = DataSet(configurations, tuple(observations))
    rows_read = TableContext(chain, data, joints=places.joints, lines=table.lines, file=str(table.path))
    warnings += tuple(f.remark for f in run(When.FILE, rows_read, ROWS))
    length = values.length if kind.located else None
    first = observations[0]
    return Reading(
        DataSet(configurations, tuple(o for o in observations if len(o))),
        table.path,
        (),
        warnings,
        suspicions(first, places.joints, chain, places.angle, length),
        Units(values.length or units.length, places.angle),
        alternatives(first, places.joints, chain, places.angle, values.length, kind.lengths),
        (table_notation(model, table, chain, document, places.angle, values.length),),
    )


def _units(model: DataModel, values: Values, angle: Unit, document: YamlDocument) -> Units:
    """The units of frames and targets: as stated, else those in which the measurements are."""
    if model.units is not None:
        return read_units(model.units, document)
    return Units(values.length or UNITS["m"], values.angle or angle)


def _owners(machine: Model) -> set[str]:
    """The parts of a machine that have parameters, by name."""
    return {n.rpartition(".")[0] for n in machine.table.names}


def _frame_name(
    model: DataModel, place: Path, csv: Path, chain: Model, taken: set[str] | frozenset[str], document: YamlDocument
) -> str:
    """The instrument's name: as stated, else the file's, made unlike any owner of a parameter."""
    owners = _owners(chain)
    given = model.frame.name if isinstance(model, FramedModel) else None
    if given is not None:
        if given in owners:
            expected = f"a name other than {', '.join(owners)}"
            document.fail("this name belongs to the robot", ("frame", "name"), found=given, expected=expected)
        return given
    stem = csv.stem if place.stem.lower() in ("data", "dataset") else place.stem
    name = re.sub(r"\W+", "_", stem).strip("_") or model.kind
    if name in taken:
        name = re.sub(r"\W+", "_", f"{csv.resolve().parent.name}_{name}").strip("_")
    while name in owners | set(taken) | set(model.targets):
        name += "_frame"
    return name


def _instrument(given: InstrumentModel, name: str, units: Units) -> Frame:
    # An instrument stands where it stands: metres and any turn, unless its place is stated.
    expected = (0.1, 0.1) if given.given else (10.0, 3.0)
    return Frame(name, frame_vector(given, units), given.free_flags(True), given.mount, expected, given.has_details)


def _targets(
    model: DataModel, table: CsvTable, kind: KindFile, chain: Model, frame: str, units: Units, document: YamlDocument
) -> tuple[tuple[Frame, ...], Ints | None]:
    """The targets and which one each row sees (None: the tool itself)."""
    models: Mapping[str, FrameModel] = model.targets
    cells = table.texts(model.target.column) if model.target is not None else None
    if not models and cells is not None:
        models = {name: TargetModel() for name in dict.fromkeys(cells)}
    if not models:
        return (), None
    around = Around(table, document, units, frame, frozenset(_owners(chain) | {frame}))
    frames = []
    for name, given in models.items():
        around.refuse_taken(name, ("targets", name))
        # A target whose place is not stated is unknown; what this kind of measurement cannot see of it stays.
        flags = given.free_flags(not given.given)
        if given.free is None or given.free is True:
            flags = tuple(f and s for f, s in zip(flags, kind.sees, strict=True))
        expected = (0.01, 0.05) if given.given else (0.2, 3.0)
        mount = getattr(given, "mount", "tool")
        frames.append(Frame(name, frame_vector(given, units), flags, mount, expected, given.has_details))
    if cells is None:
        if len(frames) > 1:
            document.fail(
                "several targets, and no column that says which", ("target",), expected="target: {column: ...}"
            )
        return tuple(frames), np.zeros(len(table), dtype=np.int64)
    order = {f.name: i for i, f in enumerate(frames)}
    for row, cell in enumerate(cells):
        if cell not in order:
            column = table.label(table.find(model.target.column))
            raise table.fail("unknown target", row, column, found=cell, **one_of(cell, order))
    return tuple(frames), np.array([order[c] for c in cells], dtype=np.int64)

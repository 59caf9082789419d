"""Measurements as files hold them, a data.yaml beside any CSV or a CSV that describes itself, to a data set in SI.

One wide CSV is read as both: configurations (rows with one id are one configuration) and observations made at them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Ints
from robocal.diagnose.check_registry import ROWS, When, run
from robocal.diagnose.hypotheses.reading import OtherUnit
from robocal.diagnose.rows.table import TableContext
from robocal.errors import FormatError, one_of
from robocal.files.configurations import RowReader, nowhere, read_configurations, remarks_on_columns
from robocal.files.csvtable import MissingCells, read_csv
from robocal.files.data_checks import alternatives, suspicions
from robocal.files.datamodel import ColumnModel, DataModel, FramedModel, InstrumentModel, TargetModel
from robocal.files.headers import self_description, vocabulary
from robocal.files.kinds.kind import Around, KindFile
from robocal.files.kinds.registry import readers_of
from robocal.files.notation import TableNotation, table_notation
from robocal.files.onething import (
    new_distances,
    one_thing,
    refuse_again,
    refuse_copies,
    refuse_names_of_lens,
    target_remarks,
)
from robocal.files.orientation import frame_vector, refuse_turns
from robocal.files.robot import read_units
from robocal.files.schema import FrameModel, validate
from robocal.files.text import InputFile, discreet, meant
from robocal.files.units import UNITS, Units
from robocal.files.unread import Excluded, LeftOut, Unread, left_over, split_list, unread_remarks
from robocal.files.yamlio import YamlDocument, load
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Model
from robocal.remarks.remark import Remark

__all__ = ["Reading", "read_dataset", "read_datasets"]


@record
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
        lists = ("dataset", "warnings", "suspicions", "alternatives", "notations", "left_out", "unread")
        sums = {name: getattr(self, name) + getattr(other, name) for name in lists}
        files = (*self.files, *(f for f in other.files if f not in self.files))
        return replace(self, files=files, described={**other.described, **self.described}, **sums)


def read_datasets(
    paths: Sequence[str | os.PathLike[str]],
    chain: Model,
    *,
    kind: str | None = None,
    group: str | None = None,
    exclude: Sequence[str] = (),
    given: Mapping[str, object] | None = None,
) -> Reading:
    """Several data files for one identification; instruments that nobody named are kept apart. `exclude` names rows that
    are left out (`files.unread`), `given` is what a data.yaml would say of a CSV. Raises as `read_dataset`."""
    if not paths:
        raise FormatError("no data files are given", expected="at least one")
    total: Reading | None = None
    taken: set[str] = set()
    known: dict[tuple[object, ...], Path] = {}
    asked = Excluded(split_list(exclude), "--exclude")
    for path in paths:
        made = read_dataset(path, chain, kind=kind, taken=taken, group=group, exclude=asked, given=given)
        refuse_again(made.dataset, {str(f.file): f.sha256 for f in made.files}, known)
        taken |= {o.frame.name for o in made.dataset.observations if o.frame}
        total = made if total is None else total + made
    assert total is not None
    refuse_names_of_lens(total.dataset)
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
    given: Mapping[str, object] | None = None,
) -> Reading:
    """Reads a data.yaml with its CSV files, or a CSV with units in its headers, for this arm.

    `kind` overrides the file's (positions only, of a file of poses); `taken` are instrument names that a default must
    avoid; `given` is what a data.yaml would say of a CSV; `group` is a column with a label for each row, whatever the file
    says of groups; `exclude` are rows to leave out beside those that the file excludes. Raises FileError or
    FormatError naming file, row and column or key.
    """
    place = path if isinstance(path, Path) else Path(path)
    if place.suffix.lower() in (".yaml", ".yml"):
        document = load(place)
        reads = _kind_file(kind or document.data.get("kind"), document, chain)
        model = validate(reads.model, document)
        tables = [read_csv(os.path.normpath(place.parent / name), **model.csv.style) for name in model.file]
        files = [InputFile(place, document.sha256)]
    else:
        tables, files = [read_csv(place)], []
        known = self_description(tables[0], chain, kind) if given is None else dict(given)
        document = YamlDocument(place, "", "", known)
        reads = _kind_file(document.data["kind"], document, chain)
        model = validate(reads.model, document)
    if group is not None:
        given = {**model.configuration, "group": ColumnModel(column=int(group) if group.isdecimal() else group)}
        model = model.model_copy(update={"configuration": given})
    files += [InputFile(t.path, t.sha256) for t in tables]
    reader = RowReader(model, tables[0], chain, document)
    name = _frame_name(reader, place, taken)
    own = Excluded(model.exclude, "exclude", place)
    words = (own,) if exclude is None else (own, exclude)
    parts = [_read_rows(replace(reader, table=table), reads, name, words) for table in tables]
    own.finish()
    total = sum(parts[1:], start=parts[0])
    described = dict.fromkeys((*model.targets, *getattr(model, "places", ())), place)
    return replace(total, path=place, files=(*files, *total.files), described=described)


def _read_rows(reader: RowReader, kind: KindFile, name: str, exclude: Sequence[Excluded]) -> Reading:
    """A table without the rows that are left out: those that were named, and where the file says so, those that lack
    something."""
    table = replace(reader.table, skip=reader.model.csv.missing == "skip")
    given = reader.model.configuration.get("id")
    at = None if given is None else table.find(given.column)

    def ids() -> list[str] | None:
        return None if at is None else list(map(meant, table.strip(at)))

    out = np.any([words.rows(table, ids() if words.names else None) for words in exclude], axis=0)
    left = []
    if out.any():
        left.append(LeftOut(table.path, tuple(map(int, table.lines[out])), "excluded"))
        table = table.without(out, ids())
    missing: list[int] = []
    while True:
        try:
            made = _read_table(replace(reader, table=table), kind, name)
            break
        except MissingCells as lacking:
            rows = np.zeros(len(table), dtype=bool)
            rows[lacking.rows] = True
            missing += map(int, table.lines[rows])
            table = table.without(rows, ids())
    if missing:
        left.append(LeftOut(table.path, tuple(sorted(missing)), "missing"))
    said = (*(o.remark for o in left), *made.warnings)
    unread = left_over(table, vocabulary(reader.machine), kind.silent)
    return replace(made, left_out=tuple(left), warnings=said, unread=(unread,))


def _kind_file(kind: object, document: YamlDocument, machine: Model) -> KindFile:
    known = readers_of(machine)
    if kind is None:
        document.fail("a key is missing", ("kind",), expected=", ".join(known))
    document.insist_known(kind, tuple(known), "unknown kind", ("kind",))
    return known[str(kind)]


def _read_table(reader: RowReader, kind: KindFile, name: str) -> Reading:
    model, table, chain, document = reader.model, reader.table, reader.machine, reader.document
    values = kind.read(model, table, document)
    places = read_configurations(reader)
    # Frames and targets are in the units that are stated, else in those of the measurements.
    units = Units(values.length or UNITS["m"], values.angle or places.angle)
    units = units if model.units is None else read_units(model.units, document)
    owners = frozenset(_owners(chain))
    targets, target = _targets(model, kind, Around(table, document, units, name, owners | {name}))
    frame = _instrument(model.frame, name, units, document) if isinstance(model, FramedModel) else None
    owners |= {t.name for t in targets} | ({name} if frame else set())
    around = Around(table, document, units, name, owners)
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
        where = np.array([next(alone)]) if part.nowhere else places.first[rows]
        seen = target[rows] if part.targeted and target is not None else None
        group = model.group or part.group or ("" if frame else name)
        obs = Observations(
            part.kind or kind.name, where, read.value, read.sigma, frame, targets if part.targeted else (), seen,
            read.extra, read.options, group, str(table.path), None if part.nowhere else table.lines[rows], second,
            digits=read.digits, scale=_scale_sigma(model, kind, document),
        )  # fmt: skip
        observations.append(obs)
    warnings = remarks_on_columns(model, document)
    data = DataSet(configurations, tuple(observations))
    rows_read = TableContext(chain, data, joints=places.joints, lines=table.lines, file=str(table.path))
    warnings += table.remarks + tuple(f.remark for f in refuse_copies(run(When.FILE, rows_read, ROWS), len(table)))
    read_as = (observations[0], places.joints, chain, places.angle)
    return Reading(
        DataSet(configurations, tuple(o for o in observations if len(o))), table.path, values.files, warnings,
        suspicions(*read_as, values.length if kind.located else None),
        Units(values.length or units.length, places.angle),
        alternatives(*read_as, values.length, kind.lengths),
        (table_notation(reader, places.angle, values.length),),
    )  # fmt: skip


def _scale_sigma(model: DataModel, kind: KindFile, document: YamlDocument) -> float | None:
    """What the scale of the instrument may be off by; nothing where it is a number of its own."""
    given = model.scale
    if given is None or not given.free:
        return None if given is None else given.sigma
    document.insist(
        kind.name == "pixels",
        "no scale of this kind is identified",
        ("scale", "free"),
        found=kind.name,
        expected="pixels",
    )
    return 0.0


def _prior(
    given: InstrumentModel | TargetModel, units: Units, document: YamlDocument, at: tuple[str, ...]
) -> tuple[float, ...] | None:
    """Standard deviations around a stated place, m and rad."""
    if given.prior is None:
        return None
    document.insist(
        given.given, "a prior around a place that nobody states", (*at, "prior"), expected="xyz beside prior"
    )
    document.insist(
        given.free is not False,
        "a prior around a place that is fixed",
        (*at, "prior"),
        expected="prior, or free: false",
    )
    return (*[units.length.to_si(given.prior.length)] * 3, *[units.angle.to_si(given.prior.angle)] * 3)


def _owners(machine: Model) -> set[str]:
    """The parts of a machine that have parameters, by name."""
    return {n.rpartition(".")[0] for n in machine.table.names}


def _frame_name(reader: RowReader, place: Path, taken: set[str] | frozenset[str]) -> str:
    """The instrument's name: as stated, else the file's, made unlike any owner of a parameter."""
    model, csv, owners = reader.model, reader.table.path, _owners(reader.machine)
    given = model.frame.name if isinstance(model, FramedModel) else None
    if given is not None:
        if given in owners:
            expected = f"a name other than {', '.join(owners)}"
            at = ("frame", "name")
            reader.document.fail("this name belongs to the robot", at, found=given, expected=expected)
        return given
    stem = csv.stem if place.stem.lower() in ("data", "dataset") else place.stem
    name = re.sub(r"\W+", "_", stem).strip("_") or model.kind
    if name in taken:
        name = re.sub(r"\W+", "_", f"{csv.resolve().parent.name}_{name}").strip("_")
    while name in owners | set(taken) | set(model.targets):
        name += "_frame"
    return name


def _instrument(given: InstrumentModel, name: str, units: Units, document: YamlDocument) -> Frame:
    # An instrument stands where it stands: metres and any turn, unless its place is stated.
    expected = (0.1, 0.1) if given.given else (10.0, 3.0)
    refuse_turns(document, given, units, ("frame",))
    value, prior = frame_vector(given, units), _prior(given, units, document, ("frame",))
    return Frame(name, value, given.free_flags(True), given.mount, expected, given.has_details, prior)


def _mount(model: DataModel, name: str, given: FrameModel, document: YamlDocument) -> str:
    """What carries a target: as stated, else the tool, or the base where the tool carries the instrument."""
    aboard = isinstance(model, FramedModel) and model.frame.mount == "tool"
    if "mount" not in given.model_fields_set:
        return "base" if aboard else "tool"
    mount = str(getattr(given, "mount", "tool"))
    document.insist(
        not aboard or mount != "tool",
        "the tool carries both instrument and target",
        ("targets", name, "mount"),
        found=mount,
        expected="mount: base, or an instrument on the base",
    )
    return mount


def _targets(model: DataModel, kind: KindFile, around: Around) -> tuple[tuple[Frame, ...], Ints | None]:
    """The targets and which one each row sees (None: the tool itself)."""
    table, units = around.table, around.units
    models: Mapping[str, FrameModel] = model.targets
    cells = table.texts(model.target.column) if model.target is not None else None
    if not models and cells is not None:
        models = {name: TargetModel() for name in dict.fromkeys(cells)}
    if not models:
        return (), None
    frames = []
    for name, given in models.items():
        around.refuse_taken(name, ("targets", name))
        refuse_turns(around.document, given, units, ("targets", name))
        # A target whose place is not stated is unknown; what this kind of measurement cannot see of it stays.
        flags = given.free_flags(not given.given or getattr(given, "prior", None) is not None)
        if given.free is None or given.free is True:
            flags = tuple(f and s for f, s in zip(flags, kind.sees, strict=True))
        mount = _mount(model, name, given, around.document)
        expected = (0.01, 0.05) if given.given else (0.2, 3.0) if mount == "tool" else (10.0, 3.0)
        prior = _prior(given, units, around.document, ("targets", name)) if isinstance(given, TargetModel) else None
        frames.append(Frame(name, frame_vector(given, units), flags, mount, expected, given.has_details, prior))
    if cells is None:
        if len(frames) > 1:
            message = "several targets, and no column that says which"
            around.document.fail(message, ("target",), expected="target: {column: ...}")
        return tuple(frames), np.zeros(len(table), dtype=np.int64)
    order = {f.name: i for i, f in enumerate(frames)}
    for row, cell in enumerate(cells):
        if cell not in order:
            column = table.label(table.find(model.target.column))
            raise table.fail("unknown target", row, column, found=cell, **one_of(cell, order))
    return tuple(frames), np.array([order[c] for c in cells], dtype=np.int64)

"""A robot as a file describes it: robot.yaml, a URDF, or a name from the catalogue, to a chain in SI and back.

Writing back changes numbers only: comments, order and layout of the original stay. What a format cannot say (a gain
in a URDF) is listed in `left_out`, never dropped in silence.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, FiniteFloat

from robocal._record import record, replace
from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS, chain, rows
from robocal.errors import FormatError, ModelError
from robocal.files.orientation import frame_changes, frame_vector
from robocal.files.robot_rows import (
    MOST_REACH,
    MOST_TURN,
    changes,
    complete_rows,
    missing_key_remarks,
    read_row,
    show_row,
)
from robocal.files.schema import FileModel, FrameModel, UnitsModel, Version, validate
from robocal.files.text import ROBOT_LIMIT, Source, read_text
from robocal.files.units import UNITS, Unit, Units, number, same
from robocal.files.yamlio import Path_, YamlDocument, add_stamp, edit, parse, quote
from robocal.parameters import ParameterTable
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Robot", "describe", "open_robot", "parse_robot", "read_robot", "render_robot"]


@record
class Robot:
    """A chain with where it came from: `text` and `sha256` of the file, and the units in which it and its reports
    speak.

    `format` is yaml or urdf; `path` is None for a catalogue robot, whose `text` was made; `root` and `tip` are the
    links of a URDF; `left_out` are parameters of the chain whose values `text` cannot hold.
    """

    chain: Chain
    units: Units
    path: Path | None
    text: str
    sha256: str
    format: str = "yaml"
    warnings: tuple[Remark, ...] = ()
    root: str = ""
    tip: str = ""
    left_out: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The robot's name."""
        return self.chain.name

    @property
    def machine(self) -> Chain:
        """The chain, as what an identification is made of."""
        return self.chain

    def with_machine(self, machine: Chain) -> Self:
        """Another chain of the same file."""
        return replace(self, chain=machine)

    @property
    def place(self) -> str:
        """Its file, or its name in the catalogue."""
        return str(self.path) if self.path is not None else f"catalogue robot {self.name}"

    @property
    def convention(self) -> str:
        """The convention in which the file describes the arm."""
        return self.chain.convention

    @property
    def source(self) -> str:
        """Where the numbers come from."""
        return self.chain.source

    def unit_of(self, name: str) -> Unit:
        """The unit in which this file speaks of a parameter."""
        return self.units.of(self.chain.table[name].unit)


class CalibrateModel(FileModel):
    """What is to be identified: groups (symbols, owners) or single names. Of parameters that the data cannot tell apart,
    those in `prefer` are kept, the first named before the others."""

    free: list[str] | None = None
    fixed: list[str] = Field(default_factory=list)
    prefer: list[str] = Field(default_factory=list)
    prior: dict[str, FiniteFloat] = Field(default_factory=dict)
    bounds: dict[str, list[FiniteFloat]] = Field(default_factory=dict)


class RobotModel(FileModel):
    """robot.yaml as a mapping; its joints are checked against their convention afterwards."""

    robocal: Version
    name: str
    kind: Literal["arm", "cable"] = "arm"
    units: UnitsModel
    convention: str
    joints: list[Any]
    base: FrameModel | None = None
    home: FrameModel | None = None
    tool: FrameModel | None = None
    calibrate: CalibrateModel | None = None
    groups: dict[str, Any] | None = None
    source: str | None = None


def open_robot(name: str | os.PathLike[str], *, base: str | None = None, tip: str | None = None) -> Robot:
    """A robot from a file, or from the catalogue when no file has this name. Raises FileError, FormatError or
    ModelError."""
    place = Path(name)
    if place.exists() or place.suffix or len(place.parts) > 1:
        return read_robot(place, base=base, tip=tip)
    from robocal.arms import catalog

    made = catalog.get(str(name))
    text = describe(made, Units())
    robot = parse_robot(Source(Path(f"{name}.yaml"), text, sha256(text.encode()).hexdigest()))
    return replace(robot, path=None, chain=replace(robot.chain, meta={**made.meta, **robot.chain.meta}))


def read_robot(path: str | os.PathLike[str], *, base: str | None = None, tip: str | None = None) -> Robot:
    """Reads a robot.yaml, or a URDF (by suffix or content) from link `base` to link `tip`. Raises FileError or
    FormatError."""
    source = read_text(path, limit=ROBOT_LIMIT)
    if source.path.suffix.lower() in (".urdf", ".xacro", ".xml") or source.text.lstrip().startswith("<"):
        from robocal.files.urdf import read_urdf

        made = read_urdf(source, base=base, tip=tip)
        units, text = Units(UNITS["m"], UNITS["rad"]), source.mark + source.text
        return Robot(made.chain, units, source.path, text, source.sha256, "urdf", made.warnings, made.root, made.tip)
    return parse_robot(source)


def parse_robot(source: Source) -> Robot:
    """The same from the text of a robot.yaml."""
    document = parse(source)
    if document.data.get("kind") == "cable":
        expected = "arm; cable robots have verbs of their own: robocal cable --help"
        document.fail("this is a cable robot, and an arm is needed", ("kind",), found="cable", expected=expected)
    model = validate(RobotModel, document)
    units = read_units(model.units, document)
    document.insist_known(model.convention, CONVENTIONS, "unknown convention", ("convention",))
    document.insist(model.joints, "a robot needs a joint", ("joints",), found=[])
    rule = CONVENTIONS[model.convention]
    made = [read_row(row, ("joints", i), rule, units, document) for i, row in enumerate(model.joints)]
    frames = {owner: frame_vector(getattr(model, owner), units) for owner in ("base", "tool")}
    home = None if model.home is None else frame_vector(model.home, units)
    meta = {"file": str(source.path)}
    try:
        arm = chain(model.name, model.convention, made, **frames, home=home, source=model.source or "", meta=meta)
        if document.data.get("groups") is not None:
            from robocal.files.group_block import read_groups

            arm = read_groups(arm, document, units)
        table = _calibrate(arm, model, units, document)
    except ModelError as error:
        raise _locate_error(error, document, made) from None
    arm = replace(arm, table=table)
    warnings = (*missing_key_remarks(model.joints, rule, document), *_doubts(arm, units, document))
    return Robot(arm, units, source.path, source.text, source.sha256, warnings=warnings)


def read_units(model: UnitsModel, document: YamlDocument, at: Path_ = ("units",)) -> Units:
    """units: {length, angle} as units. Raises FormatError with the nearest name."""
    return Units(document.unit(model.length, "m", (*at, "length")), document.unit(model.angle, "rad", (*at, "angle")))


def _calibrate(arm: Chain, model: RobotModel, units: Units, document: YamlDocument) -> ParameterTable:
    """The table with its free flags, priors and bounds."""
    wanted, table = model.calibrate or CalibrateModel(), arm.table

    def match(word: str, *at: str | int) -> tuple[str, ...]:
        return _match(table, word, ("calibrate", *at), document)

    if wanted.free is None:
        free = {n for n in arm.usual if not n.startswith(("tool.", "base."))}
    else:
        free = {n for i, word in enumerate(wanted.free) for n in match(word, "free", i)}
    for owner, frame, default in (("base", model.base, False), ("tool", model.tool, True)):
        flags, own = (frame or FrameModel()).free_flags(default), [n for n in table.names if n.startswith(f"{owner}.")]
        free |= {n for n, flag in zip(own, flags, strict=True) if flag}
    free |= {n for group in arm.groups for n in group.parameters}
    free -= {n for i, word in enumerate(wanted.fixed) for n in match(word, "fixed", i)}
    table = table.with_free(free)
    rank: dict[str, int] = {}
    for i, word in enumerate(wanted.prefer):
        for n in match(word, "prefer", i):
            rank.setdefault(n, len(wanted.prefer) - i)
    table = table.with_preferences(rank)
    priors: dict[str, float | None] = {}
    for word, sigma in wanted.prior.items():
        path = ("calibrate", "prior", word)
        document.insist(sigma > 0, "a prior is a standard deviation", path, found=sigma, expected="a number above 0")
        if si := {"length": "m", "angle": "rad"}.get(word):
            names = tuple(n for n in arm.geometric if n in free and table[n].unit == si and n not in priors)
        else:
            names = match(word, "prior", word)
        priors.update({n: units.of(table[n].unit).to_si(sigma) for n in names})
    table = table.with_priors(priors)
    for word, pair in wanted.bounds.items():
        path = ("calibrate", "bounds", word)
        ordered = len(pair) == 2 and pair[0] < pair[1]
        document.insist(ordered, "wrong bounds", path, found=pair, expected="[lower, upper]")
        names = match(word, "bounds", word)
        for n in names:
            nominal = number(units.of(table[n].unit).from_si(table[n].value))
            message, expected = f"these bounds exclude the nominal value of {n}", f"bounds around {nominal}"
            document.insist(pair[0] <= float(nominal) <= pair[1], message, path, found=pair, expected=expected)
        low, high = ({n: units.of(table[n].unit).to_si(v) for n in names} for v in pair)
        made = (replace(p, lower=low[p.name], upper=high[p.name]) if p.name in low else p for p in table.rows)
        table = ParameterTable(tuple(made), table.together)
    return table


def _match(table: ParameterTable, word: str, at: Path_, document: YamlDocument) -> tuple[str, ...]:
    """Names that a word selects; a bare symbol speaks of joints only, never of base, home or tool."""
    try:
        hits = table.match([word])
    except ModelError as error:
        expected = "a parameter, a symbol or a joint"
        document.fail(error.message, at, found=word, expected=expected, suggestion=error.suggestion)
    if word in table or word in {n.rpartition(".")[0] for n in table.names}:
        return hits
    return tuple(n for n in hits if n.rpartition(".")[0] not in ("base", "home", "tool")) or hits


def _locate_error(error: ModelError, document: YamlDocument, made: Sequence[Mapping[str, object]]) -> FormatError:
    """A complaint of the model, with the file and the line of the joint that it names."""
    path: Path_ = ()
    for i, row in enumerate(made):
        owner, _, symbol = str(error.key or "").partition(".")
        if owner in (row.get("name", f"j{i + 1}"), f"joint {i + 1}"):
            path = ("joints", i, symbol.partition("[")[0])
    return error.of_file(document.path, row=document.row(path))


def _doubts(arm: Chain, units: Units, document: YamlDocument) -> tuple[Remark, ...]:
    """Values that are possible but look like another unit."""
    out = []
    reach = sum(abs(p.value) for p in arm.table.rows if p.unit == "m" and p.name in arm.geometric)
    if reach > MOST_REACH or 0.0 < reach < 5e-3:
        out.append(Remark.of(Code.ROBOT_SIZE, file=str(document.path), reach=reach, unit=units.length.name))
    for p in arm.table.rows:
        if p.unit == "rad" and abs(p.value) > MOST_TURN:
            shown, unit = units.angle.from_si(p.value), units.angle.name
            out.append(Remark.of(Code.OVER_A_TURN, file=str(document.path), parameter=p.name, value=shown, unit=unit))
            break
    return tuple(out)


# --- writing ----------------------------------------------------------------------------------------------------------------


def render_robot(robot: Robot, values: Mapping[str, float]) -> tuple[str, tuple[str, ...]]:
    """The robot with other parameter values (SI, by name) as text, and the names that its format cannot hold. Raises ModelError for an
    unknown name."""
    changed = {n: float(v) for n, v in values.items() if not same(robot.chain.table[n].value, float(v))}
    if robot.format == "urdf":
        from robocal.files.urdf import edit_urdf

        text, left_out = edit_urdf(robot.text, robot.chain, changed)
        return text, tuple(dict.fromkeys((*robot.left_out, *left_out)))
    document = parse(Source(robot.path or Path(robot.name), robot.text, robot.sha256))
    after = robot.chain.with_values(changed)
    rule = CONVENTIONS[robot.chain.convention]
    out: dict[Path_, float | str] = {}
    given = document.data["joints"]
    for i, (old, new) in enumerate(zip(rows(robot.chain), rows(after), strict=True)):
        out.update({("joints", i, *p): v for p, v in changes(old, new, given[i], rule, robot.units).items()})
    out.update(complete_rows(given, out, rule))
    for owner in ("base", "home", "tool"):
        names = [n for n in robot.chain.table.names if n.rpartition(".")[0] == owner]
        if any(n in changed for n in names):
            vector = np.array([after.table[n].value for n in names])
            out.update(frame_changes(document.data, owner, vector, robot.units))
    if after.groups:
        from robocal.files.group_block import group_changes

        out.update(group_changes(document, after, robot.units))
    text = edit(robot.text, out, robot.path)
    origin = robot.path.name if robot.path else f"the catalogue's {robot.name}"
    return add_stamp(text, origin, len(changed)), ()


def describe(arm: Chain, units: Units | None = None, *, comment: str = "", calibrate: bool = True) -> str:
    """A robot.yaml for a chain that a convention wrote: what `open_robot` makes of a catalogue robot, and `robocal
    new` of a template."""
    units = units or Units()
    rule = CONVENTIONS[arm.convention]
    lines = [f"# {line}" for line in comment.splitlines()]
    lines += ["robocal: 1", f"name: {quote(arm.name)}", "kind: arm"]
    lines += [f"units: {{length: {units.length.name}, angle: {units.angle.name}}}"]
    lines += [f"convention: {arm.convention}    # {rule.formula}", "joints:"]
    for i, row in enumerate(rows(arm), start=1):
        named = {"name": f"j{i}", "type": "revolute"} | row
        lines.append(f"  - {show_row(named, rule, units)}")
    for owner in ("base", "home", "tool"):
        names = [n for n in arm.table.names if n.rpartition(".")[0] == owner]
        if names:
            values = [units.of(arm.table[n].unit).from_si(arm.table[n].value) for n in names]
            shown = [f"[{', '.join(number(v) for v in part)}]" for part in (values[:3], values[3:])]
            free = ", free: false" if owner == "base" else ", free: true" if owner == "tool" else ""
            lines.append(f"{owner}: {{xyz: {shown[0]}, rotation_vector: {shown[1]}{free}}}")
    if calibrate:
        symbols = list(dict.fromkeys(n.rpartition(".")[2] for n in arm.usual if not n.startswith("tool.")))
        if symbols:
            example = quote(f"{arm.joint_names[-1]}.{symbols[0]}")
            hint = f"# symbols, joints or single names such as {example}"
            lines.append(f"calibrate: {{free: [{', '.join(quote(s) for s in symbols)}]}}    {hint}")
    if arm.groups:
        from robocal.files.group_block import group_lines

        lines += group_lines(arm, units)
    if arm.source:
        lines.append(f"source: {quote(arm.source)}")
    return "\n".join(lines) + "\n"

"""A cable robot as a file describes it: robot.yaml with `kind: cable`, to a CableRobot in SI and back.

Other descriptions (CASPR's XML, the YAML of published robots) are read by `caspr.py` and `published.py`
and written as this.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from robocal._record import replace
from robocal.cables.geometry import (
    BUILD_UP,
    COMMON,
    GAIN,
    PLATFORM,
    RAIL,
    STRETCH,
    SYMBOLS,
    WHEEL,
    CableRobot,
    cable_robot,
)
from robocal.cables.pulley import Pulleys
from robocal.errors import FileError, ModelError, one_of
from robocal.files.cable.cable_model import (
    MATERIALS,
    CableCalibrateModel,
    CableModel,
    CableRobotModel,
    CableUnits,
    CableValues,
)  # fmt: skip
from robocal.files.cable.cable_places import name_paths, places_of
from robocal.files.cable.cablefile import CableFile, robot_remarks
from robocal.files.cable.caspr import read_caspr
from robocal.files.cable.published import read_published
from robocal.files.cable.segment_rows import (
    Anchor,
    Anchors,
    CableRow,
    SegmentRow,
    SegmentUse,
    named_segments,
    read_rail,
    reeving_of,
    runs_of,
    shared_ends,
)  # fmt: skip
from robocal.files.schema import validate
from robocal.files.stated_covariance import covariance_of
from robocal.files.text import ROBOT_LIMIT, Source, read_text
from robocal.files.yamlio import Path_, YamlDocument, parse
from robocal.parameters import ParameterTable
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["parse_cable", "read_cable"]

EYELET = (0.0, np.array([0.0, 0.0, 1.0]))  # a pulley of no radius
PARAMETERS = {
    "pulley": WHEEL,
    "elasticity": (STRETCH,),
    GAIN: (GAIN,),
    BUILD_UP: (BUILD_UP,),
}  # keys of a cable, and the parameters that they are


def read_cable(path: str | os.PathLike[str]) -> CableFile:
    """Reads a cable robot: robot.yaml, CASPR's `X_cables.xml` (with `X_bodies.xml` beside it), or the YAML of a
    published robot. Raises FileError or FormatError."""
    if os.path.isdir(path):
        _not_a_folder(Path(path))
    source = read_text(path, limit=ROBOT_LIMIT)
    if source.path.suffix.lower() == ".xml" or source.text.lstrip().startswith("<"):
        return read_caspr(source)
    document = parse(source)
    if not {"robocal", "kind"} & set(document.data) and "frame_anchors" in document.data:
        return read_published(document)
    return _read_model(document)


def _not_a_folder(place: Path) -> NoReturn:
    """Which file of a run is the robot's: the run knows more than that file, and not every verb reads it."""
    from robocal.files.runfolder import ROBOTS

    own = place / ROBOTS[0]
    raise FileError("this is a folder", file=place, expected=f"a robot's file, {own}" if own.is_file() else "a file")


def parse_cable(source: Source) -> CableFile:
    """The same from the text of a robot.yaml. Raises FormatError with file, line and key of whatever is wrong."""
    return _read_model(parse(source))


def _read_model(document: YamlDocument) -> CableFile:
    if document.data.get("kind") in (None, "arm") and "joints" in document.data:
        expected = "a cable robot: kind: cable, frame_anchors, ..."
        document.fail("this is an arm", ("kind",), found="arm", expected=expected)
    model = validate(CableRobotModel, document)
    units = CableUnits(
        **{what: document.unit(name, getattr(CableUnits, what).si, ("units", what)) for what, name in model.units}
    )
    values = CableValues(document, units)
    frame, platform = (_anchors(document, f"{side}_anchors", values) for side in ("frame", "platform"))
    rows = _pair_anchors(model, document, {"frame": frame, "platform": platform})
    robot, places = _robot(model, rows, values), places_of(model, rows, values)
    warnings = (
        *robot_remarks(robot, document, {}),
        *_idle(rows, {"frame": frame, "platform": platform}, document),
        *_missing_zero(rows, document),
    )
    return CableFile(robot, units, document.path, document.text, document.sha256, "yaml", warnings, places)


def _anchors(document: YamlDocument, key: str, values: CableValues) -> Anchors:
    """Anchors by name; those of a list are called 1, 2, ..."""
    given = document.data[key]
    if isinstance(given, list):
        entries = [(str(i + 1), raw, (key, i)) for i, raw in enumerate(given)]
    elif isinstance(given, dict):
        entries = [(name, raw, (key, name)) for name, raw in given.items()]
    else:
        document.fail("not a list or mapping", (key,), found=given, expected="a list of [x, y, z], or NAME: [x, y, z]")
    return {name: Anchor(name, values.vector(raw, at, "m"), raw, at) for name, raw, at in entries}


def _pair_anchors(model: CableRobotModel, document: YamlDocument, sides: Mapping[str, Anchors]) -> list[CableRow]:
    """Every cable with its anchors: stated, or the i-th of either of the `sides`, frame and platform, for the i-th cable."""
    given = model.cables
    if given is None:
        many = [len(anchors) for anchors in sides.values()]
        if many[0] != many[1]:
            found = f"{many[0]} frame anchors, {many[1]} platform anchors"
            expected = "as many of one as of the other, or cables: [{frame: NAME, platform: NAME}, ...]"
            message = "the numbers of frame anchors and platform anchors differ, and no cables connect them"
            document.fail(message, ("frame_anchors",), found=found, expected=expected)
        given = [CableModel()] * many[0]
    out: list[CableRow] = []
    segments, used = named_segments(model, document, sides), set[str]()
    for i, own in enumerate(given):
        name = own.name or f"c{i + 1}"
        if any(name == row.name for row in out):
            document.fail("this name is given twice", ("cables", i, "name"), found=name)
        if own.segments is None:
            runs: tuple[SegmentUse, ...] = (_straight(own, i, name, model, document, sides),)
        else:
            runs = runs_of(own, i, document, segments, used)
        out.append(CableRow(own, model.every_cable, ("cables", i), name, runs))
    _check_segments(out, segments, used, model, document)
    return out


def _straight(
    own: CableModel, i: int, name: str, model: CableRobotModel, document: YamlDocument, sides: Mapping[str, Anchors]
) -> SegmentUse:
    """A cable from its frame anchor to its platform anchor."""
    ends = []
    for key, anchors in sides.items():
        wanted = getattr(own, key)
        if wanted is None and i >= len(anchors):
            count = len(model.cables or anchors)
            found = f"{len(anchors)} {key} anchors for {count} cables"
            expected = f"as many {key}_anchors as cables, or {key}: NAME in every cable"
            document.fail(f"cable {i + 1} has no {key} anchor", ("cables", i), found=found, expected=expected)
        at_name = list(anchors)[i] if wanted is None else str(wanted)
        if at_name not in anchors:
            facts = one_of(at_name, anchors)
            document.fail(f"no such {key} anchor", ("cables", i, key), found=wanted, **facts)
        ends.append((key, anchors[at_name]))
    (one, two), at = ends, ("cables", i)
    pulley, wheel_at = (own.pulley, at) if own.pulley is not None else (model.every_cable.pulley, ("every_cable",))
    return SegmentUse(SegmentRow(name, (one, two), pulley, (*wheel_at, "pulley"), own.rail, (*at, "rail")), 1)


def _check_segments(
    rows: list[CableRow],
    segments: Mapping[str, SegmentRow],
    used: set[str],
    model: CableRobotModel,
    document: YamlDocument,
) -> None:
    """Raises FormatError for segments that no cable runs along, or that are called as a cable is, and for a pulley of every cable."""
    for name in segments:
        at: Path_ = ("segments", name)
        document.insist(
            name in used,
            "no cable runs along this segment",
            at,
            found=name,
            expected=f"segments: {{{name}: 1}} in a cable",
        )
        taken = name in {COMMON, PLATFORM, *(row.name for row in rows)}
        document.insist(not taken, "this name is given twice", at, found=name, expected="a name that no cable has")
    if segments and model.every_cable.pulley is not None:
        document.fail(
            "segments have pulleys of their own",
            ("every_cable", "pulley"),
            expected="pulley in each segment that has one",
        )


def _idle(rows: list[CableRow], sides: Mapping[str, Anchors], document: YamlDocument) -> Iterator[Remark]:
    """A remark on anchors that no cable uses: they may be spare, or a cable is missing."""
    ends = {(side, anchor.name) for row in rows for run in row.runs for side, anchor in run.segment.ends}
    for side, anchors in sides.items():
        spare = tuple(name for name in anchors if (side, name) not in ends)
        if spare:
            yield Remark.of(Code.ANCHORS_UNUSED, file=str(document.path), side=side, anchors=spare)


def _missing_zero(rows: list[CableRow], document: YamlDocument) -> Iterator[Remark]:
    """A remark on the one cable without a zero where all others state theirs: it may have been forgotten."""
    silent = [row for row in rows if row.own.zero is None]
    if len(silent) == 1 and len(rows) >= 3:
        place = {"file": str(document.path), "row": document.row(silent[0].at), "joint": f"cable {silent[0].name}"}
        yield Remark.of(Code.KEYS_UNSTATED, **place, keys=("zero",), others="all others", values=("zero: 0",))


def _robot(model: CableRobotModel, rows: list[CableRow], values: CableValues) -> CableRobot:
    zeros = [0.0 if row.own.zero is None else values.number(row.own.zero, (*row.at, "zero"), "m") for row in rows]
    reeving, segments = reeving_of([row.name for row in rows], [row.runs for row in rows])
    known = _materials(rows, values) | _wheels(segments, values)
    for key, what, read, si in (
        ("mass", "mass", values.number, "kg"),
        ("inertia", "inertia", values.matrix, "kg m2"),
        ("centre_of_mass", "com", values.vector, "m"),
    ):
        if (raw := getattr(model.platform, key)) is not None:
            known[what] = read(raw, ("platform", key), si)
    a, b = (np.array([s.ends[e][1].point for s in segments]).reshape(-1, 3) for e in (0, 1))
    known |= {"degrees": model.degrees, "plane": model.plane, "names": [row.name for row in rows], "reeving": reeving}
    shared = _shared(rows) | shared_ends([row.name for row in rows] if reeving is None else reeving.names, segments)
    robot = cable_robot(model.name, a, b, zeros, shared=shared, **known)
    said = name_paths(rows)
    sources = {name: values.sources[at] for name, at in said.items() if at in values.sources}
    assumed = tuple(name for name, at in said.items() if at in values.assumed)
    robot = replace(robot, sources=({"": model.source} if model.source else {}) | sources, assumed=assumed)
    if model.calibrate is None:
        return robot
    free = {
        n for i, word in enumerate(model.calibrate.free) for n in _match(robot, word, ("calibrate", "free", i), values)
    }
    return replace(robot, table=_with_priors(robot, model.calibrate, values).with_free(free))


def _match(robot: CableRobot, word: str, at: Path_, values: CableValues) -> tuple[str, ...]:
    """Names of parameters that a word selects; a segment's are those of its ends, whoever has its anchors first."""
    ways = robot.segments
    if not ways.is_plain and word in ways.labels:
        own = ways.names[ways.labels.index(word)]
        names = [robot.row(f"{own}.{s}") for s in (*SYMBOLS[:6], *WHEEL, *RAIL)]
        return tuple(n for n in names if n in robot.table)
    try:
        return robot.table.match([word])
    except ModelError as error:
        expected = f"a parameter, a cable or one of {', '.join((*SYMBOLS, *WHEEL, *RAIL, STRETCH, GAIN, BUILD_UP))}"
        values.document.fail(error.message, at, found=word, expected=expected, suggestion=error.suggestion)


def _with_priors(robot: CableRobot, said: CableCalibrateModel, values: CableValues) -> ParameterTable:
    """The table of a robot with what is said beforehand of its numbers, each alone, or together where correlations are stated."""
    priors = _priors(robot, said, values)
    if said.correlation is None:
        return robot.table.with_priors(priors)
    at = ("calibrate", "correlation")
    expected = "priors of single names, of which it has rows and columns"
    for word in said.prior:
        values.document.insist(word in robot.table, "a correlation with many", at, found=word, expected=expected)
    priors = {word: priors[word] for word in said.prior}
    covariance = covariance_of(values.document, priors, said.correlation, tuple(priors), ("calibrate",), of="prior")
    return robot.table.with_covariance(tuple(priors), covariance)


def _priors(robot: CableRobot, said: CableCalibrateModel, values: CableValues) -> dict[str, float]:
    """Standard deviations of what is stated, SI; a single name is stronger than a symbol or a cable."""
    out: dict[str, float] = {}
    for word in sorted(said.prior, key=lambda w: w in robot.table):
        at = ("calibrate", "prior", word)
        names = _match(robot, word, at, values)
        units = {robot.table[n].unit for n in names}
        if len(units) > 1:
            expected = f"one of {', '.join(SYMBOLS)}, or one name"
            values.document.fail("a prior of several units", at, found=word, expected=expected)
        sigma = values.number(said.prior[word], at, units.pop())
        message, expected = "a prior is a standard deviation", "a number above 0"
        values.document.insist(sigma > 0, message, at, found=said.prior[word], expected=expected)
        out |= dict.fromkeys(names, sigma)
    return out


def _shared(rows: list[CableRow]) -> dict[str, str]:
    """Pulleys and elasticities are all cables' own where they are said under every_cable, and the cable says nothing else."""
    return {
        f"{row.name}.{s}": f"{COMMON}.{s}"
        for row in rows
        for key, symbols in PARAMETERS.items()
        if getattr(row.every, key) is not None and getattr(row.own, key) is None
        for s in symbols
    }


def _materials(rows: list[CableRow], values: CableValues) -> dict[str, Any]:
    """What is said of each cable, or of every cable, as arrays; what is said of some cables only is refused."""
    out: dict[str, Any] = {}
    for key, (what, si) in MATERIALS.items():
        found = [
            None if raw is None else values.vector(raw, at, si, 2) if key == "tension" else values.number(raw, at, si)
            for raw, at in (row.material(key) for row in rows)
        ]
        missing = [row for row, v in zip(rows, found, strict=True) if v is None]
        if len(missing) == len(rows):
            continue
        if missing:
            names, expected = ", ".join(row.name for row in missing), f"{key} in every cable, or under every_cable"
            message = f"the {key} is given for some cables only"
            values.document.fail(message, missing[0].at, found=f"none for {names}", expected=expected)
        out[what] = np.array(found)
    return out


def _wheels(segments: Sequence[SegmentRow], values: CableValues) -> dict[str, Any]:
    """Pulleys and rails of segments, where any has one."""
    out: dict[str, Any] = {}
    wheels = [s.pulley and s.pulley.numbers(s.pulley_at, values) for s in segments]
    if any(wheels):
        each = [wheel or EYELET for wheel in wheels]
        out["pulleys"] = Pulleys(np.array([radius for radius, _ in each]), np.array([axis for _, axis in each]))
    if any(s.rail is not None for s in segments):
        out["rails"] = np.array([read_rail(s, values) for s in segments])
    return out

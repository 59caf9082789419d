"""A cable robot as a file describes it: robot.yaml with `kind: cable`, to a CableRobot in SI and back.

Other descriptions (CASPR's XML, the YAML of published robots) are read by `caspr.py` and `published.py`
and written as this.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.geometry import COMMON, GAIN, PLATFORM, STRETCH, SYMBOLS, WHEEL, CableRobot, cable_robot
from robocal.cables.pulley import Pulleys
from robocal.errors import FileError, ModelError, one_of
from robocal.files.cable.cable_model import (
    MATERIALS,
    CableCalibrateModel,
    CableModel,
    CableRobotModel,
    CableUnits,
    CableValues,
    CommonModel,
)  # fmt: skip
from robocal.files.cable.cablefile import CableFile, robot_remarks
from robocal.files.cable.caspr import read_caspr
from robocal.files.cable.published import read_published
from robocal.files.schema import validate
from robocal.files.text import ROBOT_LIMIT, Source, read_text
from robocal.files.units import Unit
from robocal.files.yamlio import Path_, YamlDocument, parse, path_text
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["parse_cable", "read_cable"]

Place = tuple[Path_, Unit]
EYELET = (0.0, np.array([0.0, 0.0, 1.0]))  # a pulley of no radius
PARAMETERS = {
    "pulley": WHEEL,
    "elasticity": (STRETCH,),
    GAIN: (GAIN,),
}  # keys of a cable, and the parameters that they are


@record
class Anchor:
    """An anchor: its name, its coordinates in m, what the file says of it, and where."""

    name: str
    point: Array
    raw: Any
    at: Path_


Anchors = Mapping[str, Anchor]


@record
class CableRow:
    """One cable: what the file says of it, alone and of every cable; where; its name; and its anchors, a and b."""

    own: CableModel
    every: CommonModel
    at: Path_
    name: str
    ends: Anchors

    def material(self, key: str) -> tuple[Any, Path_]:
        """What is said under a key of it, or of every cable, and where."""
        own = getattr(self.own, key)
        return (own, (*self.at, key)) if own is not None else (getattr(self.every, key), ("every_cable", key))


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
    robot, places = _robot(model, rows, values), _places(model, rows, values)
    warnings = (
        *robot_remarks(robot, document, {}),
        *_idle(rows, {"frame": ("a", frame), "platform": ("b", platform)}, document),
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
    for i, own in enumerate(given):
        ends = {}
        for letter, (key, anchors) in zip("ab", sides.items(), strict=True):
            wanted = getattr(own, key)
            if wanted is None and i >= len(anchors):
                found = f"{len(anchors)} {key} anchors for {len(given)} cables"
                expected = f"as many {key}_anchors as cables, or {key}: NAME in every cable"
                document.fail(f"cable {i + 1} has no {key} anchor", ("cables", i), found=found, expected=expected)
            name = list(anchors)[i] if wanted is None else str(wanted)
            if name not in anchors:
                at, facts = ("cables", i, key), one_of(name, anchors)
                document.fail(f"no such {key} anchor", at, found=wanted, **facts)
            ends[letter] = anchors[name]
        name = own.name or f"c{i + 1}"
        if any(name == row.name for row in out):
            document.fail("this name is given twice", ("cables", i, "name"), found=name)
        out.append(CableRow(own, model.every_cable, ("cables", i), name, ends))
    return out


def _idle(rows: list[CableRow], sides: Mapping[str, tuple[str, Anchors]], document: YamlDocument) -> Iterator[Remark]:
    """A remark on anchors that no cable uses: they may be spare, or a cable is missing."""
    for side, (letter, anchors) in sides.items():
        spare = tuple(name for name in anchors if name not in {row.ends[letter].name for row in rows})
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
    known = _materials(rows, values)
    for key, what, read, si in (
        ("mass", "mass", values.number, "kg"),
        ("inertia", "inertia", values.matrix, "kg m2"),
        ("centre_of_mass", "com", values.vector, "m"),
    ):
        if (raw := getattr(model.platform, key)) is not None:
            known[what] = read(raw, ("platform", key), si)
    a, b = (np.array([row.ends[letter].point for row in rows]).reshape(-1, 3) for letter in "ab")
    known |= {"degrees": model.degrees, "plane": model.plane, "names": [row.name for row in rows]}
    robot = cable_robot(model.name, a, b, zeros, shared=_shared(rows), **known)
    said = _name_paths(rows)
    sources = {name: values.sources[at] for name, at in said.items() if at in values.sources}
    assumed = tuple(name for name, at in said.items() if at in values.assumed)
    robot = replace(robot, sources=({"": model.source} if model.source else {}) | sources, assumed=assumed)
    if model.calibrate is None:
        return robot
    free = {
        n for i, word in enumerate(model.calibrate.free) for n in _match(robot, word, ("calibrate", "free", i), values)
    }
    return replace(robot, table=robot.table.with_free(free).with_priors(_priors(robot, model.calibrate, values)))


def _match(robot: CableRobot, word: str, at: Path_, values: CableValues) -> tuple[str, ...]:
    """Names of parameters that a word selects."""
    try:
        return robot.table.match([word])
    except ModelError as error:
        expected = f"a parameter, a cable or one of {', '.join((*SYMBOLS, *WHEEL, STRETCH, GAIN))}"
        values.document.fail(error.message, at, found=word, expected=expected, suggestion=error.suggestion)


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
    """Whose numbers those of a cable are that shares an anchor with an earlier one; pulleys and elasticities are all cables' own where
    they are said under every_cable, and the cable says nothing else."""
    owners: dict[tuple[str, str], str] = {}
    out: dict[str, str] = {}
    for row in rows:
        for letter, end in row.ends.items():
            owner = owners.setdefault((letter, end.name), row.name)
            if owner != row.name:
                out |= {f"{row.name}.{letter}{s}": f"{owner}.{letter}{s}" for s in "xyz"}
        for key, symbols in PARAMETERS.items():
            if getattr(row.every, key) is not None and getattr(row.own, key) is None:
                out |= {f"{row.name}.{s}": f"{COMMON}.{s}" for s in symbols}
    return out


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
    wheels = [raw and raw.numbers(at, values) for raw, at in (row.material("pulley") for row in rows)]
    if any(wheels):
        each = [wheel or EYELET for wheel in wheels]
        out["pulleys"] = Pulleys(np.array([radius for radius, _ in each]), np.array([axis for _, axis in each]))
    return out


def _name_paths(rows: list[CableRow]) -> dict[str, str]:
    """Names that do not depend on how the file is laid out (c1.a, c1.b, c1.zero, c1.tension, ..., mass, com, inertia),
    and the key path at which each is said."""
    out: dict[str, str] = {}
    for row in rows:
        places = {letter: end.at for letter, end in row.ends.items()} | {"zero": (*row.at, "zero")}
        places |= {key: row.material(key)[1] for key in MATERIALS}
        places["pulley"] = (*row.material("pulley")[1], "radius")
        out |= {f"{row.name}.{what}": path_text(at) for what, at in places.items()}
    return out | {"mass": "platform.mass", "com": "platform.centre_of_mass", "inertia": "platform.inertia"}


def _places(model: CableRobotModel, rows: list[CableRow], values: CableValues) -> dict[str, Place]:
    """Where every parameter stands in the file."""
    out: dict[str, Place] = {}

    def note(name: str, raw: Any, at: Path_, si: str = "m", axes: str = "") -> None:
        path, unit = values.place(raw, at, si)
        if raw is not None:
            out.update({f"{name}{axis}": ((*path, n), unit) for n, axis in enumerate(axes)} or {name: (path, unit)})

    for row in rows:
        for letter, end in row.ends.items():
            note(f"{row.name}.{letter}", end.raw, end.at, axes="xyz")
        if "cables" in values.document.data:
            out[f"{row.name}.l0"] = values.place(row.own.zero, (*row.at, "zero"), "m")
            out[f"{row.name}.{GAIN}"] = values.place(row.own.gain, (*row.at, GAIN), "1")
    of_cables = ((row.name, row.own, row.at) for row in rows)
    for whose, said, where in (*of_cables, (COMMON, model.every_cable, ("every_cable",))):
        note(f"{whose}.{STRETCH}", said.elasticity, (*where, "elasticity"), "1/N")
        note(f"{whose}.{GAIN}", said.gain, (*where, GAIN), "1")
        note(f"{whose}.density", said.density, (*where, "density"), "N/m")
        if said.pulley is not None:
            note(f"{whose}.radius", said.pulley.radius, (*where, "pulley", "radius"))
            note(f"{whose}.n", said.pulley.axis, (*where, "pulley", "axis"), "1", "xyz")
    note(f"{PLATFORM}.mass", model.platform.mass, ("platform", "mass"), "kg")
    note(f"{PLATFORM}.c", model.platform.centre_of_mass, ("platform", "centre_of_mass"), axes="xyz")
    return out

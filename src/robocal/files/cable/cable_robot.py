"""A cable robot as a file describes it: robot.yaml with `kind: cable`, to a CableRobot in SI and back.

Other descriptions (CASPR's XML, the YAML of published robots) are read by `caspr.py` and `published.py`
and written as this.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from robocal.cables.geometry import COMMON, PLATFORM, STRETCH, SYMBOLS, WHEEL, CableRobot, cable_robot
from robocal.cables.pulley import Pulleys
from robocal.errors import FileError, ModelError, nearest
from robocal.files.cable.cable_model import (
    CableModel,
    CableRobotModel,
    CableUnitsModel,
    CommonModel,
    PlatformModel,
    PulleyModel,
)
from robocal.files.cable.cablefile import CableFile, robot_remarks
from robocal.files.cable.caspr import read_caspr
from robocal.files.cable.published import read_published
from robocal.files.cable.values import CableUnits, CableValues
from robocal.files.schema import validate
from robocal.files.text import ROBOT_LIMIT, Source, read_text
from robocal.files.units import Unit
from robocal.files.yamlio import Path_, YamlDocument, parse, path_text
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["parse_cable", "read_cable"]

Place = tuple[Path_, Unit]
MATERIAL = {"pulley": WHEEL, "elasticity": (STRETCH,)}  # keys of a cable, and the parameters that they are


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
    return _read_model(source, document)


def _not_a_folder(place: Path) -> NoReturn:
    """Which file of a run is the robot's: the run knows more than that file, and not every verb reads it."""
    from robocal.files.runfolder import ROBOTS

    own = place / ROBOTS[0]
    raise FileError("this is a folder", file=place, expected=f"a robot's file, {own}" if own.is_file() else "a file")


def parse_cable(source: Source) -> CableFile:
    """The same from the text of a robot.yaml. Raises FormatError with file, line and key of whatever is wrong."""
    return _read_model(source, parse(source))


def _read_model(source: Source, document: YamlDocument) -> CableFile:
    if document.data.get("kind") in (None, "arm") and "joints" in document.data:
        document.fail(
            "this is an arm", ("kind",), found="arm", expected="a cable robot: kind: cable, frame_anchors, ..."
        )
    model = validate(CableRobotModel, document)
    units = _units(model.units, document)
    values = CableValues(document, units)
    frame, platform = (_anchors(document, key, values) for key in ("frame_anchors", "platform_anchors"))
    rows = _pair_anchors(model, document, frame, platform)
    robot, places = _robot(model, rows, frame, platform, values)
    warnings = (
        *robot_remarks(robot, document),
        *_idle(rows, frame, platform, document),
        *_missing_zero(rows, robot, document),
    )
    return CableFile(robot, units, source.path, source.text, source.sha256, "yaml", warnings, places)


def _units(model: CableUnitsModel, document: YamlDocument) -> CableUnits:
    found = []
    for word, si in (("length", "m"), ("angle", "rad"), ("force", "N"), ("mass", "kg")):
        path = ("units", word)
        found.append(document.unit(getattr(model, word), si, path))
    return CableUnits(*found)


# name -> (coordinates in m, what the file says, where)
Anchors = dict[str, tuple[np.ndarray, Any, Path_]]
CableRows = list[tuple[CableModel, str, str]]  # of every cable, with the names of its anchors


def _anchors(document: YamlDocument, key: str, values: CableValues) -> Anchors:
    """Anchors by name; those of a list are called 1, 2, ..."""
    given = document.data[key]
    if isinstance(given, list):
        entries = [(str(i + 1), raw, (key, i)) for i, raw in enumerate(given)]
    elif isinstance(given, dict):
        entries = [(name, raw, (key, name)) for name, raw in given.items()]
    else:
        document.fail("not a list or mapping", (key,), found=given, expected="a list of [x, y, z], or NAME: [x, y, z]")
    return {name: (values.vector(raw, at, "m"), raw, at) for name, raw, at in entries}


def _pair_anchors(model: CableRobotModel, document: YamlDocument, frame: Anchors, platform: Anchors) -> CableRows:
    """Every cable with the names of its anchors: stated, or the i-th of either for the i-th cable."""
    rows = model.cables
    if rows is None:
        if len(frame) != len(platform):
            document.fail(
                "the numbers of frame anchors and platform anchors differ, and no cables connect them",
                ("frame_anchors",),
                found=f"{len(frame)} frame anchors, {len(platform)} platform anchors",
                expected="as many of one as of the other, or cables: [{frame: NAME, platform: NAME}, ...]",
            )
        rows = [CableModel() for _ in frame]
    out, seen = [], {}
    for i, row in enumerate(rows):
        ends = []
        for key, anchors in (("frame", frame), ("platform", platform)):
            wanted = getattr(row, key)
            if wanted is None and i >= len(anchors):
                document.fail(
                    f"cable {i + 1} has no {key} anchor",
                    ("cables", i),
                    found=f"{len(anchors)} {key} anchors for {len(rows)} cables",
                    expected=f"as many {key}_anchors as cables, or {key}: NAME in every cable",
                )
            name = list(anchors)[i] if wanted is None else str(wanted)
            if name not in anchors:
                document.fail(
                    f"no such {key} anchor",
                    ("cables", i, key),
                    found=wanted,
                    expected=", ".join(anchors),
                    suggestion=nearest(name, anchors),
                )
            ends.append(name)
        name = row.name or f"c{i + 1}"
        if name in seen:
            document.fail("this name is given twice", ("cables", i, "name"), found=name)
        seen[name] = i
        out.append((row, ends[0], ends[1]))
    return out


def _idle(rows: CableRows, frame: Anchors, platform: Anchors, document: YamlDocument) -> tuple[Remark, ...]:
    """A remark on anchors that no cable uses: they may be spare, or a cable is missing."""
    spare = (
        (key, [name for name in anchors if name not in {row[at] for row in rows}])
        for key, anchors, at in (("frame", frame, 1), ("platform", platform, 2))
    )
    file = str(document.path)
    return tuple(
        Remark.of(Code.ANCHORS_UNUSED, file=file, side=side, anchors=tuple(names)) for side, names in spare if names
    )


def _missing_zero(rows: CableRows, robot: CableRobot, document: YamlDocument) -> tuple[Remark, ...]:
    """A remark on the one cable without a zero where all others state theirs: it may have been forgotten."""
    silent = [i for i, (row, *_) in enumerate(rows) if row.zero is None]
    if len(silent) != 1 or len(rows) < 3:
        return ()
    cable = f"cable {robot.cables[silent[0]]}"
    row = document.row(("cables", silent[0]))
    file, keys, values = str(document.path), ("zero",), ("zero: 0",)
    return (
        Remark.of(Code.KEYS_UNSTATED, file=file, row=row, joint=cable, keys=keys, others="all others", values=values),
    )


def _robot(
    model: CableRobotModel, rows: CableRows, frame: Anchors, platform: Anchors, values: CableValues
) -> tuple[CableRobot, dict[str, Place]]:
    document = values.document
    names = [row.name or f"c{i + 1}" for i, (row, _, _) in enumerate(rows)]
    zeros = [
        0.0 if row.zero is None else values.number(row.zero, ("cables", i, "zero"), "m")
        for i, (row, *_) in enumerate(rows)
    ]
    body = model.platform or PlatformModel()
    at: Path_ = ("platform",)
    known = _materials(model, [row for row, _, _ in rows], names, values)
    known |= {
        "mass": None if body.mass is None else values.number(body.mass, (*at, "mass"), "kg"),
        "inertia": None if body.inertia is None else values.matrix(body.inertia, (*at, "inertia"), "kg m2"),
    }
    if body.centre_of_mass is not None:
        known["com"] = values.vector(body.centre_of_mass, (*at, "centre_of_mass"), "m")
    robot = cable_robot(
        model.name,
        np.array([frame[a][0] for _, a, _ in rows]).reshape(-1, 3),
        np.array([platform[b][0] for _, _, b in rows]).reshape(-1, 3),
        zeros,
        names=names,
        shared=_shared(rows, names) | _common(model, rows, names),
        degrees=model.degrees,
        plane=model.plane,
        **known,
    )
    said = _name_paths(rows, names, frame, platform)
    sources = {name: values.sources[at] for name, at in said.items() if at in values.sources}
    assumed = tuple(name for name, at in said.items() if at in values.assumed)
    robot = replace(robot, sources=({"": model.source} if model.source else {}) | sources, assumed=assumed)
    if model.calibrate is not None:
        free: set[str] = set()
        for i, word in enumerate(model.calibrate.free):
            try:
                free.update(robot.table.match([word]))
            except ModelError as error:
                expected = f"a parameter, a cable or one of {', '.join((*SYMBOLS, *WHEEL, STRETCH))}"
                document.fail(
                    error.message, ("calibrate", "free", i), found=word, expected=expected, suggestion=error.suggestion
                )
        robot = replace(robot, table=robot.table.with_free(free))
    return robot, _places(model, rows, names, frame, platform, values)


def _shared(rows: CableRows, names: list[str]) -> dict[str, str]:
    """Whose numbers those of a cable are that shares an anchor with an earlier one."""
    out: dict[str, str] = {}
    for letter, at in (("a", 1), ("b", 2)):
        first: dict[str, str] = {}
        for name, row in zip(names, rows, strict=True):
            owner = first.setdefault(str(row[at]), name)
            if owner != name:
                out.update({f"{name}.{letter}{s}": f"{owner}.{letter}{s}" for s in "xyz"})
    return out


def _common(model: CableRobotModel, rows: CableRows, names: list[str]) -> dict[str, str]:
    """The numbers of pulleys and elasticities that are all cables' own: those under every_cable, of cables that say nothing else."""
    every = model.every_cable or CommonModel()
    return {
        f"{name}.{s}": f"{COMMON}.{s}"
        for key, symbols in MATERIAL.items()
        if getattr(every, key) is not None
        for name, (row, *_) in zip(names, rows, strict=True)
        if getattr(row, key) is None
        for s in symbols
    }


def _materials(model: CableRobotModel, rows: list[CableModel], names: list[str], values: CableValues) -> dict[str, Any]:
    """What is said of each cable, or of every cable, as arrays; what is said of some cables only is refused."""
    out: dict[str, Any] = {}
    every = model.every_cable or CommonModel()
    for key, what, si in (
        ("tension", "limits", "N"),
        ("elasticity", "elasticity", "1/N"),
        ("density", "density", "N/m"),
        ("diameter", "diameter", "m"),
        ("pulley", "pulleys", "m"),
    ):
        found: list[Any] = []
        for i, row in enumerate(rows):
            own = getattr(row, key)
            raw, at = (own, ("cables", i, key)) if own is not None else (getattr(every, key), ("every_cable", key))
            if raw is None:
                found.append(None)
            elif key == "pulley":
                found.append(_pulley(raw, at, values))
            else:
                found.append(values.vector(raw, at, si, 2) if key == "tension" else values.number(raw, at, si))
        missing = [n for n, v in zip(names, found, strict=True) if v is None]
        if len(missing) == len(names):
            continue
        if missing and key != "pulley":
            values.document.fail(
                f"the {key} is given for some cables only",
                ("cables", names.index(missing[0])),
                found=f"none for {', '.join(missing)}",
                expected=f"{key} in every cable, or under every_cable",
            )
        if key == "pulley":
            wheels = [v or (0.0, np.array([0.0, 0.0, 1.0])) for v in found]
            out[what] = Pulleys(np.array([r for r, _ in wheels]), np.array([n for _, n in wheels]))
        else:
            out[what] = np.array(found)
    return out


def _pulley(model: PulleyModel, at: Path_, values: CableValues) -> tuple[float, np.ndarray]:
    axis = values.vector(model.axis, (*at, "axis"), "1")
    if not axis.any():
        values.document.fail("an axis needs a direction", (*at, "axis"), found=model.axis, expected="not all zero")
    return values.number(model.radius, (*at, "radius"), "m"), axis


def _name_paths(rows: CableRows, names: list[str], frame: Anchors, platform: Anchors) -> dict[str, str]:
    """Names that do not depend on how the file is laid out (c1.a, c1.b, c1.zero, c1.tension, ..., mass, com, inertia),
    and the key path at which each is said."""
    out: dict[str, str] = {}
    for i, (row, a, b) in enumerate(rows):
        out |= {f"{names[i]}.a": path_text(frame[a][2]), f"{names[i]}.b": path_text(platform[b][2])}
        out[f"{names[i]}.zero"] = path_text(("cables", i, "zero"))
        for key in ("tension", "elasticity", "density", "diameter", "pulley"):
            at: Path_ = ("cables", i, key) if getattr(row, key) is not None else ("every_cable", key)
            out[f"{names[i]}.{key}"] = path_text((*at, "radius") if key == "pulley" else at)
    return out | {"mass": "platform.mass", "com": "platform.centre_of_mass", "inertia": "platform.inertia"}


def _places(
    model: CableRobotModel, rows: CableRows, names: list[str], frame: Anchors, platform: Anchors, values: CableValues
) -> dict[str, Place]:
    """Where every parameter stands in the file."""
    out: dict[str, Place] = {}
    for i, (row, a, b) in enumerate(rows):
        for letter, (_, raw, at) in (("a", frame[a]), ("b", platform[b])):
            path, unit = values.place(raw, at, "m")
            out.update({f"{names[i]}.{letter}{axis}": ((*path, n), unit) for n, axis in enumerate("xyz")})
        if "cables" in values.document.data:
            out[f"{names[i]}.l0"] = values.place(row.zero, ("cables", i, "zero"), "m")
        for whose, said, where in (
            (names[i], row, ("cables", i)),
            (COMMON, model.every_cable or CommonModel(), ("every_cable",)),
        ):
            if said.elasticity is not None:
                out[f"{whose}.{STRETCH}"] = values.place(said.elasticity, (*where, "elasticity"), "1/N")
            if said.pulley is not None:
                out[f"{whose}.radius"] = values.place(said.pulley.radius, (*where, "pulley", "radius"), "m")
                path, unit = values.place(said.pulley.axis, (*where, "pulley", "axis"), "1")
                out.update({f"{whose}.n{axis}": ((*path, n), unit) for n, axis in enumerate("xyz")})
    body = model.platform or PlatformModel()
    if body.mass is not None:
        out[f"{PLATFORM}.mass"] = values.place(body.mass, ("platform", "mass"), "kg")
    if body.centre_of_mass is not None:
        path, unit = values.place(body.centre_of_mass, ("platform", "centre_of_mass"), "m")
        out.update({f"{PLATFORM}.c{axis}": ((*path, n), unit) for n, axis in enumerate("xyz")})
    return out

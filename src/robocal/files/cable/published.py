"""Cable robots described elsewhere: the YAML of published robots (CASPR is in `caspr.py`)."""

from __future__ import annotations

import re
from itertools import takewhile
from typing import Any

import numpy as np

from robocal.cables.geometry import cable_robot
from robocal.files.cable.cable_model import MATERIALS, CableUnits, CableValues
from robocal.files.cable.cablefile import CableFile, robot_remarks
from robocal.files.schema import FileModel, validate
from robocal.files.yamlio import YamlDocument

__all__ = ["read_published"]


WHERE = {
    "mass": ("mass_kg",),
    "tension": ("tension_limits_N",),
    "diameter": ("cable", "diameter_m"),
    "elasticity": ("cable", "elongation_per_N"),
    "density": ("cable", "weight_N_per_m"),
}


class MaterialModel(FileModel):
    """cable: what it is made of."""

    diameter_m: Any = None
    elongation_per_N: Any = None
    weight_N_per_m: Any = None


class PublishedModel(FileModel):
    """The YAML of a published robot: units are in the keys."""

    name: str
    length_unit: str
    mass_kg: Any = None
    centre_of_mass_m: Any = None
    tension_limits_N: Any = None
    cable: MaterialModel | None = None
    camera: Any = None
    frame_anchors: list[Any]
    initial_lengths_m: list[Any] | None = None
    platform_anchors: list[Any]


def read_published(document: YamlDocument) -> CableFile:
    """A robot of ../shared/data/cable-robots: keys carry units, `# assumed` behind a key marks what was chosen, the
    comments above are the source. Raises FormatError."""
    model = validate(PublishedModel, document)
    unit = document.unit(model.length_unit, "m", ("length_unit",))
    own, si = CableValues(document, CableUnits(length=unit)), CableValues(document, CableUnits())
    a = [own.vector(raw, ("frame_anchors", i), "m") for i, raw in enumerate(model.frame_anchors)]
    b = [own.vector(raw, ("platform_anchors", i), "m") for i, raw in enumerate(model.platform_anchors)]
    zeros = [si.number(v, ("initial_lengths_m", i), "m") for i, v in enumerate(model.initial_lengths_m or [])]
    m = len(a)
    for key, other in (("platform_anchors", b), ("initial_lengths_m", zeros)):
        if len(other) != m and (other or key == "platform_anchors"):
            expected = f"{m}, one for each frame anchor"
            document.fail("not as many as frame anchors", (key,), found=len(other), expected=expected)
    said = _comments(document)
    known: dict[str, Any] = {"sources": {"": said} if said else {}, "assumed": _find_assumed(document, m)}
    if model.mass_kg is not None:
        known["mass"] = si.number(model.mass_kg, WHERE["mass"], "kg")
    if model.centre_of_mass_m is not None:
        known["com"] = si.vector(model.centre_of_mass_m, ("centre_of_mass_m",), "m")
    if model.tension_limits_N is not None:
        known["limits"] = np.tile(si.vector(model.tension_limits_N, WHERE["tension"], "N", 2), (m, 1))
    for key in ("diameter", "elasticity", "density"):
        raw = getattr(model.cable, WHERE[key][1], None)
        if raw is not None:
            known[key] = np.full(m, si.number(raw, WHERE[key], MATERIALS[key][1]))
    robot = cable_robot(model.name, np.array(a), np.array(b), zeros or None, **known)
    warnings = robot_remarks(robot, document, WHERE)
    return CableFile(robot, own.units, document.path, document.text, document.sha256, "published", warnings)


def _comments(document: YamlDocument) -> str:
    """The comment lines at the top."""
    head = takewhile(lambda line: line.startswith("#"), document.text.splitlines())
    return " ".join(line.lstrip("# ").rstrip() for line in head)


def _find_assumed(document: YamlDocument, m: int) -> tuple[str, ...]:
    """Names of values behind whose key `# assumed` is written."""
    lines = document.text.splitlines()
    each = {"frame_anchors": "a", "platform_anchors": "b", "initial_lengths_m": "zero", "tension_limits_N": "tension"}
    names = {key: tuple(f"c{i + 1}.{what}" for i in range(m)) for key, what in each.items()}
    names |= {"mass_kg": ("mass",), "centre_of_mass_m": ("com",)}
    rows = {key: row for key in names if (row := document.lines.get((key,))) is not None}
    return tuple(n for key, row in rows.items() if re.search(r"#\s*assumed", lines[row - 1]) for n in names[key])

"""Where the numbers of a cable robot stand in its file: by the names of its parameters, and by those of what sources are said of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robocal.cables.geometry import BUILD_UP, COMMON, GAIN, PLATFORM, STRETCH
from robocal.files.cable.cable_model import MATERIALS, CableRobotModel, CableValues
from robocal.files.cable.segment_rows import CableRow
from robocal.files.units import Unit
from robocal.files.yamlio import Path_, path_text

__all__ = ["name_paths", "places_of"]

Place = tuple[Path_, Unit]


def name_paths(rows: Sequence[CableRow]) -> dict[str, str]:
    """Names that do not depend on how the file is laid out (c1.a, c1.b, c1.zero, c1.tension, ..., mass, com, inertia),
    and the key path at which each is said."""
    out: dict[str, str] = {}
    for row in rows:
        for segment in (run.segment for run in row.runs):
            ends = {letter: anchor.at for letter, (_, anchor) in zip("ab", segment.ends, strict=True)}
            ends |= {"pulley": (*segment.pulley_at, "radius"), "rail": (*segment.rail_at, "carriage")}
            out |= {f"{segment.name}.{what}": path_text(at) for what, at in ends.items()}
        places = {"zero": (*row.at, "zero")} | {key: row.material(key)[1] for key in MATERIALS}
        out |= {f"{row.name}.{what}": path_text(at) for what, at in places.items()}
    return out | {"mass": "platform.mass", "com": "platform.centre_of_mass", "inertia": "platform.inertia"}


def places_of(model: CableRobotModel, rows: Sequence[CableRow], values: CableValues) -> dict[str, Place]:
    """Where every parameter stands in the file."""
    out: dict[str, Place] = {}

    def note(name: str, raw: Any, at: Path_, si: str = "m", axes: str = "") -> None:
        path, unit = values.place(raw, at, si)
        if raw is not None:
            out.update({f"{name}{axis}": ((*path, n), unit) for n, axis in enumerate(axes)} or {name: (path, unit)})

    for row in rows:
        for segment in (run.segment for run in row.runs):
            for letter, (_, end) in zip("ab", segment.ends, strict=True):
                note(f"{segment.name}.{letter}", end.raw, end.at, axes="xyz")
            if segment.pulley is not None:
                note(f"{segment.name}.radius", segment.pulley.radius, (*segment.pulley_at, "radius"))
                note(f"{segment.name}.n", segment.pulley.axis, (*segment.pulley_at, "axis"), "1", "xyz")
            if segment.rail is not None:
                note(f"{segment.name}.r", segment.rail.direction, (*segment.rail_at, "direction"), "1", "xyz")
                out[f"{segment.name}.rail"] = values.place(segment.rail.gain, (*segment.rail_at, "gain"), "1")
                note(f"{segment.name}.carriage", segment.rail.carriage, (*segment.rail_at, "carriage"))
        if "cables" in values.document.data:
            out[f"{row.name}.l0"] = values.place(row.own.zero, (*row.at, "zero"), "m")
            out[f"{row.name}.{GAIN}"] = values.place(row.own.gain, (*row.at, GAIN), "1")
    of_cables = ((row.name, row.own, row.at) for row in rows)
    for whose, said, where in (*of_cables, (COMMON, model.every_cable, ("every_cable",))):
        note(f"{whose}.{STRETCH}", said.elasticity, (*where, "elasticity"), "1/N")
        note(f"{whose}.density", said.density, (*where, "density"), "N/m")
        note(f"{whose}.{GAIN}", said.gain, (*where, GAIN), "1")
        note(f"{whose}.{BUILD_UP}", said.build_up, (*where, BUILD_UP), "1/m")
        if whose == COMMON and said.pulley is not None:
            note(f"{whose}.radius", said.pulley.radius, (*where, "pulley", "radius"))
            note(f"{whose}.n", said.pulley.axis, (*where, "pulley", "axis"), "1", "xyz")
    note(f"{PLATFORM}.mass", model.platform.mass, ("platform", "mass"), "kg")
    note(f"{PLATFORM}.c", model.platform.centre_of_mass, ("platform", "centre_of_mass"), axes="xyz")
    return out

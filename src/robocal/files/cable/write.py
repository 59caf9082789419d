"""A cable robot with identified numbers, back into its file: only numbers change, every other byte stays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.cables.geometry import PLATFORM, CableRobot
from robocal.errors import FormatError, ModelError, nearest
from robocal.files.cable.cable_robot import parse_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.show import describe_cable
from robocal.files.text import Source
from robocal.files.units import number, same
from robocal.files.yamlio import Path_, add_stamp, edit, path_text

__all__ = ["render_cable"]

ZERO = ".l0"


def _body(robot: CableRobot) -> dict[str, float]:
    """Mass and centre of mass by the names that they have where load cells tell them."""
    if robot.mass is None:
        return {}
    return {
        f"{PLATFORM}.mass": float(robot.mass),
        **{f"{PLATFORM}.c{s}": float(v) for s, v in zip("xyz", robot.com, strict=True)},
    }


def render_cable(file: CableFile, values: Mapping[str, float]) -> tuple[str, tuple[str, ...]]:
    """The robot with other parameter values (SI, by name) as text, and the names that the file cannot hold. A file of another format
    is written as robot.yaml; one without a list of its cables gets one where zeros are to be told. Raises ModelError for an unknown
    name and for one anchor that two cables share and that is to be at two places."""
    before = {p.name: p.value for p in file.robot.table.rows} | _body(file.robot)
    unknown = [n for n in values if n not in before]
    if unknown:
        raise ModelError("unknown parameter", key=unknown[0], suggestion=nearest(unknown[0], before))
    changed = {n: float(v) for n, v in values.items() if not same(before[n], float(v))}
    if file.places is None:
        after = file.robot.with_values({n: v for n, v in changed.items() if n in file.robot.table})
        body = {**_body(file.robot), **changed}
        if any(n.startswith(f"{PLATFORM}.") for n in changed):
            com = np.array([body[f"{PLATFORM}.c{s}"] for s in "xyz"])
            after = replace(after, mass=body[f"{PLATFORM}.mass"], com=com)
        return describe_cable(after, file.units), ()
    left_out = tuple(n for n in changed if n not in file.places)
    after_values = {n: changed.get(n, v) for n, v in before.items()}
    out: dict[Path_, float | str] = {}
    owner: dict[Path_, str] = {}
    for name, (path, unit) in file.places.items():
        if name not in after_values:
            continue  # another cable's, who shares its anchor
        first = owner.setdefault(path, name)
        if first != name and not same(after_values[first], after_values[name]):
            raise ModelError(
                f"{first} and {name} are one anchor in the file and cannot be at two places",
                file=file.path,
                key=path_text(path),
                expected="a separate anchor for every cable",
            )
        if name in changed:
            out[path] = unit.from_si(changed[name])
    text = edit(file.text, out, file.path)
    if left_out and (listed := _with_zeros(text, file, after_values)) is not None:
        text, left_out = listed, tuple(n for n in left_out if not n.endswith(ZERO))
    origin = file.path.name if file.path else file.robot.name
    return add_stamp(text, origin, len(changed) - len(left_out)), left_out


def _with_zeros(text: str, file: CableFile, values: Mapping[str, float]) -> str | None:
    """The text with a list of its cables, which has room for their zeros; None where it cannot be put at its end (a text between
    braces), or is there."""
    unit = file.units.length
    zeros = [number(unit.from_si(values[f"{cable}{ZERO}"])) for cable in file.robot.cables]
    longer = "\n".join([text.rstrip("\n"), "cables:", *(f"  - {{zero: {zero}}}" for zero in zeros), ""])
    try:
        read = parse_cable(Source(file.path or Path(file.robot.name), longer, "")).robot
    except FormatError:
        return None
    return longer if read.cables == file.robot.cables else None

"""A cable robot as the text of a robot.yaml: written anew, or with identified numbers back into its file, where only numbers change
and every other byte stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import BUILD_UP, COMMON, GAIN, PLATFORM, CableRobot
from robocal.cables.rail import offset
from robocal.errors import FormatError, ModelError, nearest
from robocal.files.cable.cable_model import MATERIALS, CableUnits
from robocal.files.cable.cable_robot import parse_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.text import Source
from robocal.files.units import Unit, number, same
from robocal.files.yamlio import Path_, add_stamp, edit, path_text, quote

__all__ = ["describe_cable", "render_cable", "render_material"]

ZERO = ".l0"
EVERY = "every_cable"


def _body(robot: CableRobot) -> dict[str, float]:
    """Mass and centre of mass by the names that they have where load cells tell them."""
    if robot.mass is None:
        return {}
    com = {f"{PLATFORM}.c{s}": float(v) for s, v in zip("xyz", robot.com, strict=True)}
    return {f"{PLATFORM}.mass": float(robot.mass)} | com


def _drums(robot: CableRobot) -> dict[str, float]:
    """Gains of drums by name, of every cable, whether they are parameters or not."""
    return {f"{c}.{GAIN}": float(g) for c, g in zip(robot.cables, robot.gain, strict=True)}


def render_cable(file: CableFile, values: Mapping[str, float]) -> tuple[str, tuple[str, ...]]:
    """The robot with other values (SI, by name) of its parameters, its platform and the gains of its drums as text, and the names that
    the file cannot hold. A file of another format is written as robot.yaml; one without a list of its cables gets one where zeros or
    gains are to be told. Raises ModelError for an unknown name and for one anchor that two cables share and that is to be at two
    places."""
    before = _drums(file.robot) | {p.name: p.value for p in file.robot.table.rows} | _body(file.robot)
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
        drums = {n: changed.get(n, v) for n, v in _drums(after).items()}
        if set(drums) & set(changed):
            after = after.having(gain=list(drums.values()))
        return describe_cable(after, file.units), ()
    after_values = {n: changed.get(n, v) for n, v in before.items()}
    out: dict[Path_, float | str] = {}
    centre = [f"{PLATFORM}.c{s}" for s in "xyz"]
    if (moved := {*centre} & {*changed}) and not moved & {*file.places}:
        words = ", ".join(number(file.units.length.from_si(after_values[n])) for n in centre)
        out["platform", "centre_of_mass"] = f"[{words}]"
    left_out = tuple(n for n in changed if n not in file.places and not (out and n in centre))
    owner: dict[Path_, str] = {}
    for name, (path, unit) in file.places.items():
        if name not in after_values:
            continue  # another cable's, who shares its anchor
        first = owner.setdefault(path, name)
        if first != name and not same(after_values[first], after_values[name]):
            message = f"{first} and {name} are one anchor in the file and cannot be at two places"
            expected = "a separate anchor for every cable"
            raise ModelError(message, file=file.path, key=path_text(path), expected=expected)
        if name in changed:
            out[path] = unit.from_si(changed[name])
    text = edit(file.text, out, file.path)
    if left_out and (listed := _with_cables(text, file, after_values, left_out)) is not None:
        text, left_out = listed, tuple(n for n in left_out if not n.endswith((ZERO, f".{GAIN}")))
    origin = file.path.name if file.path else file.robot.name
    return add_stamp(text, origin, len(changed) - len(left_out)), left_out


def render_material(file: CableFile, found: Mapping[str, float]) -> str:
    """The robot with other numbers of all its cables, by the keys `density` and `elasticity` (SI), as text: where the file states them,
    of each cable or of all; else under every_cable."""
    robot = file.robot
    if file.places is None:
        known: dict[str, Any] = {k: np.full(len(robot.cables), v) for k, v in found.items()}
        return describe_cable(robot.having(**known), file.units)
    out: dict[Path_, float | str] = {}
    lines, common = [], any(path[0] == EVERY for path, _ in file.places.values()) or f"\n{EVERY}:" in file.text
    for key, value in found.items():
        stated = [
            file.places[n] for n in (*(f"{c}.{key}" for c in robot.cables), f"{COMMON}.{key}") if n in file.places
        ]
        unit = file.units.of(MATERIALS[key][1])
        if not stated and not common:
            lines.append(f"{key}: {number(unit.from_si(value))}")
        for path, own in stated or ([((EVERY, key), unit)] if common else []):
            out[path] = own.from_si(value)
    text = edit(file.text, out, file.path)
    if lines:
        text = f"{text.rstrip()}\n{EVERY}: {{{', '.join(lines)}}}\n"
    return add_stamp(text, file.path.name if file.path else robot.name, len(found))


def _with_cables(text: str, file: CableFile, values: Mapping[str, float], wanted: Sequence[str]) -> str | None:
    """The text with a list of its cables, which has room for their zeros and gains; None where it cannot be put at its end (a text
    between braces), or is there."""
    unit, lines = file.units.length, []
    for cable in file.robot.cables:
        words = [f"zero: {number(unit.from_si(values[f'{cable}{ZERO}']))}"]
        if (name := f"{cable}.{GAIN}") in wanted:
            words.append(f"{GAIN}: {number(values[name])}")
        lines.append(f"  - {{{', '.join(words)}}}")
    longer = "\n".join([text.rstrip("\n"), "cables:", *lines, ""])
    try:
        read = parse_cable(Source(file.path or Path(file.robot.name), longer, "")).robot
    except FormatError:
        return None
    return longer if read.cables == file.robot.cables else None


def describe_cable(robot: CableRobot, units: CableUnits | None = None) -> str:
    """A robot.yaml that reads back as this robot, with the sources of its values and which of them are assumed. Raises ModelError where a
    cable runs along several segments."""
    units = units or CableUnits()
    words = ", ".join(f"{f.name}: {getattr(units, f.name).name}" for f in fields(units))
    lines = [
        "robocal: 1",
        f"name: {quote(robot.name)}",
        "kind: cable",
        f"units: {{{words}}}",
        f"degrees: {robot.degrees}",
    ]
    if robot.planar:
        lines.append(f"plane: {robot.plane}")
    frame = robot.a if robot.rails is None else robot.a - offset(robot.rails)
    for key, letter, points in (("frame_anchors", "a", frame), ("platform_anchors", "b", robot.b)):
        lines.append(f"{key}:")
        for i, (cable, point) in enumerate(zip(robot.cables, points, strict=True), start=1):
            if _owner(robot, cable, letter) == i:
                lines.append(f"  {letter.upper()}{i}: {_shown(robot, f'{cable}.{letter}', point, units.length)}")
    lines += _cables(robot, units)
    com = robot.com if np.any(robot.com) or robot.mass is not None else None
    body = [
        f"{key}: {_shown(robot, name, value, units.of(si))}"
        for key, name, value, si in (
            ("mass", "mass", robot.mass, "kg"),
            ("centre_of_mass", "com", com, "m"),
            ("inertia", "inertia", robot.inertia, "kg m2"),
        )
        if value is not None
    ]
    if body:
        lines.append(f"platform: {{{', '.join(body)}}}")
    if robot.table.free:
        lines.append(f"calibrate: {{free: [{', '.join(quote(n) for n in robot.table.free)}]}}")
    if robot.sources.get(""):
        lines.append(f"source: {quote(robot.sources[''])}")
    return "\n".join(lines) + "\n"


def _cables(robot: CableRobot, units: CableUnits) -> list[str]:
    """One line per cable, and one for what they have in common."""
    common, own = [], []
    for key, (what, si) in MATERIALS.items():
        stated = {GAIN: robot.states_gains, BUILD_UP: robot.states_build_up}
        if not stated.get(key, True) or (numbers := getattr(robot, what)) is None:
            continue
        each = [
            f"{key}: {_shown(robot, f'{c}.{key}', v, units.of(si))}" for c, v in zip(robot.cables, numbers, strict=True)
        ]
        # Numbers that are free by themselves stay apart, however alike they are.
        alone = {robot.row(f"{c}.{key}") for c in robot.cables}.intersection(robot.table.free) - {f"{COMMON}.{key}"}
        if len(set(each)) == 1 and not alone:
            common.append(each[0])
        else:
            own.append(each)
    lines = ["cables:"]
    for i, cable in enumerate(robot.cables):
        words = [
            f"name: {quote(cable)}",
            f"frame: A{_owner(robot, cable, 'a')}",
            f"platform: B{_owner(robot, cable, 'b')}",
        ]
        words.append(f"zero: {_shown(robot, f'{cable}.zero', robot.zeros[i], units.length)}")
        words += [each[i] for each in own]
        if robot.pulleys is not None and robot.pulleys.radius[i] > 0:
            radius = _shown(robot, f"{cable}.pulley", robot.pulleys.radius[i], units.length)
            words.append(f"pulley: {{radius: {radius}, axis: {_numbers(robot.pulleys.axis[i], units.of('1'))}}}")
        if robot.rails is not None and robot.rails[i, 2:].any():
            carriage, gain, *direction = robot.rails[i]
            shown = f"carriage: {_numbers(carriage, units.length)}, gain: {_numbers(gain, units.of('1'))}"
            words.append(f"rail: {{direction: {_numbers(np.array(direction), units.of('1'))}, {shown}}}")
        lines.append(f"  - {{{', '.join(words)}}}")
    return lines + ([f"every_cable: {{{', '.join(common)}}}"] if common else [])


def _owner(robot: CableRobot, cable: str, letter: str) -> int:
    """The number of the cable whose anchor a cable has, from 1."""
    return robot.cables.index(robot.row(f"{cable}.{letter}x").rpartition(".")[0]) + 1


def _numbers(value: Array | float, unit: Unit) -> str:
    if isinstance(value, np.ndarray) and value.ndim:
        return f"[{', '.join(_numbers(v, unit) for v in value)}]"
    return number(unit.from_si(float(value)))


def _shown(robot: CableRobot, name: str, value: Array | float, unit: Unit) -> str:
    """A value in a unit, with its source and whether it is assumed, when either is known."""
    shown, words = _numbers(value, unit), []
    if name in robot.sources:
        words.append(f"source: {quote(robot.sources[name])}")
    if name in robot.assumed:
        words.append("assumed: true")
    return f"{{value: {shown}, {', '.join(words)}}}" if words else shown

"""A cable robot as the text of a robot.yaml."""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.files.cable.values import CableUnits
from robocal.files.units import number
from robocal.files.yamlio import quote

__all__ = ["describe_cable"]


def describe_cable(robot: CableRobot, units: CableUnits | None = None) -> str:
    """A robot.yaml that reads back as this robot, with the sources of its values and which of them are assumed."""
    units = units or CableUnits()
    lines = ["robocal: 1", f"name: {quote(robot.name)}", "kind: cable"]
    words = ", ".join(f"{k}: {getattr(units, k).name}" for k in ("length", "angle", "force", "mass"))
    lines += [f"units: {{{words}}}", f"degrees: {robot.degrees}"]
    if robot.planar:
        lines.append(f"plane: {robot.plane}")
    for key, letter, points in (("frame_anchors", "A", robot.a), ("platform_anchors", "B", robot.b)):
        lines.append(f"{key}:")
        rows = [_numbers(p, units, "m") for p in points]
        for i, (cable, row) in enumerate(zip(robot.cables, rows, strict=True), start=1):
            if _owner(robot, cable, letter.lower()) == i:
                lines.append(f"  {letter}{i}: {_value_with_source(robot, f'{cable}.{letter.lower()}', row)}")
    lines += _cables(robot, units)
    body = []
    if robot.mass is not None:
        body.append(f"mass: {_value_with_source(robot, 'mass', number(units.mass.from_si(robot.mass)))}")
    if np.any(robot.com) or robot.mass is not None:
        body.append(f"centre_of_mass: {_value_with_source(robot, 'com', _numbers(robot.com, units, 'm'))}")
    if robot.inertia is not None:
        rows = [_numbers(row, units, "kg m2") for row in robot.inertia]
        body.append(f"inertia: {_value_with_source(robot, 'inertia', '[' + ', '.join(rows) + ']')}")
    if body:
        lines.append(f"platform: {{{', '.join(body)}}}")
    if robot.table.free:
        lines.append(f"calibrate: {{free: [{', '.join(quote(n) for n in robot.table.free)}]}}")
    if robot.sources.get(""):
        lines.append(f"source: {quote(robot.sources[''])}")
    return "\n".join(lines) + "\n"


def _cables(robot: CableRobot, units: CableUnits) -> list[str]:
    """One line per cable, and one for what they have in common."""
    fields = (
        ("tension", robot.limits, "N"),
        ("elasticity", robot.elasticity, "1/N"),
        ("density", robot.density, "N/m"),
        ("diameter", robot.diameter, "m"),
    )
    common, own = [], []
    for key, array, si in fields:
        if array is None:
            continue
        shown = [
            _value_with_source(robot, f"{c}.{key}", _numbers(v, units, si))
            for c, v in zip(robot.cables, array, strict=True)
        ]
        if len(set(shown)) == 1:
            common.append(f"{key}: {shown[0]}")
        else:
            own.append((key, shown))
    lines = ["cables:"]
    for i, cable in enumerate(robot.cables):
        ends = (
            f"{word}: {letter}{_owner(robot, cable, letter.lower())}"
            for word, letter in (("frame", "A"), ("platform", "B"))
        )
        words = [f"name: {quote(cable)}", *ends]
        words.append(f"zero: {_value_with_source(robot, f'{cable}.zero', _numbers(robot.zeros[i], units, 'm'))}")
        words += [f"{key}: {shown[i]}" for key, shown in own]
        if robot.pulleys is not None and robot.pulleys.radius[i] > 0:
            radius = _value_with_source(robot, f"{cable}.pulley", _numbers(robot.pulleys.radius[i], units, "m"))
            words.append(f"pulley: {{radius: {radius}, axis: {_numbers(robot.pulleys.axis[i], units, '1')}}}")
        lines.append(f"  - {{{', '.join(words)}}}")
    return lines + ([f"every_cable: {{{', '.join(common)}}}"] if common else [])


def _owner(robot: CableRobot, cable: str, letter: str) -> int:
    """The number of the cable whose anchor a cable has, from 1."""
    return robot.cables.index(robot.row(f"{cable}.{letter}x").rpartition(".")[0]) + 1


def _numbers(value: Array, units: CableUnits, si: str) -> str:
    unit = units.of(si)
    if np.ndim(value) == 0:
        return number(unit.from_si(float(value)))
    return "[" + ", ".join(number(unit.from_si(float(v))) for v in value) + "]"


def _value_with_source(robot: CableRobot, name: str, shown: str) -> str:
    """A value with its source and whether it is assumed, when either is known."""
    words = []
    if name in robot.sources:
        words.append(f"source: {quote(robot.sources[name])}")
    if name in robot.assumed:
        words.append("assumed: true")
    return f"{{value: {shown}, {', '.join(words)}}}" if words else shown

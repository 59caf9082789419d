"""Ranges by time of flight from fixed receivers: in seconds or as lengths, one column per receiver or one row each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, FiniteFloat

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import SigmaModel, ValueModel
from robocal.files.kinds.kind import (
    XYZ,
    Around,
    KindFile,
    KindOutput,
    Part,
    QuantityColumns,
    Values,
    agree_unit,
    sigmas,
)
from robocal.files.kinds.places import PlacedModel, each_place, place_frames
from robocal.files.schema import FileModel, Name, refuse
from robocal.files.units import UNITS, Unit, Units, number
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations

__all__ = ["RANGE"]

RANGES = QuantityColumns("range", ("range",), ("s_range",))
SOUND = 343.0
SYMBOLS = ("speed", "delay")


def _symbols(value: Any) -> Any:
    parts = value if isinstance(value, list) else [value]
    if any(p not in SYMBOLS for p in parts):
        refuse("not a number of the medium", found=value, expected="speed, delay, or both in a list")
    return tuple(parts)


class MediumModel(FileModel):
    """What the signal runs through: its speed in m/s, a delay as a length, and which of the two is identified."""

    name: Name = "medium"
    speed: FiniteFloat = SOUND
    delay: FiniteFloat = 0.0
    free: Annotated[Any, BeforeValidator(_symbols)] = ()


class RangeModel(PlacedModel):
    """Ranges from receivers: several columns, each named like its receiver, or one with the place beside it."""

    range: ValueModel = ValueModel()
    medium: MediumModel = MediumModel()


def read_range(model: RangeModel, table: CsvTable, document: YamlDocument) -> Values:
    """Apparent ranges in m (k, number of receivers): a time is multiplied by the nominal speed."""
    if model.medium.speed <= 0:
        document.fail("not a speed", ("medium", "speed"), found=model.medium.speed, expected="m/s, above 0")
    names = ["range"] if model.range.columns is None else model.range.columns
    units = [_unit(model, name, table, document) for name in names]
    value = table.numbers(names) * np.array([u.factor for u in units])
    table.insist(value > 0, names, "a range must be above 0", value / np.array([u.factor for u in units]))
    given = model.range
    if isinstance(given.sigma, SigmaModel):
        # A sigma column may speak of time or of length on its own.
        spread = [_unit(model, c, table, document, units[0]) for c in given.sigma.columns]
        bare = replace(table, units=(None,) * table.width)
        raw = sigmas(given, bare, [UNITS["1"]] * len(names), "1", document, RANGES.key)
        sigma = None if raw is None else raw * np.array([u.factor for u in spread])
    else:
        sigma = sigmas(given, table, units, "m", document, RANGES.key)
    length = next((u for u in units if u.name in UNITS and UNITS[u.name].si == "m"), None)
    return Values(value, sigma, length)


def _unit(
    model: RangeModel, column: str | int, table: CsvTable, document: YamlDocument, fallback: Unit | None = None
) -> Unit:
    """The unit of a column that may hold times or lengths, as a length."""
    header, stated = table.unit(column), model.range.unit
    label = table.label(table.find(column))
    if header is None and stated is None:
        if fallback is not None:
            return fallback
        document.fail("the unit is missing", ("range", "unit"), column=label, expected="us, s, mm, m, ...")
    told = None if stated is None else document.unit(stated, None, ("range", "unit"))
    found = agree_unit(told, header, None, table, label)
    if found.si == "s":
        return Unit(found.name, "m", found.factor * model.medium.speed)
    if found.si != "m":
        expected = "a time or a length"
        document.fail("the unit is of another quantity", ("range", "unit"), found=found.name, expected=expected)
    return found


def parts(model: RangeModel, values: Values, around: Around) -> Sequence[Part]:
    """One part for every receiver; they share the medium."""
    medium = model.medium
    options: dict[str, object] = {
        "medium": medium.name,
        "speed": medium.speed,
        "values": {"speed": medium.speed, "delay": around.units.length.to_si(medium.delay)},
        "free": medium.free,
    }
    values = values.with_options(options)
    if values.value.shape[1] == 1:
        return [p for p, _ in each_place(model, values, XYZ, around)]
    if model.place is not None:
        expected = "a column per receiver and no place, or one column with `place`"
        around.document.fail("several columns, and a place", ("place",), expected=expected)
    table = around.table
    names = [str(table.label(table.find(c))) for c in model.range.columns]
    if not table.names:
        names = [f"receiver{c}" for c in names]
    frames = place_frames(model, XYZ, around, names)
    every, out = np.arange(len(values.value)), []
    for i, name in enumerate(names):
        sigma = None if values.sigma is None else values.sigma[:, [i]]
        one = replace(values, value=values.value[:, [i]], sigma=sigma).with_options({"place": frames[name]})
        out.append(Part(every, one, group=name))
    return out


def write_range(obs: Observations, units: Units) -> KindOutput:
    """One column; the place is in another."""
    values, free = obs.options.get("values", {}), obs.options.get("free", ())
    assert isinstance(values, dict) and isinstance(free, tuple)
    speed = float(values.get("speed", obs.options.get("speed", SOUND)))
    delay = number(units.length.from_si(values.get("delay", 0.0)))
    medium = f"name: {obs.options['medium']}, speed: {number(speed)}, delay: {delay}, free: [{', '.join(free)}]"
    return KindOutput(RANGES.columns(obs, units), (RANGES.line(obs), f"medium: {{{medium}}}"))


RANGE_KEYS = """range: {{columns: [range], unit: {length}, sigma: 0.2}}    # or times: unit: us; or one column per receiver
place: place    # the column that names the receiver of a row
# places: {{r1: {{xyz: [{near}]}}}}    # roughly where they stand; by default unknown
medium: {{name: air, speed: 343, delay: 0, free: [speed]}}    # m/s; what a time was, or is, multiplied by
"""
RANGE = KindFile("range", RangeModel, read_range, write_range, RANGE_KEYS, XYZ, parts, XYZ, lengths="range")

"""Data sets to files: a CSV that describes itself, and a data.yaml beside it where frames, places and targets have to be
said.

What is written here is read back by `dataset.py` to the same data set.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.csvtext import csv_text
from robocal.files.headers import CONFIGURATION, PER_JOINT
from robocal.files.kinds.kind import KindFile, yaml_names
from robocal.files.kinds.places import frame_keys, frame_line
from robocal.files.kinds.registry import READERS
from robocal.files.units import UNITS, Unit, Units, number
from robocal.files.yamlio import quote
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Mechanism
from robocal.measure.reach import names_of

__all__ = ["data_text", "table_text"]

SHOWN = {"temperature": UNITS["degC"]}
TORQUE = UNITS["Nm"]


def table_text(dataset: DataSet, chain: Mechanism, units: Units | None = None, *, digits: bool = True) -> str:
    """The CSV of a data set of one file; without `digits` lengths are rounded to 0.1 um and angles to 0.1 urad."""
    units = units or Units()
    obs, places = _one(dataset)
    c = dataset.configurations
    if c.joints is None:
        raise ModelError("a table needs joint values", found="free poses")
    headers, columns = ["configuration"], [[c.ids[i] for i in obs.configuration]]

    def add_names(header: str, cells: list[str]) -> None:
        headers.append(header)
        columns.append(cells)

    def add(name: str, unit: Unit, values: Array) -> None:
        shown = unit.from_si(values)
        if not digits and unit.si in ("m", "rad"):
            shown = np.round(shown, max(0, round(math.log10(unit.factor / 1e-7))))
        add_names(name if unit.name == "1" else f"{name} [{unit.name}]", [number(v) for v in shown.tolist()])

    for prefix, index in (("", obs.configuration), ("second.", obs.second)):
        for i, joint in enumerate(chain.joints if index is not None else ()):
            unit = units.length if joint.type == "prismatic" else units.angle
            add(f"{prefix}{joint.name}", unit, c.joints[index, i])
    if obs.second is not None:
        add_names("second", [c.ids[i] for i in obs.second])
    if len(places) > 1:
        add_names("place", [places[i].name for i in obs.extra["place of row"].astype(int)])
    for name, unit, values in _kind(obs).write(_bare(obs), units).columns:
        add(name, unit, values)
    for name in _writable_columns(c):
        if np.isfinite(c.columns[name][obs.configuration]).all():
            add(name, _unit_of(name), c.columns[name][obs.configuration])
    if c.groups is not None:
        add_names("group", [c.groups[i] for i in obs.configuration])
    if obs.target is not None and obs.targets:
        add_names("target", [obs.targets[t].name for t in obs.target])
    return csv_text(headers, zip(*columns, strict=True))


def data_text(dataset: DataSet, chain: Mechanism, file: str, units: Units | None = None) -> str:
    """The data.yaml for a CSV that `table_text` made, with frames, places and targets."""
    units = units or Units()
    obs, places = _one(dataset)
    lines = ["robocal: 1", f"kind: {obs.kind}", f"file: {quote(file)}"]
    lines.append(f"units: {{length: {units.length.name}, angle: {units.angle.name}}}")
    lines.append(f"joints: {{columns: {yaml_names(names_of(chain))}}}")
    if obs.second is not None:
        lines.append(f"second: {{columns: {yaml_names([f'second.{n}' for n in names_of(chain)])}, id: second}}")
    if obs.group and obs.frame is None and not places:
        lines.append(f"group: {quote(obs.group)}")
    lines += _kind(obs).write(_bare(obs), units).lines
    if printed := obs.options.get("print"):
        sigma = obs.options.get("print sigma")
        share = f"sigma: {number(sigma)}, " if isinstance(sigma, float) else ""
        lines.append(f"scale: {{{share}free: true, name: {quote(str(printed))}}}")
    elif obs.scale is not None:
        lines.append(f"scale: {f'{{sigma: {number(obs.scale)}}}' if obs.scale else 'known'}")
    if len(places) == 1:
        lines.append(f"place: {{name: {quote(places[0].name)}, {frame_keys(places[0], units)}}}")
    elif places:
        lines += ["places:", *(f"  {frame_line(p, units)}" for p in places), "place: place"]
    lines += _between(dataset.observations[1:], units)
    if obs.frame is not None:
        name, frame = quote(obs.frame.name), frame_keys(obs.frame, units)
        lines.append(f"frame: {{name: {name}, {frame}, mount: {obs.frame.mount}}}")
    if obs.targets:
        lines += ["targets:", *(f"  {frame_line(t, units, mount=True)}" for t in obs.targets), "target: target"]
    known = _writable_columns(dataset.configurations)
    recorded = [f"{n}: {n}" for n in known if np.isfinite(dataset.configurations.columns[n][obs.configuration]).all()]
    recorded += ["group: group"] if dataset.configurations.groups is not None else []
    lines.append(f"configuration: {{{', '.join(['id: configuration', *recorded])}}}")
    return "\n".join(lines) + "\n"


def _unit_of(name: str) -> Unit:
    if name.partition(".")[0] == "torque":
        return TORQUE
    return SHOWN.get(name, UNITS.get(CONFIGURATION.get(name, "1"), UNITS["1"]))


def _kind(obs: Observations) -> KindFile:
    if obs.kind not in READERS:
        raise ModelError("this kind cannot be written to a table", found=obs.kind, expected=", ".join(READERS))
    return READERS[obs.kind]


def _bare(obs: Observations) -> Observations:
    """Without what this file added."""
    return replace(obs, extra={k: v for k, v in obs.extra.items() if k != "place of row"})


def _one(dataset: DataSet) -> tuple[Observations, tuple[Frame, ...]]:
    """All observations of the file's kind as one, row by row, and the places that they are of. Raises ModelError when
    they are of several instruments."""
    first = dataset.observations[0]
    same = [o for o in dataset.observations if o.kind == first.kind]
    rest = [o for o in dataset.observations if o.kind != first.kind]
    places = [p for o in same if isinstance(p := o.options.get("place"), Frame)]
    one_place = len(same) == 1 or len(places) == len(same)
    if not one_place or any("ends" not in o.options for o in rest):
        raise ModelError("one file holds the data of one instrument", found=len(dataset.observations), expected="1")
    if not places:
        return first, ()
    which = np.concatenate([np.full(len(o), i, dtype=float) for i, o in enumerate(same)])
    arrays = {key: [getattr(o, key) for o in same] for key in ("configuration", "value", "sigma", "target")}
    joined: dict[str, Any] = {
        k: None if any(v is None for v in parts) else np.concatenate(parts) for k, parts in arrays.items()
    }
    extra = {k: np.concatenate([o.extra[k] for o in same]) for k in first.extra} | {"place of row": which}
    return replace(first, extra=extra, rows=None, used=None, **joined), tuple(places)


def _between(rest: Sequence[Observations], units: Units) -> list[str]:
    """The known distances between two places."""
    out, unit = [], units.length
    for obs in rest:
        ends = obs.options.get("ends")
        if isinstance(ends, tuple):
            sigma = "" if obs.sigma is None else f", sigma: {number(unit.from_si(float(obs.sigma[0, 0])))}"
            names, distance = yaml_names([e.name for e in ends]), number(unit.from_si(float(obs.value[0, 0])))
            out.append(f"  - {{places: {names}, distance: {distance}, unit: {unit.name}{sigma}}}")
    return ["between:", *out] if out else []


def _writable_columns(configurations: Configurations) -> tuple[str, ...]:
    """The columns of configurations that a table can hold."""
    return tuple(n for n in configurations.columns if n in CONFIGURATION or n.partition(".")[0] in PER_JOINT)

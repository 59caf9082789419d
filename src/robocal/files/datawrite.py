"""Data sets to files: a CSV that describes itself, and a data.yaml beside it where frames and targets have to be said.

What is written here is read back by `dataset.py` to the same data set.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.errors import ModelError
from robocal.files.headers import CONFIGURATION
from robocal.files.rows import quoted
from robocal.files.text import write_files
from robocal.files.units import UNITS, Unit, Units, number
from robocal.measure.data import DataSet, Frame, Observations
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["data_text", "table_text", "write_dataset"]

Array = NDArray[np.float64]
# The columns of each kind that can be written, and those of its standard deviation.
COLUMNS = {
    "position": (("x", "y", "z"), ("sx", "sy", "sz")),
    "pose": (FRAME_SYMBOLS, ("sx", "sy", "sz", "srx", "sry", "srz")),
}
SHOWN = {"temperature": UNITS["degC"]}


def write_dataset(
    dataset: DataSet, chain: Chain, path: str | os.PathLike[str], units: Units | None = None
) -> tuple[Path, ...]:
    """Writes the data of one instrument: a CSV, or for a path that ends in .yaml a data file with its CSV.

    Raises FileError, or ModelError for what a table cannot hold.
    """
    place, units = Path(path), units or Units()
    if len(dataset.observations) != 1:
        raise ModelError("one file holds the data of one instrument", found=len(dataset.observations), expected="1")
    table = table_text(dataset, chain, units)
    if place.suffix.lower() not in (".yaml", ".yml"):
        return write_files(place.parent, {place.name: table})
    name = f"{place.stem}.csv"
    return write_files(place.parent, {name: table, place.name: data_text(dataset.observations[0], chain, name, units)})


def table_text(dataset: DataSet, chain: Chain, units: Units | None = None) -> str:
    """The CSV of a data set with one set of observations."""
    units = units or Units()
    obs, c = dataset.observations[0], dataset.configurations
    if obs.kind not in COLUMNS:
        raise ModelError("this kind cannot be written to a table", found=obs.kind, expected=", ".join(COLUMNS))
    if c.joints is None:
        raise ModelError("a table needs joint values", found="free poses")
    headers, columns = ["configuration"], [[c.ids[i] for i in obs.configuration]]

    def add(name: str, unit: Unit, values: Array) -> None:
        headers.append(f"{name} [{unit.name}]")
        columns.append([number(v) for v in unit.from_si(values).tolist()])

    for i, joint in enumerate(chain.joints):
        add(joint.name, units.length if joint.type == "prismatic" else units.angle, c.joints[obs.configuration, i])
    names, sigmas = COLUMNS[obs.kind]
    for i, name in enumerate(names):
        add(name, units.angle if i >= 3 else units.length, obs.value[:, i])
    if obs.sigma is not None:
        for i, name in enumerate(sigmas):
            add(name, units.angle if i >= 3 else units.length, obs.sigma[:, i])
    for name, si in CONFIGURATION.items():
        if name in c.columns:
            add(name, SHOWN.get(name, UNITS.get(si, UNITS["1"])), c.columns[name][obs.configuration])
    if obs.target is not None and obs.targets:
        headers.append("target")
        columns.append([obs.targets[t].name for t in obs.target])
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(headers)
    writer.writerows(zip(*columns, strict=True))
    return stream.getvalue()


def data_text(obs: Observations, chain: Chain, file: str, units: Units | None = None) -> str:
    """The data.yaml for a CSV that `table_text` made, with the instrument's frame and the targets."""
    units = units or Units()
    names, sigmas = COLUMNS[obs.kind]
    lines = [
        "robocal: 1",
        f"kind: {obs.kind}",
        f"file: {quoted(file)}",
        f"units: {{length: {units.length.name}, angle: {units.angle.name}}}",
    ]
    lines.append(f"joints: {{columns: {_list(chain.joint_names)}}}")
    for word, part in (("position", slice(0, 3)), ("orientation", slice(3, 6))):
        if names[part]:
            form = ", form: rotation_vector" if word == "orientation" else ""
            sigma = f", sigma: {{columns: {_list(sigmas[part])}}}" if obs.sigma is not None else ""
            lines.append(f"{word}: {{columns: {_list(names[part])}{form}{sigma}}}")
    if obs.frame is not None:
        lines.append(f"frame: {{name: {quoted(obs.frame.name)}, {_frame(obs.frame, units)}}}")
    if obs.targets:
        lines += ["targets:", *(f"  {quoted(t.name)}: {{{_frame(t, units)}}}" for t in obs.targets), "target: target"]
    lines.append("configuration: {id: configuration}")
    return "\n".join(lines) + "\n"


def _frame(frame: Frame, units: Units) -> str:
    words = []
    for word, unit, part in (("xyz", units.length, frame.value[:3]), ("rotation_vector", units.angle, frame.value[3:])):
        if any(part):
            words.append(f"{word}: [{', '.join(number(unit.from_si(v)) for v in part)}]")
    free = [s for s, f in zip(FRAME_SYMBOLS, frame.free, strict=True) if f]
    words.append(f"free: {_list(free) if 0 < len(free) < 6 else str(bool(free)).lower()}")
    return ", ".join([*words, f"mount: {frame.mount}"])


def _list(names: Sequence[str]) -> str:
    return f"[{', '.join(quoted(n) for n in names)}]"

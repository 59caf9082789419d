"""A small arm with a prismatic joint, and data files for it."""

from __future__ import annotations

import math
from pathlib import Path

from robocal.arms.conventions import chain
from robocal.files.dataset import Reading, read_dataset
from robocal.files.datawrite import data_text, table_text
from robocal.files.units import Units

DEG = math.pi / 180
ARM = chain(
    "small",
    "dh",
    [
        {"d": 0.5, "limits": (-90 * DEG, 90 * DEG)},
        {"a": 0.4, "alpha": 90 * DEG},
        {"type": "prismatic", "limits": (0.0, 0.2)},
    ],
)
TABLE = """\
# measured by hand
name,q1 [deg],q2 [deg],q3 [mm],x,y,z,sx,sy,sz,T [degC]
p1,0,10,100,400,0,700,0.01,0.02,0.03,20
p2,30,20,50,300,-20.5,650,0.01,0.02,0.03,20.5

p3,60,-30,0,200,-150,600,0.01,0.02,0.03,21
p4,80,-10,20,100,-250,500,0.01,0.02,0.03,22
"""
DATA = """\
robocal: 1
kind: position
file: table.csv
joints: {columns: [q1, q2, q3]}
position: {columns: [x, y, z], unit: mm, sigma: {columns: [sx, sy, sz]}}
frame: {name: tracker, free: true}
configuration: {id: name, temperature: T}
"""


def put(folder: Path, data: str = DATA, table: str | bytes = TABLE) -> Path:
    """Writes both files into a folder; returns the data file."""
    (folder / "table.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    (folder / "data.yaml").write_text(data, encoding="utf-8")
    return folder / "data.yaml"


def read(folder: Path, data: str = DATA, table: str | bytes = TABLE, **options: object) -> Reading:
    """Writes both files and reads the data set."""
    return read_dataset(put(folder, data, table), ARM, **options)  # type: ignore[arg-type]


def write_dataset(data, arm, path, units=None):
    """The table of a data set, and for a path that ends in .yaml the data file beside it."""
    place, units = Path(path), units or Units()
    table = place.with_suffix(".csv")
    text = table_text(data, arm, units)
    table.write_text(text, encoding="utf-8")
    if place != table:
        place.write_text(data_text(data, arm, table.name, units), encoding="utf-8")

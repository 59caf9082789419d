"""Lists of poses: joint values without measurements. Read from any CSV with joint columns or from a data file, written
as a joint program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.files.csvtable import csv_text, read_csv
from robocal.files.dataset import read_dataset
from robocal.files.headers import IDS, joint_columns, row_names, vocabulary
from robocal.files.kinds.base import column_units
from robocal.files.text import InputFile
from robocal.files.units import Units, number
from robocal.files.unread import left_over, unread_remarks
from robocal.files.yamlio import Document

__all__ = ["poses_text", "read_poses"]


def read_poses(path: str | os.PathLike[str], chain: Chain) -> tuple[tuple[str, ...], Array, tuple[InputFile, ...]]:
    """Names and joint values (m, n) in rad or m of a list of poses, and the files read. Raises FileError or FormatError
    naming file, row and column."""
    place = path if isinstance(path, Path) else Path(path)
    if place.suffix.lower() in (".yaml", ".yml"):
        made = read_dataset(place, chain)
        joints = made.dataset.configurations.joints
        return made.dataset.configurations.ids, np.asarray(joints), made.files
    table = read_csv(place)
    columns = joint_columns(table, chain)
    si = ["m" if j.type == "prismatic" else "rad" for j in chain.joints]
    units = column_units(table, columns, None, si, Document(place, "", "", {}), ("joints",))
    q = table.numbers(columns) * np.array([u.factor for u in units])
    names = row_names(table, "poses")
    said = unread_remarks([left_over(table, IDS, (*vocabulary(chain), "rank"))])
    return names, q, (InputFile(table.path, table.sha256, said),)


def poses_text(chain: Chain, names: Sequence[str], q: Array, rank: Sequence[int], units: Units | None = None) -> str:
    """A joint program: one pose per row in the order of travel, with its rank (1: the most useful; the first k of them
    are a plan of k poses)."""
    units = units or Units()
    shown = [units.length if j.type == "prismatic" else units.angle for j in chain.joints]
    header = ["id", *(f"{j.name} [{u.name}]" for j, u in zip(chain.joints, shown, strict=True)), "rank"]
    rows = []
    for name, row, place in zip(names, q, rank, strict=True):
        # Finer than any controller, in degrees or in radians.
        cells = (number(round(float(u.from_si(v)), 9)) for u, v in zip(shown, row, strict=True))
        rows.append([name, *cells, str(place)])
    return csv_text(header, rows)

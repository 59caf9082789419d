"""Lists of poses: joint values without measurements. Read from any CSV with joint columns or from a data file, written
as a joint program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.files.csvtable import read_csv
from robocal.files.dataset import read_dataset
from robocal.files.headers import IDS, joint_columns, row_names, vocabulary
from robocal.files.kinds.kind import column_units
from robocal.files.listing import listing_text
from robocal.files.text import InputFile
from robocal.files.units import Units
from robocal.files.unread import left_over, unread_remarks
from robocal.files.yamlio import YamlDocument
from robocal.quantities import Column, Listing

__all__ = ["joint_program", "poses_text", "read_poses"]


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
    units = column_units(table, columns, None, si, YamlDocument(place, "", "", {}), ("joints",))
    q = table.numbers(columns) * np.array([u.factor for u in units])
    names = row_names(table, "poses")
    said = unread_remarks([left_over(table, IDS, (*vocabulary(chain), "rank"))])
    return names, q, (InputFile(table.path, table.sha256, said),)


def joint_program(chain: Chain, names: Sequence[str], q: Array, rank: Sequence[int]) -> Listing:
    """A joint program in SI: one pose per row in the order of travel, with its rank (1: the most useful; the first k of them are a plan of
    k poses)."""
    si = ["m" if j.type == "prismatic" else "rad" for j in chain.joints]
    # Finer than any controller, in degrees or in radians.
    joints = (Column(j.name, u, v, decimals=9) for j, u, v in zip(chain.joints, si, np.asarray(q).T, strict=True))
    return Listing((Column("id", "", tuple(names)), *joints, Column("rank", "", tuple(rank))))


def poses_text(chain: Chain, names: Sequence[str], q: Array, rank: Sequence[int], units: Units | None = None) -> str:
    """The same as CSV."""
    return listing_text(joint_program(chain, names, q, rank), units or Units())

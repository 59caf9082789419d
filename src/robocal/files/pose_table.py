"""Lists of poses: joint values without measurements. Read from any CSV with joint columns or from a data file, written
as a joint program; and the part of joint space in which a robot works: ranges of joints in a YAML of its own, or any list of poses.

robocal: 1
kind: region
units: {length: mm, angle: deg}
joints: {j1: [-90, 90], j2: [0, 60]}    # the other joints keep their limits, or the range in which they were measured
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from robocal._record import record
from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.errors import FormatError, one_of
from robocal.files.csvtable import read_csv
from robocal.files.dataset import read_dataset
from robocal.files.headers import IDS, joint_columns, row_names, vocabulary
from robocal.files.kinds.kind import column_units
from robocal.files.robot import read_units
from robocal.files.schema import FileModel, UnitsModel, Version, refuse, validate
from robocal.files.text import InputFile
from robocal.files.unread import left_over, unread_remarks
from robocal.files.yamlio import YamlDocument, load
from robocal.quantities import Column, Listing

__all__ = ["RegionFile", "joint_program", "read_poses", "read_region"]


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
    said = table.remarks + unread_remarks([left_over(table, IDS, (*vocabulary(chain), "rank"))])
    return names, q, (InputFile(table.path, table.sha256, said),)


def joint_program(chain: Chain, names: Sequence[str], q: Array, rank: Sequence[int]) -> Listing:
    """A joint program in SI: one pose per row in the order of travel, with its rank (1: the most useful; the first k of them are a plan of
    k poses)."""
    si = ["m" if j.type == "prismatic" else "rad" for j in chain.joints]
    # Finer than any controller, in degrees or in radians.
    joints = (Column(j.name, u, v, decimals=9) for j, u, v in zip(chain.joints, si, np.asarray(q).T, strict=True))
    return Listing((Column("id", "", tuple(names)), *joints, Column("rank", "", tuple(rank))))


def _pair(value: Any) -> Any:
    good = isinstance(value, list) and len(value) == 2
    if not good or any(isinstance(v, bool) or not isinstance(v, int | float) or not np.isfinite(v) for v in value):
        refuse("not a range", found=value, expected="[lower, upper]")
    if value[0] > value[1]:
        refuse("a range in the wrong order", found=value, expected="[lower, upper]")
    return value


class RegionModel(FileModel):
    """A region as ranges of joints."""

    robocal: Version
    kind: Literal["region"]
    units: UnitsModel
    joints: dict[str, Annotated[Any, BeforeValidator(_pair)]] = Field(min_length=1)


@record
class RegionFile:
    """Ranges (n, 2) of the joints, NaN where the file says nothing, or configurations (m, n); rad and m."""

    ranges: Array | None
    joints: Array | None
    files: tuple[InputFile, ...]


def read_region(path: str | os.PathLike[str], chain: Chain) -> RegionFile:
    """Reads ranges of joints, a list of poses (CSV with units in its headers) or the configurations of a data file. Raises
    FileError or FormatError."""
    place = Path(path)
    if place.suffix.lower() in (".yaml", ".yml"):
        document = load(place)
        if document.data.get("kind") == "region":
            model = validate(RegionModel, document)
            units = read_units(model.units, document)
            ranges = np.full((len(chain.joints), 2), np.nan)
            for name, pair in model.joints.items():
                known = one_of(name, chain.joint_names)
                document.insist(name in chain.joint_names, "no joint has this name", ("joints", name), **known)
                i = chain.joint_names.index(name)
                unit = units.length if chain.joints[i].type == "prismatic" else units.angle
                ranges[i] = [unit.to_si(float(v)) for v in pair]
            return RegionFile(ranges, None, (InputFile(place, document.sha256),))
    _, joints, files = read_poses(place, chain)
    joints = joints[np.isfinite(joints).all(axis=1)] if joints.ndim == 2 else joints
    if joints.ndim != 2 or not len(joints):
        raise FormatError("there are no joint values", file=place, expected="a list of poses, or ranges of the joints")
    return RegionFile(None, joints, files)

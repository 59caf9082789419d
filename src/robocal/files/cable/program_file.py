"""Lists of reachable poses and programs for a controller: poses with lengths and tensions, one per row.

id, x [m], ..., rz [deg], c1 [m], ..., c1.tension [N], ..., lambda, limit, contact, rank     poses.csv
id, x [m], ..., rz [deg], c1 [m], ..., c1.tension [N], ..., pose, way, share                 program.csv

Lengths are what the sensors show. Both are read back by `read_platform_poses` and `read_cable_lengths`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.geometry import CableRobot
from robocal.cables.pose_list import LIMITS, MotionProgram, PoseList
from robocal.files.cable.pose_lists import length_columns, pose_columns, tension_columns
from robocal.quantities import Column, Listing

__all__ = ["pose_listing", "program_listing"]

DIGITS = 9  # of a length in m: a nanometre


def pose_listing(
    robot: CableRobot, names: Sequence[str], poses: PoseList, made: MotionProgram, rank: Mapping[int, int] | None = None
) -> Listing:
    """The poses; `rank` says which are chosen, 1 the most telling."""
    who = poses.contacts.names(robot.cables)
    met = [LIMITS[i].startswith("cable") for i in poses.limit]
    return Listing((
        *pose_columns(names, made.pose[:, -1]),
        *_cables(robot, made.lengths[:, -1], made.tension[:, -1]),
        Column("lambda", "", poses.fraction, digits=9),
        Column("limit", "", [LIMITS[i] for i in poses.limit]),
        Column("contact", "", [w if m else None for w, m in zip(who, met, strict=True)]),
        *([] if rank is None else [Column("rank", "", [rank.get(i) for i in range(len(names))])]),
    ))  # fmt: skip


def program_listing(robot: CableRobot, names: Sequence[str], made: MotionProgram, order: Ints) -> Listing:
    """All waypoints in the order in which a controller takes them: from X_0 out to a pose, back, to the next.

    `id` counts them from 0; `way` is start, out, pose or back; `share` is how far from X_0 (0) to the pose (1).
    """
    last = len(made.shares) - 1
    one = [*range(1, last + 1), *range(last - 1, -1, -1)]
    ways = np.repeat(np.concatenate([order[:1], order]), [1, *[len(one)] * len(order)])
    points = np.concatenate([[0], np.tile(one, len(order))])
    words = ["out"] * (last - 1) + ["pose"] + ["back"] * last
    return Listing((
        *pose_columns([str(i) for i in range(len(ways))], made.pose[ways, points]),
        *_cables(robot, made.lengths[ways, points], made.tension[ways, points]),
        Column("pose", "", ["", *(names[i] for i in ways[1:])]),
        Column("way", "", ["start", *words * len(order)]),
        Column("share", "", np.asarray(made.shares)[points], digits=6),
    ))  # fmt: skip


def _cables(robot: CableRobot, lengths: Array, tension: Array) -> tuple[Column, ...]:
    return (*length_columns(robot, lengths, decimals=DIGITS), *tension_columns(robot, tension))

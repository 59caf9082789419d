"""Lists of reachable poses and programs for a controller as CSV: poses with lengths and tensions, one per row.

id, x [m], ..., rz [deg], c1 [m], ..., c1.tension [N], ..., lambda, limit, contact, rank     poses.csv
id, x [m], ..., rz [deg], c1 [m], ..., c1.tension [N], ..., pose, way, share                 program.csv

Lengths are what the sensors show. Both are read back by `read_platform_poses` and `read_cable_lengths`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.geometry import CableRobot
from robocal.cables.poses import LIMITS, PoseList
from robocal.cables.program import Program
from robocal.files.cable.lists import platform_text, tension_columns
from robocal.files.cable.values import CableUnits
from robocal.files.units import number

__all__ = ["list_text", "program_text"]

DIGITS = 9  # of a length in m: a nanometre


def list_text(
    robot: CableRobot,
    names: Sequence[str],
    listing: PoseList,
    made: Program,
    units: CableUnits,
    *,
    rank: Mapping[int, int] | None = None,
    only: Ints | None = None,
) -> str:
    """The CSV of the poses, or of `only` some by number; `rank` says which are chosen, 1 the most telling."""
    rows = np.arange(len(names)) if only is None else only
    who = listing.contacts.names(robot.cables)
    blocked = [LIMITS[i].startswith("cable") for i in listing.limit]
    more = _cables(robot, made.lengths[rows, -1], made.tension[rows, -1], units)
    more["lambda"] = [f"{listing.fraction[i]:.9g}" for i in rows]
    more["limit"] = [LIMITS[listing.limit[i]] for i in rows]
    more["contact"] = [who[i] if blocked[i] else "" for i in rows]
    if rank is not None:
        more["rank"] = [str(rank.get(int(i), "")) for i in rows]
    return platform_text([names[i] for i in rows], made.pose[rows, -1], units, more)


def program_text(robot: CableRobot, names: Sequence[str], made: Program, order: Ints, units: CableUnits) -> str:
    """The CSV of all waypoints in the order in which a controller takes them: from X_0 out to a pose, back, to the next.

    `id` counts them from 0; `way` is start, out, pose or back; `share` is how far from X_0 (0) to the pose (1).
    """
    last = len(made.shares) - 1
    one = [*range(1, last + 1), *range(last - 1, -1, -1)]
    ways = np.repeat(np.concatenate([order[:1], order]), [1, *[len(one)] * len(order)])
    points = np.concatenate([[0], np.tile(one, len(order))])
    more = _cables(robot, made.lengths[ways, points], made.tension[ways, points], units)
    more["pose"] = ["", *(names[i] for i in ways[1:])]
    words = ["out"] * (last - 1) + ["pose"] + ["back"] * last
    more["way"] = ["start", *words * len(order)]
    more["share"] = [f"{made.shares[k]:.6g}" for k in points]
    return platform_text([str(i) for i in range(len(ways))], made.pose[ways, points], units, more)


def _cables(robot: CableRobot, lengths: Array, tension: Array, units: CableUnits) -> dict[str, list[str]]:
    unit = units.length
    shown = [[number(unit.from_si(round(float(v), DIGITS))) for v in column] for column in lengths.T]
    columns = {f"{cable} [{unit.name}]": column for cable, column in zip(robot.cables, shown, strict=True)}
    return columns | tension_columns(robot, tension, units)

"""Where frames are, as people copy them: positions, quaternions, roll, pitch and yaw, in both directions, with sigma."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from robocal.report.sections import Block, Detail, Section, Table, figure, quiet, table

__all__ = ["frames", "place_of"]

MOST = 6  # frames on a terminal


def frames(result: Any) -> Section | None:
    """The frames of data files that were fitted; a terminal shows them where they are what was looked for, or the robot carries one of
    the instruments."""
    found = result.frames
    if not found:
        return None
    poses = [p for f in found for p in (f.pose, f.inverse)]
    wanted = (result.verdict.status == "located" or any(f.aboard for f in found)) and len(found) <= MOST
    words = "`a in b` is T_b_a: it takes coordinates of a to those of b. Roll, pitch, yaw: Rz(yaw) Ry(pitch) Rx(roll)."
    blocks: tuple[Block, ...] = (_places(poses), _turns(poses), *quiet(words))
    heading = "Where the frames are"
    one_way = [f.pose for f in found]
    brief = (_places(one_way), _turns(one_way, quaternion=False)) if wanted else ()
    shown = blocks if wanted else (Detail(lambda: blocks),)
    return Section.of(heading if wanted else "", *shown, title=heading, key="frames", brief=brief, folded=not wanted)


def place_of(pose: Any) -> str:
    """Where a frame is and how it is turned, in one line."""
    xyz = ", ".join(_number(v, s) for v, s in zip(pose.position.xyz, pose.position.sigma, strict=True))
    sigma = ", ".join(figure(s, 2) for s in pose.position.sigma)
    sigmas = pose.turn.sigma or [None] * 3
    turns = ", ".join(_number(v, s) for v, s in zip(pose.turn.rpy, sigmas, strict=True))
    place = f"({xyz}) {pose.position.unit}, σ ({sigma})"
    return f"{pose.child} in {pose.parent} at {place}, roll, pitch, yaw ({turns}) {pose.turn.unit}"


def _places(poses: Sequence[Any]) -> Table:
    unit = poses[0].position.unit
    rows = []
    for p in poses:
        xyz = [_number(v, s) for v, s in zip(p.position.xyz, p.position.sigma, strict=True)]
        rows.append((f"{p.child} in {p.parent}", *xyz, *(figure(s, 2) for s in p.position.sigma)))
    return table(f"position [{unit}]", "x", "y", "z", "σx", "σy", "σz", right=range(1, 7), rows=rows)


def _turns(poses: Sequence[Any], quaternion: bool = True) -> Table:
    unit = poses[0].turn.unit
    rows = []
    for p in poses:
        sigma = p.turn.sigma or [None] * 3
        q = [f"{v:.6f}" for v in p.quaternion_xyzw]
        rpy = [_number(v, s) for v, s in zip(p.turn.rpy, sigma, strict=True)]
        worst = None if p.turn.sigma is None else max(p.turn.sigma)
        rows.append((f"{p.child} in {p.parent}", *q, *rpy, figure(worst, 2)))
    names = ("qx", "qy", "qz", "qw", "roll", "pitch", "yaw", "largest σ")
    made = table(f"orientation [{unit}]", *names, right=range(1, 9), rows=rows)
    return made if quaternion else made.without(range(1, 5))


def _number(value: float, sigma: float | None) -> str:
    """A number with two digits of its sigma."""
    if not sigma or not math.isfinite(sigma):
        return figure(value, 6)
    return f"{value:.{min(max(1 - math.floor(math.log10(sigma)), 0), 9)}f}"

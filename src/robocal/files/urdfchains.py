"""The other chains of a URDF that may have been meant, from other base links, to other tips."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from robocal.arms.chain import Chain
from robocal.errors import FormatError
from robocal.files.robot import Robot
from robocal.files.text import Source
from robocal.files.urdf import read_urdf
from robocal.files.urdftree import MOVING, Node, UrdfJoint, joints_of, links_of
from robocal.measure.data import DataSet

__all__ = ["Reread", "option", "other_chains"]

MOST = 40  # chains of one file that are looked at


def other_chains(robot: Robot, *, base_free: bool = True, tip_free: bool = True) -> Iterator[Robot]:
    """Other chains of the robot's URDF, those nearest to the one that was chosen first.

    Links that joints without motion connect are one place where the frame at that end is free (`base_free`, `tip_free`): of
    such chains one is told, from the chosen link where it is among them.
    """
    if robot.format != "urdf" or robot.path is None:
        return
    source = Source(robot.path, robot.text.lstrip("\ufeff"), robot.sha256)
    tree = Node.parse(source.text, source.path)
    into = {j.child: j for j in joints_of(tree, links_of(tree))}
    seen = {_key(_way(robot.root, robot.tip, into), robot.root, robot.tip, base_free, tip_free)}
    ways = [(base, tip, way) for tip in into for base, way in _above(tip, into)]
    ways.sort(key=lambda w: (w[0] != robot.root, w[1] != robot.tip, -len(w[2])))
    made = 0
    for base, tip, way in ways:
        key = _key(way, base, tip, base_free, tip_free)
        if key in seen or not key[0] or made == MOST:
            continue
        seen.add(key)
        try:
            arm = read_urdf(source, base=base, tip=tip)
        except FormatError:  # a joint that no chain can follow
            continue
        made += 1
        yield replace(robot, chain=arm.chain, root=base, tip=tip)


def _above(tip: str, into: dict[str, UrdfJoint]) -> Iterator[tuple[str, tuple[UrdfJoint, ...]]]:
    """Every link above a tip, with the joints between, the base's first."""
    way: tuple[UrdfJoint, ...] = ()
    at = tip
    while at in into:
        way = (into[at], *way)
        at = into[at].parent
        yield at, way


def _way(base: str, tip: str, into: dict[str, UrdfJoint]) -> tuple[UrdfJoint, ...]:
    return next((way for link, way in _above(tip, into) if link == base), ())


def _key(
    way: tuple[UrdfJoint, ...], base: str, tip: str, base_free: bool, tip_free: bool
) -> tuple[tuple[str, ...], str, str]:
    """What tells chains apart: the joints that move and, where the frame there is not free, the end."""
    moving = tuple(j.name for j in way if j.type in MOVING)
    return moving, "" if base_free else base, "" if tip_free else tip


Reread = Callable[[Chain], DataSet]


def option(robot: Robot, other: Robot) -> str:
    """What to give on the command line for another chain."""
    return f"--tip {other.tip}" if other.root == robot.root else f"--base {other.root} --tip {other.tip}"

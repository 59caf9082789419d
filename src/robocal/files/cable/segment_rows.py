"""What cables run along, as a file says it: from a frame anchor to a platform anchor, or along several segments of the robot, a whole
number of times each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.rail import RAIL
from robocal.cables.reeving import Reeving
from robocal.errors import one_of
from robocal.files.cable.cable_model import (
    CableModel,
    CableRobotModel,
    CableSegmentModel,
    CableValues,
    CommonModel,
    PulleyModel,
    RailModel,
)
from robocal.files.yamlio import Path_, YamlDocument

__all__ = [
    "Anchor",
    "Anchors",
    "SegmentRow",
    "SegmentUse",
    "named_segments",
    "read_rail",
    "reeving_of",
    "runs_of",
    "shared_ends",
]

SIDES = ("frame", "platform")


@record
class Anchor:
    """An anchor: its name, its coordinates in m, what the file says of it, and where."""

    name: str
    point: Array
    raw: Any
    at: Path_


Anchors = Mapping[str, Anchor]


@record
class SegmentRow:
    """One segment: under which name its numbers go, its two ends with the side that each is on, its pulley and its rail, and where the
    file says so; `own` where it belongs to one cable."""

    name: str
    ends: tuple[tuple[str, Anchor], tuple[str, Anchor]]
    pulley: PulleyModel | None
    pulley_at: Path_
    rail: RailModel | None
    rail_at: Path_
    own: bool = True

    @property
    def moves(self) -> tuple[bool, bool]:
        """Which ends are on the platform."""
        one, two = (side == "platform" for side, _ in self.ends)
        return one, two


@record
class SegmentUse:
    """A segment along which a cable runs, and how often."""

    segment: SegmentRow
    times: int


@record
class CableRow:
    """One cable: what the file says of it, alone and of every cable; where; its name; and what it runs along."""

    own: CableModel
    every: CommonModel
    at: Path_
    name: str
    runs: tuple[SegmentUse, ...]

    def material(self, key: str) -> tuple[Any, Path_]:
        """What is said under a key of it, or of every cable, and where."""
        own = getattr(self.own, key)
        return (own, (*self.at, key)) if own is not None else (getattr(self.every, key), ("every_cable", key))


def named_segments(
    model: CableRobotModel, document: YamlDocument, sides: Mapping[str, Anchors]
) -> Mapping[str, SegmentRow]:
    """The segments that the robot names."""
    out = {}
    for name, said in (model.segments or {}).items():
        at: Path_ = ("segments", name)
        ends = tuple(_ends(said, at, document, sides))
        if len(ends) != 2:
            _not_two(document, at, said)
        if ends[0][1].name == ends[1][1].name and ends[0][0] == ends[1][0]:
            document.fail("a segment needs two ends", at, found=ends[0][1].name, expected="two different anchors")
        both = ends[0][0] == ends[1][0]
        for key in ("pulley", "rail"):
            if both and getattr(said, key) is not None:
                expected = "a segment from a frame anchor to a platform anchor"
                document.fail(
                    f"a segment on one body has no {key}",
                    (*at, key),
                    found=f"two {ends[0][0]} anchors",
                    expected=expected,
                )
        out[name] = SegmentRow(name, ends, said.pulley, (*at, "pulley"), said.rail, (*at, "rail"), own=False)
    return out


def _ends(
    said: CableSegmentModel, at: Path_, document: YamlDocument, sides: Mapping[str, Anchors]
) -> Iterator[tuple[str, Anchor]]:
    for side in SIDES:
        given = getattr(said, side)
        for i, name in enumerate(given if isinstance(given, list) else () if given is None else (given,)):
            where = (*at, side, i) if isinstance(given, list) else (*at, side)
            if str(name) not in sides[side]:
                document.fail(f"no such {side} anchor", where, found=name, **one_of(str(name), sides[side]))
            yield side, sides[side][str(name)]


def _not_two(document: YamlDocument, at: Path_, said: CableSegmentModel) -> NoReturn:
    found = {k: v for k in SIDES if (v := getattr(said, k)) is not None}
    expected = "frame: NAME and platform: NAME, or two names: frame: [NAME, NAME]"
    document.fail("a segment runs between two points", at, found=found, expected=expected)


def runs_of(
    own: CableModel, i: int, document: YamlDocument, segments: Mapping[str, SegmentRow], used: set[str]
) -> tuple[SegmentUse, ...]:
    """What the i-th cable runs along, where it says so."""
    at: Path_ = ("cables", i)
    for key in ("frame", "platform", "pulley", "rail"):
        if getattr(own, key) is not None:
            expected = f"{key} in a segment, under segments"
            document.fail(
                "a cable with segments has its ends there", (*at, key), found=getattr(own, key), expected=expected
            )
    given, at = own.segments or {}, (*at, "segments")
    if not given:
        document.fail("a cable without a segment", at, found=given, expected="{NAME: times, ...}")
    for name, times in given.items():
        if name not in segments:
            facts = (
                one_of(name, segments)
                if segments
                else {"expected": "segments: {NAME: {frame: A, platform: B}} in this file"}
            )
            document.fail("no such segment", (*at, name), found=name, **facts)
        if isinstance(times, bool) or not isinstance(times, int) or times == 0:
            document.fail(
                "not how often a cable runs there", (*at, name), found=times, expected="a whole number, not 0"
            )
        used.add(name)
    if all(segments[n].moves[0] == segments[n].moves[1] for n in given):
        expected = "at least one segment from frame to platform"
        document.fail(
            "the length of this cable is the same wherever the platform is", at, found=list(given), expected=expected
        )
    rails = [n for n in given if segments[n].rail is not None]
    if len(rails) > 1:
        document.fail("a cable has one carriage", at, found=rails, expected="at most one segment with a rail")
    return tuple(SegmentUse(segments[name], times) for name, times in given.items())


def reeving_of(
    names: Sequence[str], runs: Sequence[tuple[SegmentUse, ...]]
) -> tuple[Reeving | None, tuple[SegmentRow, ...]]:
    """What cables run along (None: each once along its own segment), and the segments in its order."""
    first, more = [r[0].segment for r in runs], [run.segment for r in runs for run in r[1:]]
    if all(s.own for s in first):
        return None, tuple(first)
    reeving = Reeving.of(names, [[(run.times, run.segment.moves, run.segment.name) for run in r] for r in runs])
    return reeving, (*first, *more)


def shared_ends(names: Sequence[str], segments: Sequence[SegmentRow]) -> dict[str, str]:
    """Under which names the ends of segments, their pulleys and their rails go, where it is not that of the cable: of whoever has the
    anchor first."""
    owners: dict[tuple[str, str], str] = {}
    out: dict[str, str] = {}
    for name, row in zip(names, segments, strict=True):
        for letter, (side, anchor) in zip("ab", row.ends, strict=True):
            owner = owners.setdefault((side, anchor.name), f"{row.name}.{letter}")
            if owner != f"{name}.{letter}":
                out |= {f"{name}.{letter}{s}": f"{owner}{s}" for s in "xyz"}
        if row.name != name:
            out |= {f"{name}.{s}": f"{row.name}.{s}" for s in ("radius", "nx", "ny", "nz", *RAIL)}
    return out


def read_rail(row: SegmentRow, values: CableValues) -> Array:
    """The rail of a segment, (5,) in the order of RAIL; zero where it has none. Raises FormatError."""
    if row.rail is None:
        return np.zeros(5)
    at = row.rail_at
    direction = values.vector(row.rail.direction, (*at, "direction"), "1")
    if not direction.any():
        values.document.fail(
            "a rail needs a direction", (*at, "direction"), found=row.rail.direction, expected="not all zero"
        )
    gain = 1.0 if row.rail.gain is None else values.number(row.rail.gain, (*at, "gain"), "1")
    values.document.insist(
        gain != 0, "a carriage that does not move its anchor", (*at, "gain"), found=gain, expected="a number near 1"
    )
    return np.array([values.number(row.rail.carriage, (*at, "carriage"), "m"), gain, *direction])

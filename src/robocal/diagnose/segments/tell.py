"""What people are told of segments: file and rows, what moved, how far, and how the rows can be read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from robocal.diagnose.limits import SEGMENT_ROWS
from robocal.diagnose.segments.find import Segment
from robocal.diagnose.segments.posed import ZERO, ZEROS
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Number, Quantity, Remark

__all__ = ["segment_numbers", "segment_remarks"]

# What a data file of its own says, so that what moved has a place of its own there.
LINES = {
    "target": "targets: {moved: {}}",
    "instrument": "frame: {name: moved}",
    "target or instrument": "frame: {name: moved}, or targets: {moved: {}}",
}
MOVED = ("target", "instrument")
EITHER = declare(
    "segment-of-either",
    "{file}: from row {first} to row {last} everything is off as if the instrument had moved[ by {shift:.3g}]; or {other}: from row "
    "{begin} to row {end} as if {sensors} had been reset[ by {by:.3g}] ({count} rows, {strength:.1f} times the residual elsewhere)",
    "If the instrument moved, read these rows of {file} by a second data file with `frame: {{name: moved}}`. If the sensors were reset, "
    "those of {other} by one with `zeros: NAME`. Or do without them (--exclude {first}-{last}).",
)
SEVERAL = declare(
    "segments",
    "{file}: {what} changed {times} times, at the rows {rows}[, by up to {shift:.3g}][, turned by up to {turn:.3g}] ({strength:.1f} "
    "times the residual elsewhere)",
    "Each of these rows begins a part. Read every part by a data file of its own, which excludes the other rows and states {line}, "
    "with another name in each. Or keep the longest part alone.",
)
PLACES = {  # what is said of it, and what each data file says
    ZEROS: ("the zeros of several cables", "`zeros: NAME`"),
    "instrument": ("the place of the instrument", "`frame: {name: NAME}`"),
    "target": ("the place of the target on the tool", "`targets: {NAME: {}}`"),
}


def segment_numbers(s: Segment) -> dict[str, Number]:
    """The numbers that a remark has of a segment."""
    said: dict[str, Number] = {"file": s.source or s.group, "first": s.rows[0], "last": s.rows[1], "count": s.count}
    said["shift"] = None if s.shift is None else Quantity(s.shift)
    said["turn"] = None if s.turn is None else Quantity(s.turn, "rad")
    said["strength"] = s.strength
    return said


def segment_remarks(found: Sequence[Segment]) -> tuple[Remark, ...]:
    """One remark for every segment, and one for several of one file in which the same moved."""
    out = []
    for some in _alike(found):
        s, said = some[0], segment_numbers(some[0])
        if len(some) > 1:
            out.append(_several(some))
        elif s.rival is not None and ZERO in (s.cause.removesuffix("s"), s.rival.cause.removesuffix("s")):
            out.append(_either(s, s.rival))
        elif s.rival is not None:
            moved = " or ".join(c for c in MOVED if c in (s.cause, s.rival.cause))
            out.append(Remark.of(Code.SEGMENT, **said, moved=moved, line=LINES[moved]))
        elif s.cause == ZERO:
            of_zero = {k: v for k, v in said.items() if k != "turn"}
            begin, end = s.without
            out.append(Remark.of(Code.SEGMENT_OF_ZERO, **of_zero, zero=s.name, begin=begin, end=end))
        elif s.cause == ZEROS:
            of_zeros = {k: v for k, v in said.items() if k != "turn"}
            out.append(Remark.of(Code.SEGMENT_OF_ZEROS, **of_zeros))
        elif s.name and s.cause == "target":
            out.append(Remark.of(Code.SEGMENT_OF_TARGET, **said, target=s.name))
        else:
            out.append(Remark.of(Code.SEGMENT, **said, moved=s.cause, line=LINES[s.cause]))
    return tuple(out)


def _either(*both: Segment) -> Remark:
    """An instrument that moved, or zeros that were set anew, each with its file and rows."""
    zeros, moved = sorted(both, key=lambda s: not s.cause.startswith(ZERO))
    said = {k: v for k, v in segment_numbers(moved).items() if k != "turn"} | {
        "strength": max(s.strength for s in both)
    }
    sensors = f"zero {zeros.name}" if zeros.cause == ZERO else "several zeros"
    anew = segment_numbers(zeros)
    second = {
        "other": anew["file"],
        "begin": anew["first"],
        "end": anew["last"],
        "by": anew["shift"],
        "sensors": sensors,
    }
    return Remark.of(EITHER, **said, **second)


def _alike(found: Sequence[Segment]) -> list[tuple[Segment, ...]]:
    """The segments, those of one file together where one cause explains them all: the strongest says which."""
    out: list[tuple[Segment, ...]] = []
    rest = list(found)
    while rest:
        ways = [[m for s in rest if (m := _by_cause(s, cause))] for cause in (rest[0], rest[0].rival) if cause]
        some = max(ways, key=len)
        out.append(tuple(some) if len(some) > 1 else (rest[0],))
        rest = [s for s in rest if not any((s.first, s.last) == (m.first, m.last) for m in out[-1])]
    return out


def _by_cause(s: Segment, like: Segment) -> Segment | None:
    """A segment by the cause and in the file of another one; None where it is none of that. One zero is among all zeros."""
    for mine in (s, s.rival):
        if mine is None or (mine.group, mine.source) != (like.group, like.source):
            continue
        if (mine.cause, mine.name) == (like.cause, like.name) or (mine.cause, like.cause) == (ZERO, ZEROS):
            return replace(mine, rival=None)
    return None


def _several(some: Sequence[Segment]) -> Remark:
    """Several changes of one thing along a file, by the rows at which its parts begin."""
    rows: list[int] = []
    for s in some:  # the strongest first
        for row in (s.rows[0], s.end):
            if row is not None and all(abs(row - known) >= SEGMENT_ROWS for known in rows):
                rows.append(row)
    first = some[0]
    what, line = PLACES.get(first.cause, (first.name, "`zeros: NAME`"))
    if first.cause == "target" and first.name:
        what, line = f"the place of {first.name}", "another name for the target"
    sizes = {k: [v for s in some if (v := getattr(s, k)) is not None] for k in ("shift", "turn")}
    return Remark.of(
        SEVERAL,
        file=first.source or first.group,
        what=what,
        times=len(rows),
        rows=", ".join(map(str, sorted(rows))),
        shift=Quantity(max(sizes["shift"])) if sizes["shift"] else None,
        turn=Quantity(max(sizes["turn"]), "rad") if sizes["turn"] and first.cause not in (ZERO, ZEROS) else None,
        strength=max(s.strength for s in some),
        line=line,
    )

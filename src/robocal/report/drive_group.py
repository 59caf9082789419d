"""The page of several motors: one table, those that are strange, and the curves above each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal.remarks.remark import sentences
from robocal.report.curves import AngleCurve, draw_curves
from robocal.report.sections import Figure, Section, Text, ends, listing_table

__all__ = ["group_pictures", "group_sections"]

CELLS = 720  # grid: of a turn, in pictures


def group_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """How many tables may be used, the table of all motors, and why some may not."""
    good = sum(m.trusted for m in found.members.values())
    many = len(found.members)
    strange = f"; strange: {', '.join(found.strange)}" if found.strange else ""
    yield Section.of("", Text.of((f"{good} of {many}", "strong"), f"   motors have a table that is proven{strange}"))
    yield Section.of("", listing_table(found.listing), title="Motors", key="motors")
    bad = {name: m for name, m in found.members.items() if not m.trusted}
    if bad:
        lines = [Text.of((name, "strong"), f"   {sentences(m.verdict.remarks)[0]}") for name, m in bad.items()]
        yield Section.of("", *lines, title="Not proven", key="not-proven")
    yield from ends(found.warnings, written)


def group_pictures(found: Any) -> Iterator[Section]:
    """The curve of each motor over the turn, one above the other."""
    angle = np.arange(CELLS) * 360 / CELLS
    curves = {name: m.motor_file.curves(CELLS)[0] for name, m in found.members.items()}
    step = 2.2 * max(float(np.abs(c).max()) for c in curves.values()) or 1.0
    unit = next(iter(found.members.values())).unit
    lines = [
        AngleCurve(angle, c - i * step, "curve random" if name in found.strange else "curve")
        for i, (name, c) in enumerate(curves.items())
    ]
    told = (
        "The curve of each motor over its turn, forward, in the order of the table from above; strange ones are dashed."
    )
    svg = draw_curves(lines, "angle [deg]", f"effort [{unit}]", title="Curves", text=told, key="curves")
    yield Section.of("The curve of each motor", Figure(svg, told), key="figure-curves")

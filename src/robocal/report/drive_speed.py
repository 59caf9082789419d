"""Figures 1.9 and 1.10 of the seed document for a log of any drive: effort and speed over a sixth of a turn, after some turns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal.report.curves import AngleCurve, draw_curves
from robocal.report.sections import Figure, Remarks, Section, Text, ends, listing_table

__all__ = ["speed_pictures", "validation_sections"]

WARM_UP = 2.0  # grid: turns, after which a controller has settled
WINDOW = 1 / 6  # grid: of a turn, as the document has it
CLASSES = {True: "curve", False: "curve random"}


def validation_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """What the table explains of each part, and whether it is of this motor."""
    if found.reasons:
        yield Section.of("", Remarks(found.reasons))
    else:
        words = " and ".join(f"{e.alone:.1%}" for e in found.parts.values()).replace("%", " %")
        yield Section.of("", Text.of((words, "strong"), "   of the effort is what the table alone says"))
    yield Section.of("", listing_table(found.listing), title="Parts of the log, by their effort", key="parts")
    yield from ends(found.warnings, written)


def speed_pictures(found: Any) -> Iterator[Section]:
    """Effort and speed of each part over a sixth of a turn."""
    sweep, unit = found.sweep, found.sweep.unit
    effort, speed = [], []
    for word in found.parts:
        rows = sweep.used & (found.on == word)
        angle = sweep.angle[rows]
        first = angle[0] + np.sign(angle[-1] - angle[0]) * WARM_UP * 2 * np.pi
        some = rows & (np.abs(sweep.angle - first) <= WINDOW * np.pi)
        if not some.any():
            continue
        at = np.degrees(np.abs(sweep.angle[some] - sweep.angle[some][0]))
        order = np.argsort(at, kind="stable")
        effort.append(AngleCurve(at[order], sweep.effort[some][order], CLASSES[word]))
        off = found.log.in_angle_unit(sweep.speed[some] - np.mean(sweep.speed[rows]))
        speed.append(AngleCurve(at[order], off[order], CLASSES[word]))
    if not effort:
        return
    told = "A sixth of a turn after two turns: compensated (solid), and not (dashed)."
    svg = draw_curves(effort, "angle [deg]", f"effort [{unit}]", title="Effort", text=told, key="effort")
    yield Section.of("Effort with and without compensation", Figure(svg, told), key="figure-effort")
    told = "The speed less its mean, over the same sixth of a turn."
    up = f"speed less its mean [{found.log.speed_unit}]"
    svg = draw_curves(speed, "angle [deg]", up, title="Speed", text=told, key="speed")
    yield Section.of("Speed with and without compensation", Figure(svg, told), key="figure-speed")

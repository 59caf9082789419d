"""The page of a motor: verdict, shares, orders, logs, and the figures of the seed document (1.4 to 1.7)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import gcd
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.remarks.remark import percent, sentences
from robocal.report.curves import AngleCurve, draw_curves
from robocal.report.numbers import significant
from robocal.report.sections import Figure, Section, Text, VerdictBlock, ends, listing_table, quiet

__all__ = ["drive_pictures", "drive_sections", "verdict_block"]

VERDICTS: dict[str, tuple[str, Any, str]] = {
    "improved": ("improved", "good", "On arcs that were left out this table is better than friction alone."),
    "located": ("improved", "good", "On arcs that were left out this table is better than friction alone."),
    "not_improved": ("not improved", "doubtful", "The table is not proven for the whole turn. Do not use it yet."),
    "refused": ("refused", "bad", "Do not use these numbers; they are listed for diagnosis only."),
}
BRIEF = 8  # orders that a terminal lists
CELLS = 1440  # grid: of a turn, in pictures
MOST_POWER = 0.9  # grid: of the variance, whose common period is drawn


def verdict_block(verdict: Any, proof: str = "") -> VerdictBlock:
    """The verdict of a motor."""
    word, style, meaning = VERDICTS[verdict.status]
    advice = () if verdict.status == "improved" else tuple(dict.fromkeys(r.advice for r in verdict.remarks if r.advice))
    return VerdictBlock(word, style, tuple(sentences(verdict.remarks)), advice, meaning, proof)


def drive_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """The verdict, the shares, the orders, and the logs."""
    taken, unit = found.taken, found.unit
    share = percent(taken.share, ".2%")
    yield Section.of(
        "", verdict_block(found.verdict, f"Unseen arcs of 30 deg, both directions: {share} of the variance.")
    )
    lines = [Text.of((share, "strong"), "   of the variance on unseen arcs, friction removed")]
    forms = {"lag": "one lag for both directions", "directions": "phases per direction"}
    for word, tried in found.tried.items():
        lines.append(Text.of(f"{percent(tried.share, '.2%')}   with {forms[word]}", indent=2))
    if np.isfinite(found.other):
        lines.append(
            Text.of(f"{percent(found.other, '.2%')}   of one direction, from the harmonics of the other", indent=2)
        )
    lines.append(Text.of(f"{percent(found.ceiling, '.2%')}   is what the noise leaves to any curve", indent=2))
    c = taken.motor.cogging
    friction = f"Coulomb friction {significant(found.motor_file.coulomb, 4)} {unit}; noise {significant(found.noise, 3)} {unit}"
    lag = "" if c.by_direction else f"; lag {significant(np.degrees(c.lag), 3)} deg each way"
    yield Section.of("", *lines, *quiet(friction + lag))
    table = listing_table(found.orders)
    yield Section.of(
        "", type(table)(table.columns, table.rows, table.right, brief=BRIEF), title="Orders per turn", key="orders",
    )  # fmt: skip
    yield Section.of("", listing_table(found.log_listing), title="Logs", key="logs")
    if len(found.fitted) > 1 or any(s.loaded for s in found.sweeps):
        title = "Friction of each log, and its load"
        yield Section.of("", listing_table(found.friction_listing), title=title, key="frictions")
    if found.other_logs:
        yield Section.of("", listing_table(found.other_listing), title="Logs that were held back", key="held")
    methods = found.document.methods
    if methods is not None:
        yield Section.of("", listing_table(methods), title="Harmonics, and tables of the seed's method", key="methods")
    yield from ends(found.warnings, written)


def _cells(found: Any, direction: int) -> tuple[Array, Array]:
    """Angles (deg) and the mean effort of each cell of the turn; NaN where nothing was read."""
    angle, effort = np.zeros(0), np.zeros(0)
    for sweep, used in zip(found.sweeps, found.used, strict=True):
        some = used & (sweep.direction == direction)
        angle, effort = np.append(angle, sweep.angle[some]), np.append(effort, sweep.effort[some])
    cell = np.floor(np.mod(angle, 2 * np.pi) / (2 * np.pi) * CELLS).astype(np.int64) % CELLS
    count = np.bincount(cell, minlength=CELLS)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(cell, effort, CELLS) / count
    return (np.arange(CELLS) + 0.5) * 360 / CELLS, np.where(count > 0, mean, np.nan)


def _curve(found: Any, angle: Array, direction: int) -> Array:
    """The curve that compensates, with friction and offset."""
    theta = np.radians(angle)
    m = found.motor_file
    if found.seed is not None:
        return np.asarray(found.seed.at(theta, direction) + found.seed.means[0 if direction > 0 else 1])
    return np.asarray(m.cogging.at(theta, direction) + m.offset + direction * m.coulomb)


def drive_pictures(found: Any) -> Iterator[Section]:
    """The sweep in both directions, both over one period, what compensates, escapes, and the orders with what is left."""
    unit = found.unit
    raw = {d: _cells(found, d) for d in (1, -1)}
    classes = {1: "curve", -1: "curve random"}
    up = f"effort [{unit}]"
    seen = [d for d in (1, -1) if np.isfinite(raw[d][1]).any()]
    told = "What the drive asked over the turn, forward (solid) and reverse (dashed); their distance is twice the friction."
    svg = draw_curves(
        [AngleCurve(*raw[d], classes[d]) for d in seen], "angle [deg]", up, title="The sweep", text=told, key="sweep"
    )
    yield Section.of("The sweep, both directions", Figure(svg, told), key="figure-sweep")
    period = _period(found)
    bins = max(12, min(360, round(CELLS * period / 360)))
    each = []
    for d in seen:
        angle, effort = raw[d]
        known = np.isfinite(effort)
        cell = np.floor(np.mod(angle[known], period) / period * bins).astype(np.int64) % bins
        count = np.bincount(cell, minlength=bins)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.bincount(cell, effort[known] - np.mean(effort[known]), bins) / count
        each.append(AngleCurve((np.arange(bins) + 0.5) * period / bins, np.where(count > 0, mean, np.nan), classes[d]))
    told = f"Without its mean, over one period of {significant(period, 4)} deg: the mean of all of them. The shift is the lag."
    svg = draw_curves(each, "angle in the period [deg]", up, title="One period", text=told, key="period")
    yield Section.of("Both directions over one period", Figure(svg, told), key="figure-period")
    window = [c for d in seen for c in _window(found, raw[d], d, classes[d])]
    told = "A twelfth of the turn: what was read (dots), and the curve that compensates it (lines)."
    svg = draw_curves(window, "angle [deg]", up, title="Read and compensated", text=told, key="compensated")
    yield Section.of("What was read, and what compensates", Figure(svg, told), key="figure-compensated")
    if len(found.logs) > 1:
        yield Section.of("Noise, and the speed of the sweep", _noise(found), key="figure-noise")
    if any(e.any() for e in found.escaped):
        yield Section.of("Where the rotor escaped", _escapes(found, raw, classes, seen, up), key="figure-escapes")
    left = found.left_amplitudes
    orders = np.arange(1, len(left))
    c = found.taken.motor.cogging
    told = f"Amplitudes of the orders that were taken (dots) and of what the fit leaves at every order (line), {unit}, as powers of ten."
    floor = max(float(np.median(left[1:])), 1e-12)
    curves = [
        AngleCurve(orders.astype(float), np.log10(np.maximum(left[1:], floor / 30)), "scatter"),
        AngleCurve(np.array(c.orders, float), np.log10(np.maximum(c.amplitudes, floor / 30)), dots="held"),
    ]
    svg = draw_curves(
        curves, "order per turn", f"log10 of the amplitude [{unit}]", title="Orders", text=told, key="spectrum"
    )
    yield Section.of("Orders, and the floor of noise", Figure(svg, told), key="figure-orders")


def _noise(found: Any) -> Figure:
    """The noise of each log beside its cogging, at its speed: why faster sweeps are not fitted."""
    size = float(np.sqrt(np.sum(found.taken.motor.cogging.amplitudes**2) / 2)) or 1.0
    first = found.logs[0]
    speed = first.in_angle_unit([log.sweep.median_speed for log in found.logs])
    share = np.array([p.noise for p in found.log_shares]) / size
    fitted = np.isin(np.arange(len(speed)), found.fitted)
    order = np.argsort(speed, kind="stable")
    curves = [AngleCurve(speed[order], share[order], "scatter")]
    for some, dots in ((fitted, "held"), (~fitted, "aside")):
        if some.any():
            curves.append(AngleCurve(speed[some], share[some], dots=dots))
    told = "Noise of each log, by the size of the cogging (rms), at its speed: diamonds are fitted, crosses held back."
    across = f"speed [{first.speed_unit}]"
    svg = draw_curves(curves, across, "noise / cogging", title="Noise and speed", text=told, key="noise")
    return Figure(svg, told)


def _period(found: Any) -> float:
    """The common period (deg) of the orders that make most of the variance."""
    c = found.taken.motor.cogging
    if not c.orders:
        return 360.0
    order = np.argsort(-c.amplitudes)
    power = np.cumsum(c.amplitudes[order] ** 2)
    strong = order[: int(np.searchsorted(power, MOST_POWER * power[-1])) + 1]
    return 360.0 / gcd(*(c.orders[i] for i in strong))


def _window(found: Any, raw: tuple[Array, Array], direction: int, cls: str) -> list[AngleCurve]:
    angle, effort = raw
    some = angle < 30
    fine = np.linspace(0, 30, 600)
    return [
        AngleCurve(angle[some], effort[some], dots="after" if direction > 0 else "before"),
        AngleCurve(fine, _curve(found, fine, direction), cls),
    ]


def _escapes(found: Any, raw: Any, classes: Any, seen: Sequence[int], up: str) -> Figure:
    curves = [AngleCurve(raw[d][0], raw[d][1], classes[d]) for d in seen]
    for sweep, rows in zip(found.sweeps, found.escaped, strict=True):
        curves.append(AngleCurve(np.degrees(np.mod(sweep.angle[rows], 2 * np.pi)), sweep.effort[rows], dots="aside"))
    told = "Crosses: rows of escapes, which say nothing of the arc. The curve there is that of the other direction, or of the orders."
    return Figure(draw_curves(curves, "angle [deg]", up, title="Escapes", text=told, key="escapes"), told)

"""The page of `drive simulate`: what compensation divides by, and the pictures of sweep and ramp."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import replace
from robocal._types import Array
from robocal.report import svg
from robocal.report.sections import Figure, Pair, Section, Text, ends, figure, listing_table, quiet

__all__ = ["trial_pictures", "trial_summary"]

WIDTH, HEIGHT = 460.0, 250.0
POINTS = 600  # of a curve on a page
DETAIL = (3, 4, 6, 7, 10)  # columns for which a terminal has no room
CLAIMS = "Of the document: position error / 3, effort / 6, peak speed error / 5."


def trial_summary(made: Any, written: Sequence[Path]) -> Iterator[Section]:
    """The error of the curve, and the ramp controller by controller."""
    share = 100 * made.curve_error / made.peak
    found = made.identified.motor_file
    words = f"{figure(made.curve_error, 2)} N m, {figure(share, 2)} % of the peak"
    less = min(r.gain.position for r in made.ramps), min(r.gain.effort for r in made.ramps)
    says = "divided by at least" if made.improved else "WORSE at a controller: divided by"
    yield Section.of(
        "",
        Text.of((words, "strong"), "   largest error of the identified curve"),
        Text.of((f"{says} {figure(less[0], 2)} and {figure(less[1], 2)}", "strong"), "   position error and effort on the ramp"),
        *quiet(
            f"sweep with {made.sweep_gain:g} N m/rad; lag {figure(math.degrees(found.cogging.lag), 2)} deg, friction "
            f"{figure(found.coulomb, 3)} N m"
        ),
    )  # fmt: skip
    table = replace(listing_table(made.listing), detail=DETAIL)
    yield Section.of("", table, *quiet(CLAIMS), title="The ramp, controller by controller", key="ramps")
    yield from ends(made.remarks, written)


def trial_pictures(made: Any) -> Iterator[Section]:
    """Figures 1.4 to 1.6, 1.9 and 1.10 of the document."""
    angle, true, found = made.curves
    turn = np.degrees(angle)
    raw = [(np.degrees(s.log.encoder) % 360, s.torque, "seen") for s in made.sweeps]
    mean = [(turn, found_of, "curve") for found_of in _by_direction(made, angle)]
    both = [(turn, true, "curve random"), (turn, found, "curve")]
    recorded = "Recorded torque in both directions (grey), and the identified curve of each."
    compared = "True cogging (dashed) and identified cogging, without lag."
    yield Section.of(
        "The sweep",
        _plot("The sweep", [*raw, *mean], ("angle of the encoder [deg]", "torque [N m]"), recorded, "sweep", 2 * WIDTH),
        _plot("The cogging", both, ("angle [deg]", "cogging [N m]"), compared, "curve", 2 * WIDTH),
        key="sweep-pictures",
    )
    for i, ramp in enumerate(made.ramps):
        at = [np.degrees(log.reference - log.reference[0]) for log in ramp.logs]
        error = [np.degrees(log.reference - log.angle) for log in ramp.logs]
        speed = [np.degrees(log.speed) for log in ramp.logs]
        across = "desired angle in the window [deg]"
        told = "Without compensation (dashed) and with it."
        drawn = [
            (f"Position error, PID {i + 1}", error, "error [deg]"),
            (f"Effort, PID {i + 1}", [log.effort for log in ramp.logs], "torque of the PID [N m]"),
            (f"Speed, PID {i + 1}", speed, "speed [deg/s]"),
        ]
        plots = [
            _plot(name, _pair(at, v), (across, up), told, f"ramp-{i}-{j}", WIDTH * (2 if j == 2 else 1))
            for j, (name, v, up) in enumerate(drawn)
        ]
        yield Section.of("The ramp, kp {:g}, ki {:g}, kd {:g}".format(*ramp.pid), Pair(tuple(plots[:2])), plots[2])


def _by_direction(made: Any, angle: Array) -> list[Array]:
    found = made.identified.motor_file
    return [found.offset + d * found.coulomb + found.cogging.at(angle, d) for d in (1.0, -1.0)]


def _pair(across: Sequence[Array], up: Sequence[Array]) -> list[tuple[Array, Array, str]]:
    return [(x, y, style) for x, y, style in zip(across, up, ("curve random", "curve"), strict=True)]


def _plot(
    title: str,
    curves: Sequence[tuple[Array, Array, str]],
    axes: tuple[str, str],
    caption: str,
    key: str,
    width: float = WIDTH,
) -> Figure:
    """Curves over one axis; of a long one every so many points."""
    across = np.concatenate([c[0] for c in curves])
    up = np.concatenate([c[1] for c in curves])
    air = 0.06 * float(np.ptp(up)) or 1.0
    x = svg.AxisScale(float(across.min()), float(across.max()), 56, width - 14)
    y = svg.AxisScale(float(up.min()) - air, float(up.max()) + air, HEIGHT - 46, 30)
    parts = [svg.axes(x, y, *axes)]
    for a, b, style in curves:
        every = max(1, len(a) // (2 * POINTS if style == "seen" else POINTS))
        places = list(zip(x.many(a[::every]).tolist(), y.many(b[::every]).tolist(), strict=True))
        mark = svg.path(svg.circles(places, 0.8), style) if style == "seen" else svg.path(svg.polyline(places), style)
        parts.append(mark)
    text = f"{axes[1]} from {float(up.min()):.4g} to {float(up.max()):.4g}."
    cls = "wide" if width > WIDTH else ""
    return Figure(svg.drawing(width, HEIGHT, parts, title=title, text=text, key=key, cls=cls), caption, title)

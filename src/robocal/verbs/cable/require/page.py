"""What `cable require` says: the errors to be expected, what an accuracy takes, and lines of equal error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from robocal.cables.calibration.requirement import ESTIMATORS, WHAT
from robocal.files.listing import in_units
from robocal.files.units import UNITS, Unit, Units
from robocal.report.cable.contours import contours
from robocal.report.cable.part import part
from robocal.report.sections import Section, Text, ends, figure, listing_table, table
from robocal.session.cable.statics_options import assumption_text
from robocal.verbs.cable.require.result import Required

__all__ = ["require_details", "require_summary"]

NOISES = {"length": "lengths", "position": "positions", "orientation": "orientations"}
SENTENCE = {
    "anchors": "a component of a frame anchor",
    "zeros": "a zero",
    "position": "the platform's position afterwards",
    "orientation": "the platform's orientation afterwards",
}


def _unit(made: Required, angle: bool) -> Unit:
    return UNITS["deg"] if angle else UNITS["mm"]


def _with_unit(made: Required, value: float, angle: bool) -> str:
    unit = _unit(made, angle)
    return f"{figure(unit.from_si(value))} {unit.name}"


def require_summary(made: Required, written: tuple[Path, ...]) -> Iterator[Section]:
    """The errors of both estimators, and what the accuracy takes."""
    r = made.requirement
    noise = ", ".join(
        f"{NOISES[name]} {_with_unit(made, value, name == 'orientation')}"
        for name, value in (
            ("length", r.noise.length),
            ("position", r.noise.position),
            ("orientation", r.noise.orientation),
        )
        if value
    )
    head = f"   {len(r.design.poses)} poses; standard deviations: {noise}"
    yield Section.of("", Text.of((made.robot.name, "strong"), head))
    rows = []
    for name in ESTIMATORS:
        e = replace(r, estimator=name).rms_errors
        rows.append((name, *(figure(_unit(made, what == "orientation").from_si(getattr(e, what))) for what in WHAT)))
    columns = ("expected error, rms", "anchors [mm]", "zeros [mm]", "position [mm]", "orientation [deg]")
    yield Section.of("", table(*columns, right=(1, 2, 3, 4), rows=rows))
    if made.needs is not None and made.accuracy is not None:
        yield Section.of("", *(Text.of(line) for line in _requirement_lines(made, made.accuracy)))
    yield from ends(made.remarks, written)


def _requirement_lines(made: Required, accuracy: float) -> Iterator[str]:
    assert made.needs is not None
    wanted, scale = _with_unit(made, accuracy, made.of == "orientation"), made.needs["scale"]
    state = "is reached" if made.enough else "is not reached"
    yield f"{wanted} rms of {SENTENCE[made.of]} ({made.requirement.estimator}) {state}. Any one of these meets it exactly:"
    yield f"  all noises times {figure(scale)}"
    for name, value in made.needs["alone"].items():
        if value is None:
            yield f"  better {NOISES[name]} alone cannot: the other noises are too large"
        elif value == float("inf"):
            yield f"  {NOISES[name]} hardly count"
        else:
            yield f"  {NOISES[name]} to {_with_unit(made, value, name == 'orientation')}"
    yield f"  {made.needs['poses']} poses like these"


def require_details(made: Required) -> Iterator[Section]:
    """Cable by cable, lines of equal error, and how it was worked out."""
    said = f"One standard deviation of what {made.requirement.estimator} finds, in mm."
    yield Section.of("Cable by cable", Text.of(said), listing_table(in_units(made.sigmas, Units())))
    for (one, two), curves in made.curves.items():
        units = [_unit(made, name == "orientation") for name in (one, two)]
        drawn = [
            (_with_unit(made, level, made.of == "orientation"), curve * [1 / u.factor for u in units])
            for level, curve in curves
        ]
        axes = [f"{NOISES[name]} [{u.name}]" for name, u in zip((one, two), units, strict=True)]
        text = (
            "With noises on a line, every cable fitted by itself and nothing else in error, the rms error of "
            f"{SENTENCE[made.of]} is what stands on it."
        )
        yield part(
            f"Noise of {NOISES[one]} and of {NOISES[two]}",
            text,
            contours(drawn, (axes[0], axes[1]), text, f"{one}-{two}"),
        )
    how = (
        "To first order in the noise, around the robot as its file has it; straight cables. It holds while the noise is small against "
        "the spread of the poses."
    )
    yield part("How it was worked out", "\n\n".join([how, *assumption_text(made.robot)]))

"""What `cable straightness` says on a terminal and on its page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from robocal.cables.straightness import level_excess, level_sag
from robocal.files.display import in_units
from robocal.files.units import Units
from robocal.quantities import Listing
from robocal.report.cable.part import part
from robocal.report.curves import AngleCurve, draw_curves
from robocal.report.sections import Detail, Section, Text, ends, figure, listing_table, table
from robocal.report.sweep import Axis, Curve, curves
from robocal.session.cable.load_fits import Loads
from robocal.session.cable.straightness_result import Straightness

__all__ = ["straightness_details", "straightness_sections"]

POINTS = 25  # grid: of a curve
NUMBERS = {"cable.weight": "weight", "cable.elasticity": "elasticity", "cable.exponent": "exponent"}


def straightness_sections(made: Straightness, written: tuple[Path, ...]) -> Iterator[Section]:
    """The errors at the poses, the tensions for what is wanted, the level cable, what loads say."""
    pulls = made.tension[np.isfinite(made.tension).all(axis=1)]
    head = (
        f"   {len(made.names)} poses, tensions {figure(float(pulls.min()))} to {figure(float(pulls.max()))} N; cables of "
        f"{figure(float(made.weight.max()))} N/m, {_elasticity(made)}"
    )
    yield Section.of("", Text.of((made.robot.name, "strong"), head), Detail(lambda: [_answer(made)]))
    yield Section.of(
        "", listing_table(_shown(made.errors), title="What straight cables of constant length leave aside")
    )
    yield Section.of("", *map(Text.of, _needed(made)))
    span = figure(1e3 * made.length)
    yield Section.of("", listing_table(_shown(made.level), title=f"A level cable of {span} mm"))
    if made.numbers is not None:
        yield Section.of(
            "", table(*HEADS, right=(2, 3, 4, 5, 6), rows=_found(made.numbers), title="What the loads say")
        )
    if made.measured is not None:
        yield Section.of("", listing_table(_shown(made.measured), title="Loads"))
    yield from ends(made.remarks, written)


def straightness_details(made: Straightness) -> Iterator[Section]:
    """Pictures of the level cable and of what was measured, and how it was worked out."""
    low, high = float(made.levels.min()), float(made.levels.max())
    t = np.geomspace(low, max(high, 1.001 * low), POINTS)
    longer = 1e3 * level_excess(made.length, t, float(made.weight.max()))
    said = f"Excess length and stretch of a level cable of {figure(1e3 * made.length)} mm, in mm, against its tension."
    stretch = [Curve(name, 1e3 * made.length * law.strain(t)) for name, law in made.laws.items()]
    wanted = (1e3 * made.wanted, f"{figure(1e3 * made.wanted)} mm")
    drawn = curves(Axis("tension [N]", t), [Curve("sag", longer), *stretch], "[mm]", said, "straightness", wanted)
    yield part("Sag falls with the tension, stretch grows", said, drawn)
    yield _hanging(made)
    if made.loads is not None:
        yield from _pictures(made.loads)
    yield made.method_part(HOW)


def _hanging(made: Straightness) -> Section:
    """The level cable as it hangs under the least and the greatest tension of the table."""
    w, l = float(made.weight.max()), made.length
    x = np.linspace(0.0, l, 2 * POINTS + 1)
    ends = tuple(dict.fromkeys((float(made.levels.min()), float(made.levels.max()))))
    # Under one horizontal tension the part between two points at one height hangs as a level cable of that span.
    below = [np.asarray(level_sag(np.abs(l - 2 * x), t, w) - level_sag(l, t, w)) for t in ends]
    drawn = [AngleCurve(1e3 * x, 1e3 * y, c) for y, c in zip(below, CLASSES, strict=False)]
    said = f"A level cable of {figure(1e3 * l)} mm and {figure(w)} N/m between its ends, in mm against them"
    said += f", under {figure(ends[0])} N (solid)" + (f" and {figure(ends[1])} N (dashed)." if len(ends) > 1 else ".")
    svg = draw_curves(drawn, "along [mm]", "height [mm]", title="A level cable", text=said, key="catenary")
    return part("How a level cable hangs", said, svg)


CLASSES = ("curve", "curve random")
HEADS = ("fit", "number", "value", "low", "high", "left out, rms [mm]", "loads")
HOW = (
    "Sag: the catenary of each cable under its tension at the platform, against its chord. Stretch: the strain of each cable times its "
    "length without load. Position and orientation: what a platform's pose seems to change by where lengths change so, least squares to "
    "first order. Both are what a model of straight cables of constant length leaves aside; zeros of sensors that were found under the "
    "same tensions take a part of it."
)


def _shown(listing: Listing) -> Listing:
    """The same in mm, deg and N."""
    return in_units(listing, Units())


def _elasticity(made: Straightness) -> str:
    t = made.middle
    law = None if made.loads is None else made.loads.law
    told = f"{figure(1e2 * float(made.ropes[0].strain(t)) / t)} %/N at {figure(t)} N"
    return told if law is None else f"{told} ({law.what})"


def _needed(made: Straightness) -> Iterator[str]:
    """Which tensions keep within what is wanted."""
    error, n = f"{figure(1e3 * made.wanted)} mm", made.needed
    least = f"{_force(n['sag.length'])}, at most {error} of a position from {_force(n['sag.position'])}"
    yield f"sag takes at most {error} of a length where every cable bears at least {least}"
    both = (n["stretch.length"], n["stretch.position"])
    if both == (None, None):
        yield f"stretch takes at most {error} under any tension"
    else:
        yield f"stretch takes at most {error} of a length up to {_force(both[0])}, of a position up to {_force(both[1])}"
    low, high = n["sag.position"], both[1]
    if low is not None and high is not None and low > high:
        yield f"no tension does both for a position: correct the stretch (elasticity in the robot file), and hold {_force(low)}"


def _force(value: float | None) -> str:
    return "any tension" if value is None else f"{figure(value)} N"


def _answer(made: Straightness) -> Detail:
    """What a page says first."""
    rows = {r["left aside"]: r for r in made.errors.rows}
    asked = f"what sag and stretch do to {len(made.names)} poses, and which tension keeps sag within {figure(1e3 * made.wanted)} mm"
    parts = (
        f"{name} up to {figure(1e3 * r['length'])} mm of a length and {figure(1e3 * r['position'])} mm of a position"
        for name, r in rows.items()
    )
    after = f"state weight and elasticity in {made.place}; robocal cable inverse --sag has the lengths of such cables"
    return made.answer(
        ("Asked", asked), ("Found", "; ".join(parts)), ("Tension", "; ".join(_needed(made))), ("Next", after)
    )


def _found(found: Listing) -> Iterator[tuple[str, ...]]:
    """The rows of what loads say, elasticities in percent per newton."""
    for r in found.rows:
        name = str(r["number"])
        unit, many = {"1/N": ("%/N", 1e2), "m": ("mm", 1e3)}.get(r["unit"], (r["unit"], 1.0))
        word = NUMBERS.get(name, name) + ("" if unit == "1" else f" [{unit}]")
        numbers = (figure(None if r[k] is None else many * r[k]) for k in ("value", "low", "high"))
        left = r["left out, rms"]
        yield (r["fit"], word, *numbers, figure(None if left is None else 1e3 * left), str(r["loads"]))


def _pictures(loads: Loads) -> Iterator[Section]:
    """Measured loads with what was fitted to them: elongations from no tension on, where a gauge shows its offset."""
    one, other = loads.constant, loads.curve
    for fit, beside, heading in ((loads.weight, None, "Sag under loads"), (one, other, "Elongation under loads")):
        if fit is None:
            continue
        fits = [f for f in (fit, beside) if f is not None]
        said = f"Measured (dots), and as fitted: {' (solid), '.join(f.what for f in fits)} ({'dashed' if beside else 'solid'})."
        drawn = [AngleCurve(fit.tension, 1e3 * fit.measured, dots="after")]
        for f, cls in zip(fits, CLASSES, strict=False):
            t, y = f.curve(POINTS)
            drawn.append(AngleCurve(t, 1e3 * y, cls))
        if fit is one:
            said += " A line that misses the origin is the offset of the gauge."
        svg = draw_curves(drawn, "tension [N]", "[mm]", title=heading, text=said, key=f"loads-{fit.what}")
        yield part(heading, said, svg)

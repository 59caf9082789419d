"""Pictures of a plan: how accurate so many poses will be, and where they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from robocal.quantities import Listing
from robocal.report.numbers import finite, significant
from robocal.report.sections import Block, Figure, Pair, Text
from robocal.report.svg import AxisScale, axes, drawing, label, line, num, path, points, polyline, span

__all__ = ["accuracy_forecast", "accuracy_picture", "place_pictures", "places"]

Points = Sequence[Sequence[float]]
CURVES = (("random", "curve random", "random poses"), ("p95", "curve p95", "95 %"), ("mean", "curve", "mean"))


def accuracy_forecast(forecast: Listing, n: int, asked: float | None) -> Iterator[Block]:
    """What is predicted of n poses, in a sentence and a picture: of every number of poses the mean error, that at 95 % of the tests, and
    that of random poses, in mm; `asked` is what shall be reached."""
    mean, wide, random = (f"{significant(forecast[k].values[n])} mm" for k in ("mean", "p95", "random"))
    yield Text.of(
        f"After these {n:.0f} poses the error at poses that were not measured is foretold to be {mean} in the mean, below {wide} at "
        f"95 % of them; {n:.0f} random poses would reach {random}."
    )
    if svg := accuracy_picture(forecast, n, asked):
        caption = (
            "Foretold error (rms of all three axes) at test poses, from the noise as stated and the errors that are expected "
            "beforehand. What no parameter describes, such as gears and bending, comes on top."
        )
        yield Figure(svg, caption)


def places(found: Mapping[str, Points]) -> Iterator[Block]:
    """Where the poses are; points (m) in base coordinates: candidates, tests, chosen."""
    yield Pair(tuple(Figure(svg, words) for svg, words in place_pictures(found)))
    yield Text.of(
        "poses.csv holds the joint values in an order that is short to travel; its column rank says which are worth most. Whether "
        "the arm hits itself or anything around it was not checked."
    )


def accuracy_picture(forecast: Listing, n: int, asked: float | None) -> str:
    """Foretold error against the number of poses on a logarithmic axis: mean, 95 %, random poses; empty text when
    nothing is predicted."""
    # The first poses only find the instrument.
    shown = [r for r in forecast.rows if r["poses"] >= min(3, n)]
    curves = {k: [finite(r[k]) for r in shown] for k in ("mean", "p95", "random")}
    around = span(v for c in curves.values() for v in c if v is not None)
    if not shown or around is None:
        return ""
    at = [float(r["poses"]) for r in shown]
    left, right, bottom, top = 56.0, 922.0, 300.0, 34.0
    x, y = AxisScale(0.0, at[-1] * 1.04, left, right), AxisScale(*around, bottom, top, log=True)
    parts = [axes(x, y, "poses measured", "foretold error, mm, logarithmic")]
    # All curves fall, so names stand in the upper right corner, beside a piece of their curve.
    for i, (key, cls, words) in enumerate(CURVES):
        known = [(x(a), y(v)) for a, v in zip(at, curves[key], strict=True) if v is not None]
        parts.append(path(polyline(known), cls))
        if known:
            parts += [line(right - 130, top + 12 + 17 * i, right - 104, top + 12 + 17 * i, cls)]
            parts.append(label(right - 96, top + 16 + 17 * i, words, "name"))
    there = [c[at.index(n)] for c in curves.values()] if n in at else []
    here = curves["mean"][at.index(n)] if there else None
    if here is not None:
        above = min(y(v) for v in there if v is not None) - 10
        parts += [line(x(n), bottom, x(n), above + 4, "axis"), points([(x(n), y(here))], "held")]
        parts.append(label(x(n) + 4, above, f"{n:.0f} poses: {significant(here)} mm", "strong"))
    if asked is not None and around[0] <= asked <= around[1]:
        parts.append(line(left, y(asked), right, y(asked), "mean held"))
        parts.append(label(right, y(asked) - 6, "asked for", "name", "end"))
    first, last = (f"{significant(curves['mean'][i])} mm after {at[i]:.0f} poses" for i in (0, -1))
    said = f"Foretold mean error falls from {first} to {last}."
    title = "Foretold error against the number of poses"
    return drawing(940, 345, parts, title=title, text=said, key="forecast", cls="wide")


def place_pictures(places: Mapping[str, Points]) -> list[tuple[str, str]]:
    """The measured points from above and from the side, each with its caption."""
    every = np.array([p for group in places.values() for p in group])
    if not len(every):
        return []
    candidates, chosen = places.get("candidates", ()), places.get("chosen", ())
    out = []
    for key, (i, j), words in (("above", (0, 1), "From above"), ("side", (0, 2), "From the side")):
        low, high = every[:, [i, j]].min(axis=0), every[:, [i, j]].max(axis=0)
        half, middle = float((high - low).max()) / 2 * 1.05 or 1.0, (high + low) / 2
        (left, below), (right, above) = ((1e3 * (middle + s * half)).tolist() for s in (-1, 1))
        x, y = AxisScale(left, right, 52, 452), AxisScale(below, above, 434, 34)
        dots = "".join(f"M{num(x(p[i] * 1e3) - 1)} {num(y(p[j] * 1e3) - 1)}h2v2h-2z" for p in candidates)
        parts = [axes(x, y, f"{'xyz'[i]}, mm", f"{'xyz'[j]}, mm"), path(dots, "seen")]
        parts.append(points([(x(p[i] * 1e3), y(p[j] * 1e3)) for p in chosen], "after"))
        parts.append(points([(x(0.0), y(0.0))], "before") if left <= 0 <= right and below <= 0 <= above else "")
        grey = f", and {len(candidates)} of the candidates as grey dots" if candidates else ""
        said = f"{words}: {len(chosen)} chosen poses{grey}; the circle is the base."
        out.append((drawing(460, 480, parts, title=words, text=said, key=key), said))
    return out

"""Pictures of errors: their histogram, every configuration in a row, the cost while it converges, and one picture for
a README."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal.report import svg
from robocal.report.numbers import significant, unit_text, with_unit
from robocal.report.proof import times_smaller
from robocal.report.series import ASIDE, Series, pairs
from robocal.report.svg import AxisScale, drawing, label, left_axis, line, num, path, points, polyline

__all__ = ["before_after", "convergence", "drawn_of", "histogram", "per_pose"]

MOST = 2000  # marks of a picture: more would be one black cloud
LARGEST = 20  # of each series, drawn in any case

# The colours of style.css, for a picture that stands alone.
STYLE = """
svg{--ink:#16202b;--soft:#5b6673;--grid:#e3e7ec;--axis:#9aa4af;--before:#c2530a;--held:#16202b;--paper:#fff}
@media (prefers-color-scheme:dark){
svg{--ink:#e8edf2;--soft:#a3afbb;--grid:#2a343f;--axis:#62707e;--before:#f08a45;--held:#fff;--paper:#10171f}}
text{font:12.5px system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;fill:var(--soft)}
.strong{font-weight:600;fill:var(--ink)}.big{font-size:17px;font-weight:600;fill:var(--ink)}
.grid,.join{stroke:var(--grid);fill:none}.axis{stroke:var(--axis);fill:none}.back{fill:var(--paper)}
.halo{stroke:var(--paper);stroke-width:4;opacity:.8}.mark.before{fill:none;stroke:var(--before);stroke-width:1.3}.mark.held{fill:var(--held)}
.mean{fill:none;stroke-width:1.5;stroke-dasharray:6 4}.mean.before{stroke:var(--before)}.mean.held{stroke:var(--held)}
"""


def _describe(series: Sequence[Series], unit: str) -> str:
    means = ("" if s.key == ASIDE else f", mean {with_unit(significant(s.mean), unit)}" for s in series)
    return "; ".join(f"{s.name}: {len(s.values)} values{mean}" for s, mean in zip(series, means, strict=True)) + "."


def histogram(series: Sequence[Series], quantity: str = "", unit: str = "mm") -> str:
    """How many errors of each size there are, one row per series over one logarithmic axis; empty text when there are
    no numbers."""
    around = _around(series)
    if around is None:
        return ""
    width, left, right, row, bins = 460.0, 8.0, 452.0, 78.0, 44
    height = 14 + row * len(series) + 44
    x = AxisScale(*around, left, right, log=True)
    parts = [svg.bottom_axis(x, height - 44, 10, f"error, {unit_text(unit)}, logarithmic")]
    for k, s in enumerate(series):
        foot = 14 + row * (k + 1)
        place = ((x.many(s.values) - left) / (right - left) * bins).astype(np.int64)
        counts = np.bincount(np.clip(place, 0, bins - 1), minlength=bins).tolist()
        step, most = (right - left) / bins, max(counts)
        bars = [
            f"M{num(left + i * step + 0.7)} {num(foot)}v{num(-(row - 42) * c / most)}h{num(step - 1.4)}V{num(foot)}z"
            for i, c in enumerate(counts)
            if c
        ]
        parts += [path("".join(bars), f"bar {s.key}"), line(left, foot, right, foot, "axis")]
        parts.append(label(left, foot - row + 28, f"{s.name} ({len(s.values)})", "name"))
        if s.key != ASIDE:
            at, mean = x(s.mean) if s.mean > 0 else left, f"mean {with_unit(significant(s.mean), unit)}"
            parts.append(line(at, foot - row + 38, at, foot, f"mean {s.key}"))
            parts.append(label(right, foot - row + 28, mean, "strong", "end"))
    said = "Histograms on one logarithmic axis. " + _describe(series, unit)
    key = f"hist-{quantity.strip('_') or 'distance'}"
    return drawing(width, height, parts, title="Histogram of errors", text=said, key=key)


def per_pose(series: Sequence[Series], quantity: str = "", unit: str = "mm") -> str:
    """Every error over its configuration's place in the file; of very many some, as `drawn_of` says."""
    if _around(series) is None:
        return ""
    parts, said = _scatter(series, unit, (52.0, 922.0, 284.0, 34.0), "configuration, in the order of the file")
    title, key = "Error of every configuration", f"pose-{quantity.strip('_') or 'distance'}"
    return drawing(940, 330, parts, title=title, text=said, key=key, cls="wide")


def drawn_of(series: Sequence[Series]) -> tuple[list[Series], str]:
    """What `per_pose` draws of series, and in words which share it is, where it is not all: of very many errors at even
    steps, with the largest of each series and whatever was set aside."""
    count = sum(len(s.values) for s in series if s.key != ASIDE)
    step = -(-count // MOST)
    if step <= 1:
        return list(series), ""
    out = []
    for s in series:
        kept = np.arange(len(s.values)) % (1 if s.key == ASIDE else step) == 0
        kept[np.argsort(s.values)[-LARGEST:]] = True
        out.append(Series(s.key, s.name, s.at[kept], s.values[kept]))
    return out, f"Of {count} errors one in {step} is drawn, and the {LARGEST} largest of each series."


def _around(series: Sequence[Series]) -> tuple[float, float] | None:
    """The range of all series on a logarithmic axis, as `span`."""
    values = np.concatenate([s.values for s in series]) if series else np.zeros(0)
    positive = values[values > 0]
    return svg.span([float(positive.min()), float(positive.max())]) if len(positive) else None


def _scatter(
    series: Sequence[Series], unit: str, box: tuple[float, float, float, float], what: str, named: bool = False
) -> tuple[list[str], str]:
    """Points over ordinals between (left, right, bottom, top) with mean lines; `named` writes the means and joins two
    series."""
    left, right, bottom, top = box
    low, high = _around(series) or (0.1, 1.0)
    last = max(int(s.at.max()) for s in series)
    x = AxisScale(0.5, last + 0.5, left, right)
    y = AxisScale(low, high, bottom, top, log=True)
    ticks = [t for t in svg.nice_ticks(1, max(last, 2)) if 1 <= t <= last]
    parts = [left_axis(y, left, right, f"error, {unit_text(unit)}, logarithmic")]
    parts.append(svg.count_axis(x, ticks, bottom, (left, right), what))
    shown, share = (list(series), "") if named else drawn_of(series)
    places = [(x.many(s.at), np.where(s.values > 0, y.many(s.values), bottom)) for s in shown]
    if named:
        (across, before), (_, after) = places
        joined = zip(across.tolist(), before.tolist(), after.tolist(), strict=True)
        parts.append(path("".join(f"M{num(i)} {num(b)}V{num(a)}" for i, b, a in joined), "join"))
    # Lines lie below the points: the halo that keeps a line apart from the axis would hide them.
    for s in series:
        if s.key == ASIDE:
            continue
        at = y(s.mean) if s.mean > 0 else bottom
        parts += [line(left, at, right, at, "halo"), line(left, at, right, at, f"mean {s.key}")]
        if named:
            parts.append(label(right + 12, at - 3, with_unit(significant(s.mean), unit), "big"))
            parts.append(label(right + 12, at + 14, s.name, "strong" if s.key == "held" else ""))
    parts += [points(np.stack(xy, axis=1).tolist(), s.key) for s, xy in zip(shown, places, strict=True)]
    said = "Errors on a logarithmic axis over configurations, with dashed lines at their means."
    return parts, f"{said} {_describe(series, unit)} {share}".strip()


def convergence(
    values: Sequence[float], at: Sequence[int] = (), what: str = "cost", unit: str = "", key: str = "convergence"
) -> str:
    """A cost or an error after iterations `at` (after each), logarithmic; empty text when there is no line to draw."""
    if len(values) < 2 or min(values) <= 0:
        return ""
    around = svg.span(values, 1e-32)  # the square of rounding
    if around is None:
        return ""
    width, height, left, right, bottom, head = 460.0, 250.0, 62.0, 446.0, 206.0, 34.0
    at = at or range(len(values))
    x = AxisScale(at[0], at[-1], left + 10, right - 8)
    y = AxisScale(*around, bottom, head, log=True)
    places = [*zip(x.many(at).tolist(), y.many(values).tolist(), strict=True)]
    parts = [left_axis(y, left, right, ", ".join(t for t in (what, unit_text(unit), "logarithmic") if t))]
    parts += [svg.count_axis(x, x.ticks, bottom, (left, right), "iteration"), path(polyline(places), "curve")]
    if len(values) <= 60:
        parts.append(points(places, "after"))
    first, last = (with_unit(significant(v), unit) for v in (values[0], values[-1]))
    said = f"The {what} {'falls' if values[-1] < values[0] else 'goes'} from {first} to {last} in {at[-1]} iterations."
    return drawing(width, height, parts, title=f"{what.capitalize()} after each iteration", text=said, key=key)


def before_after(residuals: Mapping[str, Sequence[object]]) -> str:
    """A stand-alone picture (SVG text) for a README: the same measurements before and after, joined, and the two means.

    Shows what was held out, or the fit where nothing was. Raises ValueError when the columns hold no errors.
    """
    name, found = pairs(residuals)
    if svg.span(v for pair in found for v in pair) is None:
        raise ValueError("the residuals hold no errors to draw")
    at, values = np.arange(1, len(found) + 1), np.array(found)
    shown = [Series("before", "before", at, values[:, 0]), Series("held", name, at, values[:, 1])]
    factor = times_smaller(shown[0].mean, shown[1].mean)
    title = f"Position error: {factor}" if factor else "Position error"
    title += " on measurements that the identification never saw" if name == "held out" else ""
    box = (52.0, 690.0, 318.0, 76.0)
    drawn, said = _scatter(shown, "mm", box, f"measurements ({name})", True)
    parts = ['<rect class="back" width="860" height="372" rx="10"/>', label(16, 32, title, "big"), *drawn]
    return drawing(860, 372, parts, title=title, text=said, key="robocal", style=STYLE.replace("\n", ""))

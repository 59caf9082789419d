"""The page of a lens: verdict, numbers, views, and pictures of what it leaves and of how sure it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array, Bools
from robocal.quantities import Listing
from robocal.remarks.remark import percent, sentences
from robocal.report.numbers import significant
from robocal.report.sections import Figure, Section, Text, VerdictBlock, ends, figure, listing_table, quiet
from robocal.report.svg import AxisScale, axes, drawing, label, line, num, path, points, polyline, rect

__all__ = ["further_section", "lens_pictures", "lens_sections"]

VERDICTS: dict[str, tuple[str, Any, str]] = {
    "improved": ("improved", "good", "On views that were left out this lens is better than the nominal one."),
    "not_improved": ("not improved", "doubtful", "A better lens was not proven. Keep the nominal one."),
    "refused": ("refused", "bad", "Do not use these numbers; they are listed for diagnosis only."),
}
BRIEF = 12  # views that a terminal lists
FIRST = 4  # further ones that a terminal lists, and how it is now
WIDE = 620.0  # px, of a picture
ARROWS = 3000  # of a picture
DIGIT = 8.0  # px, of a label, at most
GRID = 13, 9  # grid: places at which a pixel's spread is asked
BINS = 12  # grid: of a radius


def lens_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """The verdict, the errors, the numbers, and how each view is met."""
    said, errors = found.verdict, found.errors
    word, style, meaning = VERDICTS[said.status]
    advice = () if said.status == "improved" else tuple(dict.fromkeys(r.advice for r in said.remarks if r.advice))
    proof = ""
    if errors.unseen is not None:
        before, after = figure(errors.nominal.rms, 3), figure(errors.unseen.rms, 3)
        proof = f"Corners of views that were left out: {before} px by the nominal lens, {after} px by this one (rms)."
    yield Section.of("", VerdictBlock(word, style, tuple(sentences(said.remarks)), advice, meaning, proof))
    count, views = len(found.left), len(found.table.data.configurations)
    aside = f", {int(found.aside.sum())} set aside" if found.aside.any() else ""
    yield Section.of(
        "",
        Text.of(
            (f"{figure(errors.fitted.rms, 3)} px", "strong"),
            f"   rms of {count} corners in {views} views, as fitted{aside}",
        ),
        *_unseen(errors),
        *_again(found.again),
        *quiet(f"corners in {percent(found.coverage)} of the image; nominal: {found.named}"),
    )
    numbers = [c for c in found.numbers.columns if c.name not in ("low", "high")]
    yield Section.of("", listing_table(type(found.numbers)(tuple(numbers))), title="The lens", key="numbers")
    yield Section.of(
        "",
        listing_table(found.surely),
        *quiet("one standard deviation of where a point is seen, along the worst direction"),
        title="How sure a pixel is",
        key="sure",
    )
    table = listing_table(found.views)
    yield Section.of(
        "", type(table)(table.columns, table.rows, table.right, brief=BRIEF), title="View by view", key="views"
    )
    if found.further is not None:
        yield further_section(found.further)
    yield from ends(found.warnings, written)


def further_section(further: Listing) -> Section:
    """Where the target should be in more views."""
    table = listing_table(further)
    shown = type(table)(table.columns, table.rows, table.right, brief=FIRST)
    note = "views that would help most: where the target should be; sure: one standard deviation, a mean over the image"
    return Section.of("", shown, *quiet(note), title="Views that would help most", key="further")


def _unseen(errors: Any) -> Iterator[Text]:
    if errors.left_out is not None:
        yield Text.of(
            (f"{figure(errors.left_out.rms, 3)} px", "strong"),
            "   rms of views that were left out one by one, their own poses fitted",
        )


def _again(again: Any) -> Iterator[Text]:
    if again is not None:
        moved = f"moved corners by {figure(again.first, 2)} px at first, by {figure(again.last, 2)} px in the end (rms)"
        yield from quiet(
            f"{again.markers} markers and boards fitted again with the lens: {again.rounds} rounds, which {moved}"
        )


def lens_pictures(found: Any) -> Iterator[Section]:
    """Where residuals point, what they are along the radius, how sure a pixel is."""
    width, height = found.table.size
    uv, left, aside = found.table.pixels.value, found.left, found.aside
    scale = WIDE / width
    longest = float(np.percentile(np.linalg.norm(left[~aside], axis=1), 95)) or 1.0
    gain = 0.03 * WIDE / longest
    times = significant(gain / scale)
    caption = f"Every corner, with what the lens leaves of it, {times} times as long. They should point anywhere. Crosses: set aside."
    yield Section.of(
        "Where residuals point", Figure(_arrows(uv, left, aside, (width, height), gain), caption), key="residuals"
    )
    caption = "Errors away from and around the middle, by their distance from it: means of rings. Far from zero: another --model is wanted."
    yield Section.of("Along the radius", Figure(_radial(uv, left, aside, found.lens), caption), key="radius")
    far = f"{1e3 * found.distance:.0f} mm"
    caption = f"One standard deviation (px) of where a point at {far} is seen, along the worst direction. Grey dots are corners."
    yield Section.of("How sure, over the image", Figure(_sure(found), caption), key="map")


def _arrows(uv: Array, left: Array, aside: Bools, size: tuple[int, int], gain: float) -> str:
    scale = WIDE / size[0]
    tall = size[1] * scale
    step = -(-len(uv) // ARROWS)
    some = ~aside & (np.arange(len(uv)) % step == 0)
    at = (uv + 0.5) * scale
    parts = [rect(0, 0, WIDE, tall, "box"), path(_segments(at[some], at[some] - gain * left[some]), "arrow after")]
    parts.append(points(at[aside].tolist(), "aside"))
    return drawing(
        WIDE,
        tall,
        parts,
        title="Residuals over the image",
        text=f"{int(some.sum())} corners with their residuals",
        key="arrows",
    )


def _segments(begin: Array, end: Array) -> str:
    pairs = zip(begin.tolist(), end.tolist(), strict=True)
    return "".join(f"M{num(a[0])} {num(a[1])}L{num(b[0])} {num(b[1])}" for a, b in pairs)


def _radial(uv: Array, left: Array, aside: Bools, lens: Any) -> str:
    middle = lens.intrinsics[2:4]
    way = uv[~aside] - middle
    radius = np.linalg.norm(way, axis=1)
    way = way / np.maximum(radius, 1e-9)[:, None]
    out = -np.sum(left[~aside] * way, axis=1)
    around = -(left[~aside, 1] * way[:, 0] - left[~aside, 0] * way[:, 1])
    edges = np.linspace(0, radius.max() * 1.0001, BINS + 1)
    ring = np.digitize(radius, edges) - 1
    many = np.bincount(ring, minlength=BINS)
    full = many > 0
    means = [np.bincount(ring, v, minlength=BINS)[full] / many[full] for v in (out, around)]
    spread = 2 * np.sqrt(np.bincount(ring, out**2, minlength=BINS)[full]) / many[full]
    at = (edges[:-1] + edges[1:])[full] / 2
    most = 1.1 * max(float(np.abs(means[0]).max() + spread.max()), float(np.abs(means[1]).max()), 1e-9)
    x, y = AxisScale(0, float(edges[-1]), 60.0, WIDE - 10), AxisScale(-most, most, 260.0, 34.0)
    parts = [axes(x, y, "distance from the middle, px", "mean error, px"), line(x.start, y(0.0), x.end, y(0.0), "axis")]
    for values, cls in zip(means, ("curve", "curve random"), strict=True):
        parts.append(path(polyline([(x(a), y(v)) for a, v in zip(at.tolist(), values.tolist(), strict=True)]), cls))
    bars = [
        ((x(a), y(m - s)), (x(a), y(m + s)))
        for a, m, s in zip(at.tolist(), means[0].tolist(), spread.tolist(), strict=True)
    ]
    parts.append(path(_segments(np.array([b[0] for b in bars]), np.array([b[1] for b in bars])), "arrow after"))
    parts += [line(WIDE - 190, 16, WIDE - 166, 16, "curve"), label(WIDE - 160, 20, "outwards", "name")]
    parts += [line(WIDE - 90, 16, WIDE - 66, 16, "curve random"), label(WIDE - 60, 20, "around", "name")]
    return drawing(
        WIDE,
        310,
        parts,
        title="Errors along the radius",
        text=f"Means of rings up to {significant(most)} px",
        key="radial",
    )


def _sure(found: Any) -> str:
    width, height = found.table.size
    scale = WIDE / width
    tall = height * scale
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, width - 1, GRID[0]), np.linspace(0, height - 1, GRID[1])))
    sigma = found.sure(np.stack([u, v], axis=1))
    spots = ((found.table.pixels.value + 0.5) * scale)[:: -(-len(found.left) // ARROWS)]
    dots = "".join(f"M{num(a)} {num(b)}h0" for a, b in spots.tolist())
    parts = [rect(0, 0, WIDE, tall, "box"), f'<path d="{dots}" class="dots edge" stroke-width="2"/>']
    words = [significant(s, 2) if np.isfinite(s) else "folds" for s in sigma.tolist()]
    # Where numbers are long, every second or third of a row: they stand apart, and both ends are there.
    room = DIGIT * (max(map(len, words)) + 1) * (GRID[0] - 1) / WIDE
    apart = next((n for n in (1, 2, 3, 4, 6) if n >= room), GRID[0] - 1)
    for k, (a, b, word) in enumerate(zip((u * scale).tolist(), (v * scale).tolist(), words, strict=True)):
        if k % GRID[0] % apart:
            continue
        anchor = "start" if a < 20 else "end" if a > WIDE - 20 else "middle"
        parts.append(label(a, min(max(b + 4, 12), tall - 3), word, "strong", anchor))
    return drawing(
        WIDE,
        tall,
        parts,
        title="How sure a pixel is",
        text=f"From {significant(float(np.nanmin(sigma)))} to {significant(float(np.nanmax(sigma)))} px",
        key="sure",
    )

"""Marks in space: each carries its points, is drawn for one view, and is sorted so that near ones hide far ones. turn.js
draws the same marks again for another view."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.report.svg import num, polyline
from robocal.report.view import Box, View

__all__ = ["Mark", "draw", "labels", "place_labels"]

LINE = 15.0  # px from one line of words to the next


@record(eq=False)
class Mark:
    """One mark: points (n, 3) m joined by a line (`closed`: a face; one point: a dot of radius `size` px), its classes, further
    attributes as text, what shows when the pointer rests on it, and by how much (px) it is taken for nearer than it is."""

    points: Array
    cls: str
    closed: bool = False
    size: float = 0.0
    more: str = ""
    hint: str = ""
    lift: float = 0.0


def draw(marks: Iterable[Mark], view: View, ordered: bool = True) -> str:
    """All marks as one text, far ones first."""
    listed = list(marks)
    if not listed:
        return ""
    every = np.concatenate([m.points for m in listed])
    cuts = np.cumsum([len(m.points) for m in listed])[:-1]
    flat, near = view.flat(every)
    places, data, depth = (np.split(part, cuts) for part in (flat, view.local(every), near))
    found = [
        (float(d.mean()) + m.lift, _one(m, xy.tolist(), local.ravel().tolist()))
        for m, xy, local, d in zip(listed, places, data, depth, strict=True)
    ]
    if ordered:
        found.sort(key=lambda pair: pair[0])
    return "".join(text for _, text in found)


def _one(mark: Mark, xy: list[list[float]], local: list[float]) -> str:
    """A mark drawn at places (px), with what turn.js needs to draw it elsewhere."""
    data = " ".join(num(v) for v in local)
    lift = f' data-lift="{num(mark.lift)}"' if mark.lift else ""
    if len(xy) == 1:
        tag, shape = "circle", f'cx="{num(xy[0][0])}" cy="{num(xy[0][1])}" r="{num(mark.size)}"'
    else:
        tag, shape = "path", f'd="{polyline(xy, mark.closed)}"'
    text = f'<{tag} class="{mark.cls}" {shape} data-p="{data}"{lift}{mark.more}'
    return f"{text}><title>{escape(mark.hint)}</title></{tag}>" if mark.hint else f"{text}/>"


def labels(points: Array, texts: Sequence[tuple[str, str]], view: View, box: Box) -> str:
    """Two words (a name, and what is said of it) beside each point (n, 3) m: outwards from the middle, and apart from one another."""
    xy = view.flat(points)[0]
    wide = np.array([7.9 * len(a) + 7.1 * len(b) + (5 if b else 0) for a, b in texts])
    at, side = place_labels(xy, wide, np.asarray(view.at), box)
    parts = []
    for k, (name, said) in enumerate(texts):
        data = " ".join(num(v) for v in view.local(points[k]).tolist())
        more = f' <tspan class="said">{escape(said)}</tspan>' if said else ""
        parts.append(
            f'<text class="halo-text" x="{num(at[k, 0])}" y="{num(at[k, 1])}" text-anchor="{"end" if side[k] < 0 else "start"}" '
            f'data-w="{num(wide[k])}" data-p="{data}"><tspan class="strong">{escape(name)}</tspan>{more}</text>'
        )
    return "".join(parts)


def place_labels(xy: Array, wide: Array, middle: Array, box: Box) -> tuple[Array, Array]:
    """Where texts of widths (n,) stand beside points (n, 2) px, (n, 2): on the side away from the middle where
    the box has room, else on the other, -1 left or 1 right (n,); pushed apart up and down until none covers another."""
    left, top, right, bottom = box
    side = np.where(xy[:, 0] < middle[0], -1.0, 1.0)
    side = np.where(np.where(side < 0, xy[:, 0] - 9.0 - wide < left, xy[:, 0] + 9.0 + wide > right), -side, side)
    at = xy + np.stack([9.0 * side, np.where(xy[:, 1] < middle[1], -3.0, 11.0)], axis=1)
    start = np.where(side < 0, at[:, 0] - wide, at[:, 0])
    across = (start[:, None] < (start + wide)[None]) & (start[None] < (start + wide)[:, None])
    np.fill_diagonal(across, False)
    # The lower index goes up where two are level.
    first = np.sign(np.subtract.outer(np.arange(len(at)), np.arange(len(at))))
    for _ in range(60):
        gap = at[:, None, 1] - at[None, :, 1]
        push = np.where(across, np.maximum(LINE - np.abs(gap), 0.0), 0.0) * np.where(gap == 0.0, first, np.sign(gap))
        if not np.abs(push).max(initial=0.0) > 0.05:
            break
        at[:, 1] = np.clip(at[:, 1] + 0.5 * push.sum(axis=1), top + 12.0, bottom - 4.0)
    return at, side

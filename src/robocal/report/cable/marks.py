"""Marks in space: each carries its points, is drawn for one view, and is sorted so that near ones hide far ones. turn.js
draws the same marks again for another view."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from robocal.report.cable.view import View
from robocal.report.svg import num

__all__ = ["Mark", "draw", "labels"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mark:
    """One mark: points (n, 3) m joined by a line (`closed`: a face; one point: a dot of radius `size` px), its classes, further
    attributes as text, and what shows when the pointer rests on it. `lift` (px) draws it before what is as near."""

    points: Array
    cls: str
    closed: bool = False
    size: float = 0.0
    more: str = ""
    hint: str = ""
    lift: float = 0.0


def draw(marks: Iterable[Mark], view: View, ordered: bool = True) -> str:
    """All marks as one text, far ones first."""
    found = [(_near(m, view), _one(m, view)) for m in marks]
    if ordered:
        found.sort(key=lambda pair: pair[0])
    return "".join(text for _, text in found)


def _near(mark: Mark, view: View) -> float:
    return float(view.flat(mark.points)[1].mean()) + mark.lift


def _one(mark: Mark, view: View) -> str:
    local = view.local(mark.points)
    xy = view.flat(mark.points)[0]
    data = " ".join(num(v) for v in local.ravel().tolist())
    more = f' data-p="{data}"{f" data-lift={chr(34)}{num(mark.lift)}{chr(34)}" if mark.lift else ""}{mark.more}'
    end = f"><title>{escape(mark.hint)}</title></" if mark.hint else "/>"
    if len(mark.points) == 1:
        x, y = (num(v) for v in xy[0].tolist())
        text = f'<circle class="{mark.cls}" cx="{x}" cy="{y}" r="{num(mark.size)}"{more}{end}'
        return text + ("circle>" if mark.hint else "")
    d = "M" + "L".join(f"{num(x)} {num(y)}" for x, y in xy.tolist()) + ("z" if mark.closed else "")
    return f'<path class="{mark.cls}" d="{d}"{more}{end}' + ("path>" if mark.hint else "")


def labels(points: Array, texts: Sequence[tuple[str, str]], view: View, width: float, height: float) -> str:
    """Two words (a name, and what is said of it) beside each point (n, 3) m: outwards from the middle, and apart from one another."""
    if not len(points):
        return ""
    xy = view.flat(points)[0]
    wide = np.array([7.6 * len(a) + 6.9 * len(b) + (5 if b else 0) for a, b in texts])
    at, side = placed(xy, wide, np.asarray(view.at), width, height)
    data = view.local(points)
    parts = []
    for (name, said), p, (x, y), s, w in zip(
        texts, data.tolist(), at.tolist(), side.tolist(), wide.tolist(), strict=True
    ):
        anchor = "end" if s < 0 else "start"
        more = f' <tspan class="said">{escape(said)}</tspan>' if said else ""
        parts.append(
            f'<text class="name" x="{num(x)}" y="{num(y)}" text-anchor="{anchor}" data-w="{num(w)}" data-p="{" ".join(num(v) for v in p)}">'
            f'<tspan class="strong">{escape(name)}</tspan>{more}</text>'
        )
    return "".join(parts)


def placed(xy: Array, wide: Array, middle: Array, width: float, height: float) -> tuple[Array, Array]:
    """Where texts of a width stand beside points (n, 2), (n, 2), and on which side of them, -1 left or 1 right."""
    side = np.where(xy[:, 0] < middle[0], -1.0, 1.0)
    at = xy + np.stack([10.0 * side, np.where(xy[:, 1] < middle[1], -3.0, 11.0)], axis=1)
    left, right = np.where(side < 0, at[:, 0] - wide, at[:, 0]), np.where(side < 0, at[:, 0], at[:, 0] + wide)
    at[:, 0] += np.clip(4.0 - left, 0.0, None) - np.clip(right - (width - 4.0), 0.0, None)
    for _ in range(40):
        moved = False
        for i in range(len(at)):
            for j in range(i):
                if left[i] < right[j] and left[j] < right[i]:
                    gap = at[i, 1] - at[j, 1]
                    if abs(gap) < 15.0:
                        push = (15.0 - abs(gap)) / 2.0 + 0.01
                        sign = 1.0 if gap >= 0 else -1.0
                        at[i, 1] += sign * push
                        at[j, 1] -= sign * push
                        moved = True
        at[:, 1] = np.clip(at[:, 1], 14.0, height - 6.0)
        if not moved:
            break
    return at, side

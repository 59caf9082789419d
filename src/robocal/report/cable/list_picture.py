"""What a list of poses reaches: figure 3.6 of the thesis, the box Z, the poses that were wished for and those that were found."""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.cables.boundary import Outline
from robocal.cables.pose_list import LIMITS, PoseBox, PoseList
from robocal.report.cable.drawing import figure
from robocal.report.cable.length_unit import METRE, LengthUnit
from robocal.report.cable.plane_view import Plane, plane
from robocal.report.svg import circles, crosses, label, num, path, segments

__all__ = ["draw_reach"]

MOST = 2000
WHY = {
    "statics": "tension limits", "cable-cable": "cable on cable", "cable-platform": "cable on platform",
    "cable-pulley": "cable on its pulley",
}  # fmt: skip


def draw_reach(
    outline: Outline | None,
    listing: PoseList,
    axes: tuple[int, int] = (0, 1),
    *,
    box: PoseBox | None = None,
    ruler: LengthUnit = METRE,
) -> str:
    """The picture (SVG) of a list in the plane of two axes: targets X_r red, poses X_j blue crosses, the start X_0, and where they
    are given the box Z and the outline of the workspace."""
    start = listing.start[:3, 3]
    wished, found = (start + listing.translation)[:MOST], listing.poses[:MOST, :3, 3]
    z = None if box is None else _box(start, box, axes)
    every = [wished, found, start[None], *([] if z is None else [z]), *([] if outline is None else [outline.points])]
    at = plane(axes, np.concatenate(every), right=204.0, widest=640.0, ruler=ruler)
    parts = [at.frame]
    if outline is not None:
        parts.append(at.line(outline.points, "space", closed=True))
    if z is not None:
        parts.append(at.line(z, "zbox", closed=True))
    if len(wished) <= 300:
        ends = np.concatenate([at.flat(found), at.flat(wished)], axis=1)
        parts.append(path(segments(ends.tolist()), "way"))
    size = 3.4 if len(wished) <= 300 else 2.4
    parts.append(path(circles(at.flat(wished).tolist(), 0.75 * size), "wished"))
    parts.append(path(crosses(at.flat(found).tolist(), size), "found"))
    x, y = at.flat(start).tolist()[0]
    parts += [path(crosses([(x, y)], 6.0), "home"), label(x + 10, y + 4, "start", "strong halo-text")]
    parts.append(_legend(at, listing, outline is not None, z is not None))
    said = f"{len(listing.fraction)} poses; {_percent(listing.reach_share)} % of their targets were reached."
    title = f"Targets and poses, plane {'xyz'[axes[0]]}{'xyz'[axes[1]]}"
    return figure("reached", at.width, at.height, parts, title=title, text=said)


def _box(start: Array, box: PoseBox, axes: tuple[int, int]) -> Array:
    out = np.tile(start + box.offset, (4, 1))
    half = np.asarray(box.translation, float)
    for k, signs in zip(axes, ((-1, 1, 1, -1), (-1, -1, 1, 1)), strict=True):
        out[:, k] += half[k] * np.array(signs)
    return out


def _legend(at: Plane, listing: PoseList, space: bool, z: bool) -> str:
    x, y = at.x.end + 24, at.y.end + 8
    rows = [(path(circles([(x + 8, y)], 2.6), "wished"), "targets")]
    rows.append((path(crosses([(x + 8, y + 22)], 3.4), "found"), "poses"))
    if z:
        rows.append((f'<path class="zbox" d="M{num(x)} {num(y + 22 * len(rows))}h16"/>', "box of targets"))
    if space:
        rows.append((f'<path class="space line" d="M{num(x)} {num(y + 22 * len(rows))}h16"/>', "workspace"))
    parts = [mark + label(x + 24, y + 22 * k + 4, word, "name") for k, (mark, word) in enumerate(rows)]
    y += 22 * len(rows) + 16
    parts.append(label(x, y, f"{_percent(listing.reach_share)} % reached", "strong"))
    parts.append(label(x, y + 19, f"of {len(listing.fraction)}; others ended", "tick"))
    for k, word in enumerate(LIMITS[1:]):
        count = int((listing.limit == k + 1).sum())
        if count or word != "cable-pulley":
            parts.append(label(x, y + 38 + 18 * k, f"{count} by {WHY[word]}", "tick"))
    return "".join(parts)


def _percent(share: float) -> str:
    """Two digits where so few are reached that a rounded number would say none."""
    value = 100.0 * share
    return f"{value:.0f}" if value == 0 or value >= 10 else f"{value:.2g}"

"""Where a platform can be at all, and what a grid of its workspace looks like: parts, holes, what is seen from a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from robocal._record import record
from robocal._types import Array, Bools
from robocal.cables.geometry import CableRobot
from robocal.cables.workspace import Grid
from robocal.errors import require

__all__ = ["FLAT", "Regions", "cut_off", "frame_box", "regions", "visible_share"]

SAMPLE = 20_000
FLAT = 0.1  # a frame lower than this share of its width hangs its platform below itself


def frame_box(robot: CableRobot, rotations: ArrayLike | None = None) -> tuple[Array, str]:
    """The box (3, 2) m of positions in which a frame can hold its platform, and in words how far down it goes.

    To the sides and upwards: the box of the frame anchors, grown by the platform in its `rotations` (n, 3, 3) and by pulleys.
    Beyond it all cables pull back to one side, which no weight balances. Downwards: to z = 0 where the frame stands above it,
    otherwise to the lowest frame anchor; below a flat frame, which hangs its platform, as far as it is wide. Platform
    anchors and origin stay above that. A planar robot keeps to the plane of `robot.home`.
    """
    turned = np.eye(3)[None] if rotations is None else np.asarray(rotations, float)
    b = robot.platform_points @ turned.swapaxes(-1, -2)  # (n, p, 3)
    wheel = 0.0 if robot.wheels is None else 2.0 * float(robot.wheels.radius.max())
    low, high = robot.frame_points.min(axis=0) - wheel, robot.frame_points.max(axis=0) + wheel
    box = np.stack([low - b.max(axis=(0, 1)), high - b.min(axis=(0, 1))], axis=1)
    off = [i for i in range(3) if i not in robot.axes]
    box[off] = robot.home[off, 3, None]
    if 2 in off:
        return box, "the frame anchors, grown by the platform"
    bottom, words = _bottom(robot)
    box[2, 0] = bottom - min(0.0, float(b[..., 2].min()))
    box[2, 1] = max(box[2, 1], box[2, 0])
    return box, f"the frame anchors, grown by the platform; {words}"


def _bottom(robot: CableRobot) -> tuple[float, str]:
    """The lowest height, m, and in words what it is."""
    low, high = robot.frame_points.min(axis=0), robot.frame_points.max(axis=0)
    wide = float((high - low)[:2].max())
    deep = float(low[2]) - max(wide, float(high[2] - low[2]))
    bottom, words = (0.0, "down to z = 0") if low[2] >= 0.0 else (float(low[2]), "down to the lowest one")
    if high[2] - bottom < FLAT * wide or bottom < deep:
        return deep, "as far below the frame as it is large"
    return bottom, words


@record
class Regions:
    """What the held cells of a grid make up.

    `parts` and `holes`: numbers of cells, greatest first, of parts that touch by faces and of holes enclosed in them; `main`
    (nx, ny, nz): the cells of the greatest part; `centre` (3,) m of the held cells, and their `extent` (3, 2) m.
    """

    parts: tuple[int, ...]
    holes: tuple[int, ...]
    main: Bools
    centre: Array
    extent: Array

    @property
    def heart(self) -> tuple[int, int, int]:
        """The cell of the greatest part that is nearest to the part's centre."""
        at = np.argwhere(self.main)
        i, j, k = at[np.argmin(((at - at.mean(axis=0)) ** 2).sum(axis=1))]
        return int(i), int(j), int(k)


def regions(made: Grid) -> Regions:
    """Parts, holes and extent of a grid's held cells. Raises ModelError when no cell is held."""
    held = made.inside
    require(held.any(), "no cell of the grid can be held")
    labels, count = ndimage.label(held)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    wide = [1 if n > 1 else 0 for n in held.shape]  # an axis of one cell has no outside
    outside, blanks = ndimage.label(~np.pad(held, [(w, w) for w in wide]))
    hollow = np.bincount(outside.ravel(), minlength=blanks + 1)
    rim = outside[tuple(0 if w else slice(None) for w in wide)].ravel()
    hollow[0], hollow[rim] = 0, 0
    cells = np.argwhere(held)
    x = np.stack([made.axes[i][cells[:, i]] for i in range(3)], axis=1)
    extent = np.stack([x.min(axis=0) - made.cell / 2, x.max(axis=0) + made.cell / 2], axis=1)
    main = labels == 1 + int(np.argmax(sizes))
    parts, holes = (tuple(np.sort(n)[::-1].tolist()) for n in (sizes, hollow[hollow > 0]))
    return Regions(parts, holes, main, x.mean(axis=0), extent)


def cut_off(extent: ArrayLike, box: ArrayLike) -> tuple[str, ...]:
    """The sides of a box (3, 2), such as "z-", that an extent (3, 2) reaches; none where the box has no thickness."""
    held, sides = np.asarray(extent, float), np.asarray(box, float)
    room = 1e-9 * (sides[:, 1] - sides[:, 0])
    below, above = held[:, 0] <= sides[:, 0] + room, held[:, 1] >= sides[:, 1] - room
    hits = [
        (f"{'xyz'[i]}{sign}", hit[i]) for i in range(3) for sign, hit in (("-", below), ("+", above)) if room[i] > 0.0
    ]
    return tuple(side for side, hit in hits if hit)


def visible_share(made: Grid, start: ArrayLike) -> float:
    """The share of a grid's held cells that are seen from `start` (3,) m: every cell on the straight way is held too. Many cells
    are represented by SAMPLE of them."""
    cells = np.argwhere(made.inside)
    cells = cells[:: max(1, len(cells) // SAMPLE)]
    if not len(cells):
        return 0.0
    size = np.where(made.cell > 0.0, made.cell, 1.0)
    origin = (np.asarray(start, float) - [axis[0] for axis in made.axes]) / size  # in cells, centres at whole numbers
    seen = np.ones(len(cells), bool)
    steps = 2 * max(made.inside.shape)
    last = np.array(made.inside.shape) - 1
    for share in (np.arange(steps) + 0.5) / steps:
        at = np.clip(np.rint(origin + share * (cells - origin)).astype(int), 0, last)
        seen &= made.inside[tuple(at.T)]
    return float(seen.mean())

"""What is said of corners before a lens is fitted, and of a lens that was: what is wrong, and what to do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.diagnose.check_registry import Finding, doubt, qualify, refuse
from robocal.diagnose.vision_limits import (
    IMAGE_COVERAGE,
    LENS_CENTRE,
    LENS_FOCAL,
    LENS_LEFT,
    LENS_MISSES,
    LENS_MISSES_TIMES,
    LENS_TILT,
    LENS_UNSEEN,
    LENS_VIEW_LEFT,
    LENS_VIEWS,
)
from robocal.errors import ModelError
from robocal.prove.statistics import Statistic
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, percent
from robocal.session.vision.corner_table import CornerTable
from robocal.vision.camera import fold_mask, unproject
from robocal.vision.lens_start import FlatViews
from robocal.vision.lenses import Lens

__all__ = ["check_inside", "check_sights", "judge_lens", "names_of", "outside_image", "refuse_views"]

UNSTATED = 0.1  # px: of a corner, where nobody states it
SURE = 2.0  # tolerance: standard deviations
SHOWN = 8  # grid: views that a sentence names
WITHOUT = "corners with the right numbers, --exclude these views, or --model fisheye for a very wide lens"


def refuse_views(table: CornerTable, seen: FlatViews | None) -> None:
    """Raises ModelError where corners cannot be what a camera saw of this target, whatever its lens."""
    ids, (width, height), uv = table.data.configurations.ids, table.size, table.pixels.value
    many = np.bincount(table.pixels.configuration, minlength=len(ids))
    full = int((many >= 4).sum())
    if full < LENS_VIEWS:
        expected = (
            f"{LENS_VIEWS:g} at least, better 15 to 40: tilted by 20 to 45 deg in different directions, near and far"
        )
        raise ModelError("too few views tell no lens", key="view", found=f"{full} with four corners", expected=expected)
    check_inside(uv, width, height)
    if seen is not None:
        check_sights(table, seen)


def check_inside(uv: Array, width: int, height: int) -> None:
    """Raises ModelError where corners lie outside the image."""
    outside = outside_image(uv, width, height)
    if outside.any():
        turned = not outside_image(uv[:, ::-1], width, height).any()
        message = "corners lie outside the image"
        if turned:
            message = "u and v are exchanged, or width and height of the image"
        found = f"{int(outside.sum())} of {len(uv)} corners beyond {width} x {height} px"
        raise ModelError(
            message, key="u", found=found, expected="u to the right, v down, and --image as the camera takes it"
        )


def check_sights(table: CornerTable, seen: FlatViews) -> None:
    """Raises ModelError where no camera sees corners so, or sees the target from behind."""
    ids, known = table.data.configurations.ids, seen.known
    _refuse_bent(ids, seen)
    behind = known & ~seen.front
    if not table.upright and behind.sum() > known.sum() / 2:
        behind = known & seen.front  # whoever made the table has z into the target: what most views show is its front
    if behind.any():
        every = bool(behind.sum() == known.sum())
        expected = (
            "u to the right and v down, corners as they are printed"
            if every
            else "one side of the target; --exclude the others"
        )
        message = (
            "u and v are exchanged, or images mirrored"
            if every
            else "some views show the target from behind, or mirrored"
        )
        raise ModelError(message, key="view", found=names_of(ids, seen.view[behind]), expected=expected)


def _refuse_bent(ids: Sequence[str], seen: FlatViews) -> None:
    """A lens bends a flat target by little of what an image shows of it."""
    strange = seen.known & (np.nan_to_num(seen.left) > LENS_VIEW_LEFT * seen.extent)
    if strange.any():
        worst = float((seen.left[strange] / seen.extent[strange]).max())
        found = f"{names_of(ids, seen.view[strange])} (off by up to {percent(worst)} of what they show)"
        raise ModelError("corners that no camera sees so of this target", key="view", found=found, expected=WITHOUT)


def outside_image(uv: Array, width: int, height: int) -> Bools:
    """Which pixels (n, 2) lie outside an image."""
    return np.asarray((uv < -0.5).any(axis=1) | (uv[:, 0] > width - 0.5) | (uv[:, 1] > height - 0.5))


def names_of(ids: Sequence[str], some: Ints) -> str:
    """The first of some views by name."""
    names = [ids[i] for i in np.unique(some).tolist()]
    return ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")


def judge_lens(
    lens: Lens,
    sigma: dict[str, float],
    tilt: float,
    noise: float,
    unseen: Statistic | None,
    coverage: float,
    points: Array,
    stated: Array | None,
) -> list[Finding]:
    """What speaks against a lens: sigma of its numbers by symbol, the largest tilt of a view (deg), the noise that
    the fit tells (px), the errors of views that were left out, the share of the image with corners, all corners (n, 3) in the
    camera's frame, and the sigma (n, 2) that they state (px), with which another check compares what is left, or None."""
    out: list[Finding] = []
    axis = noise / np.sqrt(2.0)
    times = axis / (UNSTATED if stated is None else float(np.sqrt(np.mean(np.square(stated)))))
    assert lens.size is not None
    width, height = lens.size
    if axis > LENS_MISSES * width and times > LENS_MISSES_TIMES:
        out.append(qualify(Code.LENS_MISSES, left=Quantity(axis, "px"), times=times))
    elif stated is None and axis > LENS_LEFT:
        usual = Quantity(UNSTATED, "px")
        out.append(doubt(Code.LENS_LEAVES, left=Quantity(axis, "px"), stated=None, usual=usual))
    if unseen is not None and unseen.rms > LENS_UNSEEN * noise:
        out.append(qualify(Code.LENS_OVERFITTED, unseen=unseen.rms, seen=noise, times=unseen.rms / noise))
    off = {
        s: sigma.get(s, np.inf) / abs(f)
        for s, f in zip(lens.kind.symbols[:2], lens.numbers, strict=False)
        if s in sigma
    }
    if off and max(off.values()) > LENS_FOCAL:
        told = tilt if tilt < LENS_TILT else None
        out.append(refuse(Code.LENS_FOCAL_OPEN, names=tuple(off), share=max(off.values()), tilt=told))
    beyond = fold_mask(points, lens.intrinsics)
    apart = np.abs(lens.intrinsics[2:4] - [(width - 1) / 2, (height - 1) / 2])
    unsure = np.array([sigma.get(s, 0.0) for s in lens.kind.symbols[2:4]])
    if (apart - SURE * unsure > LENS_CENTRE * width).any():
        out.append(doubt(Code.LENS_OFF_CENTRE, share=float(np.hypot(*apart) / width)))
    if beyond.any():
        out.append(refuse(Code.LENS_FOUND_FOLDS, count=int(beyond.sum()), total=len(points)))
    else:
        corners = np.array([(u, v) for u in (0, width - 1) for v in (0, height - 1)], dtype=float)
        lost = np.isnan(unproject(corners, lens.intrinsics)).any(axis=1)
        if lost.any():
            out.append(doubt(Code.LENS_FOLDS_OUTSIDE, count=int(lost.sum())))
    if coverage < IMAGE_COVERAGE:
        out.append(doubt(Code.IMAGE_HARDLY_COVERED, share=coverage))
    return out

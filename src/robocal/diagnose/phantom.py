"""Mistakes in the list of a phantom, tried one by one: names exchanged, inches for millimetres, one axis mirrored, one wire elsewhere. And
pixels of another size than stated.

    left_k^2 = (|r|^2 - |r_k|^2) / n_k,    r_k of the rows without wire k, fitted alone

Every list is tried with the best affine image plane (`fit.starts.image_planes`), which costs one linear system, on all rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose import vision_limits
from robocal.diagnose.check_registry import Context, Finding, When, check, doubt, refuse
from robocal.fit.starts.image_planes import affine_image
from robocal.geometry import se3
from robocal.measure.data import Observations
from robocal.measure.machine import Model, freedom_of
from robocal.measure.plane_points import ACROSS, AT, IMAGE, NAMED, PIXEL_SIZES
from robocal.measure.reach import nominal_poses
from robocal.remarks.english import declare
from robocal.remarks.remark import Number, Quantity

__all__: list[str] = []

INCH = 25.4
EXCHANGES = 4  # grid: of names, one after another
EXCHANGED = declare(
    "phantom-exchanged",
    "{one} and {other} of the phantom of {group} are exchanged: as named, points are {stated:.3g} rms from them, exchanged {left:.3g}",
    "Exchange the two names in the table, or in the list of the phantom.",
)
MIXED = declare(
    "phantom-mixed",
    "the names of the phantom of {group} are mixed up ({names}): as named, points are {stated:.3g} rms from it, so {left:.3g}",
    "Correct these names in the table, or in the list of the phantom.",
)
OTHER_UNIT = declare(
    "phantom-unit",
    "the phantom of {group} is stated {factor:.4g} times its size: so points are {stated:.3g} rms from it, else {left:.3g}",
    "State the phantom in the unit of the file: a factor of 25.4 is inches and millimetres.",
)
MIRRORED = declare(
    "phantom-mirrored",
    "the phantom of {group} is mirrored along {axis}: as stated, points are {stated:.3g} rms from it, mirrored {left:.3g}",
    "Change the sign of {axis} in the list of the phantom: its axes must be right-handed.",
)
DISPLACED = declare(
    "phantom-displaced",
    "{name} of the phantom of {group} is not where it is stated: its points are {stated:.3g} rms from it, the others {left:.3g}",
    "Correct the coordinates of {name} in the list of the phantom, or leave its rows out.",
)
PIXELS = declare(
    "pixel-size",
    "pixels of {group} are {u:.4g} by {v:.4g} large, {factor:.3g} times the stated size: images of another depth, or another unit",
    "State the size of a pixel at the depth of these images (image: pixel).",
)


@record
class _PhantomRows:
    """What one image shows: T_phantom_probe (k, 4, 4), pixels (k, 2), which name (k,), and of each name a point and directions."""

    carried: Array
    image: Array
    named: Ints
    at: Array
    across: Array

    def left(self) -> float:
        """What the best affine plane leaves, rms of the distance (m)."""
        at, e = self.at[self.named], self.across[self.named]
        h = affine_image(self.carried, self.image, at, e)
        if h is None:
            return np.inf
        inside = np.column_stack([self.image, np.ones(len(self.image))]) @ h.T
        there = np.einsum("mij,mj->mi", self.carried[:, :3, :3], inside) + self.carried[:, :3, 3]
        left = np.einsum("mdi,mi->md", e, there - at)
        return float(np.sqrt((left**2).sum(axis=1).mean()))


@check("phantom", When.PROOF, order=131, needs=("data", "fit"))
def phantom_causes(context: Context[Model]) -> Iterator[Finding]:
    """A mistake in the list of a phantom that explains most of what is left."""
    for obs in context.need_data.observations:
        rows = _rows(context, obs)
        if rows is None:
            continue
        stated = rows.left()
        tried = [(other.left(), code, facts) for other, code, facts in (*_others(rows, obs), *_mixed(rows, obs))]
        left, code, facts = min(tried, key=lambda t: t[0])
        # A smaller list leaves less of everything: where the probe hardly moves, exactly so much less.
        factor = facts.get("factor")
        smaller = max(1.0, factor) if isinstance(factor, float) else 1.0
        if vision_limits.PHANTOM_TIMES * smaller * left < stated < np.inf:
            yield refuse(code, **facts, group=obs.label, stated=Quantity(stated), left=Quantity(left))
            continue
        own, others, name = max(_without_each(rows, obs), default=(0.0, np.inf, ""))
        if vision_limits.PHANTOM_TIMES * others < own < np.inf:
            yield refuse(DISPLACED, name=name, group=obs.label, stated=Quantity(own), left=Quantity(others))


def _without_each(rows: _PhantomRows, obs: Observations) -> Iterator[tuple[float, float, str]]:
    """What one wire adds to what is left, per row of it; what the others leave without it; its name."""
    every, count = obs.options["names"], len(rows.named)
    assert isinstance(every, tuple)
    whole = rows.left() ** 2 * count
    for i, number in enumerate(np.unique(obs.extra[NAMED]).astype(int).tolist()):
        kept = rows.named != i
        if not kept.any() or kept.all():
            continue
        left = replace(rows, carried=rows.carried[kept], image=rows.image[kept], named=rows.named[kept]).left()
        if not np.isfinite(left):
            continue
        many = int(kept.sum())
        yield float(np.sqrt(max(whole - left**2 * many, 0.0) / (count - many))), left, str(every[number])


def _rows(context: Context[Model], obs: Observations) -> _PhantomRows | None:
    frame, named = obs.frame, obs.extra.get(NAMED)
    # Poses that are free say nothing of a phantom before the fit.
    if named is None or frame is None or len(obs.targets) != 1 or freedom_of(context.model):
        return None
    machine = nominal_poses(context.model, context.need_data.configurations)
    if machine is None:
        return None
    machine = machine[obs.configuration]
    target, held = se3.from_vector(obs.targets[0].value), np.eye(4)
    place = target if obs.targets[0].mount == "base" else machine @ target
    carried = np.broadcast_to(se3.inverse(place) @ (machine if frame.mount == "tool" else held), machine.shape)
    known = np.isfinite(carried).all(axis=(1, 2))
    names, first, which = np.unique(named[known], return_index=True, return_inverse=True)
    if not len(names):
        return None
    at = obs.extra[AT][known][first]
    across = obs.extra[ACROSS][known][first] if ACROSS in obs.extra else np.broadcast_to(np.eye(3), (len(at), 3, 3))
    return _PhantomRows(carried[known], obs.extra[IMAGE][known], which.ravel(), at, across)


def _mixed(rows: _PhantomRows, obs: Observations) -> Iterator[tuple[_PhantomRows, str, dict[str, Number]]]:
    """Several exchanges, each the one that leaves least after those before it."""
    every, count = obs.options["names"], len(rows.at)
    assert isinstance(every, tuple)
    names = [every[i] for i in np.unique(obs.extra[NAMED]).astype(int)]
    order, least = np.arange(count), rows.left()
    for k in range(EXCHANGES):
        found = []
        for i, j in combinations(range(count), 2):
            new = order.copy()
            new[[i, j]] = order[[j, i]]
            found.append((replace(rows, at=rows.at[new], across=rows.across[new]).left(), i, j))
        left, i, j = min(found, default=(np.inf, 0, 0))
        if not left < least:
            return
        least, order[[i, j]] = left, order[[j, i]]
        if k:  # one exchange is tried by itself
            said = ", ".join(f"{names[i]} is {names[int(o)]}" for i, o in enumerate(order) if i != o)
            yield replace(rows, at=rows.at[order], across=rows.across[order]), MIXED, {"names": said}


def _others(rows: _PhantomRows, obs: Observations) -> Iterator[tuple[_PhantomRows, str, dict[str, Number]]]:
    """Lists that somebody may have meant, with what is said of each."""
    every = obs.options["names"]
    assert isinstance(every, tuple)
    names = [every[i] for i in np.unique(obs.extra[NAMED]).astype(int)]
    for i, j in combinations(range(len(rows.at)), 2):
        order = np.arange(len(rows.at))
        order[[i, j]] = j, i
        yield (
            replace(rows, at=rows.at[order], across=rows.across[order]),
            EXCHANGED,
            {"one": names[i], "other": names[j]},
        )
    for factor in (INCH, 1 / INCH):
        yield replace(rows, at=rows.at / factor), OTHER_UNIT, {"factor": factor}
    for i, axis in enumerate("xyz"):
        signs = np.where(np.arange(3) == i, -1.0, 1.0)
        yield replace(rows, at=rows.at * signs, across=rows.across * signs), MIRRORED, {"axis": axis}


@check("pixel-size", When.FIT, order=132, needs=("data", "fit"))
def pixel_sizes(context: Context[Model]) -> Iterator[Finding]:
    """Pixels whose size is found far from what was stated."""
    for obs in context.need_data.observations:
        stated, owner = obs.options.get("values"), obs.options.get(IMAGE)
        names = [f"{owner}.{s}" for s in PIXEL_SIZES]
        if NAMED not in obs.extra or not isinstance(stated, dict) or any(n not in context.values for n in names):
            continue
        found = np.array([context.values[n] for n in names])
        ratio = found / np.array([stated[s] for s in PIXEL_SIZES])
        factor = float(np.exp(np.log(np.abs(ratio)).mean()))
        if np.abs(np.log(np.abs(ratio))).max() > np.log1p(vision_limits.PIXEL_FACTOR):
            yield doubt(
                PIXELS, group=obs.label, u=Quantity(float(found[0])), v=Quantity(float(found[1])), factor=factor
            )

"""Poses of a body of which an instrument saw points: the rows of one id become one pose, with its covariance.

Where the file says where the points are on the body, the pose is that of its frame. Else the points themselves say how they lie to each
other, and the frame is in their middle.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array, Bools
from robocal.diagnose.limits import POINTS_DISAGREE, POINTS_ELSEWHERE
from robocal.errors import FormatError, ModelError
from robocal.geometry.point_poses import FEWEST, PointPoses, body_of, point_poses
from robocal.measure.data import DataSet, Observations
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["BodyPoses", "poses_of_points"]

TARGETS = "targets: {A: {xyz: [0, 0, 0]}, B: {xyz: [100, 0, 0]}, C: {xyz: [0, 100, 0]}} and target: {column: target}"


@record(eq=False)
class BodyPoses:
    """Poses (k, 4, 4) by id with their covariance (k, 6, 6) of (v, w) in the instrument's axes (m, rad), and what is to be said of them."""

    ids: tuple[str, ...]
    poses: Array
    covariance: Array
    groups: tuple[str, ...] | None
    remarks: tuple[Remark, ...]


def poses_of_points(data: DataSet, place: str) -> BodyPoses:
    """The poses of a file of `kind: position` with several targets. Raises FormatError where no id has three points that are not on
    one line, and where the points lie to each other otherwise than the file says."""
    joined = data.by_id()
    obs, all_ids = joined.observations[0], joined.configurations.ids
    names, at, seen, sigma = _table(obs, len(all_ids), place)
    if at is None:
        try:
            at = body_of(seen)
        except ModelError as error:
            message = f"nothing says where the points are on the body, and {error.message}"
            raise FormatError(message, file=place, key="targets", expected=TARGETS) from None
        places_unknown = True
    else:
        places_unknown = False
        _refuse_elsewhere(names, at, seen, place)
    found, sigma = _fit(at, seen, sigma)
    if not found.known.any():
        most, expected = int(found.points.max(initial=0)), f"{FEWEST} or more that are not on one line"
        what = "the points of a pose are on one line" if most >= FEWEST else "too few points for a pose"
        raise FormatError(what, file=place, key="target", found=f"{most} of an id", expected=expected)
    apart = _disagree(found)
    keep = found.known & ~apart
    if not keep.any():
        raise FormatError(
            "the points of no pose agree", file=place, key="position.sigma", expected="a larger sigma, or one body"
        )
    remarks = tuple(_remarks(all_ids, names, found, apart, place, places_unknown))
    kept = np.flatnonzero(keep).tolist()
    groups = joined.configurations.groups
    return BodyPoses(
        tuple([all_ids[i] for i in kept]), found.poses[keep], found.covariance[keep],
        None if groups is None else tuple([groups[i] for i in kept]), remarks,
    )  # fmt: skip


def _table(obs: Observations, ids: int, place: str) -> tuple[tuple[str, ...], Array | None, Array, Array | None]:
    """Names of the points (j,), where they are on the body (j, 3) if it is said of all, where they were seen (k, j, 3), and sigma."""
    if obs.target is None or len(obs.targets) < FEWEST:
        many = max(len(obs.targets), 1)
        raise FormatError(
            "a pose takes points of three targets", file=place, key="targets", found=many, expected=TARGETS
        )
    names = tuple(t.name for t in obs.targets)
    said = [t.described for t in obs.targets]
    if any(said) and not all(said):
        missing = names[said.index(False)]
        raise FormatError(
            "the place of this point is not said", file=place, key=f"targets.{missing}.xyz", expected="three numbers"
        )
    seen = np.full((ids, len(names), 3), np.nan)
    sigma = None if obs.sigma is None else np.full(seen.shape, np.nan)
    cells = obs.configuration * len(names) + obs.target
    if len(np.unique(cells)) < len(cells):
        order = np.sort(cells)
        again = int(order[1:][order[1:] == order[:-1]][0])
        twice = f"{names[again % len(names)]} twice"
        raise FormatError(
            "one point of a pose is there twice",
            file=place,
            key="configuration.id",
            found=twice,
            expected="one row for each",
        )
    seen[obs.configuration, obs.target] = obs.value[:, :3]
    if sigma is not None and obs.sigma is not None:
        sigma[obs.configuration, obs.target] = obs.sigma[:, :3]
    return names, np.array([t.value[:3] for t in obs.targets]) if all(said) else None, seen, sigma


def _refuse_elsewhere(names: tuple[str, ...], at: Array, seen: Array, place: str) -> None:
    """Raises FormatError where two points lie farther from or nearer to each other than the file says: another unit, or exchanged."""
    i, j = np.triu_indices(len(names), 1)
    stated = np.linalg.norm(at[i] - at[j], axis=1)
    there = np.linalg.norm(seen[:, i] - seen[:, j], axis=2)
    some = np.isfinite(there).any(axis=0)
    read = np.full(len(i), np.nan)
    read[some] = np.nanmedian(there[:, some], axis=0)
    size = float(stated.max())
    off = np.abs(read - stated) / max(size, np.finfo(float).tiny)
    if np.nanmax(off, initial=0.0) > POINTS_ELSEWHERE:
        k = int(np.nanargmax(off))
        raise FormatError(
            "the points lie to each other otherwise than the file says", file=place, key=f"targets.{names[j[k]]}.xyz",
            found=f"{1e3 * stated[k]:.4g} mm from {names[i[k]]}", expected=f"{1e3 * read[k]:.4g} mm, as measured",
        )  # fmt: skip


def _fit(at: Array, seen: Array, sigma: Array | None) -> tuple[PointPoses, Array]:
    """Poses, and the standard deviations (k, j, 3) by which they were weighed: as stated, else from what the middle pose leaves."""
    if sigma is not None:
        return point_poses(at, seen, sigma), sigma
    fine = 1e-6 * float(np.ptp(at, axis=0).max())  # tolerance: of the size; all weights are alike
    first = point_poses(at, seen, fine)
    some = first.known & (first.freedom > 0)
    if not some.any():
        return first, np.full(seen.shape, fine)
    middle = np.median(first.chi2[some] / np.array([scipy.special.chdtri(n, 0.5) for n in first.freedom[some]]))
    size = np.full(seen.shape, fine * float(np.sqrt(middle)))
    return point_poses(at, seen, size), size


def _disagree(found: PointPoses) -> Bools:
    """Poses (k,) whose points do not lie to each other as those of the others."""
    out = np.zeros(len(found.known), dtype=bool)
    rows = np.flatnonzero(found.known)
    chance = POINTS_DISAGREE / max(len(rows), 1)
    out[rows] = found.chi2[rows] > np.array([scipy.special.chdtri(n, chance) for n in found.freedom[rows]])
    return out


def _remarks(
    ids: tuple[str, ...], names: tuple[str, ...], found: PointPoses, apart: Bools, place: str, unknown: bool
) -> Iterator[Remark]:
    """What was left out, and how well the rest is known."""
    lost = np.flatnonzero(~found.known)
    if len(lost):
        yield Remark.of(
            Code.POINTS_TOO_FEW,
            file=place,
            count=len(lost),
            one=ids[lost[0]],
            found=int(found.points[lost[0]]),
            least=FEWEST,
        )
    rows = np.flatnonzero(apart)
    if len(rows):
        k = int(rows[np.argmax(found.chi2[rows])])
        far = np.linalg.norm(found.residuals[k], axis=1)
        point = int(np.nanargmax(far))
        yield Remark.of(
            Code.POINTS_APART,
            file=place,
            count=len(rows),
            one=ids[k],
            point=names[point],
            far=Quantity(float(far[point])),
        )
    if unknown:
        yield Remark.of(Code.POINTS_WITHOUT_PLACES, file=place)
    good = found.known & ~apart
    v = np.trace(found.covariance[good][:, :3, :3], axis1=1, axis2=2)
    w = np.trace(found.covariance[good][:, 3:, 3:], axis1=1, axis2=2)
    place_known, turn_known = (Quantity(float(np.sqrt(np.median(c))), u) for c, u in ((v, "m"), (w, "rad")))
    yield Remark.of(
        Code.POSES_FROM_POINTS, file=place, count=int(good.sum()), position=place_known, orientation=turn_known
    )

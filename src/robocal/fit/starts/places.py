"""Starts of places that the tool touches, and of receivers and bars.

    point:   p_i + R_i c = s                     linear in (c, s): the pivot calibration
    reach:   |p_i - s| = y_i + L                 |p|^2 - y^2 = 2 p.s + 2 y L + (L^2 - |s|^2), linear in (s, L, w)
    plane:   n . p_i = c                         the smallest principal axis
    cube:    R n_f = m_f, m_f . t = c_f - o_f    one plane for every face, then a rotation and a linear system

A sphere, the socket of a ballbar and a receiver are all of the second form; where all readings are equal, L and w
merge, and it is the algebraic fit of a sphere.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.fit.starts.target_rows import TargetRows, frame_values, start
from robocal.geometry import fits, se3, so3
from robocal.measure.builder import place_of
from robocal.measure.data import Frame
from robocal.measure.plane import normals

__all__ = ["cube", "pivot", "reach"]

# Readings (m) and thickness of a cloud of points, relative to its size, below which nothing can be told from them.
EQUAL, FLAT = 1e-6, 0.05
UPRIGHT = 0.3  # cosine


def pivot(machine: Array) -> tuple[Array, Array]:
    """c and s with p_i + R_i c = s: what stays in one place; machine (m, 4, 4)."""
    m = len(machine)
    design = np.concatenate([machine[:, :3, :3], np.broadcast_to(-np.eye(3), (m, 3, 3))], axis=2).reshape(-1, 6)
    found = np.linalg.lstsq(design, -machine[:, :3, 3].ravel(), rcond=1e-6)[0]
    return found[:3], found[3:]


def reach(points: Array, reading: Array, length: float | None) -> list[tuple[Array, float]]:
    """Places s (3,) and lengths L with |p_i - s| = y_i + L; points (m, 3), reading (m,). Length None: unknown.

    Points in one plane cannot tell the two sides of it, so there are two answers. Empty for fewer points than unknowns.
    """
    centre = points.mean(axis=0)
    p = points - centre
    y = reading + (length or 0.0)
    equal = np.ptp(reading) < EQUAL
    columns = [2 * p, np.ones((len(p), 1))]
    if length is None and not equal:
        columns.insert(1, 2 * y[:, None])
    design = np.concatenate(columns, axis=1)
    size, axes = np.linalg.svd(p, full_matrices=False)[1:]
    flat = bool(size[2] < FLAT * size[0])
    if len(p) < design.shape[1] - flat:
        return []
    if flat:
        # Only what lies in the plane is linear.
        design = np.concatenate([design[:, :3] @ axes[:2].T, design[:, 3:]], axis=1)
    values = np.einsum("mi,mi->m", p, p) - (0.0 if length is None and equal else y * y)
    found = np.linalg.lstsq(design, values, rcond=1e-12)[0]
    inside = found[:2] @ axes[:2] if flat else found[:3]
    free, w = (float(found[-2]) if len(columns) == 3 else 0.0), float(found[-1])
    if length is None and equal:
        # w = (y + L)^2 - |s|^2; without a height the plane holds the centre.
        radius2 = w + inside @ inside
        return [(inside + centre, float(np.sqrt(max(radius2, 0.0)) - reading.mean()))]
    if not flat:
        return [(inside + centre, length if length is not None else free)]
    height = float(np.sqrt(max((free**2 if length is None else 0.0) - w - inside @ inside, 0.0)))
    side = height * axes[2]
    known = length if length is not None else free
    return [(inside + s * side + centre, known) for s in (1.0, -1.0)]


def cube(points: Array, normal: Array, offset: Array) -> Array | None:
    """T_base_cube (4, 4) from contacts p_i (m, 3) with faces n . q = o in its own axes; None with fewer than two faces
    of three contacts."""
    centre = points.mean(axis=0)
    faces, which = np.unique(np.round(normal, 6), axis=0, return_inverse=True)
    which = which.ravel()
    own, seen, height = [], [], []
    for i, face in enumerate(faces):
        some = points[which == i]
        if len(some) < 3 or np.linalg.matrix_rank(some - some.mean(axis=0), tol=1e-6) < 2:
            continue
        m, c, _ = fits.plane(some)
        # Faces look away from the body.
        outward = np.sign(m @ (some.mean(axis=0) - centre)) or 1.0
        own.append(face / np.linalg.norm(face))
        seen.append(outward * m)
        height.append(outward * c - offset[which == i].mean())
    if len(own) < 2 or np.linalg.matrix_rank(np.array(own), tol=0.1) < 2:
        return None
    r = so3.project(np.einsum("fi,fj->ij", np.array(seen), np.array(own)))
    # Without a third face, what it would say stays at the centre.
    sides = np.array(own) @ r.T
    t = centre + np.linalg.lstsq(sides, np.array(height) - sides @ centre, rcond=0.1)[0]
    return se3.compose(r, t)


# --- what the registry calls --------------------------------------------------------------------------------------------


def _number(seen: TargetRows, option: str, symbol: str) -> tuple[str, float | None]:
    """The name of one of a kind's own numbers, and its value; None where it is to be found."""
    from robocal.measure.base import kind_of

    for p in kind_of(seen.obs).parameters(seen.obs):
        if p.name == f"{seen.obs.options.get(option)}.{symbol}":
            return p.name, None if p.free else p.value
    return "", 0.0


def _shift_place(place: Frame, s: Array) -> dict[str, float]:
    """A place moved to s, turned as stated."""
    return frame_values(place.name, se3.compose(se3.from_vector(place.value)[:3, :3], s))


@start("point")
def _point(seen: TargetRows) -> list[dict[str, float]]:
    place = place_of(seen.obs)
    shift = seen.value.mean(axis=0)
    out = [_shift_place(place, seen.points.mean(axis=0) - shift)]
    if seen.loose:
        c, s = pivot(seen.at(seen.machine))
        out.insert(0, {**_shift_place(place, s - shift), **seen.shift_target(se3.compose(np.eye(3), c))})
    return out


@start("sphere")
def _sphere(seen: TargetRows) -> list[dict[str, float]]:
    place = place_of(seen.obs)
    name, radius = _number(seen, "radius", "radius")
    return [{**_shift_place(place, s), name: r} for s, r in reach(seen.points, seen.value[:, 0], radius)]


@start("range")
def _range(seen: TargetRows) -> list[dict[str, float]]:
    place = place_of(seen.obs)
    name, delay = _number(seen, "medium", "delay")
    known = None if delay is None else -delay
    found = reach(seen.points, seen.value[:, 0], known)
    if delay is None:
        # A delay is small, and a poor geometry makes much of it.
        found += reach(seen.points, seen.value[:, 0], 0.0)
    return [{**_shift_place(place, s), **({name: -length} if name else {})} for s, length in found]


@start("distance")
def _distance(seen: TargetRows) -> list[dict[str, float]]:
    """A ballbar's socket, or the length of a bar between two configurations."""
    ends = seen.obs.options.get("ends", ())
    assert isinstance(ends, tuple)
    name, length = _number(seen, "length", "length")
    if not ends:
        if length is not None or seen.other is None:
            return []
        far = np.linalg.norm(seen.at(seen.other)[:, :3, 3] - seen.points, axis=1)
        return [{name: float(np.mean(far - seen.value[:, 0]))}]
    fixed, carried = (sorted(ends, key=lambda end: end.mount)) if len(ends) == 2 else (None, None)
    if fixed is None or carried is None or (fixed.mount, carried.mount) != ("base", "tool") or not any(fixed.free):
        return []
    machine = seen.machine if carried is ends[0] or seen.other is None else seen.other
    points = (machine @ se3.from_vector(carried.value))[:, :3, 3]
    found = reach(points, seen.value[:, 0], length)
    return [{**_shift_place(fixed, s), **({name: far} if name else {})} for s, far in found]


@start("plane")
def _plane(seen: TargetRows) -> list[dict[str, float]]:
    place = place_of(seen.obs)
    name, radius = _number(seen, "radius", "radius")
    normal, offset = (v[seen.index] for v in normals(seen.obs))
    stated = se3.from_vector(place.value)
    apart = offset + seen.value[:, 0] + (radius or 0.0)
    values = {} if not name or radius is not None else {name: 0.0}
    if np.ptp(normal, axis=0).max() > 1e-6:
        found = cube(seen.points, normal, apart)
        return [] if found is None else [{**frame_values(place.name, found), **values}]
    n = stated[:3, :3] @ normal[0]
    # Contacts less their heights lie in one plane, to first order whichever way it looks.
    m, c, _ = fits.plane(seen.points - (apart - apart.mean())[:, None] * n)
    # A contact does not say from which side: the plate looks where it is stated to look, a wall that was not stated
    # looks at the robot.
    if (m @ n if abs(m @ n) > UPRIGHT else -c) < 0:
        m, c = -m, -c
    r = _turn(n, m) @ stated[:3, :3]
    gap = c - float(apart.mean()) - float(m @ stated[:3, 3])
    # Where only its height is free, the plane is met above the stated place; a wall is met where it is nearest.
    s = stated[:3, 3] + (np.array([0.0, 0.0, gap / m[2]]) if abs(m[2]) > UPRIGHT else gap * m)
    return [{**frame_values(place.name, se3.compose(r, s)), **values}]


def _turn(a: Array, b: Array) -> Array:
    """The smallest rotation that brings the unit vector a to b, which are at most a right angle apart."""
    axis = np.cross(a, b)
    size = float(np.linalg.norm(axis))
    return so3.exp(axis / size * np.arctan2(size, a @ b)) if size > 1e-12 else np.eye(3)

"""The first contact along a motion: between two cables, and between a cable and the platform; certified, batched.

    p(lambda) = p_0 + lambda v,   R(lambda) = exp(lambda w) R_0,   0 <= lambda <= 1

A cable is a straight rod of some diameter from its frame anchor, or from where it leaves its pulley there, to its platform
anchor. The search steps along lambda; every step is proven not to pass a contact, so the motion is free on [0, fraction)
without doubt, up to rounding.
Source: the motion is (3.27) to (3.32) of the thesis behind `examples/cable-laval`; its (3.37) minimises the distance, which
finds the closest contact or a local one, not the first. Formulas and proofs: docs/cables/interference.md.

The platform's body: a convex set of half-spaces, from a box or from points.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from robocal._jit import as_kernel_array, as_kernel_indices
from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.cables.pulley import Pulleys
from robocal.errors import ModelError, require

__all__ = ["KINDS", "Body", "Contacts", "are_lengths", "box", "distances", "first_contact", "hull"]


@record
class Body:
    """All x in platform coordinates with n_f . x <= h_f for every face f: normals (f, 3) of unit length, offsets (f,) in m."""

    normals: Array
    offsets: Array

    def height(self, points: ArrayLike) -> Array:
        """max_f (n_f . x - h_f) in m for points (..., 3): at most 0 inside, and never more than the distance outside."""
        return np.asarray((np.asarray(points, float) @ self.normals.T - self.offsets).max(axis=-1))


def box(half_sizes: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Body:
    """The box of the given half sizes (3,) in m about `centre`, its edges along the platform's axes.

    Raises ModelError for half sizes that are not three numbers of at least 0.
    """
    half, c = np.asarray(half_sizes, float), np.asarray(centre, float)
    long, place = half.shape == (3,) and are_lengths(half), c.shape == (3,) and np.isfinite(c).all()
    require(long, "half sizes of the platform's box", expected="three lengths in m, at least 0", found=half_sizes)
    require(place, "centre of the platform's box", expected="three coordinates in m", found=centre)
    normals = np.vstack([np.eye(3), -np.eye(3)])
    return Body(normals, normals @ c + np.tile(half, 2))


def are_lengths(numbers: Array) -> bool:
    """Whether all of them are lengths: finite, at least 0."""
    return bool(((numbers >= 0) & (numbers < np.inf)).all())


def hull(points: ArrayLike) -> Body:
    """The convex hull of points (k, 3) in platform coordinates; points in a plane, on a line or in one place give a flat one.

    Raises ModelError for anything but finite points.
    """
    p = np.asarray(points, float)
    if p.ndim != 2 or p.shape[1:] != (3,) or len(p) == 0 or not np.isfinite(p).all():
        raise ModelError("points of the platform's body", expected="finite numbers of shape (k, 3)", found=p.shape)
    centre = p.mean(axis=0)
    _, sizes, axes = np.linalg.svd(p - centre)
    rank = int((sizes > 1e-9 * max(1.0, sizes[0])).sum())
    local = (p - centre) @ axes[:rank].T
    if rank >= 2:
        # The same face comes once per triangle.
        faces = np.unique(np.round(ConvexHull(local).equations, 12), axis=0)
        inner, offsets = faces[:, :-1], -faces[:, -1]
        # Rounding of the equations must not leave a point outside.
        offsets = np.maximum(offsets, (local @ inner.T).max(axis=0))
    elif rank == 1:
        inner, offsets = np.array([[1.0], [-1.0]]), np.array([local.max(), -local.min()])
    else:
        inner, offsets = np.zeros((0, 0)), np.zeros(0)
    flat = np.vstack([axes[rank:], -axes[rank:]])
    # A flat body keeps no room of its own across itself, but for the rounding of its points.
    thickness = ((p - centre) @ flat.T).max(axis=0) if len(flat) else np.zeros(0)
    normals = np.vstack([inner @ axes[:rank], flat])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Body(normals, normals @ centre + np.concatenate([offsets, thickness]))


KINDS = ("none", "cable-cable", "cable-platform", "cable-pulley")
_LIMIT = 10_000  # steps for one pair; a motion that needs more is told apart by `resolved`


@record
class Contacts:
    """What B motions meet first: `fraction` (B,) of each that is certainly free, and why it ends there.

    `kind` (B,) indexes KINDS (of a pulley its own: the platform anchor reaches it); `who` (B, 2): the two cables, or one cable and -1,
    or -1 -1 for none; `gap` (B,) in m: the room left at `fraction`, inf where nothing is met; negative where the motion starts in a
    contact.
    """

    fraction: Array
    kind: Ints
    who: Ints
    gap: Array
    tolerance: float

    @property
    def free(self) -> Bools:
        """Whether the whole motion meets nothing, (B,)."""
        return np.asarray(self.kind == 0)

    @property
    def complete(self) -> Bools:
        """Whether the search ended, (B,); where not, the motion is free up to `fraction` and nothing is known beyond."""
        return np.asarray(self.free | (self.gap <= self.tolerance))

    def names(self, cables: Sequence[str]) -> list[str]:
        """One phrase per motion, such as `c1 meets c5` or `c3 meets the platform`, `c1 may meet c5` where the search did not end; empty
        where it is free."""
        whom = {2: "the platform", 3: "its pulley"}
        return [
            ""
            if kind == 0
            else f"{cables[k]} {'meets' if sure else 'may meet'} {whom[int(kind)] if kind > 1 else cables[l]}"
            for kind, (k, l), sure in zip(self.kind, self.who, self.complete, strict=True)
        ]


def first_contact(
    a: ArrayLike,
    b: ArrayLike,
    start: ArrayLike,
    translation: ArrayLike,
    rotation: ArrayLike | None = None,
    *,
    diameter: ArrayLike = 0.0,
    pulleys: Pulleys | None = None,
    body: Body | None = None,
    relief: float | None = None,
    tolerance: float = 1e-6,
) -> Contacts:
    """The first contact of each motion; no body, no contact with the platform.

    a, b (m, 3) m: anchors on the frame (base axes) and on the platform (its own axes); start (4, 4) or (B, 4, 4): T_base_platform;
    translation (B, 3) m and rotation (B, 3) rad: v and w, in base axes, the whole motion; diameter of the cables in m, one or (m,);
    `pulleys` at the frame anchors, over which cables leave where their wheels let them go.
    `relief` in m: a cable may touch its own eyelet, and a cable that shares the eyelet, up to so far from it; ten diameters by
    default, 10 mm for cables without one. Closer than `tolerance` in m is a contact.
    Raises ModelError for shapes that do not fit, numbers that are none, two cables between the same two points, and a platform
    anchor outside the body.
    """
    from robocal.cables.contact._kernels import first_contacts

    a, b = _anchors(a, b)
    radius = _radii(diameter, len(a))
    c = float(relief) if relief is not None else float(20 * radius.max() or 0.01)
    for name, value in (("relief", c), ("tolerance", tolerance)):
        require(0 < value < np.inf, name, expected="a length in m above 0", found=value)
    pose, v, w = _motions(start, translation, rotation)
    normals, offsets = (np.zeros((0, 3)), np.zeros(0)) if body is None else (body.normals, body.offsets)
    if body is not None:
        _check_anchors(body, b)
    n = len(v)
    fraction, gap = np.empty(n), np.empty(n)
    kind, who = np.empty(n, np.int64), np.empty((n, 2), np.int64)
    axis, wheel = _wheels(pulleys, len(a))
    common = _common(a, b)
    common[(common == 1) & ((wheel[:, None] > 0) | (wheel > 0))] = 3
    a, b, axis, wheel, radius, normals, offsets, pose, v, w = as_kernel_array(
        a, b, axis, wheel, radius, normals, offsets, pose, v, w
    )
    first_contacts(
        a, b, axis, wheel, radius, as_kernel_indices(common), normals, offsets, c, pose, v, w, float(tolerance), _LIMIT,
        fraction, kind, who, gap,
    )  # fmt: skip
    return Contacts(fraction, kind, who, gap, float(tolerance))


def _anchors(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    frame, platform = np.asarray(a, float), np.asarray(b, float)
    for name, array in (("frame anchors", frame), ("platform anchors", platform)):
        if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0 or not np.isfinite(array).all():
            raise ModelError(name, expected="finite numbers of shape (cables, 3)", found=array.shape)
    sizes = len(frame), len(platform)
    require(sizes[0] == sizes[1], "frame and platform anchors", expected="one of each per cable", found=sizes)
    return frame, platform


def _radii(diameter: ArrayLike, m: int) -> Array:
    d = np.asarray(diameter, float)
    long = d.shape in ((), (m,)) and are_lengths(d)
    require(long, "cable diameter", expected=f"one length in m or {m}, at least 0", found=diameter)
    return np.broadcast_to(d / 2, (m,)).copy()


def _wheels(pulleys: Pulleys | None, m: int) -> tuple[Array, Array]:
    """Axes (m, 3) and radii (m,) of the wheels, zeros without."""
    if pulleys is None:
        return np.zeros((m, 3)), np.zeros(m)
    axis, wheel = np.asarray(pulleys.axis, float), np.asarray(pulleys.radius, float)
    found = f"{axis.shape} and {wheel.shape}"
    require(axis.shape == (m, 3) and wheel.shape == (m,), "pulleys", expected=f"one per cable, {m}", found=found)
    return axis, wheel


def _motions(start: ArrayLike, translation: ArrayLike, rotation: ArrayLike | None) -> tuple[Array, Array, Array]:
    v = np.atleast_2d(np.asarray(translation, float))
    w = np.zeros_like(v) if rotation is None else np.atleast_2d(np.asarray(rotation, float))
    pose = np.asarray(start, float)
    paired, found = v.shape[1:] == (3,) and w.shape == v.shape, f"{v.shape} and {w.shape}"
    require(paired, "translation and rotation", expected="both of shape (motions, 3)", found=found)
    expected = f"shape (4, 4) or ({len(v)}, 4, 4)"
    require(pose.shape in ((4, 4), (len(v), 4, 4)), "start pose", expected=expected, found=pose.shape)
    for name, array in (("start pose", pose), ("translation", v), ("rotation", w)):
        require(np.isfinite(array).all(), f"{name}: a number that is none", expected="finite numbers")
    return np.broadcast_to(pose, (len(v), 4, 4)), v, w


def _common(a: Array, b: Array) -> Ints:
    """(m, m): 0 no common end, 1 at the frame, 2 at the platform."""
    at_frame, at_platform = (np.linalg.norm(p[:, None] - p[None], axis=2) <= 1e-9 for p in (a, b))
    same = np.argwhere(np.triu(at_frame & at_platform, 1))
    if len(same):
        k, l = same[0] + 1
        raise ModelError(f"cables {k} and {l} run between the same two points", expected="anchors of their own")
    return np.where(at_platform, 2, np.where(at_frame, 1, 0)).astype(np.int64)


def _check_anchors(body: Body, b: Array) -> None:
    out = body.height(b)
    worst = int(out.argmax())
    why = f"platform anchor {worst + 1} lies {1e3 * out[worst]:.3g} mm outside the platform's body"
    expected = "anchors on or in the body (take them into `hull` as well)"
    require(out[worst] <= 1e-9, why, expected=expected, found=b[worst].round(6).tolist())


def distances(p: ArrayLike, p_end: ArrayLike, q: ArrayLike, q_end: ArrayLike) -> Array:
    """The distance in m between segments p p_end and q q_end, points (k, 3) each -> (k,)."""
    from robocal.cables.contact.segments._kernels import separations

    arrays = np.broadcast_arrays(*(np.asarray(x, float) for x in (p, p_end, q, q_end)))
    one, one_end, two, two_end = as_kernel_array(*arrays)
    out = np.empty(len(one))
    separations(one, one_end, two, two_end, out)
    return out

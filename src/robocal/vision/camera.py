"""The camera: what a lens makes of directions. How many numbers a lens has says which model it is of.

x = X / Z, y = Y / Z, r2 = x^2 + y^2, d = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3)
u = fx (x d + 2 p1 x y + p2 (r2 + 2 x^2)) + cx,  v = fy (y d + p1 (r2 + 2 y^2) + 2 p2 x y) + cy

brown (Brown 1966) is this without k4 to k6, rational the whole. A fisheye (Kannala and Brandt 2006) has its x and y along X and Y at the
length theta, the angle to the axis, and d = 1 + k1 r2 + k2 r2^2 + k3 r2^3 + k4 r2^4. Numbers mean what they mean in OpenCV.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.errors import require

__all__ = [
    "MODELS",
    "SYMBOLS",
    "LensModel",
    "fold_mask",
    "fold_radius",
    "image_and_slope",
    "image_of",
    "image_radius",
    "model_of",
    "project",
    "unproject",
]

SYMBOLS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
AXIS = 1e-24  # of a square of slopes: so near to the axis, angle and slope are one
TINY = 1e-100  # of a coefficient that no direction feels
STEPS, NEAR, STILL = 60, 1e-6, 1e-14  # of a search for a direction; where it ends along the radius, and in the plane
MISSED = 1e-9  # of a place, by a direction that was found


@record
class LensModel:
    """A model of lenses: its name, the symbols of its numbers in their order, and by how much each is usually off (px, 1)."""

    name: str
    symbols: tuple[str, ...]
    expected: tuple[float, ...]

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of every number."""
        return tuple("px" if s in SYMBOLS[:4] else "1" for s in self.symbols)


PINHOLE = (10.0, 10.0, 10.0, 10.0)
BROWN = LensModel("brown", SYMBOLS, (*PINHOLE, 0.1, 0.1, 0.01, 0.01, 0.1))
RATIONAL = LensModel("rational", (*SYMBOLS, "k4", "k5", "k6"), (*BROWN.expected, 0.1, 0.1, 0.1))
FISHEYE = LensModel("fisheye", (*SYMBOLS[:4], "k1", "k2", "k3", "k4"), (*PINHOLE, 0.1, 0.1, 0.1, 0.1))
MODELS: Mapping[str, LensModel] = {m.name: m for m in (BROWN, RATIONAL, FISHEYE)}
_BY_COUNT = {len(m.symbols): m for m in MODELS.values()}


def model_of(intrinsics: Array) -> LensModel:
    """The model of a lens, by how many numbers (..., n) it has. Raises ModelError."""
    count = np.shape(intrinsics)[-1]
    require(count in _BY_COUNT, "no lens has so many numbers", found=count, expected=", ".join(map(str, _BY_COUNT)))
    return _BY_COUNT[count]


def image_of(points: Array, intrinsics: Array) -> Array:
    """Pixels (..., 2) of points (..., 3), as `project` has them, without Jacobians."""
    x, y, _ = _flatten(points, intrinsics)
    return _place(x, y, intrinsics)[0]


def project(points: Array, intrinsics: Array) -> tuple[Array, Array, Array]:
    """Pixels (..., 2) of points (..., 3) in camera coordinates (Z forward, m), with the Jacobians (..., 2, 3) and
    (..., 2, n).

    intrinsics (..., n) in the order of the model's symbols, broadcast against the points. Raises ModelError.
    """
    x, y, by = _flatten(points, intrinsics)
    uv, slope = _place(x, y, intrinsics)
    return uv, slope @ by, _answer(x, y, intrinsics)


def image_and_slope(points: Array, intrinsics: Array) -> tuple[Array, Array]:
    """The same with the Jacobians by the points alone, (..., 2, 3)."""
    x, y, by = _flatten(points, intrinsics)
    uv, slope = _place(x, y, intrinsics)
    return uv, slope @ by


def _flatten(points: Array, intrinsics: Array) -> tuple[Array, Array, Array]:
    """The undistorted x and y (...) of points, and their derivatives (..., 2, 3)."""
    px, py, pz = np.moveaxis(points, -1, 0)
    by = np.zeros((*px.shape, 2, 3))
    if model_of(intrinsics) is not FISHEYE:
        s = 1 / pz
        by[..., 0, 0] = by[..., 1, 1] = s
        by[..., 0, 2], by[..., 1, 2] = -px * s * s, -py * s * s
        return px * s, py * s, by
    across, all_ = px * px + py * py, px * px + py * py + pz * pz
    off = across > AXIS * pz * pz
    rho = np.sqrt(np.where(off, across, 1.0))
    s = np.where(off, np.arctan2(rho, pz) / rho, 1 / np.where(off, 1.0, pz))
    q = np.where(off, (pz / all_ - s) / rho**2, 0.0)  # 1 / rho times the slope of s
    by[..., 0, 0], by[..., 1, 1] = s + q * px * px, s + q * py * py
    by[..., 0, 1] = by[..., 1, 0] = q * px * py
    by[..., 0, 2], by[..., 1, 2] = -px / all_, -py / all_
    return px * s, py * s, by


def _place(x: Array, y: Array, intrinsics: Array) -> tuple[Array, Array]:
    """Pixels (..., 2) of undistorted places, with their derivatives by these (..., 2, 2)."""
    n = _name(intrinsics)
    fx, fy, p1, p2, r2 = n["fx"], n["fy"], n.get("p1", 0.0), n.get("p2", 0.0), x * x + y * y
    (top, dtop), (low, dlow) = (_series([n[s] for s in part], r2) for part in _radial(model_of(intrinsics)))
    d = top / low
    dd = (dtop - d * dlow) / low  # derivative of d with respect to r2
    u = fx * (x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + n["cx"]
    v = fy * (y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + n["cy"]
    xy = 2 * x * y * dd + 2 * p1 * x + 2 * p2 * y
    by = np.empty((*u.shape, 2, 2))
    by[..., 0, 0] = fx * (d + 2 * x * x * dd + 2 * p1 * y + 6 * p2 * x)
    by[..., 0, 1], by[..., 1, 0] = fx * xy, fy * xy
    by[..., 1, 1] = fy * (d + 2 * y * y * dd + 6 * p1 * y + 2 * p2 * x)
    return np.stack([u, v], axis=-1), by


def _answer(x: Array, y: Array, intrinsics: Array) -> Array:
    """The derivatives (..., 2, n) of pixels by the numbers of the lens."""
    model, n, r2 = model_of(intrinsics), _name(intrinsics), x * x + y * y
    fx, fy, p1, p2, at = n["fx"], n["fy"], n.get("p1", 0.0), n.get("p2", 0.0), model.symbols.index
    above, below = _radial(model)
    top, low = (_series([n[s] for s in part], r2)[0] for part in (above, below))
    d = top / low
    ji = np.zeros((*np.broadcast_shapes(x.shape, np.shape(fx)), 2, len(model.symbols)))
    ji[..., 0, 0] = x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    ji[..., 1, 1] = y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    ji[..., 0, 2] = ji[..., 1, 3] = 1.0
    for part, factor in ((above, 1 / low), (below, -d / low)):
        for power, symbol in enumerate(part, start=1):
            gain = r2**power * factor
            ji[..., 0, at(symbol)], ji[..., 1, at(symbol)] = fx * x * gain, fy * y * gain
    if model is not FISHEYE:
        ji[..., 0, 6], ji[..., 1, 6] = fx * 2 * x * y, fy * (r2 + 2 * y * y)
        ji[..., 0, 7], ji[..., 1, 7] = fx * (r2 + 2 * x * x), fy * 2 * x * y
    return ji


def _name(intrinsics: Array) -> dict[str, Array]:
    """The numbers of a lens by symbol."""
    return dict(zip(model_of(intrinsics).symbols, np.moveaxis(np.asarray(intrinsics, dtype=float), -1, 0), strict=True))


def _radial(model: LensModel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The symbols of d: above the line and below it, by powers of r2."""
    if model is FISHEYE:
        return ("k1", "k2", "k3", "k4"), ()
    return ("k1", "k2", "k3"), ("k4", "k5", "k6") if model is RATIONAL else ()


def _series(numbers: list[Array], r2: Array) -> tuple[Array, Array]:
    """1 + k1 r2 + k2 r2^2 + ..., and its derivative by r2."""
    total, slope = np.ones_like(r2), np.zeros_like(r2)
    for power, k in reversed(list(enumerate(numbers, start=1))):
        total, slope = total + k * r2**power, slope + power * k * r2 ** (power - 1)
    return total, slope


def fold_radius(intrinsics: Array) -> float:
    """The undistorted radius from which on a lens (n,) folds back, d(r d)/dr <= 0: a slope, of a fisheye an angle (rad, at most pi);
    infinite where it never does. What is tangential is left out."""
    from numpy.polynomial import polynomial

    model, n = model_of(intrinsics), _name(intrinsics)
    most = np.pi if model is FISHEYE else np.inf
    top, low = (np.array([1.0, *(n[s] for s in part)]) for part in _radial(model))
    twice = np.array([0.0, 2.0])
    with np.errstate(all="ignore"):
        # d(r d)/dr low^2 = (top + 2 r2 top') low - 2 r2 top low'; where low is 0, r d is infinite.
        rise = polynomial.polymul(polynomial.polyadd(top, polynomial.polymul(twice, polynomial.polyder(top))), low)
        rise = polynomial.polysub(rise, polynomial.polymul(polynomial.polymul(twice, top), polynomial.polyder(low)))
    if not np.isfinite(rise).all():
        return 0.0
    roots = np.concatenate([polynomial.polyroots(polynomial.polytrim(p, TINY)) for p in (rise, low)])
    real = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0)]  # tolerance: of arithmetic
    return float(min(most, np.sqrt(real.min(initial=np.inf))))


def image_radius(intrinsics: Array) -> float:
    """How far from its centre, by its focal lengths, a lens (n,) images at most before it folds back; infinite where it never does."""
    r, n = fold_radius(intrinsics), _name(intrinsics)
    if not np.isfinite(r):
        return np.inf
    top, low = (_series([n[s] for s in part], np.asarray(r * r))[0] for part in _radial(model_of(intrinsics)))
    return float(r * top / low) if low > 0 else np.inf


def fold_mask(points: Array, intrinsics: Array) -> Bools:
    """Whether points (..., 3) in camera coordinates are where a lens (n,) cannot see them: beyond the radius at which it folds back, or
    behind it; a fisheye may see what lies behind."""
    x, y, _ = _flatten(points, intrinsics)
    behind = (points[..., 2] <= 0) & (model_of(intrinsics) is not FISHEYE)
    return np.asarray(behind | (x * x + y * y >= fold_radius(intrinsics) ** 2))


def unproject(uv: Array, intrinsics: Array, nearest: bool = False) -> Array:
    """Unit directions (..., 3) that a lens (n,) images at pixels uv (..., 2), by Newton's method along the radius, then in the plane. Where
    there is none before it folds back: NaN, or with `nearest` the direction on that side at which it folds."""
    fold = fold_radius(intrinsics)
    given = (np.asarray(uv, dtype=float) - intrinsics[2:4]) / intrinsics[:2]
    with np.errstate(all="ignore"):
        size = np.linalg.norm(given, axis=-1)
        r = _radius(size, intrinsics, fold)
        p = begin = given * np.where(size > 0, r / np.where(size > 0, size, 1.0), 1.0)[..., None]
        for _ in range(STEPS):
            out, by = _place(p[..., 0], p[..., 1], intrinsics)
            (a, b), (c, d) = np.moveaxis(by / intrinsics[:2, None], (-2, -1), (0, 1))
            e, f = np.moveaxis((uv - out) / intrinsics[:2], -1, 0)
            step = np.stack([d * e - b * f, a * f - c * e], axis=-1) / (a * d - b * c)[..., None]
            p = p + step
            if not (np.abs(step) > STILL * (1 + np.abs(p))).any():
                break
        left = np.abs(_place(p[..., 0], p[..., 1], intrinsics)[0] - uv) / intrinsics[:2]
        radius = np.linalg.norm(p, axis=-1)
        found = (left < MISSED * (1 + np.abs(given))).all(axis=-1) & (radius < fold)
        if nearest:
            p, radius, found = np.where(found[..., None], p, begin), np.where(found, radius, r), np.isfinite(r)
        ray = np.concatenate([p, np.ones((*radius.shape, 1))], axis=-1)
        if model_of(intrinsics) is FISHEYE:
            ray[..., :2] *= np.sinc(radius / np.pi)[..., None]
            ray[..., 2] = np.cos(radius)
        return np.where(found[..., None], ray / np.linalg.norm(ray, axis=-1, keepdims=True), np.nan)


def _radius(size: Array, intrinsics: Array, fold: float) -> Array:
    """The radius that the lens images at `size` (...), before it folds back; near the fold where there is none."""
    model, n = model_of(intrinsics), _name(intrinsics)
    low, high = np.zeros_like(size), np.full_like(size, fold)
    r = np.minimum(size, 0.9 * fold)
    for _ in range(STEPS):
        (top, dtop), (under, dunder) = (_series([n[s] for s in part], r * r) for part in _radial(model))
        d = top / under
        off = r * d - size
        high, low = np.where(off > 0, r, high), np.where(off <= 0, r, low)
        to = r - off / (d + 2 * r * r * (dtop - d * dunder) / under)
        # A step that leaves what is known to hold the radius is one to its middle, or outward where it has no end.
        middle = np.where(np.isfinite(high), (low + high) / 2, 2 * low + 1)
        to = np.where((to >= low) & (to <= high), to, middle)
        still = np.abs(to - r) <= NEAR * (1 + r)
        r = to
        if still.all():
            break
    return r

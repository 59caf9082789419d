"""The four edges of a marker, where its pixels as a whole do not tell: a line through each edge, and their intersections."""

from __future__ import annotations

import numpy as np

from robocal._types import Array

__all__ = ["fit_edges"]

REACH, STEP = 4.0, 0.25  # px, on each side of an edge, and between samples
SHARE = 0.1  # of an edge, at each end, that a corner blurs
FEWEST = 8  # profiles of an edge
STEEP = 8.0  # grey levels across an edge
ROUNDS = 2
PARTS = 4  # grid: of an edge, that are left out in turn


def fit_edges(image: Array, corners: Array) -> tuple[Array, Array] | None:
    """Corners (4, 2) near those given, in a grey image (h, w), and their covariance (8, 8) in px^2; None where an edge does not show.

    A profile across an edge gives a point, the middle of its slope; the line through the points of an edge minimises their squares.
    """
    lines, spreads = [], []
    for k in range(4):
        line = _line(image, corners[k], corners[(k + 1) % 4], corners.mean(axis=0))
        if line is None:
            return None
        lines.append(line[0])
        spreads.append(line[1])
    found, covariance = np.empty((4, 2)), np.zeros((8, 8))
    by = np.zeros((4, 2, 4, 2))  # of a corner by the two numbers of each line
    for k in range(4):
        (p, d), (q, e) = lines[k - 1], lines[k]  # the edge that ends here, and that which begins
        normal = np.array([[-d[1], d[0]], [-e[1], e[0]]])
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        found[k] = inverse @ [normal[0] @ p, normal[1] @ q]
        for j, (m, t), column in ((k - 1) % 4, (p, d), inverse[:, 0]), (k, (q, e), inverse[:, 1]):
            by[k, :, j, 0], by[k, :, j, 1] = column, column * ((found[k] - m) @ t)
    flat = by.reshape(8, 8)
    for k in range(4):
        covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = spreads[k]
    return found, flat @ covariance @ flat.T


def _line(image: Array, start: Array, end: Array, middle: Array) -> tuple[tuple[Array, Array], Array] | None:
    """A point and a direction of the line along an edge, and the covariance (2, 2) of its offset and its turn about that point."""
    length = float(np.hypot(*(end - start)))
    count = int(length * (1 - 2 * SHARE))
    if count < FEWEST:
        return None
    along = (end - start) / length
    out = np.array([along[1], -along[0]])
    out = out if out @ (middle - start) < 0 else -out  # from black to white
    base = start + np.outer(np.linspace(SHARE, 1 - SHARE, count) * length, along)
    reach = min(REACH, 0.1 * length)
    across = np.arange(-reach, reach + STEP / 2, STEP)
    at, good = np.zeros(count), np.ones(count, dtype=bool)
    for _ in range(ROUNDS):
        places = base + at[:, None] * out
        levels = sample(image, places[:, None] + across[None, :, None] * out)
        slope = np.maximum(np.diff(levels, axis=1), 0.0)
        total = slope.sum(axis=1)
        good = np.isfinite(total) & (total > STEEP)
        if good.sum() < FEWEST:
            return None
        mid = 0.5 * (across[1:] + across[:-1])
        weight = np.where(good[:, None], slope, 0.0) ** 2
        at = at + np.where(good, weight @ mid / np.maximum(weight.sum(axis=1), 1e-12), 0.0)
        at = np.where(good, at, np.median(at[good]))
    s = (base - base.mean(axis=0)) @ along
    for _ in range(3):  # points off the line are not of this edge
        design = np.stack([np.ones(good.sum()), s[good]], axis=1)
        offset, turn = np.linalg.lstsq(design, at[good], rcond=None)[0]
        left = at - offset - turn * s
        noise = 1.4826 * float(np.median(np.abs(left[good]))) + 1e-3
        kept = good & (np.abs(left) < 3 * noise)
        if kept.sum() < FEWEST:
            return None
        if (kept == good).all():
            break
        good = kept
    centre = base.mean(axis=0) + offset * out
    direction = along + turn * out
    design = np.stack([np.ones(good.sum()), s[good]], axis=1)
    spread = noise**2 * np.linalg.inv(design.T @ design) + spread_of_parts(s[good], at[good])
    return (centre, direction / np.hypot(*direction)), spread


def spread_of_parts(s: Array, at: Array) -> Array:
    """The covariance (2, 2) of the offset and the turn of a line through points (k,) by what each part of it changes when it is left out
    (jackknife): glare and shadows move the points of a part together."""
    part = np.arange(len(s)) * PARTS // len(s)
    lines = np.array([np.polynomial.polynomial.polyfit(s[part != k], at[part != k], 1) for k in range(PARTS)])
    apart = lines - lines.mean(axis=0)
    return np.asarray((PARTS - 1) / PARTS * apart.T @ apart)


def sample(image: Array, places: Array) -> Array:
    """Grey levels at places (..., 2) between pixels, bilinear; NaN outside."""
    h, w = image.shape
    u, v = places[..., 0], places[..., 1]
    inside = (u >= 0) & (v >= 0) & (u <= w - 1) & (v <= h - 1)
    i, j = np.clip(u, 0, w - 1.001).astype(int), np.clip(v, 0, h - 1.001).astype(int)
    a, b = np.clip(u - i, 0, 1), np.clip(v - j, 0, 1)
    top = (1 - a) * image[j, i] + a * image[j, i + 1]
    low = (1 - a) * image[j + 1, i] + a * image[j + 1, i + 1]
    return np.where(inside, (1 - b) * top + b * low, np.nan)

"""Markers on a table and two walls, and a camera that walks about them, by the formulas of the tests' own."""

from __future__ import annotations

import numpy as np
from lens_world import LENS, SIZE, SQUARE, see, turn

EDGE = 0.06
PLACES = [
    *((x, y, 0.0, 0) for x in (-0.3, -0.1, 0.1, 0.3) for y in (-0.15, 0.1)),
    *((x, 0.35, 0.2, 1) for x in (-0.25, 0.0, 0.25)),
    *((0.45, y, 0.2, 2) for y in (-0.1, 0.15)),
]
WALLS = (np.eye(3), np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]]))


def room(rng, tilt=0.05):
    """Poses T_room_marker (M, 4, 4) of markers, each tilted by a little."""
    out = np.tile(np.eye(4), (len(PLACES), 1, 1))
    for t, (x, y, z, wall) in zip(out, PLACES, strict=True):
        t[:3, :3] = turn(rng.normal(0, tilt, 3)) @ WALLS[wall] @ turn(np.array([0, 0, rng.uniform(-3, 3)]))
        t[:3, 3] = (x, y, z)
    return out


def corners_of(poses, edges):
    """Corners (M, 4, 3) in the room."""
    own = SQUARE * np.asarray(edges)[:, None, None] / 2
    return np.einsum("mij,mkj->mki", poses[:, :3, :3], own) + poses[:, None, :3, 3]


def cameras(rng, count):
    """Poses T_camera_room (count, 4, 4) of cameras that look at the room."""
    out = np.tile(np.eye(4), (count, 1, 1))
    for t in out:
        at = np.array([rng.uniform(-0.5, 0.2), rng.uniform(-0.7, -0.2), rng.uniform(0.4, 0.8)])
        to = np.array([rng.uniform(-0.1, 0.2), rng.uniform(0.0, 0.2), rng.uniform(0.0, 0.15)])
        z = (to - at) / np.linalg.norm(to - at)
        x = np.cross(z, [0, 0, 1.0])
        x /= np.linalg.norm(x)
        r = turn(z * rng.uniform(-1, 1)) @ np.stack([x, np.cross(z, x), z], axis=1)
        t[:3, :3], t[:3, 3] = r.T, -r.T @ at
    return out


def sightings(poses, views, edges, lens=LENS, size=SIZE):
    """Every marker that a view shows whole from its printed side: (view, marker, pixels (4, 2))."""
    corners = corners_of(poses, edges)
    for v, t in enumerate(views):
        for m, c in enumerate(corners):
            seen = c @ t[:3, :3].T + t[:3, 3]
            normal = t[:3, :3] @ poses[m][:3, 2]
            if seen[:, 2].min() < 0.1 or normal @ seen.mean(axis=0) > -0.25 * np.linalg.norm(seen.mean(axis=0)):
                continue
            flat = np.abs(seen[:, :2] / seen[:, 2:])
            if flat.max() > 0.75:
                continue
            uv = see(seen, lens)
            if (uv > 2).all() and (uv < np.array(size) - 3).all():
                yield v, m, uv


def map_rows(seen, noise, rng, names=None, sigma=True):
    """Rows as `vision detect` lists them."""
    rows = []
    for v, m, uv in seen:
        for k, (u, w) in enumerate((uv + rng.normal(0, noise, uv.shape)).tolist()):
            row = {
                "view": f"v{v + 1}",
                "marker": m if names is None else names[m],
                "corner": k,
                "u [px]": f"{u:.6f}",
                "v [px]": f"{w:.6f}",
            }
            rows.append(row | ({"su [px]": noise, "sv [px]": noise} if sigma else {}))
    return rows

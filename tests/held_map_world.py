"""A room with markers on three walls, a map of it that may be off, and photographs in it, by formulas of the tests' own."""

from __future__ import annotations

import numpy as np
from lens_world import LENS, SIZE, see, turn

from robocal.files.lens import lens_text
from robocal.files.map import map_covariance_text, map_text
from robocal.geometry import se3
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import project_covariance
from robocal.vision.maps import MarkerMap

EDGE = 0.12
OWN = np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * EDGE / 2
# Walls look along x, -x and y: the columns are the marker's x (right), y (up) and z (out of the print).
WALLS = (
    (np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), (-1.2, 0.0, 1.0)),
    (np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]]), (1.2, 0.0, 1.0)),
    (np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]]), (0.0, -1.2, 1.0)),
)


def room(per_wall=4, sigma=2e-4, seed=0):
    """The map: markers 0, 1, ... wall by wall, with a covariance in which neighbours share a part."""
    rng = np.random.default_rng(seed)
    vector = []
    for axes, middle in WALLS:
        for k in range(per_wall):
            at = np.array(middle) + axes @ [0.25 * (k % 2) - 0.12, 0.25 * (k // 2) - 0.12, 0.0]
            vector.append(se3.to_vector(se3.compose(axes @ turn(0.03 * rng.normal(size=3)), at)))
    count = len(vector)
    bare = MarkerMap(tuple(map(str, range(count))), np.full(count, EDGE), np.array(vector), None, "36h11", "a room")
    shared = np.repeat(rng.normal(size=(3, 6)), per_wall, axis=0).ravel()[:, None] * 0.7 * sigma
    covariance = project_covariance(bare, shared @ shared.T + sigma**2 * np.eye(6 * count))
    return MarkerMap(bare.names, bare.size, bare.vector, covariance, bare.family, bare.source)


def draw_room(known, rng):
    """The truth that a map may have: its markers moved by its covariance."""
    values, along = np.linalg.eigh(known.covariance)
    moved = (along @ (np.sqrt(values.clip(0)) * rng.normal(size=len(values)))).reshape(-1, 6)
    poses = se3.displace(known.poses, moved[:, :3], moved[:, 3:])
    return MarkerMap(known.names, known.size, se3.to_vector(poses))


def eye(towards, place, rng, shake=0.1):
    """T_map_camera that looks along a direction, z forward and y down."""
    z = np.array(towards, float) / np.linalg.norm(towards)
    x = np.cross(z, [0.0, 0, 1])
    x /= np.linalg.norm(x)
    return se3.compose(
        np.stack([x, np.cross(z, x), z], axis=1) @ turn(shake * rng.normal(size=3)), np.array(place, float)
    )


def views_of_room(true, rng, count, noise=0.1, lens=LENS, only=None, eyes=None):
    """Photographs: rows of corners (view, marker, corner, u, v), and where the camera was."""
    rows, where = [], []
    while len(where) < count:
        k = len(where)
        if eyes is not None:
            pose = eyes[k]
        else:
            way = (np.cos(2.1 * k + 0.4), np.sin(2.1 * k + 0.4), 0.1 * rng.normal())
            pose = eye(way, 0.25 * rng.normal(size=3) + [0, 0, 1], rng)
        back = se3.inverse(pose)
        seen = []
        for name, t in zip(true.names, true.poses, strict=True):
            corners = OWN @ t[:3, :3].T + t[:3, 3]
            there = corners @ back[:3, :3].T + back[:3, 3]
            if there[:, 2].min() < 0.3 or (back[:3, :3] @ t[:3, 2])[2] > -0.2 or (only and name not in only):
                continue
            uv = see(there, lens)
            if uv.min() > 5 and (uv < np.array(SIZE) - 5).all():
                seen += [(f"v{k}", name, j, *(uv[j] + noise * rng.normal(size=2))) for j in range(4)]
        if len(seen) >= 8 or (only and seen):
            rows += seen
            where.append(pose)
    return rows, np.array(where)


def corners_csv(rows, sigma=0.1):
    head = "view,marker,corner,u [px],v [px],su [px],sv [px]\n"
    return head + "".join(f"{v},{m},{j},{a:.4f},{b:.4f},{sigma},{sigma}\n" for v, m, j, a, b in rows)


def lens_known(sigma=0.5):
    symbols = tuple(LENS)
    some = symbols[:4] if sigma else ()
    return Lens.of("brown", list(LENS.values()), SIZE, some, np.eye(4) * sigma**2 if sigma else None, "a test")


def write_room(folder, known, rows, *, lens=None, sigma=0.1):
    """map.yaml with its table, lens.yaml and corners.csv in a folder."""
    (folder / "map.yaml").write_text(
        map_text(known, "robocal", "map.covariance.csv" if known.covariance is not None else "")
    )
    if known.covariance is not None:
        (folder / "map.covariance.csv").write_text(map_covariance_text(known))
    (folder / "lens.yaml").write_text(lens_text(lens_known() if lens is None else lens))
    (folder / "corners.csv").write_text(corners_csv(rows, sigma))
    return folder

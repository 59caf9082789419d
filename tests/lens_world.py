"""A camera and a printed target by the formulas of the tests' own: views as tables of corners."""

from __future__ import annotations

import csv
import io

import numpy as np

SIZE = 1280, 960
LENS = {
    "fx": 1050.0,
    "fy": 1055.0,
    "cx": 652.0,
    "cy": 470.0,
    "k1": -0.22,
    "k2": 0.07,
    "p1": 0.0008,
    "p2": -0.0006,
    "k3": 0.0,
}
BOARD = np.array([((i - 4) * 0.025, (3 - j) * 0.025, 0.0) for j in range(7) for i in range(9)])
SQUARE = np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])


def turn(w):
    """The rotation by a vector (Rodrigues)."""
    angle = np.linalg.norm(w)
    k = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]) / max(angle, 1e-12)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def see(points, lens):
    """Pixels (m, 2) of points (m, 3): radial and tangential."""
    x, y = (points[:, :2] / points[:, 2:]).T
    r = x * x + y * y
    d = 1 + lens["k1"] * r + lens["k2"] * r**2 + lens["k3"] * r**3
    u = x * d + 2 * lens["p1"] * x * y + lens["p2"] * (r + 2 * x * x)
    v = y * d + lens["p1"] * (r + 2 * y * y) + 2 * lens["p2"] * x * y
    return np.column_stack([lens["fx"] * u + lens["cx"], lens["fy"] * v + lens["cy"]])


def see_wide(points):
    """Pixels (m, 2) of points (m, 3) through a fisheye that images equal angles at equal lengths."""
    across = np.linalg.norm(points[:, :2], axis=1)
    way = points[:, :2] * (np.arctan2(across, points[:, 2]) / across)[:, None]
    return np.array([420.0, 421.0]) * way + [652.0, 470.0]


def look(rng, count, points=BOARD, lens=LENS, tilt=0.6, depth=(0.3, 0.6), wide=False):
    """So many views of points (m, 3), each wholly in the image: pixels (count, m, 2)."""
    out = []
    while len(out) < count:
        z = rng.uniform(*depth)
        r = turn(np.array([0.0, 0, rng.uniform(-3, 3)])) if tilt == 0 else turn(rng.uniform(-1, 1, 3) * (tilt, tilt, 3))
        at = np.array([*rng.uniform(-0.5, 0.5, 2) * z * np.array(SIZE) / lens["fx"], z])
        seen = points @ (r @ np.diag([1.0, -1, -1])).T + at
        if seen[:, 2].min() < 0.1:
            continue
        uv = see_wide(seen) if wide else see(seen, lens)
        if (uv > 5).all() and (uv < np.array(SIZE) - 6).all():
            out.append(uv)
    return np.array(out)


def board_rows(uv, noise, rng, points=BOARD, sigma=True):
    """Rows as `vision detect` lists those of a board: view, marker, corner, u, v, and su, sv; point_x, point_y, point_z in mm."""
    rows = []
    for i, view in enumerate(uv + rng.normal(0, noise, uv.shape)):
        for k, ((u, v), p) in enumerate(zip(view.tolist(), points.tolist(), strict=True)):
            row = {"view": f"v{i + 1}", "marker": "board", "corner": k, "u [px]": f"{u:.6f}", "v [px]": f"{v:.6f}"}
            row |= {"su [px]": noise, "sv [px]": noise} if sigma else {}
            rows.append(row | {f"point_{a} [mm]": 1e3 * c for a, c in zip("xyz", p, strict=True)})
    return rows


def marker_rows(uv, noise, rng, names):
    """Rows of square markers (count, 4 m, 2), without places."""
    rows = []
    for i, view in enumerate(uv + rng.normal(0, noise, uv.shape)):
        for k, (u, v) in enumerate(view.tolist()):
            row = {
                "view": f"v{i + 1}",
                "marker": names[k // 4],
                "corner": k % 4,
                "u [px]": f"{u:.6f}",
                "v [px]": f"{v:.6f}",
            }
            rows.append(row | {"su [px]": noise, "sv [px]": noise})
    return rows


def write(place, rows):
    """A CSV of rows."""
    text = io.StringIO()
    table = csv.DictWriter(text, list(rows[0]))
    table.writeheader()
    table.writerows(rows)
    place.write_text(text.getvalue())
    return str(place)

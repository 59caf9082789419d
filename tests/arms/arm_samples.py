"""Sample rows for every convention, and the textbook matrices of each, written with NumPy and SciPy only."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from robocal.arms.conventions import CONVENTIONS, chain
from robocal.geometry import so3

NAMES = tuple(CONVENTIONS)
COMPLETE = tuple(n for n, c in CONVENTIONS.items() if c.complete)
BASE = (0.1, -0.2, 0.3, 0.1, -0.2, 0.4)
TOOL = (0.05, 0.02, 0.11, -0.3, 0.2, 0.1)
NOTHING = {"R": (), "P": ("shift",), "F": ("shift", "offset")}  # keys of which a row of this type makes nothing
HOME = (0.4, 0.1, 0.6, 0.2, 0.5, -0.3)


def rows(convention, types, rng):
    """A generic row for each letter of `types` (R, P or F): every key non-zero, lengths 0.1 to 0.5 m, angles 0.3 to
    1.2 rad."""
    out = []
    for letter in types:
        kind = {"R": "revolute", "P": "prismatic", "F": "fixed"}[letter]
        row = {"type": kind}
        if letter != "F":
            row["gain"] = float(rng.choice([0.8, -1.0, 1.1]))
        for key in CONVENTIONS[convention].keys:
            made = value(key, kind, rng)
            if not key.name.startswith(NOTHING[letter]):
                row[key.name] = made
        if convention == "poe":
            w, p = unit(rng), rng.uniform(-0.5, 0.5, 3)
            row |= {"v": list(np.cross(p, w)), "w": list(w)} if letter == "R" else {"v": list(w), "w": [0.0, 0.0, 0.0]}
        out.append(row)
    return out


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def value(key, kind, rng):
    sign = rng.choice([-1.0, 1.0])
    if key.name.startswith(("tilt", "shift", "offset")):
        return float(sign * rng.uniform(0.02, 0.05))
    if key.quantity == "angle":
        return float(sign * rng.uniform(0.3, 1.2))
    if key.quantity == "length":
        return float(sign * rng.uniform(0.1, 0.5))
    if key.quantity == "direction":
        return list(unit(rng) + [0, 0, 0.5])
    if key.quantity == "steps":
        axis = "tz" if kind == "prismatic" else "rz"
        return [
            {"axis": "ty", "symbol": "l", "value": 0.2},
            {"axis": "rx", "symbol": "alpha", "value": float(sign * rng.uniform(0.3, 1.2))},
            {"axis": "tx", "value": 0.3},
            {"axis": axis, "symbol": "q0", "value": 0.1, "driven": 0 if kind == "fixed" else -1},
            {"axis": "ry", "symbol": "e", "value": 0.4},
            {"axis": "tz", "symbol": "d", "value": 0.25},
        ]
    return list(rng.uniform(-0.5, 0.5, 3))


def arm(convention, types, rng, **more):
    return chain(f"{convention} {types}", convention, rows(convention, types, rng), base=BASE, tool=TOOL, **more)


def joint_values(types, rng, m):
    spread = [1.2 if t == "R" else 0.3 for t in types if t != "F"]
    return rng.uniform(-1, 1, (m, len(spread))) * spread


# --- the textbook -----------------------------------------------------------------------------------------------------------


def moved(axis, value):
    """A 4x4 elementary transform: axis is tx ty tz rx ry rz."""
    t = np.eye(4)
    i = "xyz".index(axis[1])
    if axis[0] == "t":
        t[i, 3] = value
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        t[j, j] = t[k, k] = np.cos(value)
        t[k, j], t[j, k] = np.sin(value), -np.sin(value)
    return t


def twist(v, w):
    """expm of the 4x4 matrix of a twist."""
    m = np.zeros((4, 4))
    m[:3, :3] = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
    m[:3, 3] = v
    return expm(m)


def frame(x):
    """Translation and rotation vector as a 4x4 matrix."""
    t = twist((0, 0, 0), x[3:])
    t[:3, 3] = x[:3]
    return t


def textbook(convention, row, q):
    """The matrix of one joint at q (None for a fixed row), as its source prints it."""
    kind = row["type"]
    g = 0.0 if q is None else row.get("gain", 1.0) * q
    turn, shift = (g, 0.0) if kind == "revolute" else (0.0, g)
    c, s = np.cos, np.sin
    if convention in ("dh", "dh-hayati"):
        th, d, a, al = row["theta"] + turn, row["d"] + shift, row["a"], row["alpha"]
        t = np.array(
            [
                [c(th), -s(th) * c(al), s(th) * s(al), a * c(th)],
                [s(th), c(th) * c(al), -c(th) * s(al), a * s(th)],
                [0, s(al), c(al), d],
                [0, 0, 0, 1],
            ]
        )
        return t @ moved("ry", row["beta"]) if convention == "dh-hayati" else t
    if convention.startswith(("mdh", "khalil")):
        k = convention.startswith("khalil")
        a, d = (row["d"], row["r"]) if k else (row["a"], row["d"])
        th, d, al = row["theta"] + turn, d + shift, row["alpha"]
        t = np.array(
            [
                [c(th), -s(th), 0, a],
                [c(al) * s(th), c(al) * c(th), -s(al), -d * s(al)],
                [s(al) * s(th), s(al) * c(th), c(al), d * c(al)],
                [0, 0, 0, 1],
            ]
        )
        return moved("ry", row["beta"]) @ t if convention.endswith("hayati") else t
    if convention == "s-model":
        dh = textbook("dh", {**row, "theta": row["beta"], "gain": 1.0}, None if q is None else g)
        return dh @ moved("rz", row["gamma"]) @ moved("tz", row["b"])
    if convention == "mcpc":
        q_part = moved("rz", row["theta"] + turn) @ moved("tz", row["d"] + shift)
        return (
            q_part
            @ moved("rx", row["alpha"])
            @ moved("ry", row["beta"])
            @ moved("tx", row["x"])
            @ moved("ty", row["y"])
        )
    if convention == "elements":
        t = np.eye(4)
        for e in row["elements"]:
            t = t @ moved(e["axis"], e["value"] + e.get("driven", 0) * g)
        return t
    g += row["offset"] if q is not None else 0.0
    if convention == "cpc":
        t = moved("tz" if kind == "prismatic" else "rz", g)
        x, y, z = np.array(row["b"]) / np.linalg.norm(row["b"])
        # Zhuang, Roth and Hamano, the rotation whose third column is b.
        r = np.eye(4)
        r[:3, :3] = [
            [1 - x * x / (1 + z), -x * y / (1 + z), x],
            [-x * y / (1 + z), 1 - y * y / (1 + z), y],
            [-x, -y, z],
        ]
        t = t @ r @ moved("rx", row["tilt_x"]) @ moved("ry", row["tilt_y"]) @ moved("rz", row["beta"])
        return t @ moved("tx", row["lx"]) @ moved("ty", row["ly"]) @ moved("tz", row["lz"])
    if convention == "urdf":
        r, p, y = row["rpy"]
        origin = moved("rz", y) @ moved("ry", p) @ moved("rx", r)
        origin[:3, 3] = row["xyz"]
        return origin @ about(kind, row["axis"], (0, 0, 0), g)
    if convention in ("offsets", "poe-local"):
        own = frame([row[k] for k in ("x", "y", "z", "rx", "ry", "rz")])
        return own @ about(kind, row["axis"], row.get("point", (0, 0, 0)), g)
    if convention == "zero-reference":
        w, p = np.array(row["axis"]) / np.linalg.norm(row["axis"]), np.array(row["point"])
    else:
        w = np.array(row["w"]) if kind == "revolute" else np.array(row["v"])
        # The foot of the perpendicular from the origin onto the axis.
        p = np.cross(w, row["v"]) if kind == "revolute" else np.zeros(3)
    k = (np.argmax(np.abs(w)) + 1) % 3
    u = np.eye(3)[k] - w[k] * w
    u /= np.linalg.norm(u)
    e = about("revolute", u, p, row["tilt_u"]) @ about("revolute", np.cross(w, u), p, row["tilt_v"])
    if kind == "revolute":
        e[:3, 3] += e[:3, :3] @ (u * row["shift_u"] + np.cross(w, u) * row["shift_v"])
    return e @ about(kind, w, p, g) @ np.linalg.inv(e)


def about(kind, axis, point, value):
    """A turn about the line through a point, or a shift along a direction; nothing for a fixed row."""
    w = np.array(axis) / np.linalg.norm(axis)
    if kind == "fixed":
        return np.eye(4)
    if kind == "prismatic":
        return twist(value * w, (0, 0, 0))
    t = twist((0, 0, 0), value * w)
    t[:3, 3] = np.array(point) - t[:3, :3] @ np.array(point)
    return t


def textbook_pose(robot, q, home=None):
    """T_base_tool at one configuration, as the product of the textbook's matrices."""
    t, left = frame(BASE), list(q)
    for row in robot.meta["rows"]:
        t = t @ textbook(robot.convention, row, None if row["type"] == "fixed" else left.pop(0))
    return t @ (np.eye(4) if home is None else frame(home)) @ frame(TOOL)


# --- tangent steps ----------------------------------------------------------------------------------------------------------


def step_table(table):
    """add(x, step) on a parameter vector, rotation vectors on the group."""

    def add(x, step):
        out = x + step
        for t in table.turns:
            out[t : t + 3] = so3.log(so3.exp(step[t : t + 3]) @ so3.exp(x[t : t + 3]))
        return out

    return add


def pose_difference(a, b):
    """Tangent difference (v, w) of poses a, b (..., 4, 4) in base coordinates."""
    turn = so3.log(a[..., :3, :3] @ np.swapaxes(b[..., :3, :3], -1, -2))
    return np.concatenate([a[..., :3, 3] - b[..., :3, 3], turn], axis=-1)

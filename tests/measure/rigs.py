"""A rig for every kind of measurement on any arm: what a true machine would do there, and what an engineer would state.

A rig gives data whose frames and places are the true ones and whose configurations reach what must be reached: a
constraint reads exactly 0, and the noise of contact is in the first `contact` configurations, as on a real machine.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.arms.inverse_kinematics import inverse_point
from robocal.geometry import se3, so3
from robocal.measure.base import kind_of, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

XYZ = (True,) * 3 + (False,) * 3
SIX = (True,) * 6
SIGMA = 5e-5  # m
TURN = 1e-4  # rad
# A ball on the tool whose place an engineer measured with a ruler.
BALL = Frame("ball", (0.02, -0.03, 0.12, 0.0, 0.0, 0.0), XYZ, "tool", expected=(5e-3, 0.1))


def ball_of(truth, q):
    """Where the true machine has the ball, (m, 3)."""
    return (truth.pose(q) @ se3.from_vector(BALL.value))[:, :3, 3]


def configurations(q):
    return Configurations(tuple(f"c{i}" for i in range(len(q))), q)


def anywhere(truth, rng, m):
    return rng.uniform(-1, 1, (m, len(truth.joints))) * np.array(
        [0.3 if j.type == "prismatic" else 1.2 for j in truth.joints]
    )


def reaching(truth, rng, points):
    """Joint values that bring the ball to points (m, 3), each from a start of its own; points out of reach raise."""
    held = se3.from_vector(BALL.value)
    with_ball = replace(
        truth, table=truth.table.with_values({f"tool.{s}": v for s, v in zip(("x", "y", "z", "rx", "ry", "rz"), se3.to_vector(se3.from_vector([truth.table[f"tool.{s}"].value for s in ("x", "y", "z", "rx", "ry", "rz")]) @ held), strict=True)})
    )  # fmt: skip
    found = inverse_point(with_ball, points, start=anywhere(truth, rng, len(points)))
    assert found.success.all(), "a point of the rig is out of reach"
    # Joint values are as good within one turn, and encoders do not count turns.
    turns = np.array([j.type == "revolute" and abs(truth.table[f"{j.name}.gain"].value) == 1.0 for j in truth.joints])
    return np.where(turns, so3_wrap(found.joints), found.joints)


def so3_wrap(q):
    return (q + np.pi) % (2 * np.pi) - np.pi


def rows(kind, m, sigma, frame=None, targets=(BALL,), **more):
    size = kind_of(Observations(kind, np.arange(0), np.zeros((0, 1)))).size
    spread = np.broadcast_to(np.asarray(sigma, float), (m, size)).copy()
    return Observations(
        kind, more.pop("configuration", np.arange(m)), np.zeros((m, size)), spread, frame, targets, **more
    )


def station(truth, rng, side, name, free=SIX):
    """An instrument some spreads away from the middle of the workspace, level but for some degrees: T_frame_base."""
    p = ball_of(truth, anywhere(truth, rng, 200))
    size = np.linalg.norm(p - p.mean(axis=0), axis=1).max()
    where = p.mean(axis=0) + 2.5 * size * np.array([np.cos(side), np.sin(side), 0.1])
    turned = so3.exp([0.0, 0.0, side + np.pi]) @ so3.exp(rng.normal(scale=0.05, size=3))
    return Frame(name, tuple(se3.to_vector(se3.inverse(se3.compose(turned, where)))), free)


# --- instruments ----------------------------------------------------------------------------------------------------------


def watched(kind, sigma, targets=(BALL,), stations=1, **more):
    """One or more instruments that watch the tool."""

    def rig(truth, rng, m, contact=0):
        q = anywhere(truth, rng, m)
        found = [
            rows(kind, m, sigma, station(truth, rng, 0.4 + 1.3 * i, f"eye{i}"), targets, **more)
            for i in range(stations)
        ]
        return DataSet(configurations(q), tuple(found))

    return rig


def pairs(kind, sigma, framed=False, options=None):
    """Every configuration with the next one."""

    def rig(truth, rng, m, contact=0):
        frame = station(truth, rng, 0.4, "eye", (False,) * 3 + (True,) * 3) if framed else None
        obs = rows(kind, m, sigma, frame, options=options or {})
        return DataSet(configurations(anywhere(truth, rng, m)), (replace(obs, second=(np.arange(m) + 1) % m),))

    return rig


def in_hand(truth, rng, m, contact=0):
    """A camera in hand that sees a marker on the base."""
    eye = Frame("eye", (0.03, -0.02, 0.05, 0.2, 0.1, 0.4), SIX, "tool")
    p = ball_of(truth, anywhere(truth, rng, 100)).mean(axis=0)
    marker = Frame("marker", (*p, 0.3, -0.2, 0.5), SIX)
    return DataSet(
        configurations(anywhere(truth, rng, m)), (rows("pose", m, [SIGMA] * 3 + [TURN] * 3, eye, (marker,)),)
    )


def pixels(truth, rng, m, contact=0):
    """A known fixed camera that sees four points of a board on the tool; it looks along its z axis."""
    eye = station(truth, rng, 0.4, "eye")
    looks = se3.compose(np.array([[0, -1.0, 0], [0, 0, -1], [1, 0, 0]]), np.zeros(3))
    eye = replace(eye, value=tuple(se3.to_vector(looks @ se3.from_vector(eye.value))))
    board = 0.1 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0.2], [-1, 1, 0]])
    options = {"camera": "lens", "intrinsics": (2000.0, 2000.0, 1000.0, 800.0, -0.05, 0.01, 0.0, 0.0, 0.0), "free": ()}
    many = rows(
        "pixels", 4 * m, 0.05, eye, (BALL,), configuration=np.repeat(np.arange(m), 4), options=options,
        extra={"point": np.tile(board, (m, 1))},
    )  # fmt: skip
    return DataSet(configurations(anywhere(truth, rng, m)), (many,))


def ranges(truth, rng, m, contact=0):
    """Five receivers around the workspace, one speed of sound and one delay for all."""
    p = ball_of(truth, anywhere(truth, rng, 200))
    size = np.linalg.norm(p - p.mean(axis=0), axis=1).max()
    around = np.array([[1.0, 0, -0.6], [-0.3, 1, 0.2], [-0.6, -0.9, 0.5], [0.2, 0.3, 1.3], [0.8, -0.9, 0.1]])
    options = {"medium": "air", "speed": 343.0, "values": {"speed": 345.5, "delay": 2e-3}, "free": ("speed", "delay")}
    found = [
        rows("range", m, 1e-4, options={**options, "place": Frame(f"ear{i}", (*c, 0, 0, 0), XYZ)}, group=f"ear{i}")
        for i, c in enumerate(p.mean(axis=0) + 1.5 * size * around)
    ]
    return DataSet(configurations(anywhere(truth, rng, m)), tuple(found))


# --- constraints ----------------------------------------------------------------------------------------------------------


def middles(truth, rng, many):
    """Some places that the arm reaches easily, apart from each other: medoids of where it goes."""
    p = ball_of(truth, 0.6 * anywhere(truth, rng, 60))
    chosen = [int(np.argmin(np.linalg.norm(p - p.mean(axis=0), axis=1)))]
    while len(chosen) < many:
        chosen.append(int(np.argmax(np.min([np.linalg.norm(p - p[c], axis=1) for c in chosen], axis=0))))
    return p[chosen]


def directions(rng, m):
    d = rng.normal(size=(m, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def touching(kind, many, offset, options=lambda i: {}, sigma=SIGMA, axes=None, extra=lambda i, n: {}):
    """The ball at `offset(rng, i, k)` (k, 3) from place i, in its axes; contact noise where contact is asked for."""

    def rig(truth, rng, m, contact=0):
        centres = middles(truth, rng, many)
        found, q = [], []
        for i, c in enumerate(centres):
            index = np.arange(m)[i::many]
            free = SIX if kind == "plane" else XYZ
            turned = (0.0, 0.0, 0.0) if axes is None else tuple(so3.log(axes[i]))
            place = Frame(f"place{i}", (*c, *turned), free)
            where, along = offset(rng, i, len(index))
            noise = sigma * rng.standard_normal((len(index), along.shape[1])) * (index < contact)[:, None]
            reached = where + np.einsum("kd,kdj->kj", noise, along)
            points = reached @ so3.exp(turned).T + c
            q.append((index, reaching(truth, rng, points)))
            found.append(
                rows(kind, len(index), sigma, configuration=index, group=place.name, options={"place": place, **options(i)}, extra=extra(i, len(index)))
            )  # fmt: skip
        joints = np.empty((m, len(truth.joints)))
        for index, values in q:
            joints[index] = values
        data = DataSet(configurations(joints), tuple(found))
        return data

    return rig


def at_the_place(rng, i, k):
    return np.zeros((k, 3)), np.tile(np.eye(3), (k, 1, 1))


def on_a_sphere(radius):
    def offset(rng, i, k):
        d = directions(rng, k)
        return radius * d, d[:, None]

    return offset


def on_a_plate(height, wide=0.15):
    def offset(rng, i, k):
        p = np.concatenate([rng.uniform(-wide, wide, (k, 2)), np.full((k, 1), height)], axis=1)
        return p, np.tile([0.0, 0.0, 1.0], (k, 1, 1))

    return offset


FACES = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [-1, 0, 0]])
HALF = 0.06


def on_a_cube(rng, i, k):
    n = np.resize(FACES, (k, 3))
    flat = rng.uniform(-HALF, HALF, (k, 3))
    return np.where(n != 0, 0.0, flat) + n * (HALF + 0.005), n[:, None]


def cube_faces(i, k):
    return {"normal": np.resize(FACES, (k, 3)), "offset": np.full(k, HALF)}


# Plates that face three ways, one of them a wall.
PLATES = so3.exp(np.array([[0.1, -0.1, 0.2], [0.2, 1.5, 0.1], [-0.9, 0.3, 0.4]]))


def two_sockets(truth, rng, m, contact=0):
    """Two sockets, and one row that says how far apart they are."""
    data = touching("point", 2, at_the_place)(truth, rng, m, contact)
    sockets = tuple(o.options["place"] for o in data.observations)
    gauge = rows("distance", 1, 1e-5, None, (), options={"ends": sockets}, group="gauge")
    return DataSet(data.configurations, (*data.observations, gauge))


def ballbar(truth, rng, m, contact=0):
    """A bar of unknown length from three sockets on the base to the ball."""
    data = touching("point", 3, on_a_sphere(0.25), sigma=SIGMA)(truth, rng, m, contact)
    bar = {"length": "bar", "values": {"length": 0.25}, "free": ("length",)}
    found = [
        rows("distance", len(o), SIGMA, None, (), configuration=o.configuration, group=o.label,
             options={"ends": (o.options["place"], BALL), **bar})
        for o in data.observations
    ]  # fmt: skip
    return DataSet(data.configurations, tuple(found))


RIGS = {
    "position": watched("position", SIGMA),
    "pose": watched("pose", [SIGMA] * 3 + [TURN] * 3, ()),
    "pose, camera in hand": in_hand,
    "pose, fixed camera": watched("pose", [SIGMA] * 3 + [TURN] * 3, (Frame("marker", (0.02, -0.03, 0.12, 0.3, 0.1, -0.2), SIX, "tool"),)),
    "relative_pose": pairs("relative_pose", [SIGMA] * 3 + [TURN] * 3),
    "displacement": pairs("displacement", SIGMA, framed=True),
    "distance, between configurations": pairs("distance", SIGMA, options={"length": "bar", "values": {"length": 0.2}, "free": ("length",)}),
    "distance, ballbar": ballbar,
    "point": two_sockets,
    "plane": touching("plane", 3, on_a_plate(0.005), lambda i: {"radius": "tip", "values": {"radius": 0.005}}, axes=PLATES),
    "plane, datum cube": touching("plane", 1, on_a_cube, lambda i: {"radius": "tip", "values": {"radius": 0.005}}, axes=PLATES, extra=cube_faces),
    "sphere": touching("sphere", 3, on_a_sphere(0.03), lambda i: {"radius": "gauge", "values": {"radius": 0.03}}),
    "bearing": watched("bearing", 2e-5, stations=2),
    "range": ranges,
    "spherical": watched("spherical", [1e-5, 2e-5, 2e-5], options={"zero": "prism", "values": {"zero": 1e-3}, "free": ("zero",)}),
    "pixels": pixels,
}  # fmt: skip


def stated(data, rng, error=2e-3):
    """What an engineer states: nothing of where instruments and places are, the ball within two millimetres, lengths
    that were never measured as zero, and the speed of sound from a table."""

    def frame(f):
        if f is None:
            return None
        if f.mount == "tool" and f.name != "eye":
            off = np.where(f.free, rng.normal(scale=error, size=6), 0.0)
            return replace(f, value=tuple(np.asarray(f.value) + off))
        return replace(f, value=tuple(0.0 if free else v for v, free in zip(f.value, f.free, strict=True)))

    known = {}

    def once(f):
        return known.setdefault(f.name, frame(f)) if f is not None else None

    out = []
    for obs in data.observations:
        options = dict(obs.options)
        if "place" in options:
            options["place"] = once(options["place"])
        if "ends" in options:
            options["ends"] = tuple(once(e) for e in options["ends"])
        if "free" in options and "values" in options:
            unknown = {"length": 0.0, "radius": 0.0, "zero": 0.0, "speed": options.get("speed"), "delay": 0.0}
            options["values"] = {k: unknown[k] if k in options["free"] else v for k, v in options["values"].items()}
        out.append(replace(obs, frame=once(obs.frame), targets=tuple(once(t) for t in obs.targets), options=options))
    return DataSet(data.configurations, tuple(out))


def recorded(kind, truth, rng, m, contact):
    """What the rig of a kind records."""
    return recorded_by(RIGS[kind], truth, rng, m, contact)


def recorded_by(rig, truth, rng, m, contact):
    """What a rig records with noise: constraints read exactly 0, the first `contact` configurations have their noise."""
    data = rig(truth, rng, m, contact)
    read = synthesise(truth, data, rng)
    return DataSet(
        data.configurations,
        tuple(o if constrains(o) else r for o, r in zip(data.observations, read.observations, strict=True)),
    )


def constrains(obs):
    """Whether the machine was brought to where these rows read 0."""
    return obs.kind in ("point", "plane", "sphere") or ("length" in obs.options and obs.second is None)

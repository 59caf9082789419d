"""Every kind of measurement on every carrier that it can ride on: small problems away from any special point,
everything free."""

from __future__ import annotations

import numpy as np

from robocal.arms.conventions import chain
from robocal.cables.geometry import cable_robot
from robocal.estimate.problem import Problem
from robocal.geometry import se3
from robocal.measure.base import kind_of, problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

DEG = np.pi / 180
CAMERA = (900.0, 910.0, 320.0, 250.0, -0.05, 0.02, 0.003, -0.002, 0.01)
# A camera 2 m in front of the robot that looks back at it.
LOOKS = se3.compose(np.array([[0, 0, -1.0], [1, 0, 0], [0, -1, 0]]), [2.0, 0.1, 0.3])
TRACKER = Frame("tracker", (1.0, 2.0, 0.3, 0.2, -0.4, 1.1), (True,) * 6)
EYE = Frame("eye", tuple(se3.to_vector(se3.inverse(LOOKS))), (True,) * 6)
BALL = Frame("ball", (0.05, 0.02, 0.1, 0.1, 0.2, -0.3), (True,) * 6, "tool")
HAND = Frame("hand", (0.03, -0.02, 0.05, 0.2, 0.1, 0.4), (True,) * 6, "tool")
TAGS = tuple(Frame(f"tag{i}", (0.3 + 0.1 * i, -0.2 * i, -0.9, 0.1, 0.2, 0.3 * i), (True,) * 6) for i in range(2))


def arm():
    rows = [
        {"r": 0.3},
        {"alpha": -90 * DEG, "theta": -90 * DEG},
        {"d": 0.25, "beta": 0.02},
        {"d": 0.16, "theta": 90 * DEG},
    ]
    return chain(
        "small", "khalil-hayati", rows, base=(0.1, 0, 0.2, 0.1, 0.2, -0.1), tool=(0.02, 0.01, 0.1, 0.3, -0.2, 0.1)
    )


def platform():
    rng = np.random.default_rng(5)
    corners = np.array([(x, y, 2.5) for x in (-2.0, 2.0) for y in (-1.5, 1.5)])
    return cable_robot(
        "four",
        corners,
        rng.normal(scale=0.15, size=(4, 3)),
        np.full(4, 0.3),
        free=("ax", "ay", "az", "bx", "by", "bz", "l0"),
    )


def configurations(machine, rng, m):
    ids = tuple(f"c{i}" for i in range(m))
    if hasattr(machine, "joints"):
        return Configurations(ids, rng.uniform(-0.6, 0.6, (m, len(machine.joints))) + 0.1)
    return Configurations(
        ids,
        start=np.concatenate([rng.normal(scale=0.4, size=(m, 3)) + [0, 0, 1], rng.normal(scale=0.4, size=(m, 3))], 1),
    )


def observations(kind, m, sigma, frame=None, targets=(), each=1, **more):
    """`each` rows per configuration and target."""
    count = max(len(targets), 1)
    configuration = np.repeat(np.arange(m), count * each)
    target = np.tile(np.repeat(np.arange(count), each), m) if targets else None
    d = {"position": 3, "pose": 6, "distance": 1, "pixels": 2, "lengths": 1}[kind]
    k = len(configuration)
    spread = sigma * np.linspace(1, 2, k * d).reshape(k, d)
    return Observations(kind, configuration, np.zeros((k, d)), spread, frame, tuple(targets), target, **more)


def made(machine, obs, rng, m, *, local_targets=(), free=None, error=0.05):
    """The problem with measurements `error` away from what the model says, so that residuals are far from zero."""
    where = configurations(machine, rng, m)
    data = synthesise(machine, DataSet(where, tuple(obs)), local_targets=local_targets)
    moved = []
    for o in data.observations:
        size = error * (100 if o.kind == "pixels" else 3 if o.kind == "pose" else 1)
        moved.append(
            o.__class__(
                **{**o.__dict__, "value": kind_of(o).disturb(o.value, rng.normal(scale=size, size=o.value.shape))}
            )
        )
    built = problem(machine, DataSet(where, tuple(moved)), local_targets=local_targets)
    wanted = [n for n in built.table.names if not n.endswith(".gain")] if free is None else free
    return built.with_free(wanted)


def pixels(m, frame, targets):
    square = 0.06 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0.3], [-1, -1, 0]])
    point = np.tile(square, (m * len(targets), 1))
    return observations(
        "pixels",
        m,
        0.1,
        frame,
        targets,
        4,
        extra={"point": point},
        options={"camera": "lens", "intrinsics": CAMERA, "free": ()},
    )


def carriers_of(kind, sigma):
    """The carriers of a kind that measures one frame in another."""
    return {
        f"{kind}/arm alone": lambda rng: made(arm(), [observations(kind, 4, sigma)], rng, 4),
        f"{kind}/arm, instrument on the base": lambda rng: made(arm(), [observations(kind, 4, sigma, TRACKER, (BALL,))], rng, 4),
        f"{kind}/arm, instrument in hand": lambda rng: made(arm(), [observations(kind, 4, sigma, HAND, TAGS)], rng, 4),
        f"{kind}/arm, instrument in hand, no target": lambda rng: made(arm(), [observations(kind, 3, sigma, HAND)], rng, 3),
        f"{kind}/frames alone": lambda rng: made(arm(), [observations(kind, 3, sigma, TRACKER, TAGS)], rng, 3, free=[f"{n}.{s}" for n in ("tracker", "tag0", "tag1") for s in ("x", "y", "z", "rx", "ry", "rz")]),
        f"{kind}/arm, targets eliminated": lambda rng: made(arm(), [observations(kind, 4, sigma, HAND, TAGS)], rng, 4, local_targets=("tag0", "tag1")),
        f"{kind}/free poses": lambda rng: made(platform(), [observations(kind, 3, sigma)], rng, 3, free=[]),
        f"{kind}/free poses, instrument on the base": lambda rng: made(platform(), [observations(kind, 3, sigma, TRACKER, (BALL,))], rng, 3, free=[f"{n}.{s}" for n in ("tracker", "ball") for s in ("x", "y", "z", "rx", "ry", "rz")]),
        f"{kind}/free poses, instrument on board": lambda rng: made(platform(), [observations(kind, 3, sigma, HAND, TAGS)], rng, 3, free=[f"{n}.{s}" for n in ("hand", "tag1") for s in ("x", "y", "z", "rx", "ry", "rz")]),
    }  # fmt: skip


def distance(rng):
    sockets = tuple(Frame(f"socket{i}", tuple(rng.normal(size=6)), (True,) * 6) for i in range(2))
    obs = observations("distance", 2, 1e-3, options={"ends": sockets}, group="bar")
    return made(
        arm(), [obs], rng, 2, free=[f"socket{i}.{s}" for i in range(2) for s in ("x", "y", "z", "rx", "ry", "rz")]
    )


def lengths(rng):
    m = 5
    obs = observations("lengths", m, 1e-3, each=4, extra={"cable": np.tile(np.arange(4), m)})
    return made(platform(), [obs], rng, m)


def lens(names):
    return [f"{n}.{s}" for n in names for s in ("x", "y", "z", "rx", "ry", "rz")] + [
        f"lens.{s}" for s in ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
    ]


def mixed(rng):
    """Two instruments and three kinds in one problem."""
    m = 3
    obs = [
        observations("position", m, 1e-3, TRACKER, (BALL,)),
        pixels(m, EYE, (BALL,)),
        observations("pose", m, 1e-3, TRACKER),
    ]
    return made(arm(), obs, rng, m)


SCENARIOS = {
    **carriers_of("position", 1e-3),
    **carriers_of("pose", 1e-3),
    "distance/two frames": distance,
    "lengths/free poses": lengths,
    "pixels/arm, camera on the base": lambda rng: made(arm(), [pixels(3, EYE, (BALL,))], rng, 3),
    "pixels/arm, camera in hand": lambda rng: made(arm(), [pixels(3, HAND, TAGS)], rng, 3),
    "pixels/arm, markers eliminated": lambda rng: made(
        arm(), [pixels(3, HAND, TAGS)], rng, 3, local_targets=("tag0", "tag1")
    ),
    "pixels/free poses": lambda rng: made(platform(), [pixels(3, HAND, TAGS)], rng, 3, free=lens(["hand", "tag0"])),
    "mixed": mixed,
}


def build(name) -> Problem:
    return SCENARIOS[name](np.random.default_rng(11))

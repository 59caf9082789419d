"""Every kind of measurement on every carrier that it can ride on: small problems away from any special point,
everything free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from cables.kinds import DRUMS, MOVING, PLANAR, RAILS, robot_of

from robocal.arms.conventions import chain
from robocal.arms.joint_loads import load_names, with_loads
from robocal.cables.geometry import cable_robot
from robocal.cables.pulley import Pulleys
from robocal.cables.rope import rope
from robocal.drives.drive_sweep import sweep_of
from robocal.drives.motor import motor_of
from robocal.estimate.problem import Problem
from robocal.geometry import se3
from robocal.measure.base import KINDS, kind_of, problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.plane_points import across
from robocal.session.drive.drive_data import NUMBERS, drive_data

DEG = np.pi / 180
CAMERA = (900.0, 910.0, 320.0, 250.0, -0.05, 0.02, 0.003, -0.002, 0.01)
RATIONAL = (*CAMERA, 0.03, -0.01, 0.02)
FISHEYE = (400.0, 410.0, 320.0, 250.0, -0.02, 0.01, 0.003, -0.002)
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
    if machine.joints:
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
    d = KINDS[kind].size
    k = len(configuration)
    spread = sigma * np.linspace(1, 2, k * d).reshape(k, d)
    return Observations(kind, configuration, np.zeros((k, d)), spread, frame, tuple(targets), target, **more)


def made(machine, obs, rng, m, *, local_targets=(), free=None, error=0.05):
    """The problem with measurements `error` away from what the model says, so that residuals are far from zero."""
    where = configurations(machine, rng, m)
    data = synthesise(machine, DataSet(where, tuple(obs)), local_targets=local_targets)
    moved = []
    for o in data.observations:
        size = error * (100 if o.kind == "pixels" else 3 if o.kind in ("pose", "relative_pose") else 1)
        moved.append(
            o.__class__(
                **{**o.__dict__, "value": kind_of(o).disturb(o.value, rng.normal(scale=size, size=o.value.shape))}
            )
        )
    built = problem(machine, DataSet(where, tuple(moved)), local_targets=local_targets)
    wanted = [n for n in built.table.names if not n.endswith(".gain")] if free is None else free
    return built.with_free(wanted)


def pixels(m, frame, targets, many=4, camera=None, printed=""):
    square = 0.06 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0.3], [-1, -1, 0]])
    size = np.linspace(0.2, 1, -(-many // 4))[:, None, None]  # squares in squares
    point = np.tile((size * square if many > 4 else square).reshape(-1, 3)[:many], (m * len(targets), 1))
    return observations(
        "pixels",
        m,
        0.1,
        frame,
        targets,
        many,
        extra={"point": point},
        options={"camera": "lens", "intrinsics": camera or CAMERA, "free": ()}
        | ({"print": printed} if printed else {}),
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
        f"{kind}/free poses, free targets": lambda rng: made(platform(), [observations(kind, 3, sigma, HAND, TAGS)], rng, 3, free=all_six("hand"), local_targets=("tag0", "tag1")),
        f"{kind}/free poses, instrument on board": lambda rng: made(platform(), [observations(kind, 3, sigma, HAND, TAGS)], rng, 3, free=[f"{n}.{s}" for n in ("hand", "tag1") for s in ("x", "y", "z", "rx", "ry", "rz")]),
    }  # fmt: skip


def distance(rng):
    sockets = tuple(Frame(f"socket{i}", tuple(rng.normal(size=6)), (True,) * 6) for i in range(2))
    obs = observations("distance", 2, 1e-3, options={"ends": sockets}, group="bar")
    return made(
        arm(), [obs], rng, 2, free=[f"socket{i}.{s}" for i in range(2) for s in ("x", "y", "z", "rx", "ry", "rz")]
    )


def all_six(*names):
    return [f"{n}.{s}" for n in names for s in ("x", "y", "z", "rx", "ry", "rz")]


PLACE = Frame("place", (0.3, -0.2, -0.6, 0.2, 0.5, -0.3), (True,) * 6)
SOCKET = Frame("socket", (0.3, -0.2, -0.6, 0.2, 0.5, -0.3), (True,) * 6)
# The numbers that each of the kinds against a place has, as it reads them.
OWN = {
    "point": {},
    "sphere": {"radius": "probe", "values": {"radius": 0.3}},
    "plane": {"radius": "probe", "values": {"radius": 0.01}},
    "range": {"medium": "air", "speed": 343.0, "values": {"speed": 346.0, "delay": 0.02}},
}


def against(kind, m, targets=(BALL,), place=PLACE, **more):
    """Rows of a kind that measures against a place; planes are the faces of a cube."""
    obs = observations(kind, m, 1e-3, None, targets, options={"place": place, **OWN[kind]}, **more)
    if kind != "plane":
        return obs
    faces = np.resize(np.vstack([np.eye(3), -np.eye(3)]), (len(obs), 3))
    return replace(obs, extra={"normal": faces, "offset": np.linspace(0.02, 0.05, len(obs))})


def places_of(kind):
    """The carriers of a kind that measures against a place."""
    own = list({p.name for p in KINDS[kind].parameters(against(kind, 2))})
    return {
        f"{kind}/arm, target on the tool": lambda rng: made(arm(), [against(kind, 6)], rng, 6),
        f"{kind}/arm, the tool itself": lambda rng: made(arm(), [against(kind, 6, ())], rng, 6),
        f"{kind}/arm, two targets": lambda rng: made(arm(), [against(kind, 4, (BALL, replace(BALL, name="other", value=(0.0, 0.1, 0.05, 0.0, 0.1, 0.0))))], rng, 4),
        f"{kind}/frames alone": lambda rng: made(arm(), [against(kind, 4, TAGS)], rng, 4, free=[*all_six("place", "tag0", "tag1"), *own]),
        f"{kind}/free poses": lambda rng: made(platform(), [against(kind, 4)], rng, 4, free=[*all_six("place", "ball"), *own]),
    }  # fmt: skip


def pairs(kind, m, frame=None, targets=(), **more):
    """Rows that compare every configuration with the next one."""
    obs = observations(kind, m, 1e-3, frame, targets, **more)
    return replace(obs, second=(obs.configuration + 1) % m)


def differences():
    """Kinds that compare two configurations, and distances with every kind of end."""
    bar = {"length": "bar", "values": {"length": 0.05}}
    sockets = (SOCKET, BALL)
    return {
        "displacement/arm alone": lambda rng: made(arm(), [pairs("displacement", 5)], rng, 5),
        "displacement/arm, instrument on the base": lambda rng: made(arm(), [pairs("displacement", 5, TRACKER, (BALL,))], rng, 5),
        "displacement/arm, instrument in hand": lambda rng: made(arm(), [pairs("displacement", 5, HAND, TAGS)], rng, 5),
        "relative_pose/arm alone": lambda rng: made(arm(), [pairs("relative_pose", 5)], rng, 5),
        "relative_pose/arm, target on the tool": lambda rng: made(arm(), [pairs("relative_pose", 5, None, (BALL,))], rng, 5),
        "distance/arm, two configurations": lambda rng: made(arm(), [pairs("distance", 5, None, (BALL,))], rng, 5),
        "distance/arm, two configurations, the tool itself": lambda rng: made(arm(), [pairs("distance", 5, options=bar)], rng, 5),
        "distance/arm, socket and ball": lambda rng: made(arm(), [observations("distance", 5, 1e-3, options={"ends": sockets, **bar})], rng, 5),
        "distance/arm, ball and socket": lambda rng: made(arm(), [observations("distance", 5, 1e-3, options={"ends": sockets[::-1]})], rng, 5),
        "distance/arm, two balls at two configurations": lambda rng: made(arm(), [pairs("distance", 5, options={"ends": (HAND, BALL)})], rng, 5),
        "distance/free poses": lambda rng: made(platform(), [observations("distance", 5, 1e-3, options={"ends": sockets, **bar})], rng, 5, free=[*all_six("socket", "ball"), "bar.length"]),
        "distance/free poses, ball first": lambda rng: made(platform(), [observations("distance", 5, 1e-3, options={"ends": sockets[::-1]})], rng, 5, free=all_six("socket", "ball")),
    }  # fmt: skip


def lengths(rng):
    m = 5
    obs = observations("lengths", m, 1e-3, each=4, extra={"cable": np.tile(np.arange(4), m)})
    return made(platform(), [obs], rng, m)


def stretched(rng):
    """Cables of which each stretches under a tension of its own."""
    m = 5
    extra = {"cable": np.tile(np.arange(4), m), "tension": np.linspace(20.0, 400.0, 4 * m)}
    obs = observations("lengths", m, 1e-3, each=4, extra=extra)
    return made(platform().having(elasticity=np.linspace(1e-4, 4e-4, 4)), [obs], rng, m)


def set_anew(rng):
    """Two power-ups: the second counts from zeros of its own."""
    m, machine = 6, platform()
    extra = {"cable": np.tile(np.arange(4), m)}
    obs = observations("lengths", m, 1e-3, each=4, extra=extra, group="morning")
    other = observations(
        "lengths", m, 1e-3, each=4, extra=extra, group="evening", options={"zeros": "evening", "cables": machine.cables}
    )
    return made(machine, [obs, other], rng, m)


def drums(each):
    def made_of(rng):
        """Drums that wind up more or less than they show."""
        m, machine = 5, platform()
        options = {"gain": "drums", "each": each, "values": {"gain": 1.02}, "free": ("gain",), "cables": machine.cables}
        obs = observations("lengths", m, 1e-3, each=4, extra={"cable": np.tile(np.arange(4), m)}, options=options)
        return made(
            machine,
            [obs],
            rng,
            m,
            free=list(machine.table.names) + ([f"drums.c{i}.gain" for i in range(1, 5)] if each else ["drums.gain"]),
        )

    return made_of


def weighed(planar):
    def made_of(rng):
        """Cables with load cells: what they read does not quite balance the weight."""
        m = 5
        if planar:
            a = np.array([(-1.0, 0, 0), (1, 0, 0), (1, 0, 1), (-1, 0, 1)])
            b = 0.1 * np.array([(-1.0, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)])
            machine = cable_robot("plane", a, b, degrees="1R2T", plane="xz")
        else:
            machine = cable_robot("eight", rng.normal(size=(8, 3)) * 2, 0.2 * rng.normal(size=(8, 3)))
        d, n = len(machine.axes), len(machine.cables)
        extra = {"axis": np.tile(np.arange(d), m), "tension": np.repeat(rng.uniform(20, 100, (m, n)), d, axis=0)}
        options = {
            "platform": "platform",
            "values": {"mass": 5.0, "cx": 0.02, "cy": -0.01, "cz": 0.03},
            "free": ("mass", "cx", "cy", "cz"),
        }
        obs = observations("load", m, 1.0, each=d, extra=extra, options=options)
        ends = [f"{c}.{s}" for c in machine.cables for s in ("ax", "ay", "az", "bx", "by", "bz")]
        return made(
            machine, [obs], rng, m, free=[*ends, *(f"platform.{s}" for s in ("mass", "cx", "cy", "cz"))], error=0.5
        )

    return made_of


def roped(rng, kind):
    """A cable by itself under loads."""
    m, machine = 7, rope(0.12, 2e-3, 0.8, 50.0, ("cable.weight", "cable.elasticity", "cable.exponent"))
    length = {"span" if kind == "sag" else "length": np.full(m, 5.0)}
    options = {"offset": "gauge"} if kind == "elongation" else {}
    where = Configurations(tuple(map(str, range(m))))
    obs = Observations(
        kind, np.arange(m), rng.normal(scale=0.1, size=(m, 1)), np.full((m, 1), 1e-3), extra={**length, "tension": rng.uniform(5, 90, m)},
        options=options,
    )  # fmt: skip
    names = ["cable.weight"] if kind == "sag" else ["cable.elasticity", "cable.exponent", "gauge.offset"]
    return problem(machine, DataSet(where, (obs,))).with_free(names)


def burdened(rng):
    """An arm whose drives bear links and friction."""
    machine, m = with_loads(arm()), 5
    n = len(machine.joints)
    extra = {"joint": np.tile(np.arange(n), m), "speed": rng.uniform(-1, 1, m * n)}
    obs = observations("joint_torque", m, 0.1, each=n, extra=extra)
    return made(machine, [obs], rng, m, free=load_names(machine), error=1.0)


def winding(rng):
    """Winches beside lengths: what currents tell of tensions balances the weight, and stretches the cables, each with friction."""
    m = 5
    machine = cable_robot(
        "eight", rng.normal(size=(8, 3)) * 2, 0.2 * rng.normal(size=(8, 3)), elasticity=np.linspace(1e-4, 4e-4, 8)
    )
    current, speed = rng.uniform(1, 4, (m, 8)), 0.1 * rng.choice([-1.0, 1.0], (m, 8))
    shared = {"winches": "winches", "ratio": 40.0, "cables": machine.cables}
    known = {"mass": 5.0, "cx": 0.02, "cy": -0.01, "cz": 0.03, "kt": 0.6, "coulomb": 0.1, "viscous": 0.01}
    options = {
        **shared,
        "platform": "platform",
        "values": known,
        "free": ("mass", "cx", "cy", "cz", "kt", "coulomb", "viscous"),
    }
    extra = {
        "axis": np.tile(np.arange(6), m),
        "current": np.repeat(current, 6, axis=0),
        "speed": np.repeat(speed, 6, axis=0),
    }
    rows = observations("winches", m, 1.0, each=6, extra=extra, options=options)
    extra = {
        "cable": np.tile(np.arange(8), m),
        "tension": np.full(8 * m, 50.0),
        "current": current.ravel(),
        "speed": speed.ravel(),
    }
    lengths = observations("lengths", m, 1e-3, each=8, extra=extra, options=shared)
    numbers = ["winches.kt", *(f"winches.{c}.{s}" for c in machine.cables for s in ("coulomb", "viscous"))]
    body = [f"platform.{s}" for s in ("mass", "cx", "cy", "cz")]
    return made(machine, [rows, lengths], rng, m, free=[*machine.table.names, *body, *numbers], error=0.05)


def sharing(rng):
    """Cables that share anchors on the frame and on the platform, not always with the same one."""
    m = 5
    a = np.array([(-2, -1.5, 2.5), (-2, 1.5, 2.5), (-2, 1.5, 2.5), (2, 1.5, 2.5), (2, -1.5, 2.5)])
    b = 0.15 * rng.normal(size=(5, 3))
    b[3] = b[0]
    shared = {"c3.a": "c2.a", "c4.b": "c1.b"}
    each = {f"{k}{s}": f"{v}{s}" for k, v in shared.items() for s in "xyz"}
    machine = cable_robot(
        "sharing", a, b, np.full(5, 0.3), free=("ax", "ay", "az", "bx", "by", "bz", "l0"), shared=each
    )
    obs = observations("lengths", m, 1e-3, each=5, extra={"cable": np.tile(np.arange(5), m)})
    turned = observations(
        "swivel", m, 1e-3, each=5, extra={"cable": np.tile(np.arange(5), m)}, options={"cables": machine.cables}
    )
    return made(machine, [obs, turned], rng, m)


def wheeled(common):
    def made_of(rng):
        """Cables over pulleys that lean, of which one has none, stretched by tensions and hanging; or all over one kind of pulley."""
        m, machine = 5, platform()
        axis = np.array([[0.1, 0.2, 1.1], [0.2, -0.1, 0.8], [0.3, 0, 0.9], [0, 0.3, -1.2]])
        extra = {
            "cable": np.tile(np.arange(4), m),
            "tension": np.linspace(20.0, 400.0, 4 * m),
            "hanging": np.linspace(0.9, 1.1, 4 * m),
        }
        if common:
            shared = {
                f"{c}.{s}": f"cables.{s}" for c in machine.cables for s in ("radius", "nx", "ny", "nz", "elasticity")
            }
            wheels = Pulleys(np.full(4, 0.05), np.tile([0.0, 0.0, 1.0], (4, 1)))
            machine = cable_robot(
                "alike", machine.a, machine.b, shared=shared, pulleys=wheels, elasticity=np.full(4, 2e-4)
            )
            assert {p.name for p in machine.table.rows if p.name.startswith("cables.")} == set(shared.values())
        else:
            wheels = Pulleys(np.array([0.03, 0.0, 0.07, 0.05]), axis)
            machine = machine.having(pulleys=wheels, elasticity=np.linspace(1e-4, 4e-4, 4))
        obs = observations("lengths", m, 1e-3, each=4, extra=extra, options={"cables": machine.cables})
        return made(machine, [obs], rng, m)

    return made_of


def kind_of_cable(text, tense=False):
    def made_of(rng):
        """Cables that are sums of segments, anchors on rails with one carriage read, drums that grow; everything free."""
        m, machine = 3, robot_of(text)
        n = len(machine.cables)
        machine = machine.having(elasticity=np.full(n, 2e-4)) if tense else machine
        extra = {"cable": np.tile(np.arange(n), m)}
        if machine.rails is not None:
            extra["carriage"] = np.where(extra["cable"] == 2, np.linspace(0.2, 0.9, n * m), np.nan)
        if tense:
            extra["tension"] = np.linspace(20.0, 400.0, n * m)
        obs = observations("lengths", m, 1e-3, each=n, extra=extra, options={"cables": machine.cables})
        return made(machine, [obs], rng, m)

    return made_of


def swivelling(rng):
    """Pulleys that swivel about axes that lean, one of them along the base's x."""
    m, machine = 5, platform()
    axis = np.array([[0.0, 0, 1], [0.2, -0.1, 1], [1, 0, 0], [0, 0.3, -1]])
    obs = observations(
        "swivel", m, 1e-3, each=4, extra={"cable": np.tile(np.arange(4), m)}, options={"cables": machine.cables}
    )
    return made(machine.having(pulleys=Pulleys(np.full(4, 0.05), axis)), [obs], rng, m)


FISH = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")


def lens(names, numbers=("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")):
    return [f"{n}.{s}" for n in names for s in ("x", "y", "z", "rx", "ry", "rz")] + [f"lens.{s}" for s in numbers]


def mixed(rng):
    """Several instruments and many kinds in one problem."""
    m = 3
    obs = [
        observations("position", m, 1e-3, TRACKER, (BALL,)),
        pixels(m, EYE, (BALL,)),
        observations("pose", m, 1e-3, TRACKER),
        observations("bearing", m, 1e-3, TRACKER, (BALL,)),
        against("range", m),
        against("point", m, place=SOCKET),
        pairs("displacement", m, TRACKER, (BALL,)),
        pairs("distance", m, None, (BALL,)),
    ]
    return made(arm(), obs, rng, m)


def plane(kind, m, frame, targets, each=4):
    """Points of an image of some centimetres, against wires in all directions or against points."""
    obs = observations(
        kind,
        m,
        1e-3,
        frame,
        targets,
        each,
        options={"image": "image", "values": {"su": 1e-3, "sv": 2e-3}, "free": ("su", "sv")},
    )
    rng = np.random.default_rng(8)
    extra = {"image": rng.uniform(50, 400, (len(obs), 2)), "at": rng.normal(scale=0.1, size=(len(obs), 3))}
    if kind == "plane_points":
        extra["across"] = across(rng.normal(size=(len(obs), 3)))
    return replace(obs, extra=extra)


def planes(kind):
    """A probe in hand, beside the robot, and on a platform."""
    sizes = ["image.su", "image.sv"]
    return {
        f"{kind}/arm, probe in hand": lambda rng: made(arm(), [plane(kind, 3, HAND, TAGS)], rng, 3),
        f"{kind}/arm, phantom in hand": lambda rng: made(arm(), [plane(kind, 3, EYE, (BALL,))], rng, 3),
        f"{kind}/free poses": lambda rng: made(platform(), [plane(kind, 3, HAND, TAGS)], rng, 3, free=[*all_six("hand", "tag0"), *sizes]),
    }  # fmt: skip


def swept(unit, by_direction):
    """A motor that is led to and fro, with all of its numbers free."""

    def sweep(rng):
        way = np.sort(rng.uniform(0, 7, 40))
        log = sweep_of("sweep", unit, np.arange(80.0), np.concatenate([way, way[::-1]]), rng.standard_normal(80))
        motor = motor_of("motor", (3, 8), unit, 1.0, by_direction=by_direction, eccentric=True)
        values = dict(zip(motor.table.names, rng.uniform(0.5, 1.0, len(motor.table)).tolist(), strict=True))
        free = motor.with_values(values).with_table(motor.table.with_values(values).with_free(motor.table.names))
        return problem(free, drive_data([log], [log.used], NUMBERS))

    return sweep


SCENARIOS = {
    "current/motor, one lag": swept("A", False),
    "torque/motor, phases per direction": swept("N m", True),
    **carriers_of("position", 1e-3),
    **carriers_of("pose", 1e-3),
    **carriers_of("bearing", 1e-3),
    **carriers_of("spherical", 1e-3),
    **carriers_of("inclination", 1e-3),
    **{k: v for kind in OWN for k, v in places_of(kind).items()},
    **differences(),
    **{k: v for kind in ("plane_points", "plane_targets") for k, v in planes(kind).items()},
    "distance/two frames": distance,
    "lengths/free poses, pulleys of each": wheeled(False),
    "lengths/free poses, pulleys of all alike": wheeled(True),
    "swivel/free poses": swivelling,
    "lengths/free poses, shared anchors": sharing,
    "load/free poses": weighed(False),
    "winches/free poses, beside lengths": winding,
    "sag/a rope": lambda rng: roped(rng, "sag"),
    "elongation/a rope, a gauge with an offset": lambda rng: roped(rng, "elongation"),
    "joint_torque/arm": burdened,
    "load/free poses, in a plane": weighed(True),
    "lengths/free poses, zeros of their own": set_anew,
    "lengths/free poses, a gain of all drums": drums(False),
    "lengths/free poses, a gain of each drum": drums(True),
    "lengths/free poses": lengths,
    "lengths/free poses, sums of segments": kind_of_cable(MOVING),
    "lengths/free poses, sums of segments that stretch": kind_of_cable(PLANAR, tense=True),
    "lengths/free poses, an anchor on a rail": kind_of_cable(RAILS),
    "lengths/free poses, drums that grow": kind_of_cable(DRUMS),
    "lengths/free poses, stretched": stretched,
    "pixels/arm, camera on the base": lambda rng: made(arm(), [pixels(3, EYE, (BALL,))], rng, 3),
    "pixels/arm, several targets": lambda rng: made(
        arm(), [pixels(3, EYE, (BALL, replace(BALL, name="corner")))], rng, 3
    ),
    "pixels/arm, more points than are projected at once": lambda rng: made(
        arm(), [pixels(3, EYE, (BALL,), 131)], rng, 3
    ),
    "pixels/arm, rational lens": lambda rng: made(arm(), [pixels(3, EYE, (BALL,), camera=RATIONAL)], rng, 3),
    "pixels/free poses, fisheye": lambda rng: made(
        platform(), [pixels(3, HAND, TAGS, camera=FISHEYE)], rng, 3, free=lens(["hand", "tag0"], FISH)
    ),
    "pixels/arm, a print of unknown size": lambda rng: made(arm(), [pixels(3, HAND, TAGS, printed="print")], rng, 3),
    "pixels/free poses, prints of unknown size": lambda rng: made(
        platform(), [pixels(3, HAND, TAGS, printed="print")], rng, 3, free=[*lens(["hand", "tag0"]), "print.size"]
    ),
    "pixels/free poses, free markers of unknown size": lambda rng: made(
        platform(),
        [pixels(3, HAND, TAGS, printed="print")],
        rng,
        3,
        free=[*lens(["hand"]), "print.size"],
        local_targets=("tag0", "tag1"),
    ),
    "pixels/fisheye, a print of unknown size": lambda rng: made(
        platform(),
        [pixels(3, HAND, TAGS, camera=FISHEYE, printed="print")],
        rng,
        3,
        free=[*lens(["hand"], FISH), "print.size"],
    ),
    "pixels/arm, camera in hand": lambda rng: made(arm(), [pixels(3, HAND, TAGS)], rng, 3),
    "pixels/arm, markers eliminated": lambda rng: made(
        arm(), [pixels(3, HAND, TAGS)], rng, 3, local_targets=("tag0", "tag1")
    ),
    "pixels/free poses": lambda rng: made(platform(), [pixels(3, HAND, TAGS)], rng, 3, free=lens(["hand", "tag0"])),
    "pixels/free poses, free markers": lambda rng: made(
        platform(), [pixels(3, HAND, TAGS)], rng, 3, free=lens(["hand"]), local_targets=("tag0", "tag1")
    ),
    "pixels/free poses, a marker is known": lambda rng: made(
        platform(), [pixels(3, HAND, TAGS)], rng, 3, free=lens(["hand"]), local_targets=("tag1",)
    ),
    "pixels/free poses, markers on board": lambda rng: made(
        platform(), [pixels(3, EYE, (BALL,))], rng, 3, free=lens(["eye"]), local_targets=("ball",)
    ),
    "mixed": mixed,
}


def build(name) -> Problem:
    return SCENARIOS[name](np.random.default_rng(11))

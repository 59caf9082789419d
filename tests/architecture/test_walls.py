"""The structure: every machine, sensor and estimator that it must carry, through one Problem and one
Levenberg-Marquardt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocal.arms.conventions import chain
from robocal.cables.geometry import cable_robot
from robocal.estimate.kalman import kalman
from robocal.estimate.least_squares import least_squares
from robocal.geometry import se3
from robocal.geometry.path.program import Element, Term
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.parameters import Parameter, ParameterTable

FRAME = ("x", "y", "z", "rx", "ry", "rz")
DEG = np.pi / 180
CAMERA = (1200.0, 1190.0, 640.0, 512.0, -0.05, 0.01, 0.0, 0.0, 0.0)
SQUARE = 0.06 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def arm(tool=(0.02, 0.01, 0.1, 0, 0, 0)):
    rows = [
        {"r": 0.3},
        {"alpha": -90 * DEG, "theta": -90 * DEG},
        {"d": 0.25},
        {"d": 0.16, "theta": 90 * DEG},
        {"alpha": 90 * DEG, "r": 0.072},
    ]
    return chain("small", "khalil-hayati", rows, tool=tool)


FREE = (
    "j2.alpha",
    "j2.theta",
    "j2.d",
    "j3.alpha",
    "j3.theta",
    "j3.d",
    "j4.d",
    "j4.alpha",
    "j4.theta",
    "j5.theta",
    "j3.beta",
)


def perturbed(robot, rng, free=FREE, size=1e-3):
    return robot.with_values({n: robot.table[n].value + rng.normal(0, size) for n in free})


def joints(rng, m, spread=1.0):
    return rng.uniform(-spread, spread, (m, 5))


def configurations(q, **columns):
    return Configurations(tuple(f"p{i}" for i in range(len(q))), q, columns)


def frame(name, value, mount="base", free=True):
    return Frame(name, tuple(value), (free,) * 6, mount)


def positions(m, sigma=2e-5, instrument=None, **more):
    return Observations("position", np.arange(m), np.zeros((m, 3)), np.full((m, 3), sigma), instrument, **more)


def pixels(configuration, camera, target, sigma=0.1):
    k = len(configuration)
    return Observations(
        "pixels",
        np.repeat(configuration, 4),
        np.zeros((4 * k, 2)),
        np.full((4 * k, 2), sigma),
        camera,
        tuple(target) if isinstance(target, list) else (target,),
        np.zeros(4 * k, dtype=np.int64),
        {"point": np.tile(SQUARE, (k, 1))},
        {"camera": "lens", "intrinsics": CAMERA, "free": ()},
    )


def moved(f, rng, size=0.02):
    return replace(f, value=tuple(np.asarray(f.value) + rng.normal(0, size, 6)))


def with_frames(data, frames):
    """The same data seen through other starting frames."""
    by = {f.name: f for f in frames}
    out = []
    for o in data.observations:
        ends = o.options.get("ends")
        options = {**o.options, "ends": tuple(by.get(e.name, e) for e in ends)} if ends else o.options
        own = by.get(o.frame.name, o.frame) if o.frame else None
        out.append(replace(o, frame=own, targets=tuple(by.get(t.name, t) for t in o.targets), options=options))
    return DataSet(data.configurations, tuple(out))


def fit_and_check(robot, truth, data, frames, q_new, rng, extra_free=(), limit=2e-4, loss="none"):
    """Identifies from nominal and wrong frames, then predicts the tool where nothing was measured."""
    start = with_frames(data, [moved(f, rng) for f in frames])
    p = problem(robot, start)
    p = p.with_free([*p.free, *FREE, *extra_free]).with_loss(loss)
    s = least_squares(p)
    assert s.reasons[0].converged, s.reasons
    got = robot.with_values(dict(zip(robot.table.names, s.x[0], strict=False)))
    error = np.linalg.norm(got.pose(q_new)[:, :3, 3] - truth.pose(q_new)[:, :3, 3], axis=1)
    before = np.linalg.norm(robot.pose(q_new)[:, :3, 3] - truth.pose(q_new)[:, :3, 3], axis=1)
    assert error.max() < limit < before.mean(), (error.max(), before.mean())
    return p, s


@pytest.mark.slow
def test_arm_with_positions(rng):
    robot = arm()
    truth = perturbed(robot, rng)
    tracker = frame("tracker", (1, 2, 0.3, 0.1, 0.2, 1.0))
    data = synthesise(truth, DataSet(configurations(joints(rng, 60)), (positions(60, instrument=tracker),)), rng)
    p, s = fit_and_check(robot, truth, data, [tracker], joints(rng, 40), rng)
    assert 0.6 < 2 * s.cost[0] / (180 - p.n) < 1.4


def test_arm_with_tracker_and_camera_each_in_its_own_frame(rng):
    robot = arm()
    truth = perturbed(robot, rng)
    m = 60
    tracker = frame("tracker", (1, 2, 0.3, 0.1, 0.2, 1.0))
    # A camera 1.5 m in front of the robot, looking back at it: T_eye_base.
    looks = se3.from_vector([1.5, 0, 0.4, 0, 0, 0]) @ se3.compose(
        np.array([[0, 0, -1.0], [1, 0, 0], [0, -1, 0]]), [0, 0, 0]
    )
    eye = frame("eye", se3.to_vector(se3.inverse(looks)))
    marker = frame("tag", (0.01, 0, 0.03, 0.1, 0.2, 0.3), mount="tool")
    see = pixels(np.arange(m), eye, marker)
    data = synthesise(truth, DataSet(configurations(joints(rng, m)), (positions(m, instrument=tracker), see)), rng)
    fit_and_check(robot, truth, data, [tracker, eye, marker], joints(rng, 40), rng)


def hand_eye(rng, m=60):
    robot = arm()
    truth = perturbed(robot, rng)
    camera = frame("hand", (0.03, 0.01, 0.02, 0.05, -0.04, 0.8), mount="tool")
    tags = [frame(f"tag{i}", (0.2 + 0.1 * i, 0.1 * (i - 1), -0.4, 0.1, 0.05 * i, 0.02), mount="base") for i in range(3)]
    q = joints(rng, m, 0.35) + np.array([0, 0.2, 0.9, 1.9, 0])  # looking down
    k = 4 * m * 3
    obs = replace(pixels(np.repeat(np.arange(m), 3), camera, list(tags)), target=np.tile(np.repeat(np.arange(3), 4), m))
    assert len(obs) == k
    return robot, truth, camera, tags, synthesise(truth, DataSet(configurations(q), (obs,)), rng), q


def test_camera_on_arm_with_unknown_markers_shared_or_eliminated(rng):
    robot, truth, camera, tags, data, q = hand_eye(rng)
    # A camera alone cannot tell scale from a hand-held map: the tags' size does; base and tool are absorbed by the
    # frames.
    start = with_frames(data, [moved(f, rng, 0.01) for f in [camera, *tags]])
    free = [f"hand.{s}" for s in FRAME] + ["j3.d", "j4.d", "j3.theta", "j4.theta", "j3.alpha", "j4.alpha"]
    shared = problem(robot, start, free=[*free, *(f"tag{i}.{s}" for i in range(3) for s in FRAME)])
    local = problem(robot, start, free=free, local_targets=("tag0", "tag1", "tag2"))
    a, b = least_squares(shared), least_squares(local)
    assert a.reasons[0].converged and b.reasons[0].converged
    np.testing.assert_allclose(a.cost, b.cost, rtol=1e-8)
    np.testing.assert_allclose(a.x[0, : len(robot.table)], b.x[0, : len(robot.table)], atol=1e-7)


def cable_rig(rng, m=40):
    corner = np.array([(x, y, z) for z in (0.0, 3.0) for x in (-2.0, 2.0) for y in (-2.0, 2.0)])
    attach = 0.15 * np.array([(x, y, -z) for z in (-1, 1) for x in (-1.0, 1) for y in (-1.0, 1)])
    attach = attach[[3, 2, 1, 0, 5, 4, 7, 6]]
    robot = cable_robot("eight", corner, attach, np.full(8, 0.5), free=("l0", "ax", "ay", "az"))
    truth = replace(
        robot, table=robot.table.with_values({n: robot.table[n].value + rng.normal(0, 0.01) for n in robot.table.free})
    )
    poses = np.concatenate([rng.uniform((-0.8, -0.8, 1), (0.8, 0.8, 2), (m, 3)), rng.normal(0, 0.15, (m, 3))], axis=1)
    return robot, truth, poses


def test_same_pixels_on_a_cable_platform_with_free_poses_and_lengths(rng):
    m = 40
    robot, truth, poses = cable_rig(rng, m)
    eye = frame("eye", (0, 0, 0.05, np.pi, 0.0, 0.0), mount="tool", free=False)
    floor = [
        frame(f"tag{i}", (-0.5 + 0.5 * i, 0.3 * (-1) ** i, 0, 0, 0, 0.1 * i), mount="base", free=i > 0)
        for i in range(3)
    ]
    see = replace(pixels(np.repeat(np.arange(m), 3), eye, floor), target=np.tile(np.repeat(np.arange(3), 4), m))
    rope = Observations(
        "lengths",
        np.repeat(np.arange(m), 8),
        np.zeros((8 * m, 1)),
        np.full((8 * m, 1), 1e-3),
        extra={"cable": np.tile(np.arange(8), m)},
    )
    where = Configurations(tuple(map(str, range(m))), start=poses)
    data = synthesise(truth, DataSet(where, (see, rope)), rng)
    rough = replace(data, configurations=replace(where, start=poses + rng.normal(0, 0.02, poses.shape)))
    p = problem(robot, rough)
    assert p.blocks == m
    s = least_squares(p)
    assert s.reasons[0].converged
    dof = sum(t.scale.size for t in p.terms) - p.n - 6 * m
    assert 0.8 < 2 * s.cost[0] / dof < 1.2
    # Anchors scatter as far as the information says, local poses eliminated, and the corrected robot measures new
    # lengths better.
    names = robot.table.free
    error = s.x[0, [p.table.index[n] for n in names]] - np.array([truth.table[n].value for n in names])
    lin = p.linearize(s.x)
    dense = np.zeros((len(lin.r), p.n + 6 * m))
    dense[:, : p.n] = lin.j
    dense[np.arange(len(lin.r))[:, None], p.n + 6 * lin.local[:, None] + np.arange(6)] = lin.jl
    covariance = np.linalg.inv(dense.T @ dense)
    mine = [p.free.index(n) for n in names]
    z = error @ np.linalg.solve(covariance[np.ix_(mine, mine)], error)
    assert 0.5 < z / len(names) < 1.8


def test_a_ball_in_two_sockets(rng):
    robot = arm()
    truth = perturbed(robot, rng, size=2e-3)
    sockets = [np.array([0.35, 0.05, 0.2]), np.array([0.35, 0.1, 0.2])]
    frames, seen, where = [], [], []
    for s, at in enumerate(sockets):
        # The frame may only shift: T_socket_base = translation by minus the socket's place.
        f = Frame(f"socket{s}", (*(-at), 0, 0, 0), (True,) * 3 + (False,) * 3)
        q = reach(truth, at, rng, 40)
        frames.append(f)
        where.append(q)
        seen.append(positions(len(q), 5e-5, f))
    n0, n1 = map(len, where)
    seen[1] = replace(seen[1], configuration=np.arange(n0, n0 + n1))
    apart = Observations(
        "distance",
        np.array([0]),
        np.array([[0.05]]),
        np.array([[1e-5]]),
        options={"ends": (frames[0], frames[1])},
        group="bar",
    )
    data = DataSet(configurations(np.vstack(where)), (*seen, apart))
    start = with_frames(
        data, [replace(f, value=tuple(np.asarray(f.value) + [*rng.normal(0, 0.01, 3), 0, 0, 0])) for f in frames]
    )
    p = problem(robot, start)
    p = p.with_free([*p.free, "j3.theta", "j4.theta", "j5.theta", "j3.d", "j4.d"]).with_table(p.table)
    truth_free = robot.with_values({n: truth.table[n].value for n in p.free if n in robot.table})
    assert truth_free is not None
    s = least_squares(p)
    assert s.reasons[0].converged
    p1, p2 = (s.x[0, [p.table.index[f"socket{i}.{a}"] for a in "xyz"]] for i in range(2))
    assert abs(np.linalg.norm(p1 - p2) - 0.05) < 1e-4


def reach(robot, at, rng, m):
    """Joint values that bring the tool point to one place from many sides (Newton with random starts)."""
    q = joints(rng, 4 * m, 1.2) + np.array([0, 0.3, 0.8, 0.5, 0])
    for _ in range(60):
        gap = at - robot.pose(q)[:, :3, 3]
        j = robot.jacobian(q)[:, :3]
        q = q + np.clip(np.linalg.pinv(j) @ gap[..., None], -0.2, 0.2)[..., 0]
    good = np.linalg.norm(at - robot.pose(q)[:, :3, 3], axis=1) < 1e-9
    return q[good][:m]


def test_one_joint_compliance(rng):
    """A coefficient on any column of a configuration: here rad per N m of torque at joint 2."""
    robot = arm()
    at = next(i for i, e in enumerate(robot.elements) if e.terms and e.terms[0].parameter == "j2.theta")
    bent = replace(robot.elements[at], terms=(*robot.elements[at].terms, Term("j2.compliance", "torque")))
    elements = (*robot.elements[:at], bent, *robot.elements[at + 1 :])
    soft = replace(
        robot,
        elements=elements,
        table=robot.table + ParameterTable((Parameter("j2.compliance", 0.0, "rad/Nm", True, expected=1e-4),)),
    )
    truth = soft.with_values({"j2.compliance": 2e-4})
    torque = rng.uniform(-10, 10, 60)
    tracker = frame("tracker", (1, 2, 0.3, 0.1, 0.2, 1.0))
    data = DataSet(configurations(joints(rng, 60), torque=torque), (positions(60, instrument=tracker),))
    p = problem(soft, synthesise(truth, data, rng))
    s = least_squares(p)
    assert abs(s.x[0, p.table.index["j2.compliance"]] - 2e-4) < 4e-6


def test_ekf_over_blocks(rng):
    """Positions without locals, then a platform whose pose enters and leaves with its configuration."""
    robot = arm()
    truth = perturbed(robot, rng)
    data = synthesise(truth, DataSet(configurations(joints(rng, 60)), (positions(60),)), rng)
    p = problem(robot, data, free=FREE)
    lm, ekf = least_squares(p), kalman(p, passes=3)
    sigma = np.sqrt(np.diag(ekf.covariance))
    assert (np.abs(lm.x[0] - ekf.x[0])[p.index] < sigma).all()
    cable, real, poses = cable_rig(rng)
    m = len(poses)
    obs = Observations("pose", np.arange(m), np.zeros((m, 6)), np.full((m, 6), 1e-4))
    rope = Observations("lengths", np.repeat(np.arange(m), 8), np.zeros((8 * m, 1)), np.full((8 * m, 1), 1e-3),
                        extra={"cable": np.tile(np.arange(8), m)})  # fmt: skip
    made = synthesise(real, DataSet(Configurations(tuple(map(str, range(m))), start=poses), (obs, rope)), rng)
    q = problem(cable, made)
    q = q.with_table(q.table.with_priors(dict.fromkeys(q.free, 0.01)))
    a, b = least_squares(q), kalman(q, local_sigma=0.1, passes=3)
    sigma = np.sqrt(np.diag(b.covariance))
    assert (np.abs(a.x[0] - b.x[0])[q.index] < 3 * sigma).all()


def test_huber_with_eliminated_blocks(rng):
    """A gross corner must not move the map, and weights act before a marker is eliminated."""
    robot, truth, camera, tags, data, q = hand_eye(rng)
    value = data.observations[0].value.copy()
    bad = rng.choice(len(value), len(value) // 20, replace=False)
    value[bad] += rng.normal(0, 30, (len(bad), 2))
    dirty = DataSet(data.configurations, (replace(data.observations[0], value=value),))
    free = [f"hand.{s}" for s in FRAME] + ["j3.d", "j4.d", "j3.alpha", "j4.alpha"]
    names = ("tag0", "tag1", "tag2")
    truth_x = np.array([*camera.value])

    def error(d, loss):
        p = problem(truth, d, free=free, local_targets=names).with_loss(loss)
        return np.abs(least_squares(p).x[0, [p.table.index[f"hand.{s}"] for s in FRAME]] - truth_x).max()

    assert error(dirty, "huber") < 0.35 * error(dirty, "none")
    shared = problem(truth, dirty, free=[*free, *(f"tag{i}.{s}" for i in range(3) for s in FRAME)]).with_loss("huber")
    local = problem(truth, dirty, free=free, local_targets=names).with_loss("huber")
    np.testing.assert_allclose(least_squares(shared).cost, least_squares(local).cost, rtol=1e-7)


def test_a_batch_of_1000_is_1000_single_problems(rng):
    robot = arm()
    truth = perturbed(robot, rng)
    m, batch = 30, 1000
    clean = synthesise(truth, DataSet(configurations(joints(rng, m)), (positions(m),)))
    obs = clean.observations[0]
    noisy = replace(obs, value=obs.value + rng.normal(0, 2e-5, (batch, m, 3)))
    p = problem(robot, DataSet(clean.configurations, (noisy,)), free=FREE)
    s = least_squares(p, np.repeat(p.start, batch, axis=0))
    assert all(r.converged for r in s.reasons)
    for b in (0, 17, 999):
        one = DataSet(clean.configurations, (replace(obs, value=noisy.value[b]),))
        single = least_squares(problem(robot, one, free=FREE))
        np.testing.assert_allclose(single.x[0], s.x[b], atol=1e-9)
    spread = s.x[:, p.index].std(axis=0)
    lin = p.linearize(s.x[:1])
    predicted = np.sqrt(np.diag(np.linalg.inv(lin.j.T @ lin.j)))
    assert (np.abs(spread / predicted - 1) < 0.12).all()


@pytest.mark.parametrize("blocks", [False, True])
def test_normal_equals_linearize(rng, blocks):
    robot, truth, camera, tags, data, q = hand_eye(rng, 12)
    names = ("tag0", "tag1", "tag2") if blocks else ()
    free = [f"hand.{s}" for s in FRAME] + ["j3.d", "j2.alpha"]
    p = problem(robot, data, free=free, local_targets=names)
    n, lin = p.normal(p.start), p.linearize(p.start)
    np.testing.assert_allclose(n.cost[0], 0.5 * lin.r @ lin.r, rtol=1e-12)
    np.testing.assert_allclose(n.g[0], lin.j.T @ lin.r, rtol=1e-9)
    full = np.tril(n.a[0]) + np.tril(n.a[0], -1).T
    np.testing.assert_allclose(full, lin.j.T @ lin.j, rtol=1e-9)
    for b in range(p.blocks):
        at = lin.local == b
        np.testing.assert_allclose(n.al[0, b], lin.jl[at].T @ lin.jl[at], rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(n.asl[0, b], lin.j[at].T @ lin.jl[at], rtol=1e-9, atol=1e-6)


def test_element_list_is_open(rng):
    """A new kind of joint error is data, not code: an element more, a column more."""
    robot = arm()
    extra = Element("ry", (Term("j3.wobble", "sin(j3)"),))
    wobbly = replace(
        robot,
        elements=(*robot.elements[:12], extra, *robot.elements[12:]),
        table=robot.table + ParameterTable((Parameter("j3.wobble", 1e-3, "rad"),)),
    )
    q = joints(rng, 5)
    t = wobbly.pose(q, {"sin(j3)": np.sin(q[:, 2])})
    assert np.abs(t - robot.pose(q)).max() > 1e-5

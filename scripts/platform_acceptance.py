"""The simulated platform against what was asked of it: parts `plant` and `mujoco` of control_acceptance.py.

Laws of mechanics, the order of the steps, the reference by Runge and Kutta in steps of 2 us, and MuJoCo in one run. The platform's centre
of mass is not its origin, and its principal axes are not its own, except where the asked numbers are those of the sketch.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot
from robocal.cables.tension import hold
from robocal.files.cable.mjcf import mjcf
from robocal.geometry import se3, so3
from robocal.geometry.gravity import GRAVITY
from robocal.simulation.platform.platform_plant import Motion, PlatformPlant, plant_of

Row = tuple[str, str, bool | None]  # asked, measured, met (None: not measured)
A = 1e-3 * np.array([
    [-1716.1, -2101.8, 844.4], [-1616.5, 2085.4, 892.5], [1483.5, 1977.1, 892.7], [1522.4, -2237.0, 789.0],
    [-2044.9, -1787.4, 2974.1], [-1369.5, 2312.9, 2856.3], [1682.8, 2019.9, 2791.0], [921.9, -2443.1, 2869.0],
])  # fmt: skip
STEPS = (1e-3, 5e-4, 2.5e-4)


def robot(skew: bool = True) -> CableRobot:
    """Eight cables of the thesis' robot."""
    from robocal.cables.geometry import cable_robot

    b = np.array([0.3, 0.1, -0.1]) * np.sign(A - A.mean(axis=0))
    turn = so3.exp([0.3, -0.5, 0.7])
    body = (
        {"com": np.array([0.02, -0.03, 0.05]), "inertia": turn @ np.diag([0.04, 0.15, 0.17]) @ turn.T} if skew else {}
    )
    return cable_robot("eight", A, b, elasticity=1 / 40000, mass=5.0, limits=np.tile([20.0, 400.0], (8, 1)), **body)


def kicked(machine: CableRobot, speed: tuple[float, ...], momentum: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Motion:
    """At home, held by its tensions, with a velocity and an angular momentum."""
    tension = hold(machine, machine.home[None]).tension[0]
    rest = inverse(machine, machine.home[None], tension)[0][0]
    return Motion(machine.home, np.array(speed), np.array(momentum), rest, tension)


def laws(machine: CableRobot, plant: PlatformPlant) -> Iterator[Row]:
    """Statics, free fall, momentum and energy."""
    worst = [0.0, 0.0]
    for shift in ([0, 0, 0, 0, 0, 0], [0.3, -0.2, 0.2, 0.05, 0.1, -0.05]):
        pose = se3.displace(machine.home, shift[:3], shift[3:])
        tension = hold(machine, pose[None]).tension[0]
        start = plant.still(pose, inverse(machine, pose[None], tension)[0][0])
        later = plant.run(start, 5.0)
        worst[0] = max(worst[0], float(np.abs(later.tension - tension).max()))
        worst[1] = max(worst[1], float(np.abs(later.pose - pose).max()))
    yield "static tensions are the solver's to 1e-6 N", f"{worst[0]:.1e} N after 5 s", worst[0] <= 1e-6
    yield "static drift at most 1e-12 m", f"{worst[1]:.1e} m in 5 s", worst[1] <= 1e-12
    slack = plant.run(plant.still(machine.home, kicked(machine, (0, 0, 0)).rest + 0.5), 0.1)
    fell = slack.pose[:3, 3] - machine.home[:3, 3]
    off, force = float(np.abs(fell - 0.5 * np.array(GRAVITY) * 0.1**2).max()), float(np.abs(slack.tension).max())
    yield (
        "slack cables: force exactly zero, free fall exact",
        f"{force:g} N, {off:.1e} m after 0.1 s",
        force == 0 and off <= 1e-15,
    )
    free = plant_of(machine)
    start = Motion(machine.home, np.array([0.1, 0.2, 0.3]), np.array([0.05, -0.02, 0.1]), np.full(8, 1e3), np.zeros(8))
    later = free.run(start, 20.0, load=-free.weight)
    same = bool((later.momentum == start.momentum).all() and (later.velocity == start.velocity).all())
    before, after = (sum(free.energy(m)[::2]) for m in (start, later))
    yield "momentum exact with slack cables", f"the same digits after 20 s: {same}", same
    change = abs(after / before - 1)
    yield (
        "energy with slack cables",
        f"changes by {change:.1e} of it in 20 s (order 2: not the last digit)",
        change < 1e-7,
    )
    start = kicked(machine, (0.2, 0.0, 0.0))
    kick, full = free.energy(start)[0], sum(free.energy(start))
    swings = [abs(sum(free.energy(free.run(start, t))) - full) / kick for t in (10.0, 20.0, 30.0)]
    yield (
        "energy does not drift with taut cables",
        f"off by {max(swings):.1e} of the kick's at 10, 20, 30 s",
        max(swings) < 0.02,
    )


def part_plant() -> Iterator[Row]:
    """Mechanics and accuracy."""
    machine = robot()
    plant = plant_of(machine, damping=30.0)
    yield from laws(machine, plant)
    speed = 1e-3 * np.sin(np.arange(8))
    start = kicked(machine, (0.03, 0.02, -0.02), (1e-3, -2e-3, 1e-3))
    exact = plant.run(start, 0.2, 1e-5, speed=speed, method="runge-kutta").pose
    for method, order in (("verlet", 2), ("runge-kutta", 4)):
        off = [np.abs(plant.run(start, 0.2, h, speed=speed, method=method).pose - exact).max() for h in STEPS]
        found = np.log2(np.array(off[:-1]) / off[1:])
        yield (
            f"order {order} shown ({method})",
            f"{found[0]:.3f}, {found[1]:.3f}",
            bool(np.abs(found - order).max() < 0.15),
        )
    plain = robot(skew=False)
    plant, start = plant_of(plain, damping=30.0), kicked(plain, (0.2, 0.0, 0.0))
    place = plant.run(start, 0.2, 2e-6, method="runge-kutta").pose[:3, 3]
    for step, most in ((1e-3, 5e-6), (1e-4, 5e-8)):
        gap = float(np.linalg.norm(plant.run(start, 0.2, step).pose[:3, 3] - place))
        yield f"beside RK4 at 2 us after 0.2 s at most {most:g} m at {1e3 * step:g} ms", f"{gap:.2e} m", gap <= most


def part_mujoco() -> Iterator[Row]:
    """MuJoCo: the same way, and how fast."""
    rows = (
        "MuJoCo at RK4 and small steps agrees to 1e-8 m", "plant at least 8 times MuJoCo's Euler at 1 ms",
        "plant at least 12 times MuJoCo's implicitfast at 1 ms", "plant with drives 1500 times real time",
    )  # fmt: skip
    try:
        import mujoco
        from platform_speed import measured
    except ImportError:
        yield from ((row, "MuJoCo is not installed: pip install 'robocal[oracles]'", None) for row in rows)
        return
    machine = robot()
    model = mujoco.MjModel.from_xml_string(mjcf(machine).replace('"implicitfast"', '"RK4"'))
    model.opt.timestep = 1e-5
    plant, start, data = (
        plant_of(machine, damping=-model.actuator_biasprm[:, 2]),
        kicked(machine, (0.2, 0, 0)),
        mujoco.MjData(model),
    )
    data.qpos[:], data.qvel[:3], data.ctrl[:] = [*machine.home[:3, 3], 1, 0, 0, 0], start.velocity, 1 / start.rest
    mujoco.mj_step(model, data, 20000)
    gap = float(np.abs(data.qpos[:3] - plant.run(start, 0.2, 1e-5, method="runge-kutta").pose[:3, 3]).max())
    yield rows[0], f"{gap:.1e} m after 0.2 s in steps of 10 us (MuJoCo {mujoco.__version__})", gap <= 1e-8
    times = measured()
    for row, name, least in zip(rows[1:3], ("MuJoCo Euler", "MuJoCo implicitfast"), (8, 12), strict=True):
        ratio = times["plant"] / times[name]
        yield row, f"{ratio:.1f} ({times['plant']:.0f} and {times[name]:.0f} times real time)", ratio >= least
    drives = times["plant with winches"]
    yield rows[3], f"{drives:.0f}", drives >= 1500

"""How fast a simulated platform moves beside MuJoCo, in one run: python scripts/platform_speed.py

Prints for each what was asked and what is measured: times of real time in steps of 1 ms, and the ratio to MuJoCo's integrators. CPU time,
medians of five rounds in turns. Needs MuJoCo (pip install 'robocal[oracles]').
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import mujoco
import numpy as np

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.tension import hold
from robocal.drives.cogging import Cogging
from robocal.files.cable.mjcf import mjcf
from robocal.simulation.platform.platform_plant import Motion, plant_of
from robocal.simulation.platform.winch_plant import Driven, Winches, WinchPlant

SECONDS, ROUNDS = 20.0, 5


def robot() -> CableRobot:
    """Eight cables of the thesis' robot."""
    a = 1e-3 * np.array([
        [-1716.1, -2101.8, 844.4], [-1616.5, 2085.4, 892.5], [1483.5, 1977.1, 892.7], [1522.4, -2237.0, 789.0],
        [-2044.9, -1787.4, 2974.1], [-1369.5, 2312.9, 2856.3], [1682.8, 2019.9, 2791.0], [921.9, -2443.1, 2869.0],
    ])  # fmt: skip
    b = np.array([0.3, 0.1, -0.1]) * np.sign(a - a.mean(axis=0))
    return cable_robot("eight", a, b, elasticity=1 / 40000, mass=5.0, limits=np.tile([20.0, 400.0], (8, 1)))


def measured() -> dict[str, float]:
    """Times of real time, by what moves."""
    machine = robot()
    tension = hold(machine, machine.home[None]).tension[0]
    rest = inverse(machine, machine.home[None], tension)[0][0]
    model = mujoco.MjModel.from_xml_string(mjcf(machine))
    plant = plant_of(machine, damping=30.0)
    kick, zero = np.array([0.2, 0.0, 0.0]), np.zeros(3)
    start = Motion(machine.home, kick, zero, rest, tension)
    curve = Cogging((4, 18, 72), (0.02, 0.03, 0.1), (0.01, 0.02, 0.05))
    winches = Winches(0.04, 3e-4, gear=4.0, growth=1e-4, coulomb=0.05, viscous=1e-3, cogging=(curve,), counts=4096)
    driven = WinchPlant(plant, winches, rest)
    moving, torque = Driven(start, np.zeros((8, 4))), 0.01 * tension

    def peer(integrator: int) -> Callable[[], object]:
        def go() -> None:
            model.opt.integrator, model.opt.timestep = integrator, 1e-3
            data = mujoco.MjData(model)
            mujoco.mj_resetDataKeyframe(model, data, 0)
            data.qvel[0] = 0.2
            mujoco.mj_step(model, data, int(SECONDS * 1e3))

        return go

    jobs: dict[str, Callable[[], object]] = {
        "plant": lambda: plant.run(start, SECONDS),
        "plant with winches": lambda: driven.run(moving, torque, SECONDS),
        "MuJoCo Euler": peer(mujoco.mjtIntegrator.mjINT_EULER),
        "MuJoCo implicitfast": peer(mujoco.mjtIntegrator.mjINT_IMPLICITFAST),
    }
    for job in jobs.values():
        job()
    taken: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(ROUNDS):
        for name, job in jobs.items():
            begin = time.process_time()
            job()
            taken[name].append(time.process_time() - begin)
    return {name: SECONDS / statistics.median(t) for name, t in taken.items()}


def main() -> None:
    """Times both and prints the table."""
    times = measured()
    print(f"MuJoCo {mujoco.__version__}; steps of 1 ms, times of real time (CPU, medians of {ROUNDS} rounds)")
    for name, value in times.items():
        print(f"  {name:22s} {value:8.0f}")
    for name, other, asked in (("plant", "MuJoCo Euler", 8), ("plant", "MuJoCo implicitfast", 12)):
        print(f"  {name} over {other}: {times[name] / times[other]:.1f}; asked: {asked}")
    print(f"  plant with winches: {times['plant with winches']:.0f} times real time; asked: 1500")


if __name__ == "__main__":
    main()

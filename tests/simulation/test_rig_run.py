"""A platform under its controller: it arrives where it believes to be, and stops where it must."""

from __future__ import annotations

import numpy as np
from simulation.test_platform import robot

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot
from robocal.cables.prepared import Drums, Prepared
from robocal.cables.tension import hold
from robocal.control.platform.platform_controller import PlatformController, PlatformState, platform_controller
from robocal.geometry import se3
from robocal.simulation.platform.platform_plant import plant_of
from robocal.simulation.platform.rig_run import Wiring, follow
from robocal.simulation.platform.winch_plant import Driven, Winches, WinchPlant

DRUMS = Drums.of(0.04, 4.0)


def rig(machine: CableRobot, **more: object) -> tuple[WinchPlant, Driven]:
    """A plant at rest at its home, held by the middle of its limits."""
    tension = hold(machine, machine.home[None], "mid").tension[0]
    rest = inverse(machine, machine.home[None], tension)[0][0] + machine.zeros
    winches = Winches(**({"radius": 0.04, "inertia": 3e-4, "gear": 4.0, "coulomb": 0.02, "viscous": 1e-3} | more))
    plant = WinchPlant(plant_of(machine, damping=30.0), winches, rest)
    return plant, plant.still(machine.home)


def commander(
    machine: CableRobot, driven: Driven, wiring: Wiring, **more: object
) -> tuple[PlatformController, PlatformState]:
    made = platform_controller(Prepared(machine, method="mid"), DRUMS, torque_limit=3.0, **more)
    return made.power_up(machine.home, wiring.readings(driven))


def few() -> CableRobot:
    """A heavier one with narrow limits."""
    return robot(mass=10.0, limits=np.tile([20.0, 200.0], (8, 1)))


def test_it_arrives():
    machine = few()
    plant, driven = rig(machine)
    wiring = Wiring(zero=np.linspace(-3, 3, 8), counts=16384)
    controller, state = commander(machine, driven, wiring)
    goal = se3.displace(machine.home, [0.3, -0.2, 0.2], [0.02, 0.04, -0.03])
    run = follow(controller, state, plant, driven, goal, 10.0, wiring=wiring, settle=0.2)
    assert not run.state.stop and run.state.arrived and run.seconds < 4.0
    assert np.abs(run.state.pose - goal)[:3, 3].max() < 5e-4
    assert np.abs(run.driven.motion.pose - goal)[:3, 3].max() < 3e-3  # stretch and friction, which encoders do not see
    assert run.log.tension.min() > 15 and run.log.tension.max() < 210

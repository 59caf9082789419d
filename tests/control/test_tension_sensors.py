"""Sensors of tension in the loop: what only strains the platform goes to what they should show, and they stop it."""

from __future__ import annotations

import numpy as np
import pytest
from simulation.test_platform import A
from simulation.test_rig_run import away, commander, few, rig, robot

from robocal._jit import as_kernel_array
from robocal.cables.single._kernels import slopes
from robocal.control.platform.platform_controller import PlatformController, PlatformState, SafeLimits
from robocal.simulation.platform.rig_run import Followed, Wiring, follow


def strain(run: Followed) -> np.ndarray:
    """What of (plan less true tensions) moves nothing, as the controller sees it, N."""
    full, slope = np.empty(8), np.empty((8, 6))
    slopes(as_kernel_array(run.state.pose), run.state.now, full, slope)
    off = run.state.tension - run.driven.motion.tension
    return off - slope @ np.linalg.lstsq(slope, off, rcond=None)[0]


def standing(sensor: object, **more: object) -> Followed:
    """Wrong anchors and much friction, at the end of a motion."""
    machine = few()
    true = robot(0.03 * np.random.default_rng(5).standard_normal(A.shape), mass=10.0, limits=machine.limits)
    plant, driven = rig(true, at=machine.home, coulomb=0.1)
    wiring = Wiring(zero=1.0, counts=16384, sensor=sensor)
    controller, state = commander(machine, driven, wiring, **more)
    run = follow(controller, state, plant, driven, away(machine), 5.0, wiring=wiring)
    assert run.state.arrived and not run.state.stop
    return run


def test_what_only_strains_the_platform_goes_to_what_sensors_should_show():
    none, half, every = (standing(s) for s in (False, [True] * 4 + [False] * 4, True))
    watched = standing(True, tension_time=np.inf)
    off = [float(np.linalg.norm(strain(run))) for run in (none, watched, half, every)]
    print(f"strain beside the plan {off} N: none, watched, half of the cables, all")
    assert off[0] > 3 and off[1] == off[0]
    assert off[3] < 0.3 * off[0] and off[3] < off[2] < off[0]
    assert np.abs(none.state.trim).max() == 0 < np.abs(every.state.trim).max()


@pytest.mark.parametrize("sensor", [False, True])
def test_sensors_see_stretch_that_friction_hides(sensor):
    machine = few()
    plant, driven = rig(machine, coulomb=0.1)
    wiring = Wiring(sensor=sensor)
    controller, state = commander(machine, driven, wiring)
    controller, state = controller.power_up(machine.home, wiring.readings(driven), wiring.sensed(driven))
    run = follow(controller, state, plant, driven, away(machine, 1.5), 6.0, wiring=wiring)
    apart = run.driven.motion.pose[:3, 3] - run.state.pose[:3, 3] - run.state.unseen[:3]
    assert bool(np.linalg.norm(apart) < 5e-5) is sensor


def still(**more: object) -> tuple[PlatformController, PlatformState]:
    """A controller at its goal."""
    machine = few()
    plant, driven = rig(machine)
    return commander(machine, driven, Wiring(), **more)


@pytest.mark.parametrize(
    ("reading", "word"),
    [
        (9.0, "cable-slack"),
        (11.0, ""),
        (209.0, ""),
        (212.0, "cable-overloaded"),
        (np.inf, "cable-overloaded"),
        (np.nan, "sensor-is-silent"),
    ],
)
def test_half_the_least_tension_beyond_its_limits_stops_it(reading, word):
    """Limits are 20 to 200 N. A reading is borne for `patience`, and a cable that never had a sensor is no matter."""
    controller, state = still(safe=SafeLimits(patience=0.02))
    shown = state.tension
    shown[5] = np.nan
    stops = []
    for n in range(30):
        if n == 5:
            shown[2] = reading
        state, command = controller.step(state, few().home, np.zeros(8), shown)
        stops.append(state.stop)
    assert stops[:24] == [""] * 24 and stops[-1] == word and not command.brake
    assert state.cable == (2 if word else None)


def test_limits_of_sensors_may_be_said():
    controller, _ = still(safe=SafeLimits(least=3.0, most=500.0))
    assert (controller.bounds[3:] == [[3.0], [500.0]]).all()
    assert (still()[0].bounds[3:] == [[10.0], [210.0]]).all()

"""What no robot, no motor and no moment has is refused by name, or stops a running controller; robots of other kinds go, or are refused."""

from __future__ import annotations

import numpy as np
import pytest
from simulation.test_platform import A, B, robot

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, cable_robot, straight
from robocal.cables.prepared import Drums, Prepared
from robocal.cables.pulley import Pulleys
from robocal.control.pid import ControlLaw
from robocal.control.platform.platform_controller import (
    MotionLimits,
    PlatformController,
    PlatformState,
    SafeLimits,
    platform_controller,
)
from robocal.errors import ModelError
from robocal.geometry import se3, so3
from robocal.simulation.platform.platform_plant import plant_of
from robocal.simulation.platform.rig_run import Wiring, follow
from robocal.simulation.platform.winch_plant import Winches, WinchPlant

DRUMS = Drums.of(0.04, 4.0)
HOME = robot().home
NAN = float("nan")


def ready(machine: CableRobot | None = None, **more: object) -> tuple[PlatformController, PlatformState]:
    own = robot() if machine is None else machine
    made = platform_controller(Prepared(own, method="mid"), DRUMS, **more)
    return made.power_up(own.home, np.zeros(len(own.cables)))


def planar(degrees: str, x: float = 0.2) -> CableRobot:
    """Four cables in a plane that stands upright."""
    a = np.array([[-2.0, 0, 0.2], [2.0, 0, 0.2], [-2.0, 0, 3.0], [2.0, 0, 3.0]])
    b = np.array([[-x, 0, 0.1], [x, 0, 0.1], [-x, 0, -0.1], [x, 0, -0.1]])
    limits = np.tile([10.0, 500.0], (4, 1))
    return cable_robot("plane", a, b, elasticity=2e-5, mass=4.0, limits=limits, degrees=degrees, plane="xz")


def few_cables(count: int) -> CableRobot:
    limits = np.tile([0.0, 1e4], (count, 1))
    return cable_robot("few", A[:count], B[:count], mass=4.0, limits=limits)


MADE = {
    "torque_limit": [{"torque_limit": 0.0}, {"torque_limit": -1.0}, {"torque_limit": NAN}, {"torque_limit": [3.0, 3.0]}],
    "limits": [{"torque_limit": 3.0}],
    "growth": [{"growth": NAN}, {"growth": np.zeros(7)}],
    "kp": [{"loop": ControlLaw(0.0)}],
    "tables": [{"tables": 0.0}, {"tables": np.zeros((2, 7, 5))}, {"tables": np.full((2, 8, 5), NAN)}, {"tables": np.ones((2, 8, 1))},
               {"tables": np.tile(np.linspace(0, 1, 9), (2, 8, 1))}, {"tables": "none"}],
    "speed_filter": [{"speed_filter": -1e-3}, {"speed_filter": NAN}],
    "tension_time": [{"tension_time": 0.0}, {"tension_time": NAN}],
}  # fmt: skip


@pytest.mark.parametrize(("key", "more"), [(key, more) for key, cases in MADE.items() for more in cases])
def test_no_controller_has_such_numbers(key, more):
    with pytest.raises(ModelError) as failure:
        ready(**more)
    assert failure.value.key == key


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: MotionLimits(speed=0.0), "speed"),
        (lambda: MotionLimits(speed=NAN), "speed"),
        (lambda: MotionLimits(acceleration=np.inf), "acceleration"),
        (lambda: MotionLimits(gain=-1.0), "gain"),
        (lambda: MotionLimits(turn_stop=-1e-3), "turn_stop"),
        (lambda: MotionLimits(go=NAN), "go"),
        (lambda: SafeLimits(residual=0.0), "residual"),
        (lambda: SafeLimits(follow=NAN), "follow"),
        (lambda: SafeLimits(least=-1.0), "least"),
        (lambda: SafeLimits(least=5.0, most=3.0), "least"),
        (lambda: SafeLimits(most=NAN), "most"),
        (lambda: ControlLaw(-0.05), "kp"),
        (lambda: ControlLaw(0.05, limit=0.0), "limit"),
        (lambda: ControlLaw(0.05, period=np.inf), "period"),
        (lambda: ControlLaw(0.05, period=NAN), "period"),
    ],
)
def test_no_motion_has_such_limits(make, key):
    with pytest.raises(ModelError) as failure:
        make()
    assert failure.value.key == key


def test_drums_of_other_cables():
    with pytest.raises(ModelError, match="a number of every cable") as failure:
        platform_controller(Prepared(robot()), Drums.of(np.full(7, 0.04)))
    assert failure.value.key == "radius"


def test_stretch_that_nobody_knows_is_neither_corrected_nor_reported():
    bare = cable_robot("bare", A, B, mass=5.0, limits=np.tile([20.0, 400.0], (8, 1)))
    with pytest.raises(ModelError) as failure:
        ready(bare, correct_stretch=True)
    assert failure.value.key == "elasticity"
    _, state = ready(bare)
    assert np.isnan(state.stretch).all() and np.isnan(state.unseen).all()
    made, _ = ready(correct_stretch=True)
    with pytest.raises(ModelError) as failure:
        made.change(Prepared(bare, method="mid"))
    assert failure.value.key == "elasticity"


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"pose": np.full((4, 4), NAN)}, "pose"),
        ({"pose": np.zeros((4, 4))}, "pose"),
        ({"pose": np.eye(3)}, "pose"),
        ({"angles": np.full(8, NAN)}, "angles"),
        ({"angles": np.zeros(7)}, "angles"),
        ({"angles": ["one"] * 8}, "angles"),
        ({"tension": np.zeros(3)}, "tension"),
        ({"pose": se3.displace(HOME, [9.0, 0, 0], np.zeros(3))}, "pose"),
    ],
)
def test_no_power_comes_on_so(change, key):
    made, _ = ready()
    with pytest.raises(ModelError) as failure:
        made.power_up(**({"pose": HOME, "angles": np.zeros(8)} | change))
    assert failure.value.key == key


def test_a_controller_keeps_to_its_robot():
    made, state = ready()
    other, theirs = ready(planar("1R2T"))
    for call, key in (
        (lambda: made.step(theirs, HOME, np.zeros(8)), "state"),
        (lambda: made.step(state, np.eye(3), np.zeros(8)), "goal"),
        (lambda: made.step(state, HOME, np.zeros(8), np.zeros(1)), "tension"),
        (lambda: made.change(Prepared(planar("1R2T"))), "cables"),
        (lambda: other.change(Prepared(planar("2T", 0.0))), "degrees"),
        (lambda: made.with_zeros(np.zeros(7)), "zeros"),
        (lambda: made.change(Prepared(robot()), np.full(8, NAN)), "zeros"),
    ):
        with pytest.raises(ModelError) as failure:
            call()
        assert failure.value.key == key


@pytest.mark.parametrize("bad", [NAN, np.inf, 1e300])
def test_an_encoder_that_says_nothing_closes_the_brakes(bad):
    """Where it was last is still known, and it stays stopped when the encoder speaks again."""
    made, state = ready()
    shown = np.zeros(8)
    shown[3] = bad
    stopped, command = made.step(state, HOME, shown)
    assert stopped.stop in ("no-pose", "lengths-disagree") and command.brake and (command.torque == 0).all()
    assert np.isfinite(stopped.pose).all() and not stopped.arrived
    later, command = made.step(stopped, HOME, np.zeros(8))
    assert later.stop == stopped.stop and command.brake
    if not np.isfinite(bad):
        assert np.array_equal(stopped.pose, state.pose) and np.isfinite(stopped.unseen).all()


@pytest.mark.parametrize("goal", [np.full((4, 4), NAN), np.zeros((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0])])
def test_a_goal_that_is_no_pose_stops_it(goal):
    made, state = ready()
    state, command = made.step(state, goal, np.zeros(8))
    assert state.stop == "no-such-goal" and not command.brake and np.isfinite(command.torque).all()


@pytest.mark.parametrize("degrees", ["1R2T", "2T"])
def test_a_planar_robot_goes_in_its_plane_and_nowhere_else(degrees):
    machine = planar(degrees) if degrees == "1R2T" else planar(degrees, 0.0)
    made, state = ready(machine)
    for shift, turn, word in (
        ([0.1, 0, 0.1], [0, 0, 0], ""),
        ([0, 0.1, 0], [0, 0, 0], "no-such-goal"),
        ([0, 0, 0], [0.1, 0, 0], "no-such-goal"),
        ([0, 0, 0], [0, 0.1, 0], "" if degrees == "1R2T" else "no-such-goal"),
    ):
        new, _ = made.step(state, se3.displace(machine.home, shift, turn), np.zeros(4))
        assert new.stop == word and not new.arrived
        assert (np.abs(new.twist[[1, 3, 5]]) == 0).all()


@pytest.mark.parametrize(("count", "word"), [(1, "fewer cables"), (5, "fewer cables"), (6, "no tensions")])
def test_robots_of_few_cables(count, word):
    """Six cables of which two pull down hold nothing."""
    with pytest.raises(ModelError, match=word):
        ready(few_cables(count))


def test_as_many_cables_as_freedoms_hang():
    """Sensors have nothing to set where no tension only strains the platform."""
    around = np.arange(6) * np.pi / 3
    a = np.column_stack([2 * np.cos(around), 2 * np.sin(around), np.full(6, 3.0)])
    b = 0.3 * np.column_stack([np.cos(around), np.sin(around), np.zeros(6)])[[1, 0, 3, 2, 5, 4]]
    machine = cable_robot("hung", a, b, mass=4.0, limits=np.tile([0.0, 1e3], (6, 1)))
    at = se3.compose(np.eye(3), [0.0, 0.0, 1.5])
    made = platform_controller(Prepared(machine, method="mid"), DRUMS)
    made, state = made.power_up(at, np.zeros(6))
    new, command = made.step(state, at, np.zeros(6), np.full(6, 5.0))
    assert new.arrived and (command.torque > 0).all() and np.abs(new.trim).max() < 1e-12


def test_cables_that_sag_are_refused():
    with pytest.raises(ModelError, match="straight") as failure:
        ready(robot(density=np.full(8, 0.1)))
    assert failure.value.key == "density"


def reads_as_it_moves(machine: CableRobot, gain: float) -> float:
    """How far the pose that a controller finds is from the one whose lengths its motors show, m and rad."""
    made, state = ready(machine)
    goal = se3.displace(machine.home, [0.03, -0.02, 0.02], [0.01, 0.02, -0.01])
    first, then = (straight(machine, p[None])[0][0] for p in (machine.home, goal))
    for part in np.linspace(0.1, 1.0, 10):
        state, _ = made.step(state, machine.home, part * (then - first) / (gain * 0.01))
    for _ in range(3):
        state, _ = made.step(state, machine.home, (then - first) / (gain * 0.01))
    return float(np.abs(state.pose - goal).max())


def test_gains_of_drums_are_the_robots():
    machine = cable_robot("grown", A, B, mass=5.0, limits=np.tile([20.0, 400.0], (8, 1)), gain=np.full(8, 1.05))
    assert reads_as_it_moves(machine, 1.05) < 1e-9
    made, state = ready(machine)
    _, command = made.step(state, machine.home, np.zeros(8))
    assert np.abs(command.torque - 1.05 * 0.01 * state.tension).max() < 1e-9
    plain, _ = ready()
    assert np.allclose(plain.change(Prepared(machine, method="mid")).winches[:, [0, 3]], [0.042, 0.0105])


def test_pulleys_are_in_the_controller_and_refused_by_the_plant():
    axes = np.tile([0.0, 0.0, 1.0], (8, 1))
    machine = cable_robot("wheels", A, B, mass=5.0, limits=np.tile([20.0, 400.0], (8, 1)), elasticity=1e-5,
                          pulleys=Pulleys(np.full(8, 0.03), axes))  # fmt: skip
    assert reads_as_it_moves(machine, 1.0) < 1e-9
    with pytest.raises(ModelError) as failure:
        plant_of(machine)
    assert failure.value.key == "pulleys"


def world() -> tuple[WinchPlant, object, PlatformController, PlatformState]:
    machine = robot()
    made, state = ready(machine)
    plant = WinchPlant(
        plant_of(machine, damping=30.0),
        Winches(0.04, 3e-4, gear=4.0),
        inverse(machine, HOME[None], state.tension[None])[0][0],
    )
    return plant, plant.still(HOME), made, state


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda p, d, c, s: follow(c, s, p, d, np.eye(3), 0.01), "goal"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, every=0), "every"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, settle=NAN), "settle"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, NAN), "seconds, step"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, load=NAN), "load"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, load=np.zeros(3)), "load"),
        (lambda p, d, c, s: follow(*ready(planar("1R2T")), p, d, HOME, 0.01), "cables"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, wiring=Wiring(sign=2.0)), "sign"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, wiring=Wiring(scale=0.0)), "scale"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, wiring=Wiring(counts=-1)), "counts"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, wiring=Wiring(zero=NAN)), "zero"),
        (lambda p, d, c, s: follow(c, s, p, d, HOME, 0.01, wiring=Wiring(winch=[0] * 8)), "winch"),
        (lambda p, d, c, s: p.still(np.full((4, 4), NAN)), "pose"),
        (lambda p, d, c, s: p.still(np.eye(3)), "pose"),
        (lambda p, d, c, s: p.run(d, np.full(8, NAN), 0.01), "torque"),
        (lambda p, d, c, s: p.run(d, np.zeros(7), 0.01), "torque"),
        (lambda p, d, c, s: p.run(d, 0.0, 0.01, load=np.inf), "load"),
        (lambda p, d, c, s: WinchPlant(p.platform, Winches(0.04, 1e-8, gear=4.0), p.first).run(d, 0.0, 0.01), "step"),
        (lambda p, d, c, s: WinchPlant(p.platform, Winches(0.04, 3e-4, viscous=5.0), p.first).run(d, 0.0, 0.01), "step"),
        (lambda p, d, c, s: plant_of(robot(), damping=1e6).run(d.motion, 0.01), "step"),
        (lambda p, d, c, s: p.platform.run(d.motion, 0.01, speed=NAN), "speed"),
        (lambda p, d, c, s: p.platform.run(d.motion, 30.0, speed=-1.0), "motion"),
        (lambda p, d, c, s: Winches(0.04, 3e-4, gear=np.inf), "gear"),
        (lambda p, d, c, s: Winches(0.04, 3e-4, growth=NAN), "growth"),
        (lambda p, d, c, s: Winches(0.04, 3e-4, limit=NAN), "limit"),
        (lambda p, d, c, s: Winches(0.04, 3e-4, coulomb=-1.0), "coulomb"),
        (lambda p, d, c, s: plant_of(robot(), damping=np.zeros(3)), "damping"),
    ],
)  # fmt: skip
def test_no_plant_moves_so(call, key):
    with pytest.raises(ModelError) as failure:
        call(*world())
    assert failure.value.key == key


@pytest.mark.parametrize("rotation", ["log", "projection"])
@pytest.mark.parametrize("angle", [2.0, np.pi])
def test_turns_of_half_a_turn_have_a_way(rotation, angle):
    """The sine of half a turn is nothing: the projection alone would say that it has arrived."""
    made, state = ready(motion=MotionLimits(rotation=rotation))
    goal = HOME.copy()
    goal[:3, :3] = so3.exp([0.0, 0.0, angle])
    state, _ = made.step(state, goal, np.zeros(8))
    assert not state.arrived and state.left[1] == pytest.approx(angle, abs=1e-6)
    assert abs(state.twist[5]) == pytest.approx(1e-3)

"""A cable robot as MJCF, the model file of MuJoCo: a platform, and a tendon with one actuator for every cable.

    force = EA - EA length / rest - c speed,  at most 0        control = 1 / rest

rest is the unstretched length (m) and EA the reciprocal of the elasticity. As the control is 1 / rest, the stiffness of a cable is
EA / rest wherever the platform is. MuJoCo counts a force positive where it lengthens a tendon: a tension t is the actuator force -t.

Source: MuJoCo's documentation of actuators (gaintype and biastype affine).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from robocal._types import Array
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, straight
from robocal.cables.tension import hold
from robocal.errors import ModelError
from robocal.geometry import so3
from robocal.geometry.gravity import GRAVITY
from robocal.simulation.platform.platform_plant import box_inertia

__all__ = ["mjcf"]

DAMPING = 0.05  # of the critical damping of the platform on one cable
STEPS = 20  # of the fastest vibration
LONGEST_STEP = 1e-3  # s
THIN, POINT = 0.004, 0.012  # m: how wide cables and how large anchors are drawn
AXES = "xyz"


def mjcf(robot: CableRobot) -> str:
    """The robot as the text of an MJCF file, in m, kg, N and s.

    Where its tensions can hold it, the key frame `home` has it at rest. Raises ModelError for what a tendon cannot be: a cable over a
    pulley that swivels, one that sags, one without elasticity; and for a platform without mass.
    """
    for cable in range(len(robot.cables)):
        if robot.pulleys is not None and robot.pulleys.radius[cable] > 0:
            raise ModelError(
                "MuJoCo has no pulley that swivels", key=f"{robot.cables[cable]}.pulley",
                found=f"a radius of {robot.pulleys.radius[cable]:.4g} m", expected="cables without pulleys",
            )  # fmt: skip
    if robot.density is not None and np.any(robot.density > 0):
        raise ModelError(
            "MuJoCo's tendons are straight, and this robot's cables sag", key="density",
            found=f"{robot.density.max():.4g} N/m", expected="a robot file without density, where straight cables will do",
        )  # fmt: skip
    stiff = 1 / robot.need("elasticity")
    if not np.isfinite(stiff).all() or not (stiff > 0).all():
        raise ModelError("a tendon needs a cable that stretches", key="elasticity", found=0, expected="above 0")
    return "\n".join([*_model(robot, stiff), ""])


def _model(robot: CableRobot, stiff: Array) -> Iterator[str]:
    """The lines of the file; `stiff` is the EA of every cable in N."""
    mass = float(robot.need("mass"))
    at_home = robot.home
    length = straight(robot, at_home)[0][0]
    stiffness = stiff / length
    damping = 2 * DAMPING * np.sqrt(stiffness * mass)
    fastest = math.sqrt(float(stiffness.sum()) / mass)
    step = min(LONGEST_STEP, float(f"{2 * math.pi / fastest / STEPS:.0e}"))
    yield f"<mujoco model={quoteattr(robot.name)}>"
    yield "  <!-- m, kg, N, s. A cable's control is 1 / its unstretched length; its tension is minus the force of its actuator."
    yield f"       The damping of the cables is assumed: {100 * DAMPING:g} % of the critical one of the platform on one cable."
    if robot.inertia is None:
        yield "       The inertia is assumed: that of a box of the platform's mass around its anchors."
    terms = ["gain y" if robot.states_gains else "y", *["build-up y^2"] * robot.states_build_up, "zero"]
    yield f"       The unstretched length of a cable whose sensor shows y is {' + '.join(terms)}:"
    drums = [("gain", robot.gain)] * robot.states_gains + [("build-up", robot.build_up)] * robot.states_build_up
    numbers = [("zero", robot.zeros), *drums]
    of_each = (
        ", ".join([cable, *(f"{what} {_text(v[i])}" for what, v in numbers)]) for i, cable in enumerate(robot.cables)
    )
    yield f"       {'; '.join(of_each).replace('--', '- -')} -->"
    yield f'  <option timestep="{step:g}" integrator="implicitfast" gravity="{_text(GRAVITY)}"/>'
    yield "  <worldbody>"
    for cable, point in zip(robot.cables, robot.a, strict=True):
        yield f'    <site name={quoteattr(f"{cable}.frame")} pos="{_text(point)}" size="{POINT}"/>'
    yield '    <body name="platform">'
    yield from _joints(robot)
    yield f"      {_inertial(robot, mass)}"
    low, high = robot.b.min(axis=0), robot.b.max(axis=0)
    size = np.maximum((high - low) / 2, POINT)
    box = f'pos="{_text((low + high) / 2)}" size="{_text(size)}"'
    yield f'      <geom type="box" {box} mass="0" contype="0" conaffinity="0" rgba="0.6 0.7 0.8 0.5"/>'
    for cable, point in zip(robot.cables, robot.b, strict=True):
        yield f'      <site name={quoteattr(f"{cable}.platform")} pos="{_text(point)}" size="{POINT}"/>'
    yield "    </body>"
    yield "  </worldbody>"
    yield "  <tendon>"
    for cable in robot.cables:
        yield f'    <spatial name={quoteattr(cable)} width="{THIN}">'
        yield from (f"      <site site={quoteattr(f'{cable}.{end}')}/>" for end in ("frame", "platform"))
        yield "    </spatial>"
    yield "  </tendon>"
    yield "  <actuator>"
    for cable, ea, c in zip(robot.cables, stiff.tolist(), damping.tolist(), strict=True):
        law = f'gaintype="affine" gainprm="0 {_text(-ea)} 0" biastype="affine" biasprm="{_text(ea)} 0 {_text(-c)}"'
        # a cable that pulls with its EA is twice as long as it was: no real one gets there
        pulls = f'forcelimited="true" forcerange="{_text(-ea)} 0" ctrllimited="false"'
        yield f"    <general name={quoteattr(cable)} tendon={quoteattr(cable)} {law} {pulls}/>"
    yield "  </actuator>"
    yield from _home(robot, at_home)
    yield "</mujoco>"


def _joints(robot: CableRobot) -> Iterator[str]:
    """The motions that the platform has; its coordinates are those of its origin, then of its rotation."""
    if len(robot.axes) == 6:
        yield '      <freejoint name="platform"/>'
        return
    for i in robot.axes:
        kind, axis = ("slide", "hinge")[i // 3], np.eye(3, dtype=int)[i % 3]
        yield f'      <joint name="{kind}_{AXES[i % 3]}" type="{kind}" axis="{_text(axis)}"/>'


def _inertial(robot: CableRobot, mass: float) -> str:
    """The element that says how heavy the platform is."""
    i = box_inertia(robot.b, mass) if robot.inertia is None else np.asarray(robot.inertia, float)
    full = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    return f'<inertial pos="{_text(robot.com)}" mass="{_text(mass)}" fullinertia="{_text(full)}"/>'


def _home(robot: CableRobot, pose: Array) -> Iterator[str]:
    """The key frame at X_0 with the controls that hold it there; nothing where no tensions within limits do."""
    if robot.limits is None:
        return
    found = hold(robot, pose[None])
    if not found.has_solution[0]:
        return
    rest = robot.wound(inverse(robot, pose[None], found.tension)[0])[0] + robot.zeros
    turn = so3.log(pose[:3, :3])
    where = (
        [*pose[:3, 3], 1.0, 0.0, 0.0, 0.0] if len(robot.axes) == 6 else [[*pose[:3, 3], *turn][i] for i in robot.axes]
    )
    yield "  <keyframe>"
    yield f'    <key name="home" qpos="{_text(where)}" ctrl="{_text(1 / rest)}"/>'
    yield "  </keyframe>"


def _text(numbers: float | Sequence[float] | Array) -> str:
    """Numbers with every digit that they have."""
    return " ".join(repr(float(v)) for v in np.atleast_1d(np.asarray(numbers, float)))

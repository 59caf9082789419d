"""What the motors of an arm bear at rest or in slow motion: gravity and friction, linear in numbers of links and joints.

    tau_j = -z_j . sum_(l >= j) (S_l - M_l o_j) x g + c_j sgn(q'_j) + b_j q'_j,    S_l = M_l p_l + R_l (m c)_l

M_l is the mass of link l (kg), (m c)_l its first moment (kg m) in the frame in which its row ends, at (R_l, p_l); z_j and o_j are the
axis of joint j and a point of it, g gravity. A joint that slides bears a force, -z_j . sum M_l g. Only sums of these numbers (base
parameters) show in torques: what the data cannot tell apart is dropped by name, and said. Frames are those of the nominal geometry.
Source: Gautier and Khalil, Direct calculation of minimum set of inertial parameters of serial robots (1990).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.arms.gravity_load import axis_of, drive, link_end
from robocal.parameters import Parameter, ParameterTable

__all__ = ["GRAVITY_SYMBOLS", "LOAD_SYMBOLS", "gravity_columns", "load_names", "with_loads"]

GRAVITY_SYMBOLS = ("mass", "mx", "my", "mz")
LOAD_SYMBOLS = (*GRAVITY_SYMBOLS, "coulomb", "viscous")
# What is expected of an arm that a person could lift with a crane, before anything is measured.
EXPECTED = {"mass": 10.0, "mx": 2.0, "my": 2.0, "mz": 2.0, "coulomb": 10.0, "viscous": 10.0}
UNITS = {"mass": "kg", "mx": "kg m", "my": "kg m", "mz": "kg m"}
FRICTION = {False: ("N m", "N m s/rad"), True: ("N", "N s/m")}  # by whether the joint slides


def load_names(chain: Chain) -> list[str]:
    """The numbers of all joints, in the order of LOAD_SYMBOLS, joint by joint."""
    return [f"{j}.{s}" for j in chain.joint_names for s in LOAD_SYMBOLS]


def with_loads(chain: Chain) -> Chain:
    """The arm with these numbers in its table, zero and free, where it has none."""
    rows = []
    for joint in chain.joints:
        units = {**UNITS, **dict(zip(("coulomb", "viscous"), FRICTION[joint.type == "prismatic"], strict=True))}
        rows += [Parameter(f"{joint.name}.{s}", 0.0, units[s], True, expected=EXPECTED[s]) for s in LOAD_SYMBOLS]
    new = tuple(r for r in rows if r.name not in chain.table)
    return chain.with_table(ParameterTable((*chain.table.rows, *new), chain.table.together))


def gravity_columns(chain: Chain, q: ArrayLike, extra: Mapping[str, ArrayLike] | None = None) -> Array:
    """What mass and first moments of every link do to every joint, (m, joints, links, 4), at joint values q (m, n)."""
    joints = np.atleast_2d(np.asarray(q, float))
    m, n, g = len(joints), len(chain.joints), np.asarray(chain.gravity, float)
    ends = [link_end(chain, name) for name in chain.joint_names]
    at = [drive(chain, name) for name in chain.joint_names]
    frames = {count: _behind(chain, count, joints, extra) for count in {*ends, *(a + 1 for a in at)}}
    out = np.zeros((m, n, n, 4))
    for j, joint in enumerate(chain.joints):
        rows, point = axis_of(chain.elements[at[j]])
        pose = frames[at[j] + 1]
        z, origin = pose[:, :3, :3] @ rows[0], pose[:, :3, :3] @ point + pose[:, :3, 3]
        for link in range(j, n):
            if joint.type == "prismatic":
                out[:, j, link, 0] = -(z @ g)
                continue
            end = frames[ends[link]]
            out[:, j, link, 0] = -np.einsum("mi,mi->m", z, np.cross(end[:, :3, 3] - origin, g))
            for k in range(3):
                out[:, j, link, 1 + k] = -np.einsum("mi,mi->m", z, np.cross(end[:, :3, k], g))
    return out


def _behind(chain: Chain, count: int, q: Array, extra: Mapping[str, ArrayLike] | None) -> Array:
    """T_base (m, 4, 4) behind so many elements."""
    from robocal._record import replace

    return np.asarray(replace(chain, elements=chain.elements[:count]).pose(q, extra))

"""Any arm as a Denavit-Hartenberg table with Hayati's beta: the same predictions, and no length that is not in the arm.

The joint axes at zero are lines in space; a table is a way to walk along them. Between two axes the common normal is
taken, unless they are within NEAR of parallel: there it runs away (axes 1e-5 rad apart meet a hundred kilometres from
the arm for every metre between them), and Hayati's step is taken instead, at d = 0 in the plane across the first axis:

    Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)

Source: Hayati, Robot arm geometric link parameter estimation (1983).
"""

from __future__ import annotations

import math

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.arms.conventions import chain as build
from robocal.errors import ModelError
from robocal.geometry import se3

__all__ = ["axes_at_zero", "to_denavit"]

SYMBOLS = ("theta", "d", "a", "alpha", "beta")
NEAR = 0.3  # rad: a common normal between axes that are less askew would stand over three times their distance away


def axes_at_zero(chain: Chain) -> tuple[Array, Array, Array, Array]:
    """The joint axes with the arm at zero, in base coordinates: unit directions (n, 3), points on them (n, 3; of a
    prismatic joint NaN), what a unit of the joint's value moves (n,), and the tool's pose (4, 4).

    With them T(q) = prod_i exp(gain_i xi_i q_i) T(0). Raises ModelError for a model that bends with its pose, as with
    compliance or eccentric gears, and for a joint that counts with another: no product of screws is that.
    """
    for joint in chain.shares:
        message = "this form cannot hold a joint that counts with another"
        raise ModelError(message, key=f"{joint}.with", expected="--format yaml")
    plain = {"1", *chain.joint_names}
    read = dict.fromkeys(t.parameter for e in chain.elements for t in e.terms if t.column not in plain)
    beyond = [n for n in read if chain.table[n].value != 0.0]
    if beyond:
        message = "this form holds geometry alone, and the model has more"
        raise ModelError(message, found=", ".join(beyond), expected="--format yaml")
    zero = np.zeros((1, len(chain.joints)))
    tool, jac = chain.pose(zero)[0], chain.jacobian(zero)[0]
    turning = np.array([j.type == "revolute" for j in chain.joints])
    columns = np.where(turning, jac[3:], jac[:3]).T
    gain = np.linalg.norm(columns, axis=1)
    axis = columns / gain[:, None]
    # v = axis x (tool - point), so tool + axis x v lies on the axis.
    point = tool[:3, 3] + np.cross(axis, jac[:3].T / gain[:, None])
    return axis, np.where(turning[:, None], point, np.nan), gain, tool


def to_denavit(chain: Chain) -> Chain:
    """The same arm in the convention dh-hayati: base, one row per joint, tool. Raises ModelError as `axes_at_zero`."""
    axis, point, gain, tool = axes_at_zero(chain.without_shares())
    first = point[0] if np.isfinite(point[0]).all() else np.zeros(3)
    first = first - axis[0] * (axis[0] @ first)
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = _beside(axis[0]), first
    base = se3.to_vector(frame)
    rows = []
    for i, joint in enumerate(chain.joints):
        row: dict[str, object] = {"name": joint.name, "type": joint.type, "limits": (joint.lower, joint.upper)}
        if abs(gain[i] - 1.0) > 1e-15:
            row["gain"] = float(gain[i])
        if joint.name in chain.shares:
            row["with"] = chain.shares[joint.name]
        if i + 1 < len(chain.joints):
            step = _step(frame, axis[i + 1], point[i + 1])
            row |= step
            frame = frame @ _matrix(step)
        else:
            # Behind the last axis comes the tool; stated, so that nobody must ask whether a row was forgotten.
            row |= dict.fromkeys(SYMBOLS, 0.0)
        rows.append(row)
    rest = se3.to_vector(np.linalg.inv(frame) @ tool)
    return build(chain.name, "dh-hayati", rows, base=base.tolist(), tool=rest.tolist(), source=chain.source)


def _beside(z: Array) -> Array:
    """A rotation (3, 3) with this z axis, its x axis as near to the base's as can be."""
    x = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
    x = x - z * (z @ x)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _step(frame: Array, axis: Array, point: Array) -> dict[str, float]:
    """theta, d, a, alpha, beta from a frame to one whose z axis is the next joint's."""
    u = frame[:3, :3].T @ axis
    # A prismatic axis has a direction and no place: here.
    p = frame[:3, :3].T @ (point - frame[:3, 3]) if np.isfinite(point).all() else np.zeros(3)
    across = math.hypot(u[0], u[1])
    if across < math.sin(NEAR):
        foot = p - u * (p[2] / u[2])
        a = math.hypot(foot[0], foot[1])
        theta = math.atan2(foot[1], foot[0]) if a > 1e-12 else 0.0
        a = a if a > 1e-12 else 0.0
        v = _rotate_about_z(u, -theta)
        return {"theta": theta, "d": 0.0, "a": a, "alpha": math.atan2(-v[1], v[2]), "beta": math.asin(v[0])}
    # The common normal points along z x u; it leaves the first axis at height d and is as long as a.
    theta = math.atan2(u[0], -u[1])
    v, w = _rotate_about_z(u, -theta), _rotate_about_z(p, -theta)
    # Now u lies in the y-z plane, and the point slides along it until y is zero.
    d = w[2] - v[2] * w[1] / v[1]
    return {"theta": theta, "d": d, "a": float(w[0]), "alpha": math.atan2(-v[1], v[2]), "beta": 0.0}


def _rotate_about_z(v: Array, angle: float) -> Array:
    """A vector turned about z."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]])


def _matrix(step: dict[str, float]) -> Array:
    """Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)."""
    out = np.eye(4)
    theta, d, a, alpha, beta = (step[symbol] for symbol in SYMBOLS)
    for vector in ((0, 0, d, 0, 0, theta), (a, 0, 0, alpha, 0, 0), (0, 0, 0, 0, beta, 0)):
        out = out @ se3.from_vector(np.array(vector, float))
    return np.asarray(out)

"""Compensation: joint values and Cartesian commands that bring a calibrated robot to its targets while the controller
keeps the nominal model.

    q_n = N^-1(T*)          what the controller does with the target: the real robot then stands at C(q_n)
    q_c = C^-1(T*)          the corrected joint values, on the controller's branch, as near q_n as the task leaves free
    T_c = N(q_c)            the corrected Cartesian command: the controller's own inverse kinematics leads it to q_c

N is the nominal model, C the calibrated one. The simulation drives C with what is handed out, so `after` is what is
left if C is the truth. Where an arm cannot meet a whole pose (fewer than six axes) the position comes first and the
orientation next to it, as near as it goes, in the null space of the position (`arms/priority.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array, Bools
from robocal.arms.chain import Chain
from robocal.arms.inverse_kinematics import Reached, inverse_point, inverse_pose
from robocal.arms.priority import by_priority
from robocal.diagnose.limits import LEAP, SINGULAR_BELOW
from robocal.errors import ModelError
from robocal.geometry import so3

__all__ = ["STATUS", "Compensation", "Targets", "compensate", "generic_rank"]

OK, RELAXED, SINGULAR, LIMITS, UNREACHABLE = range(5)
STATUS = ("ok", "orientation relaxed", "near singular", "outside limits", "unreachable")
# What counts as reached: far below what any robot repeats.
REACHED = (1e-7, 1e-6)
RESTARTS = 16


@dataclass(frozen=True)
class Targets:
    """Where the tool shall go: positions (m, 3), rotations (m, 3, 3) or None where the orientation does not matter.

    `joints` (m, n) are the controller's own joint values where they are known: they choose the branch, and without
    positions the target is their nominal pose. `extra` are columns (m,) that a model reads (temperature, payload).
    """

    position: Array | None = None
    rotation: Array | None = None
    joints: Array | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        given = self.position if self.position is not None else self.joints
        return 0 if given is None else len(given)


@dataclass(frozen=True)
class Compensation:
    """One row per target, in order; NaN where there is nothing to command.

    `nominal` (m, n) are the controller's joint values without compensation, `joints` (m, n) the corrected ones,
    `command` (m, 4, 4) the corrected poses for the nominal inverse kinematics, `target` (m, 4, 4) what was asked for.
    `before`, `after` (m,) in m and `before_angle`, `after_angle` (m,) in rad are the simulated errors; of a target
    that is not reached, `after` is what the nearest joint values leave. `status` (m,) indexes STATUS; `limit_excess` (m, n)
    is by how much the joints would leave their limits; `dexterity` (m,) the ratio of singular values.
    """

    target: Array
    oriented: bool
    nominal: Array
    joints: Array
    command: Array
    before: Array
    after: Array
    by_command: Array
    before_angle: Array
    after_angle: Array
    status: NDArray[np.int64]
    limit_excess: Array
    dexterity: Array

    @property
    def reachable(self) -> Bools:
        """The targets that have something to command, (m,)."""
        return np.asarray(self.status < LIMITS)


def generic_rank(chain: Chain, extra: Mapping[str, Array] | None = None) -> int:
    """How many degrees of freedom the tool has at most: the rank of the Jacobian at joint values away from
    singularities (the largest of 32 fixed ones)."""
    rng = np.random.default_rng(1)
    low, high = chain.limits.T
    low = np.where(np.isfinite(low), low, -1.0)
    high = np.where(np.isfinite(high), high, low + 2.0)
    q = rng.uniform(low, high, (32, len(low)))
    some = {k: np.broadcast_to(np.mean(v), 32) for k, v in (extra or {}).items() if len(v)}
    j = chain.jacobian(q, some)
    scale = np.maximum(np.linalg.norm(j[:, :3], axis=1).max(), 1e-9)
    s = np.linalg.svd(np.concatenate([j[:, :3], scale * j[:, 3:]], axis=1), compute_uv=False)
    return int((s > 1e-2 * s[:, :1]).sum(axis=1).max())


def compensate(nominal: Chain, calibrated: Chain, targets: Targets) -> Compensation:
    """Corrected joint values and Cartesian commands for every target, each checked by driving the calibrated model.

    The two chains must have the same joints; limits are the calibrated chain's. Raises ModelError for other joints,
    misshapen targets or a column that a model lacks.
    """
    if nominal.joint_names != calibrated.joint_names:
        raise ModelError(
            "the nominal and the calibrated robot have other joints",
            found=", ".join(calibrated.joint_names),
            expected=", ".join(nominal.joint_names),
        )
    columns = {k: np.asarray(v, float) for k, v in targets.extra.items()}
    target, oriented = _poses(nominal, targets, columns)
    # A whole pose asks for six degrees of freedom; an arm that has fewer gives the position first.
    short = oriented and generic_rank(nominal, columns) < 6
    if targets.position is None:
        q_n, known = np.array(targets.joints, float), np.ones(len(target), dtype=bool)
    else:
        q_n, known = _reach(nominal, target, oriented, short, targets.joints, columns)
    q_c, reached = _reach(calibrated, target, oriented, short, q_n, columns)
    q_c = _same_turn(calibrated, q_c, q_n)
    far = known & (np.abs(q_c - q_n).max(axis=1, initial=0.0) > LEAP)
    if short:
        # A position that is met at a limit by swinging the tool elsewhere is no correction of this target.
        turned, nominally = (_errors(calibrated, q, target, oriented, columns)[1] for q in (q_c, q_n))
        swung = reached & far & (turned > nominally + LEAP)
        reached, q_c = reached & ~swung, np.where(swung[:, None], q_n, q_c)
    beyond = np.zeros_like(q_c)
    status = np.full(len(target), OK)
    lost = np.flatnonzero(~reached)
    if len(lost):
        beyond[lost], free = _without_limits(calibrated, target[lost], oriented, short, q_c[lost], _take(columns, lost))
        status[lost] = np.where(free, LIMITS, UNREACHABLE)
    position, angle = _errors(calibrated, q_c, target, oriented, columns)
    before, before_angle = _errors(calibrated, q_n, target, oriented, columns)
    dexterity = _dexterity(calibrated, q_c, oriented, columns)
    relaxed = reached & (angle > REACHED[1]) if oriented else np.zeros(len(target), dtype=bool)
    status[relaxed] = RELAXED
    status[reached & ((dexterity < SINGULAR_BELOW) | far)] = SINGULAR
    command = nominal.pose(q_c, columns)
    by_command = np.full(len(target), np.nan)
    if reached.any():
        some = np.flatnonzero(reached)
        # The controller's own inverse kinematics, from where it would have gone without compensation.
        led = inverse_pose(nominal, command[some], start=q_n[some], restarts=RESTARTS, extra=_take(columns, some))
        by_command[some] = _errors(calibrated, led.joints, target[some], oriented, _take(columns, some))[0]
    command[~reached] = np.nan
    return Compensation(
        target, oriented, _only(q_n, known), _only(q_c, reached), command, _only(before, known), position, by_command,
        _only(before_angle, known), angle, status, beyond, dexterity,
    )  # fmt: skip


def _only(values: Array, rows: Bools) -> Array:
    """NaN in all other rows."""
    return np.where(rows.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan)


def _same_turn(chain: Chain, q: Array, near: Array) -> Array:
    """Angles (m, n) a whole number of turns away where that is nearer to `near` and within the limits."""
    low, high = chain.limits.T
    turning = np.array([j.type == "revolute" for j in chain.joints])
    other = q - 2 * np.pi * np.round((q - near) / (2 * np.pi))
    return np.asarray(np.where(turning & (other >= low) & (other <= high), other, q))


def _take(columns: Mapping[str, Array], rows: NDArray[np.int64]) -> dict[str, Array]:
    return {k: v[rows] for k, v in columns.items()}


def _poses(nominal: Chain, targets: Targets, columns: Mapping[str, Array]) -> tuple[Array, bool]:
    """T_base_target (m, 4, 4), and whether the orientation counts."""
    if targets.position is None:
        if targets.joints is None:
            raise ModelError("there are no targets", expected="positions, poses or joint values")
        return nominal.pose(targets.joints, columns), True
    m = len(targets.position)
    if targets.position.shape != (m, 3) or (targets.rotation is not None and targets.rotation.shape != (m, 3, 3)):
        raise ModelError("wrong shape of targets", found=targets.position.shape, expected="(m, 3) and (m, 3, 3)")
    out = np.tile(np.eye(4), (m, 1, 1))
    out[:, :3, 3] = targets.position
    if targets.rotation is not None:
        out[:, :3, :3] = targets.rotation
    return out, targets.rotation is not None


def _reach(
    chain: Chain, target: Array, oriented: bool, short: bool, start: Array | None, columns: Mapping[str, Array]
) -> tuple[Array, Bools]:
    """Joint values (m, n) within the limits at which a model meets its task as well as it can, near `start`, and where
    it does (m,)."""
    if not len(target):
        return np.zeros((0, len(chain.joints))), np.zeros(0, dtype=bool)
    options = {"restarts": RESTARTS, "extra": columns}
    start = None if start is None else _inside(chain, start)
    if oriented and not short:
        found = inverse_pose(chain, target, start=start, **options)  # type: ignore[arg-type]
    elif oriented and start is None:
        # The best compromise chooses the branch; from there the position is met exactly.
        found = inverse_pose(chain, target, **options)  # type: ignore[arg-type]
    else:
        found = inverse_point(chain, target[:, :3, 3], start=start, **options)  # type: ignore[arg-type]
    near = found.joints if start is None else start
    q = found.joints
    if short or len(chain.joints) > (6 if oriented else 3):
        q = _approach(chain, target, oriented, near, found, columns)
    position, angle = _errors(chain, q, target, oriented and not short, columns)
    return q, np.asarray((position <= REACHED[0]) & (angle <= REACHED[1]))


def _inside(chain: Chain, q: Array) -> Array:
    low, high = chain.limits.T
    return np.asarray(np.clip(q, low, high))


def _approach(
    chain: Chain, target: Array, oriented: bool, near: Array, found: Reached, columns: Mapping[str, Array]
) -> Array:
    """Position first, then orientation, then nearness to `near` (m, n); tried from `near` itself and from the solution
    that was found, and the best of all three stays."""
    choices = [
        *(by_priority(chain, target, near, q, oriented=oriented, extra=columns) for q in (near, found.joints)),
        found.joints,
    ]
    scored = []
    for q in choices:
        p, a = _errors(chain, q, target, oriented, columns)
        # A position that is not met outweighs every orientation, and that every distance.
        far = np.where(p > REACHED[0], 1e3 * (1.0 + p), 0.0)
        scored.append(far + np.round(a, 7) + 1e-9 * np.linalg.norm(q - near, axis=1))
    best = np.argmin(scored, axis=0)
    return np.asarray(np.stack(choices)[best, np.arange(len(near))])


def _without_limits(
    chain: Chain, target: Array, oriented: bool, short: bool, near: Array, columns: Mapping[str, Array]
) -> tuple[Array, Bools]:
    """By how much joints (m, n) would have to leave their limits to reach the targets, and where that would do (m,)."""
    free = replace(chain, joints=tuple(replace(j, lower=-np.inf, upper=np.inf) for j in chain.joints))
    q, reached = _reach(free, target, oriented, short, near, columns)
    turning = np.array([j.type == "revolute" for j in chain.joints])
    low, high = chain.limits.T
    # Whole turns are free: the copy of every angle that lies nearest the middle of its limits.
    both = np.isfinite(low) & np.isfinite(high)
    middle = np.where(both, 0.5 * (np.where(both, low, 0.0) + np.where(both, high, 0.0)), q)
    q = np.where(turning, q - 2 * np.pi * np.round((q - middle) / (2 * np.pi)), q)
    beyond = np.where(q > high, q - high, np.where(q < low, q - low, 0.0))
    return np.where(reached[:, None], beyond, 0.0), reached


def _errors(chain: Chain, q: Array, target: Array, oriented: bool, columns: Mapping[str, Array]) -> tuple[Array, Array]:
    """Distance (m,) and angle (m,) of a model at q from its targets."""
    pose = chain.pose(q, columns)
    gap = np.linalg.norm(pose[:, :3, 3] - target[:, :3, 3], axis=1)
    if not oriented:
        return gap, np.zeros(len(q))
    turn = so3.log(pose[:, :3, :3] @ np.swapaxes(target[:, :3, :3], 1, 2))
    return gap, np.linalg.norm(turn, axis=1)


def _dexterity(chain: Chain, q: Array, oriented: bool, columns: Mapping[str, Array]) -> Array:
    """Smallest over largest singular value of the task's Jacobian, (m,): 0 at a singularity; of an arm with fewer axes
    than the task has numbers, of what it has."""
    if not len(q):
        return np.zeros(0)
    j = chain.jacobian(q, columns)
    reach = max(float(np.linalg.norm(j[:, :3], axis=1).max()), 1e-9)
    j = np.concatenate([j[:, :3], reach * j[:, 3:]], axis=1) if oriented else j[:, :3]
    s = np.linalg.svd(j, compute_uv=False)
    return np.asarray(s[:, -1] / np.maximum(s[:, 0], 1e-300))

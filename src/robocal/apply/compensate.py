"""Compensation: joint values and Cartesian commands that bring a calibrated robot to its targets while the controller
keeps the nominal model.

    q_n = N^-1(T*)          what the controller does with the target: the real robot then stands at C(q_n)
    q_c = C^-1(T*)          the corrected joint values, on the controller's branch, as near q_n as the task leaves free
    T_c = N(q_c)            the corrected Cartesian command: the controller's own inverse kinematics leads it to q_c

N is the nominal model, C the calibrated one. The simulation drives C with what is handed out, so `after` is what is
left if C is the truth. Where an arm cannot meet a whole pose (fewer than six axes) the position comes first and the
orientation next to it, as near as it goes, in the null space of the position (`by_priority`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Bools, Ints
from robocal.apply.verification import errors
from robocal.arms.chain import Chain
from robocal.arms.inverse_kinematics import by_priority, inverse_point, inverse_pose
from robocal.diagnose.limits import LEAP, SINGULAR_BELOW
from robocal.errors import ModelError
from robocal.geometry import se3

__all__ = ["STATUS", "Compensation", "Targets", "compensate", "generic_rank"]

OK, RELAXED, SINGULAR, LIMITS, UNREACHABLE = range(5)
STATUS = ("ok", "orientation relaxed", "near singular", "outside limits", "unreachable")
# What counts as reached: far below what any robot repeats.
REACHED = (1e-7, 1e-6)
RESTARTS = 16


@record
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


@record
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
    status: Ints
    limit_excess: Array
    dexterity: Array

    @property
    def reachable(self) -> Bools:
        """The targets that have something to command, (m,)."""
        return np.asarray(self.status < LIMITS)


@record
class _ModelTargets:
    """Targets (m, 4, 4) that a model is to meet, with the columns (m,) that it reads; `short` says that it has too few axes for a
    whole pose, so that the position comes first."""

    chain: Chain
    target: Array
    oriented: bool
    short: bool
    columns: Mapping[str, Array]

    def of(self, rows: Ints) -> _ModelTargets:
        """Some of the targets."""
        return replace(self, target=self.target[rows], columns={k: v[rows] for k, v in self.columns.items()})

    def errors(self, q: Array) -> tuple[Array, Array]:
        """Distance (m,) and angle (m,) of the model at q from its targets."""
        found = errors(self.chain.pose(q, self.columns), self.target)
        return found.position, found.orientation if self.oriented else np.zeros(len(q))

    def reach(self, start: Array | None) -> tuple[Array, Bools]:
        """Joint values (m, n) within the limits at which the model meets its task as well as it can, near `start`, and where
        it does (m,)."""
        if not len(self.target):
            return np.zeros((0, len(self.chain.joints))), np.zeros(0, dtype=bool)
        start = None if start is None else np.clip(start, *self.chain.limits.T)
        # Of a short arm without a start the best compromise chooses the branch; from there the position is met exactly.
        if self.oriented and (not self.short or start is None):
            found = inverse_pose(self.chain, self.target, start=start, restarts=RESTARTS, extra=self.columns)
        else:
            points = self.target[:, :3, 3]
            found = inverse_point(self.chain, points, start=start, restarts=RESTARTS, extra=self.columns)
        q = found.joints
        if self.short or len(self.chain.joints) > (6 if self.oriented else 3):
            q = self._approach(q if start is None else start, q)
        position, angle = self.errors(q)
        return q, np.asarray((position <= REACHED[0]) & (self.short | (angle <= REACHED[1])))

    def _approach(self, near: Array, found: Array) -> Array:
        """Position first, then orientation, then nearness to `near` (m, n); tried from `near` itself and from the solution
        that was found, and the best of all three stays."""
        chain, target = self.chain, self.target
        led = [by_priority(chain, target, near, q, oriented=self.oriented, extra=self.columns) for q in (near, found)]
        choices = [*led, found]
        scored = []
        for q in choices:
            p, a = self.errors(q)
            # A position that is not met outweighs every orientation, and that every distance.
            far = np.where(p > REACHED[0], 1e3 * (1.0 + p), 0.0)
            scored.append(far + np.round(a, 7) + 1e-9 * np.linalg.norm(q - near, axis=1))
        best = np.argmin(scored, axis=0)
        return np.asarray(np.stack(choices)[best, np.arange(len(near))])

    def excess(self, near: Array) -> tuple[Array, Bools]:
        """By how much joints (m, n) would have to leave their limits to reach the targets, and where that would do (m,)."""
        free = tuple(replace(j, lower=-np.inf, upper=np.inf) for j in self.chain.joints)
        q, reached = replace(self, chain=replace(self.chain, joints=free)).reach(near)
        low, high = self.chain.limits.T
        # Whole turns are free: the copy of every angle that lies nearest the middle of its limits.
        both = np.isfinite(low) & np.isfinite(high)
        middle = np.where(both, 0.5 * (np.where(both, low, 0.0) + np.where(both, high, 0.0)), q)
        q = np.where(_turning(self.chain), _nearest_turn(q, middle), q)
        beyond = np.where(q > high, q - high, np.where(q < low, q - low, 0.0))
        return np.where(reached[:, None], beyond, 0.0), reached

    def dexterity(self, q: Array) -> Array:
        """Smallest over largest singular value of the task's Jacobian, (m,): 0 at a singularity; of an arm with fewer axes
        than the task has numbers, of what it has."""
        if not len(q):
            return np.zeros(0)
        j = self.chain.jacobian(q, self.columns)
        s = _singular_values(j) if self.oriented else np.linalg.svd(j[:, :3], compute_uv=False)
        return np.asarray(s[:, -1] / np.maximum(s[:, 0], 1e-300))


def _singular_values(j: Array) -> Array:
    """Of Jacobians (m, 6, n), where a radian counts as the arm's reach."""
    reach = max(float(np.linalg.norm(j[:, :3], axis=1).max()), 1e-9)
    return np.asarray(np.linalg.svd(np.concatenate([j[:, :3], reach * j[:, 3:]], axis=1), compute_uv=False))


def _turning(chain: Chain) -> Bools:
    return np.array([j.type == "revolute" for j in chain.joints])


def _nearest_turn(q: Array, near: Array) -> Array:
    """Angles (m, n) a whole number of turns away, as near as can be."""
    return np.asarray(q - 2 * np.pi * np.round((q - near) / (2 * np.pi)))


def generic_rank(chain: Chain, extra: Mapping[str, Array] | None = None) -> int:
    """How many degrees of freedom the tool has at most: the rank of the Jacobian at joint values away from
    singularities (the largest of 32 fixed ones)."""
    rng = np.random.default_rng(1)
    low, high = chain.limits.T
    low = np.where(np.isfinite(low), low, -1.0)
    high = np.where(np.isfinite(high), high, low + 2.0)
    q = rng.uniform(low, high, (32, len(low)))
    some = {k: np.broadcast_to(np.mean(v), 32) for k, v in (extra or {}).items() if len(v)}
    s = _singular_values(chain.jacobian(q, some))
    return int((s > 1e-2 * s[:, :1]).sum(axis=1).max())


def compensate(nominal: Chain, calibrated: Chain, targets: Targets) -> Compensation:
    """Corrected joint values and Cartesian commands for every target, each checked by driving the calibrated model.

    The two chains must have the same joints; limits are the calibrated chain's. Raises ModelError for other joints,
    misshapen targets or a column that a model lacks.
    """
    if nominal.joint_names != calibrated.joint_names:
        found, expected = (", ".join(chain.joint_names) for chain in (calibrated, nominal))
        raise ModelError("the nominal and the calibrated robot have other joints", found=found, expected=expected)
    columns = {k: np.asarray(v, float) for k, v in targets.extra.items()}
    target, oriented = _poses(nominal, targets, columns)
    # A whole pose asks for six degrees of freedom; an arm that has fewer gives the position first.
    task = _ModelTargets(calibrated, target, oriented, oriented and generic_rank(nominal, columns) < 6, columns)
    if targets.position is None:
        q_n, known = np.array(targets.joints, float), np.ones(len(target), dtype=bool)
    else:
        q_n, known = replace(task, chain=nominal).reach(targets.joints)
    q_c, reached = task.reach(q_n)
    low, high = calibrated.limits.T
    other = _nearest_turn(q_c, q_n)
    q_c = np.where(_turning(calibrated) & (other >= low) & (other <= high), other, q_c)
    far = known & (np.abs(q_c - q_n).max(axis=1, initial=0.0) > LEAP)
    before, before_angle = task.errors(q_n)
    if task.short:
        # A position that is met at a limit by swinging the tool elsewhere is no correction of this target.
        swung = reached & far & (task.errors(q_c)[1] > before_angle + LEAP)
        reached, q_c = reached & ~swung, np.where(swung[:, None], q_n, q_c)
    beyond = np.zeros_like(q_c)
    status = np.full(len(target), OK)
    lost = np.flatnonzero(~reached)
    if len(lost):
        beyond[lost], free = task.of(lost).excess(q_c[lost])
        status[lost] = np.where(free, LIMITS, UNREACHABLE)
    position, angle = task.errors(q_c)
    dexterity = task.dexterity(q_c)
    if oriented:
        status[reached & (angle > REACHED[1])] = RELAXED
    status[reached & ((dexterity < SINGULAR_BELOW) | far)] = SINGULAR
    command = nominal.pose(q_c, columns)
    by_command = np.full(len(target), np.nan)
    if reached.any():
        some = np.flatnonzero(reached)
        own = task.of(some)
        # The controller's own inverse kinematics, from where it would have gone without compensation.
        led = inverse_pose(nominal, command[some], start=q_n[some], restarts=RESTARTS, extra=own.columns)
        by_command[some] = own.errors(led.joints)[0]
    command[~reached] = np.nan
    q_n[~known], q_c[~reached], before[~known], before_angle[~known] = np.nan, np.nan, np.nan, np.nan
    return Compensation(
        target, oriented, q_n, q_c, command, before, position, by_command, before_angle, angle, status, beyond, dexterity,
    )  # fmt: skip


def _poses(nominal: Chain, targets: Targets, columns: Mapping[str, Array]) -> tuple[Array, bool]:
    """T_base_target (m, 4, 4), and whether the orientation counts."""
    if targets.position is None:
        if targets.joints is None:
            raise ModelError("there are no targets", expected="positions, poses or joint values")
        return nominal.pose(targets.joints, columns), True
    m = len(targets.position)
    turn = np.tile(np.eye(3), (m, 1, 1)) if targets.rotation is None else targets.rotation
    if targets.position.shape != (m, 3) or turn.shape != (m, 3, 3):
        raise ModelError("wrong shape of targets", found=targets.position.shape, expected="(m, 3) and (m, 3, 3)")
    return se3.compose(turn, targets.position), targets.rotation is not None

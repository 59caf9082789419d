"""Where frames alone are looked for (hand-eye calibration, a tracker beside a robot): there is no nominal model to be better than, and
what is asked is whether the frames are placed, and how far off the tool may be.

    r = M J_g s + e,    s ~ N(0, k^2 S^2),    e ~ N(0, v^2)        whitened, M takes out the frames and local poses
    k^2, v^2 = argmax likelihood,    cov(frames) = v^2 (J^T J)^-1 + k^2 G S^2 G^T,    G = (J^T J)^-1 J^T J_g

J are the columns of the frames, J_g those of what making leaves of the robot, S its expected errors. Residuals that the robot's own
errors explain shift the frames as well, and some of it leaves no trace: a longer flange is a camera farther off. k is zero where
independent noise explains the residuals as well. Variance components by restricted likelihood: Patterson and Thompson (1971).

The frames hold where

    sum r^2 <= FRAMES_LEFT^2 (|M J_g S|^2 + n (stated sigma / sigma in use)^2)

The error at the tool is that of the frames with noise as fitted, less the stated noise of the instrument: V = J C J^T + tau^2. Where
the robot's own errors are seen, which are no draw of a normal distribution, it is the error of rank 0.95 (n + 1) of n that are unseen
one by one, less the same. Vovk, Gammerman and Shafer, Algorithmic Learning in a Random World (2005).
"""

from __future__ import annotations

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.limits import FRAMES_LEFT
from robocal.diagnose.vision_limits import ARM_EXPLAINS
from robocal.estimate.elimination import beside_blocks, reweight, triangle
from robocal.estimate.uncertainty import LEVEL, radius
from robocal.fit.fit import Fit
from robocal.measure.machine import Model, freedom_of
from robocal.prove.bands import row_bands
from robocal.prove.evidence import Evidence, Gain
from robocal.prove.pose_share import pose_share
from robocal.prove.scale_share import scale_walk
from robocal.prove.statistics import rms
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["RobotShare", "judge_frames", "robot_share"]

RATIOS = np.concatenate([[0.0], np.logspace(-6, 6, 241)])  # grid: of k^2 to v^2


@record
class RobotShare:
    """What the robot's own errors do to a fit of frames alone: `times` is what is left over what noise and making allow (rms),
    `covariance` (n, n) of the fitted names with the robot's errors; None where noise explains what is left. Where poses are given,
    `errors` are how far they are off as it seems, m and rad; of an arm `making` is k, its errors over those that are expected."""

    times: float
    covariance: Array | None
    errors: tuple[float, float] | None = None
    making: float = 0.0


def robot_share(model: Model, fit: Fit) -> RobotShare:
    """Of a fit in which nothing of the robot is free."""
    problem, x = fit.problem, fit.solution.x
    noise = sum(g.n * ((g.stated or 0.0) / g.sigma) ** 2 for g in fit.groups if g.sigma > 0)
    # Where changes alone were seen, errors of poses that follow one another leave them as they were.
    if freedom_of(model) == () and all(o.second is None for o in fit.data.observations):
        share = pose_share(model, fit)
        allowed = share.robot + noise
        times = float(np.sqrt(share.square / allowed)) if allowed > 0 else np.inf
        wandered = scale_walk(fit)
        return RobotShare(times, share.covariance if wandered is None else wandered, share.errors)
    own = tuple(n for n in model.geometric if n in problem.table)
    every = problem.with_free((*problem.free, *own))
    lin = reweight(every.linearize(x), every)
    _, left = beside_blocks(replace(lin, j=np.hstack([lin.j, lin.r[:, None]])))
    # What a lens is known to beforehand.
    held = problem.prior_root @ np.column_stack([np.eye(problem.n), problem.difference(x)[0]])
    known = np.zeros((len(held), left.shape[1]))
    known[:, [*every.column_of[problem.index], -1]] = held
    left = np.vstack([left, known])
    frames, robot = every.column_of[problem.index], every.column_of[every.with_free(own).index]
    scale = every.scales
    n, k = len(frames), len(robot)
    root = triangle(np.hstack([left[:, frames] * scale[frames], left[:, robot] * scale[robot], left[:, -1:]]))
    robot_left, r = root[n:, n : n + k], root[n:, -1]
    count = max(int(problem.numbers.sum()) - n, 1)
    allowed = float(np.sum(robot_left**2)) + noise
    square = float(r @ r)
    times = float(np.sqrt(square / allowed)) if allowed > 0 else np.inf
    u, size, _ = np.linalg.svd(robot_left, full_matrices=False)
    told = (u.T @ r) ** 2
    rest = max(square - float(told.sum()), 0.0)
    weight = 1 + RATIOS[:, None] * size**2
    variance = ((told / weight).sum(axis=1) + rest) / count
    with np.errstate(divide="ignore"):
        likelihood = -0.5 * (np.log(weight).sum(axis=1) + count * np.log(variance))
    best = int(np.argmax(likelihood))
    if not k or not n or not likelihood[best] - likelihood[0] > ARM_EXPLAINS:
        return RobotShare(times, None)
    answer = np.linalg.lstsq(root[:n, :n], root[:n, : n + k], rcond=None)[0]
    inverse = np.linalg.lstsq(root[:n, :n], np.eye(n), rcond=None)[0]
    shift = answer[:, n:]
    found = variance[best] * (inverse @ inverse.T + RATIOS[best] * shift @ shift.T)
    making = float(np.sqrt(variance[best] * RATIOS[best]))
    return RobotShare(times, found * np.outer(scale[frames], scale[frames]), making=making)


def judge_frames(share: RobotShare, fit: Fit, evidence: Evidence, unseen: Array, names: tuple[str, ...]) -> Gain:
    """Whether the frames `names` hold on unseen measurements, in place of a gain; `unseen` (n,) are errors there, of as many as can be
    had."""
    unit, left = evidence.unit, rms(evidence.after)
    if not share.times <= FRAMES_LEFT:
        allowed = Quantity(left / share.times if share.times > 0 else 0.0, unit)
        amounts = {"left": Quantity(left, unit), "allowed": allowed}
        found = Remark.of(Code.FRAMES_NOT_EXPLAINED, names=names, **amounts, times=share.times, how=evidence.kind)
        return Gain(found, False)
    told = Quantity(_error_at_tool(share, fit, evidence, unseen), unit)
    place = None if fit.problem.blocks else "tool"
    found = Remark.of(
        Code.FRAMES_LOCATED, names=names, left=Quantity(left, unit), told=told, place=place, how=evidence.kind
    )
    return Gain(found, True, status="located")


def _error_at_tool(share: RobotShare, fit: Fit, evidence: Evidence, unseen: Array) -> float:
    """What 95 % of the errors stay below at poses like those that were measured, without the noise that was stated of the instrument;
    by the covariance as fitted, or where the robot's own errors are seen by `unseen` errors (n,)."""
    stated = {(g.name, g.unit): g.stated or 0.0 for g in fit.groups}
    found, noise = [], []
    every = np.arange(0 if fit.problem.blocks else fit.problem.configurations)
    bands = row_bands(fit.problem, fit.solution.x, fit.total, every)
    for term, band in zip(fit.problem.terms, bands, strict=True):
        for first, last, unit in band.parts:
            if unit == evidence.unit and len(band.new):
                known = stated[term.group, unit] ** 2 * np.eye(last - first)
                found.append(radius(band.new[:, first:last, first:last] - known, fit.total.dof))
                noise.append(float(radius(known)))
    fitted = rms(np.concatenate(found)) if found else 0.0
    # Poses and errors are drawn alike: the next error is as likely to have any rank among those before.
    rank = int(np.ceil(LEVEL * (len(unseen) + 1)))
    at = float(np.sort(unseen)[min(rank, len(unseen)) - 1])
    if found and share.covariance is None:
        return fitted
    seen = float(np.sqrt(max(at**2 - max(noise, default=0.0) ** 2, 0.0)))
    return seen if rank <= len(unseen) else max(seen, fitted)

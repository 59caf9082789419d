"""Which poses of a list to measure for the calibration of a cable robot, and what the choice is worth.

At pose j an instrument says where the platform is, and every cable how long it is:

    r_ij = |p_j + R_j b_i - a_i| - l0_i - l_ij,   dr_j = J_j dtheta + L_j dx_j + noise

theta are the free parameters (a_i and l0_i unless the robot says otherwise, (3.16) to (3.25) of the thesis behind
`examples/cable-laval`), dx_j the error of the measured pose. What pose j tells is J_j^T S_j^-1 J_j with
S_j = sigma^2 I + L_j C L_j^T: nothing else of dx_j is known, so this is exact to first order. Where no instrument measures poses, C has no
end: what is left is N_j^T J_j with N_j^T L_j = 0, and what no pose tells is held. Criteria and search are those of
every plan (`estimate.criteria`, `estimate.selection`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy.linalg

from robocal._record import record
from robocal._types import Array, Ints
from robocal.cables.geometry import EXPECTED, CableRobot, straight
from robocal.cables.gradient import by_parameters
from robocal.errors import ModelError
from robocal.estimate.selection import Design, Pool
from robocal.planning.design import Blocks, choose_best, predict_sigma, sum_information
from robocal.progress import Watch

__all__ = ["MeasurementNoise", "PoseChoice", "cable_blocks", "choose"]

DEFAULT = ("ax", "ay", "az", "l0")
LEAST, MOST = 1e-9, 1e3  # noise that can be computed with, m and rad
DRAWS = 25
OPEN = 1e-9  # of the best seen direction: what no pose tells


@record
class MeasurementNoise:
    """Standard deviations: `length` of a cable in m, `position` per axis in m and `orientation` per axis in rad of a measured
    pose; not `measured`: by encoders alone."""

    length: float = 1e-3
    position: float = 0.0
    orientation: float = 0.0
    measured: bool = True


@record(eq=False)
class PoseChoice:
    """Numbers of the poses chosen, the most telling first; the search; the value that no set of this size exceeds (None: not
    known); names of the parameters; and what is expected to be left of their errors.

    `expected` has "chosen", "random" (the median of DRAWS random sets of the same size) and "all"; each says the rms in m of
    the parameters of each symbol together, "a" (3.39a), "b", "l0" (3.39b), and "position": of the platform where its
    lengths say it is, over the whole list.
    """

    chosen: Ints
    design: Design
    limit: float | None
    criterion: str
    parameters: tuple[str, ...]
    noise: MeasurementNoise
    expected: Mapping[str, Mapping[str, float]]


def choose(
    robot: CableRobot,
    poses: Array,
    count: int,
    *,
    noise: MeasurementNoise | None = None,
    criterion: str = "A",
    rng: np.random.Generator | None = None,
    watch: Watch | None = None,
) -> PoseChoice:
    """The best `count` of the poses (k, 4, 4) by a criterion of `estimate.criteria`.

    Raises ModelError when there are fewer poses than that, for an unknown criterion, and for noise that is none.
    """
    noise, rng = noise or MeasurementNoise(), rng or np.random.default_rng(0)
    if not 1 <= count <= len(poses):
        expected = f"1 to {len(poses)}, those of the list"
        raise ModelError("so many poses cannot be chosen", key="count", found=count, expected=expected)
    b = cable_blocks(robot, poses, noise)
    design, measure, seen = choose_best(b, criterion, count, watch)
    best = Pool(seen.candidates, measure, seen.known).limit(count)
    draws = [_errors(b, rng.permutation(len(poses))[:count]) for _ in range(DRAWS)]
    at_random = {what: float(np.median([d[what] for d in draws])) for what in draws[0]}
    left = {"chosen": _errors(b, design.chosen), "random": at_random, "all": _errors(b, np.arange(len(poses)))}
    return PoseChoice(design.chosen, design, best, criterion, b.names, noise, left)


def cable_blocks(robot: CableRobot, poses: Array, noise: MeasurementNoise) -> Blocks:
    """What every pose (k, 4, 4) tells about the free parameters, and how they move the platform there.

    Candidates (k, m, n) are whitened, in units of EXPECTED; tests (k, 3, n) are the position in m that a controller without
    redundancy checks reads from its lengths, -L^+ J dtheta. Raises ModelError for noise that is none.
    """
    for name, least in (("length", LEAST), ("position", 0.0), ("orientation", 0.0)):
        if not least <= (value := getattr(noise, name)) <= MOST:
            raise ModelError(f"noise of a {name}", found=value, expected=f"{least:g} to {MOST:g}, in m or rad")
    names = _free(robot)
    rows = list(robot.axes)
    gradient = straight(robot, poses)[1][..., rows]
    j = by_parameters(robot, poses, names)[1] * EXPECTED
    spread = np.array([noise.position] * 3 + [noise.orientation] * 3)[rows]
    m = len(robot.cables)
    if not noise.measured:
        return _alone(robot, gradient, j, names, noise.length)
    cover = noise.length**2 * np.eye(m) + (gradient * spread**2) @ gradient.swapaxes(1, 2)
    whitened = np.asarray(np.linalg.solve(np.linalg.cholesky(cover), j), dtype=np.float64)
    return Blocks(names, whitened, _tests(robot, gradient, j), np.eye(len(names)))


def _tests(robot: CableRobot, gradient: Array, j: Array) -> Array:
    """How the parameters move the platform that lengths place, (k, 3, n)."""
    moves = [i for i, axis in enumerate(robot.axes) if axis < 3]
    out = np.zeros((len(j), 3, j.shape[2]))
    out[:, : len(moves)] = -(np.linalg.pinv(gradient) @ j)[:, moves]
    return out


def _alone(robot: CableRobot, gradient: Array, j: Array, names: tuple[str, ...], length: float) -> Blocks:
    """What encoders alone tell: of every pose what its lengths say beside where it is; parameters that stay open are held."""
    m, d = gradient.shape[1:]
    if m <= d:
        message = "encoders alone tell nothing of a robot that has no more cables than freedoms"
        raise ModelError(message, found=f"{m} cables for {d} freedoms", expected="measured poses, or more cables")
    beside = np.linalg.svd(gradient, full_matrices=True)[0][:, :, d:].swapaxes(1, 2)
    whitened = beside @ j / length
    stacked = whitened.reshape(-1, len(names))
    r, order = scipy.linalg.qr(stacked, mode="r", pivoting=True)
    size = np.abs(np.diag(r))
    seen = np.sort(order[: int((size > OPEN * size[0]).sum())])
    tests = _tests(robot, gradient, j[..., seen])
    return Blocks(tuple(names[i] for i in seen), whitened[..., seen], tests, np.eye(len(seen)))


def _free(robot: CableRobot) -> tuple[str, ...]:
    """What is to be identified; a planar robot's anchors have no third coordinate that could be seen."""
    if robot.table.free:
        return tuple(robot.table.free)
    still = [f"a{'xyz'[i]}" for i in range(3) if i not in robot.axes]
    symbols = [s for s in DEFAULT if s not in still]
    names = dict.fromkeys(robot.row(f"{whose}.{s}") for whose in robot.segments.names for s in symbols)
    return tuple(n for n in names if n in robot.table)


def _errors(b: Blocks, chosen: Ints) -> dict[str, float]:
    """Root mean squares of the expected errors, m, by symbol, and of the platform's position over all tests."""
    m = sum_information(b, [int(i) for i in chosen])
    variance = np.diag(np.linalg.inv(m)) * EXPECTED**2
    symbol = np.array([name.rpartition(".")[2] for name in b.names])
    groups = {"a": ("ax", "ay", "az"), "b": ("bx", "by", "bz"), "l0": ("l0",)}
    of = {what: variance[np.isin(symbol, letters)] for what, letters in groups.items()}
    out = {what: float(np.sqrt(v.mean())) for what, v in of.items() if len(v)}
    return out | {"position": float(np.sqrt((predict_sigma(b.tests, m) ** 2).mean()))}

"""The bootstrap of the parameters: fits to configurations drawn again, with replacement.

    x_b = argmin sum_u c_bu |r_u(x) / sigma_u|^2,    c_b a multinomial draw over places

Repeats of one place are drawn together. It asks no model of the noise, so it shows where the linear bars of the fit are
too narrow: heavy tails, noise that differs between poses, curvature. Like those bars it holds for the columns that were
fitted; what hidden partners may be off by it cannot know. Source: Efron and Tibshirani, An introduction to the
bootstrap (1993), chapters 9 and 13.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.check_registry import Finding, Level, When, check, of_remarks, once
from robocal.diagnose.limits import BOOTSTRAP_DRAWS, BOOTSTRAP_PLACES
from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.fit.fit import Fit
from robocal.fit.repeats import places
from robocal.geometry import so3
from robocal.measure.machine import Model
from robocal.progress import Watch, tell
from robocal.prove.decision import Decision
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Resampled", "bootstrap_of", "bootstrap_remarks", "resample"]

CHUNK = 128


@record
class Resampled:
    """The fitted parameters by name: low and high (n,) of the 95 % percentile interval, sigma (n,) their spread, ratio
    (n,) of that to the linear sigma; `draws` that ended well, out of `asked`, from so many `places`."""

    names: tuple[str, ...]
    low: Array
    high: Array
    sigma: Array
    ratio: Array
    draws: int
    asked: int
    places: int


def resample(fit: Fit, sigma: Array, draws: int, seed: int, watch: Watch | None = None) -> Resampled:
    """Draws places again and refits, as batches of exact non-linear problems from the fit's solution.

    sigma (n,) are the linear standard deviations of the fitted columns. Raises ModelError for too few draws, or when
    fewer than half of them can be fitted.
    """
    if draws < BOOTSTRAP_DRAWS:
        raise ModelError("too few draws for a 95 % interval", key="bootstrap", found=draws, expected=BOOTSTRAP_DRAWS)
    problem, x = fit.problem, fit.solution.x
    # A configuration without joint values ties frames together and is no draw of chance.
    label = places(fit.data.configurations)
    joints = fit.data.configurations.joints
    fixed = np.zeros(len(label), dtype=bool) if joints is None else np.isnan(joints).any(axis=1)
    drawn = np.unique(label[~fixed])
    own = problem.weights[0] if problem.weights is not None else np.ones(problem.configurations)
    rng = np.random.default_rng(seed)
    found = []
    for first in range(0, draws, CHUNK):
        some = min(CHUNK, draws - first)
        count = rng.multinomial(len(drawn), np.full(len(drawn), 1 / len(drawn)), some).astype(float)
        weights = np.ones((some, problem.configurations))
        weights[:, ~fixed] = count[:, np.searchsorted(drawn, label[~fixed])]
        solution = least_squares(problem.with_weights(weights * own), np.repeat(x, some, axis=0))
        ended = np.array([r.converged for r in solution.reasons]) & np.isfinite(solution.cost)
        found.append(solution.x[ended])
        tell(watch, "bootstrap", done=first + some, draws=draws)
    values = np.concatenate(found)
    if len(values) < draws / 2:
        message = "most draws leave too little to fit: too few configurations for a bootstrap"
        raise ModelError(message, key="bootstrap", found=f"{len(values)} of {draws} draws")
    low, high = np.percentile(values[:, problem.index], [2.5, 97.5], axis=0)
    spread = _differences(values, x, problem.table.turns)[:, problem.index].std(axis=0, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = spread / sigma
    return Resampled(problem.free, low, high, spread, ratio, len(values), draws, len(drawn))


def _differences(values: Array, x: Array, turns: NDArray[np.int64]) -> Array:
    """How far x (B, P) are from x (1, P): rotations by the turn between them, of which the linear sigma speaks."""
    out = values - x
    for t in turns:
        r = so3.exp(values[:, t : t + 3]) @ np.swapaxes(so3.exp(x[:, t : t + 3]), -1, -2)
        out[:, t : t + 3] = so3.log(r)
    return np.asarray(out)


@once
def bootstrap_of(context: Decision[Model]) -> Resampled | None:
    """That of the fit to everything, where it was asked for."""
    if context.chosen.bootstrap is None:
        return None
    fit, seed = context.need_fit, context.chosen.seed
    return resample(fit, context.uncertainty.sigma, context.chosen.bootstrap, seed, context.watch)


@check("bootstrap", When.FIT, order=200, needs=("proven",))
def note_bootstrap(context: Decision[Model]) -> Iterator[Finding]:
    """How the scatter compares with the linear bars."""
    yield from of_remarks(bootstrap_remarks(bootstrap_of(context)), Level.NOTE)


def bootstrap_remarks(drawn: Resampled | None) -> tuple[Remark, ...]:
    """How the scatter compares with the linear bars; nothing where no bootstrap was asked for."""
    if drawn is None or not len(drawn.names):
        return ()
    worst, few = int(np.nanargmax(drawn.ratio)), drawn.places if drawn.places < BOOTSTRAP_PLACES else None
    said = Remark.of(
        Code.BOOTSTRAP_SPREAD, draws=drawn.draws, median=float(np.nanmedian(drawn.ratio)), parameter=drawn.names[worst],
        worst=float(drawn.ratio[worst]), places=few, lost=drawn.asked - drawn.draws or None,
    )  # fmt: skip
    return (said,)

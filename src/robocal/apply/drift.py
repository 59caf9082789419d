"""Has a machine changed between two calibrations? Which parameters, and where it has places in millimetres, how far?

    d = x_2 - x_1,   cov(d) = f (C_1 + C_2) + (B_2 - B_1) S^2 (B_2 - B_1)^T + (frames of each run's own)

C is noise, B answers to the truth (`Total`), S the errors expected without data. Both runs met the same machine: what the
selection did alike to both cancels, and a hidden partner counts only as far as the two runs hid it differently. f is the
scatter of both runs' rows, block by block, over what even noise would give (`scatter`): what a model cannot describe is no
noise. The test of the parameters is that of `difference`, in the space that both runs saw: this is all that is asked of a model
(`compare_models`).

Where joint values say what the machine does, the verdict is of millimetres (`model_difference`): *unchanged* where the interval of the
change lies below what matters, *drifted* where it lies above and chance alone would show as much once in a thousand, *possible*
else. A cable robot has no joint values, and parts that move by themselves: `anchors`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.apply.difference import Difference, step_between, tail
from robocal.apply.model_difference import ModelDifference, model_difference, shows
from robocal.diagnose.limits import DRIFT_CHANCE, DRIFT_MATTERS
from robocal.diagnose.scatter import Scatter, WhitenedRows, scatter
from robocal.estimate.uncertainty import Total
from robocal.measure.machine import Model
from robocal.parameters import ParameterTable
from robocal.quantities import Amount, OwnUnit, Value

__all__ = ["Drift", "ParameterChange", "ParameterDrift", "Single", "compare", "compare_models"]

FEW = 5


@record
class ParameterChange:
    """One parameter in both runs (SI): change, its standard deviation without a drift, two-sided chance, and the same
    for the most conspicuous of all (Holm)."""

    name: str
    unit: OwnUnit
    first: Value
    second: Value
    change: Amount
    sigma: Amount
    p_value: float
    p_of_all: float


@record
class Single:
    """A change of one parameter of the robot as the only cause: its size and standard deviation (SI), and the chance of
    what it leaves unexplained. A robot's parameter need not have been fitted for that."""

    name: str
    unit: OwnUnit
    change: Amount
    sigma: Amount
    p_rest: float


@record(kw_only=True)
class ParameterDrift:
    """The parameters of two calibrations compared: joint statistic Q / r with r and nu degrees of freedom and its chance; changes, and
    single causes (the best explanation first)."""

    statistic: float
    rank: int
    dof: float
    p_value: float
    changes: tuple[ParameterChange, ...]
    singles: tuple[Single, ...]

    @property
    def status(self) -> str:
        """possible or drifted: without places nothing says which change matters, and a machine is never called unchanged."""
        return "drifted" if self.p_value < DRIFT_CHANCE else "possible"


@record(kw_only=True)
class Drift(ParameterDrift):
    """The same of a machine with places: how far it has changed, against what matters (m), and how far the runs scatter (None where
    a run did not keep its rows)."""

    difference: ModelDifference
    matters: float
    scatter: Scatter | None = None

    @property
    def status(self) -> str:
        """unchanged, possible or drifted."""
        if self.difference.low > self.matters and self.difference.p_value < DRIFT_CHANCE:
            return "drifted"
        return "unchanged" if self.difference.high <= self.matters else "possible"


class _SharedChange:
    """What two calibrations know of the same parameters: `noise` of their difference (n, n), covariance `hidden` of what held numbers
    leave in it (n, n), what the second answers to the truth (n, n), errors expected without data (n,), and the degrees of freedom of the
    noise."""

    def __init__(self, known: tuple[Total, Total], names: tuple[str, ...]) -> None:
        parts = [_split(t, names, [n for n in t.names if n not in names]) for t in known]
        (one, one_response, one_own, one_expected), (two, self.response, two_own, two_expected) = parts
        self.names, self.expected = names, np.maximum(one_expected, two_expected)
        shared = (self.response - one_response) * self.expected
        self.hidden = shared @ shared.T + one_own @ one_own.T + two_own @ two_own.T
        self.noise, self.dof = one + two, _together(known, (one, two))


def compare_models(first: Model, second: Model, known: tuple[Total, Total]) -> ParameterDrift:
    """Compares the parameters of two calibrations of any model, which are all that is asked of it; `known` is what each may be off
    by."""
    shared = _SharedChange(known, _names(first, known))
    return ParameterDrift(**_test(first, second, shared, shared.noise, shared.dof))


def compare(
    first: Model,
    second: Model,
    known: tuple[Total, Total],
    joints: Array,
    conditions: Mapping[str, float],
    *,
    new_tool: bool = False,
    rows: tuple[WhitenedRows | None, WhitenedRows | None] = (None, None),
    matters: float = DRIFT_MATTERS,
) -> Drift:
    """Compares two corrected models of one nominal robot at joint values (m, n); `rows` are those that the fits left. With
    `new_tool` the tool was mounted anew, so it may differ."""
    shared = _SharedChange(known, _names(first, known, "tool." if new_tool else None))
    seen = shows(first, second, shared.names, joints, conditions, new_tool=new_tool)
    noise, dof, spread = shared.noise, shared.dof, None
    if rows[0] is not None and rows[1] is not None and (seen.x @ noise).any():
        spread = scatter((rows[0], rows[1]), known, shared.names, seen.x)
        noise, dof = spread.factor * noise, min(dof, spread.dof)
    size = model_difference(seen, noise, shared.hidden, dof, joints, matters)
    return Drift(**_test(first, second, shared, noise, dof), difference=size, matters=matters, scatter=spread)


def _names(model: Model, known: tuple[Total, Total], without: str | None = None) -> tuple[str, ...]:
    """The parameters that either calibration knows, without those that may differ."""
    either = {*known[0].names, *known[1].names}
    return tuple(n for n in model.table.names if n in either and not (without and n.startswith(without)))


def _test(first: Model, second: Model, shared: _SharedChange, noise: Array, dof: float) -> dict[str, Any]:
    """The joint test, every parameter, and single causes."""
    one, two = first.table, second.table
    step = step_between(one, two, shared.names)
    found = Difference(shared.names, step, noise + shared.hidden, dof, shared.expected)
    changes = tuple(
        ParameterChange(s.name, one[s.name].unit, one[s.name].value, two[s.name].value, *s[1:]) for s in found.single_steps()
    )  # fmt: skip
    return {
        "statistic": found.square / max(found.rank, 1), "rank": found.rank, "dof": dof, "p_value": found.chance,
        "changes": changes, "singles": _singles(one, found, shared.response),
    }  # fmt: skip


def _split(total: Total, names: Sequence[str], other: Sequence[str]) -> tuple[Array, Array, Array, Array]:
    """Noise and response of the shared names, response to names of this run alone, and errors expected of all."""
    size = len(names)
    noise, response = np.zeros((size, size)), -np.eye(size)
    known = [i for i, n in enumerate(names) if n in total.names]
    at = [total.names.index(names[i]) for i in known]
    noise[np.ix_(known, known)] = total.noise[np.ix_(at, at)]
    response[np.ix_(known, known)] = total.response[np.ix_(at, at)]
    rest = [i for i, n in enumerate(total.names) if n in other]
    own = np.zeros((size, len(rest)))
    own[known] = total.hidden[np.ix_(at, rest)]
    expected = np.zeros(size)
    expected[known] = total.expected[at]
    return noise, response, own, expected


def _together(known: tuple[Total, Total], noise: tuple[Array, Array]) -> float:
    """Degrees of freedom of a sum of two estimated variances (Welch, Satterthwaite), by the traces of their correlations."""
    size = np.sqrt(np.maximum(np.diag(noise[0]) + np.diag(noise[1]), 1e-300))
    u, v = (float(np.trace(c / np.outer(size, size))) for c in noise)
    spread = sum(w**2 / t.dof for w, t in zip((u, v), known, strict=True) if np.isfinite(t.dof))
    return (u + v) ** 2 / spread if spread > 0 else np.inf


def _singles(table: ParameterTable, found: Difference, response: Array) -> tuple[Single, ...]:
    """Every parameter as the only cause: a true change of it by one shows in the estimates as a column of 1 + B."""
    if found.rank < 2:
        return ()
    assert found.expected is not None
    size, sigma, rest = found.causes(np.eye(len(found.names)) + response)
    # What shows less than its own expected error over the noise of both runs explains nothing.
    able = np.flatnonzero((found.expected > sigma) & (found.expected > 0))
    best = able[np.argsort(rest[able], kind="stable")][:FEW]
    units = {i: table[found.names[i]].unit for i in best}
    chances = {i: tail(float(rest[i]), found.rank - 1, found.dof) for i in best}
    return tuple(Single(found.names[i], units[i], float(size[i]), float(sigma[i]), chances[i]) for i in best)

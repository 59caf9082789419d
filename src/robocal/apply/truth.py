"""How far identified parameters are from the truth of a simulation, by group, in their own standard deviations.

    e = x - t,   Q = e_g^T C_gg^-1 e_g  ~  r F(r, nu)  of a group g, where the covariance C says what it should

The truth is a calibration without an error, so the tests are those of two calibrations (`difference`). Groups are all parameters,
those of one unit (lengths, angles), and those of one owner (base, a joint, a cable, the tool). A parameter is named where chance
alone would show as large an error of any of them less than once in twenty comparisons (Holm).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._record import record
from robocal.apply.difference import Difference, step_between
from robocal.estimate.uncertainty import Total
from robocal.parameters import ParameterTable
from robocal.quantities import Amount, DisplayUnit, Value

__all__ = ["CHANCE", "ErrorSize", "GroupErrors", "ParameterError", "TruthErrors", "compare_truth"]

CHANCE = 0.05
NEAR = 2.0  # standard deviations
KINDS = {"m": "lengths", "rad": "angles", "1": "ratios"}
ALL = "all"


@record
class ErrorSize:
    """The errors of a group in one unit: how many, root mean square, the largest, and the root mean square of what was expected."""

    unit: DisplayUnit
    n: int
    rms: Amount
    largest: Amount
    sigma: Amount


@record
class GroupErrors:
    """A group of parameters: how many, chi2 (Q) with its degrees of freedom and its chance, how many lie within two standard deviations,
    and the sizes of their errors, one for each unit."""

    group: str
    n: int
    chi2: float
    rank: int
    p_value: float
    within: int
    sizes: tuple[ErrorSize, ...]


@record
class ParameterError:
    """One parameter: truth, identified value, error (identified minus true) with its standard deviation, their quotient, and the chance
    of as much by itself and after looking at all of them (Holm)."""

    name: str
    unit: DisplayUnit
    truth: Value
    identified: Value
    error: Amount
    sigma: Amount
    sigmas: float
    p_value: float
    p_of_all: float


@record
class TruthErrors:
    """Groups and parameters, and the names of those whose errors chance does not explain, the farthest first."""

    groups: tuple[GroupErrors, ...]
    parameters: tuple[ParameterError, ...]

    @property
    def total(self) -> GroupErrors:
        """All parameters."""
        return self.groups[0]

    @property
    def named(self) -> tuple[str, ...]:
        """The parameters that are farther from the truth than chance explains."""
        far = [p for p in self.parameters if p.p_of_all < CHANCE]
        return tuple(p.name for p in sorted(far, key=lambda p: -abs(p.sigmas)))


def compare_truth(identified: ParameterTable, truth: ParameterTable, total: Total, names: Sequence[str]) -> TruthErrors:
    """Compares identified parameters with their true values; `total` is what they may be off by, `names` are those to compare, which
    both tables and `total` have."""
    at = [total.names.index(n) for n in names]
    covariance = total.covariance[np.ix_(at, at)]
    # Relative to what is expected of them all directions count: nothing that the truth says is unknown.
    error = Difference(
        tuple(names), step_between(truth, identified, names), covariance, total.dof, np.sqrt(np.diag(covariance)), np.inf
    )  # fmt: skip
    parameters = tuple(
        ParameterError(
            s.name, identified[s.name].unit, truth[s.name].value, identified[s.name].value, s.step, s.sigma, s.step / s.sigma, *s[3:],
        )
        for s in error.single_steps()
    )  # fmt: skip
    groups = _groups(identified, names)
    return TruthErrors(tuple(_group(name, error.only(at), identified) for name, at in groups.items()), parameters)


def _groups(table: ParameterTable, names: Sequence[str]) -> Mapping[str, list[int]]:
    """All, by unit, and by owner; what would be all once more is left out."""
    units: dict[str, list[int]] = {kind: [] for kind in KINDS.values()}
    owners: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        unit = table[name].unit
        units.setdefault(KINDS.get(unit, unit), []).append(i)
        owners.setdefault(name.rpartition(".")[0] or name, []).append(i)
    parts = {**units, **owners}
    return {ALL: list(range(len(names))), **{k: v for k, v in parts.items() if 0 < len(v) < len(names)}}


def _group(name: str, error: Difference, table: ParameterTable) -> GroupErrors:
    sizes = []
    for unit in dict.fromkeys(table[n].unit for n in error.names):
        some = [i for i, n in enumerate(error.names) if table[n].unit == unit]
        size, sigma = error.step[some], error.sigma[some]
        rms, expected = (float(np.sqrt(np.mean(v**2))) for v in (size, sigma))
        sizes.append(ErrorSize(unit, len(some), rms, float(np.abs(size).max()), expected))
    within = int((np.abs(error.step) <= NEAR * error.sigma).sum())
    return GroupErrors(name, len(error.names), error.square, error.rank, error.chance, within, tuple(sizes))

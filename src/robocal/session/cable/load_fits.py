"""What loads say of a cable: its weight per metre from how it hangs, its elasticity from how it lengthens, as a constant and as a curve."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.cables.rope import ELASTICITY, EXPONENT, WEIGHT, Rope, rope, strain_slopes
from robocal.errors import FormatError
from robocal.files.dataset import Reading, read_datasets
from robocal.fit.options import Options
from robocal.measure.base import predict_rows
from robocal.measure.data import DataSet
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide
from robocal.prove.results import ParameterResult, parameter_results
from robocal.prove.statistics import Statistic
from robocal.prove.verdict import Verdict, verdict_of
from robocal.remarks.english import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.cable.load_remarks import (
    copied,
    different,
    far_rows,
    insist_different,
    scatter,
    unexplained,
    unlike,
)

__all__ = ["LoadFit", "Loads", "fit_loads"]

MIDDLE = 100.0  # N, where no load is above zero


@record(eq=False)
class LoadFit:
    """One fit to loads: `what` it is, the rope that was found, and by how much it misses loads that it had not seen."""

    what: str
    decision: Decision[Rope]

    @property
    def rope(self) -> Rope:
        """The rope with what was found."""
        return self.decision.corrected

    @cached_property
    def parameters(self) -> tuple[ParameterResult, ...]:
        """Its numbers with their intervals, those of gauges last."""
        return tuple(p for p in parameter_results(self.decision) if p.status != "fixed")

    @cached_property
    def verdict(self) -> Verdict:
        """Whether it is better than what the robot's file says."""
        return verdict_of(self.decision)

    @cached_property
    def below(self) -> Remark | None:
        """That the loads do not tell a weight or an elasticity above zero, where they do not."""
        for p in self.parameters:
            if p.name in (WEIGHT, ELASTICITY) and p.interval is not None and not p.interval[0] > 0:
                low, high = (Quantity(v, p.unit) for v in p.interval)
                return Remark.of(Code.LOAD_NOT_ABOVE, what=p.name.rpartition(".")[2], low=low, high=high)
        return None

    @property
    def refused(self) -> bool:
        """Whether these loads are not those of such a cable."""
        return self.why is not None

    @cached_property
    def why(self) -> Remark | None:
        """Why these loads are not those of such a cable."""
        refused = self.verdict.status == "refused"
        told = self.below or unexplained(self.what, self.decision, always=refused)
        return told or (scatter(self.decision) if self.what == "weight" else None)

    @cached_property
    def unseen(self) -> Statistic | None:
        """Errors on loads that it had not seen, m."""
        both = self.decision.unseen("m")
        return None if both is None else both[1]

    @property
    def missed(self) -> float | None:
        """The root of their mean square, m."""
        return None if self.unseen is None else self.unseen.rms

    @cached_property
    def predicted(self) -> Array:
        """What every load should have read, (k,) m, in the order of the rows."""
        data, fit = self.decision.need_data, self.decision.need_fit
        every = (
            predict_rows(self.decision.model, data, obs, fit.problem.table, fit.solution.x)[:, 0]
            for obs in data.observations
        )
        return np.concatenate(list(every))

    @cached_property
    def tension(self) -> Array:
        """The loads (k,) in N."""
        return np.concatenate([obs.extra["tension"] for obs in self.decision.need_data.observations])

    @cached_property
    def measured(self) -> Array:
        """What was read, (k,) in m."""
        return np.concatenate([obs.value[:, 0] for obs in self.decision.need_data.observations])

    def curve(self, count: int) -> tuple[Array, Array]:
        """Tensions (n,) in N, for sags from the least one on, else from 0, and what loads of the first one's length read there, m."""
        data = self.decision.need_data
        first = next(o for o in data.observations if len(o))
        low = 0.0 if first.kind == "elongation" else float(self.tension.min())
        t = np.linspace(low, float(self.tension.max()), count)
        extra = {k: np.full(count, v[0]) for k, v in first.extra.items()} | {"tension": t}
        none = np.zeros(count, dtype=np.int64)
        asked = replace(
            first, configuration=none, value=np.zeros((count, 1)), sigma=None, extra=extra, rows=None, used=None, digits=None,
            rounding=None, target=None,
        )  # fmt: skip
        fit = self.decision.need_fit
        return t, predict_rows(self.decision.model, data, asked, fit.problem.table, fit.solution.x)[:, 0]

    @property
    def stiffens(self) -> bool:
        """Whether the interval of the exponent leaves a constant out."""
        found = next((p for p in self.parameters if p.name == EXPONENT), None)
        return found is not None and found.interval is not None and not found.interval[0] <= 1.0 <= found.interval[1]

    def strain_half(self, tension: Array) -> Array:
        """Half of the 95 % interval of the strain at tensions (k,) in N."""
        names, covariance = self.decision.spread
        e, p = (np.array(self.rope.table[n].value) for n in (ELASTICITY, EXPONENT))
        by_e, by_p = strain_slopes(np.asarray(tension, float), e, p, self.rope.reference)
        slope = np.stack([by_e if n == ELASTICITY else by_p if n == EXPONENT else 0 * by_e for n in names], axis=-1)
        first = next(q for q in self.parameters if q.name == ELASTICITY)
        assert first.interval is not None and first.sigma
        reach = (first.interval[1] - first.interval[0]) / 2 / first.sigma
        return np.asarray(reach * np.sqrt(np.einsum("ki,ij,kj->k", slope, covariance, slope)))


@record(eq=False)
class Loads:
    """What was read of loads, and the fits to them: of the weight, of a constant elasticity, of a curve; None where nothing tells.
    `stated` is what the robot's file says of them (N/m, 1/N), 0 where nothing."""

    reading: Reading
    stated: Mapping[str, float] = field(default_factory=dict)
    weight: LoadFit | None = None
    constant: LoadFit | None = None
    curve: LoadFit | None = None

    @property
    def fits(self) -> tuple[LoadFit, ...]:
        """Those that there are."""
        return tuple(f for f in (self.weight, self.constant, self.curve) if f is not None)

    @property
    def law(self) -> LoadFit | None:
        """The elasticity to take: the curve where the loads rule a constant out, or the constant is refused and the curve is not, and where
        unseen loads prefer it; else the constant."""
        one, other = self.constant, self.curve
        if one is None or other is None or one.missed is None or other.missed is None:
            return one
        bent = other.stiffens or (one.refused and not other.refused)
        return other if bent and other.missed < one.missed else one

    @property
    def material(self) -> dict[str, float]:
        """What a robot's file can hold of it, by its keys, SI: the weight, and a constant elasticity where that is the one to take."""
        taken = {"density": self.weight, "elasticity": self.constant if self.law is self.constant else None}
        return {k: f.parameters[0].identified for k, f in taken.items() if f is not None and not f.refused}

    @property
    def refused(self) -> tuple[Remark, ...]:
        """Why these loads must not be trusted."""
        out: list[Remark] = []
        for fit in (f for f in (self.weight, self.law) if f is not None):
            if fit.why is not None:
                out.append(fit.why)
            else:
                out += [r for r in (self._unlike(fit)[0],) if r is not None]
        again, whole = copied(self.reading.dataset)
        return tuple(dict.fromkeys((*out, again) if again is not None and whole else out))

    @property
    def notes(self) -> tuple[Remark, ...]:
        """What to look at: rows that are far from the others, and numbers that the robot's file has otherwise."""
        out: list[Remark] = []
        for fit in (f for f in (self.weight, self.law) if f is not None and not f.refused):
            out += far_rows(fit.decision, "sag" if fit is self.weight else "elongation")
            out += [r for r in (self._unlike(fit)[1],) if r is not None]
        again, whole = copied(self.reading.dataset)
        return tuple(dict.fromkeys((*out, again) if again is not None and not whole else out))

    def _unlike(self, fit: LoadFit) -> tuple[Remark | None, Remark | None]:
        """Whether its weight or elasticity is another one than the robot's file has; of a curve the strain at its middle is compared."""
        first = next((p for p in fit.parameters if p.name in (WEIGHT, ELASTICITY)), None)
        return (None, None) if first is None else unlike(first, self.stated.get(first.name, 0.0))


def fit_loads(
    paths: Sequence[str | os.PathLike[str]], weight: float = 0.0, elasticity: float = 0.0, watch: Watch | None = None
) -> Loads:
    """Fits to loads, from what a robot's file says of its cables (N/m, 1/N). Raises InputError."""
    reading = read_datasets(paths, rope())
    data = reading.dataset
    sags, longer = _of_kind(data, "sag"), _of_kind(data, "elongation")
    found = Loads(reading, {WEIGHT: weight, ELASTICITY: elasticity})
    if sags is not None:
        made = decide(rope(weight, free=(WEIGHT,)), sags, Options(), watch)
        insist_different(sags, made.need_fit.problem.n)
        found = _with(found, weight=LoadFit("weight", made))
    if longer is not None:
        pulls = np.concatenate([o.extra["tension"] for o in longer.observations])
        middle = float(np.exp(np.log(pulls[pulls > 0]).mean())) if (pulls > 0).any() else MIDDLE
        for name, free in (("constant", (ELASTICITY,)), ("curve", (ELASTICITY, EXPONENT))):
            made = decide(rope(0.0, elasticity, reference=middle, free=free), longer, Options(), watch)
            told = set(free) <= set(made.need_fit.problem.free)
            if told and name == "constant":
                insist_different(longer, made.need_fit.problem.n)
            if told and different(longer) > made.need_fit.problem.n:
                found = _with(found, **{name: LoadFit(name, made)})
        if found.constant is None:
            span = f"{len(pulls)} of {pulls.min():.4g} to {pulls.max():.4g} N"
            expected = "loads of different tensions, or offset: {value: 0, unit: mm, free: false}"
            source = longer.observations[0].source
            raise FormatError(
                "these loads tell no elasticity", file=source, key="tension", found=span, expected=expected
            )
    return found


def _with(found: Loads, **more: LoadFit) -> Loads:
    parts = {"weight": found.weight, "constant": found.constant, "curve": found.curve}
    return Loads(found.reading, found.stated, **{**parts, **more})


def _of_kind(data: DataSet, kind: str) -> DataSet | None:
    """The loads of one kind alone."""
    mine = tuple(o for o in data.observations if o.kind == kind)
    if not mine:
        return None
    return DataSet(data.configurations, mine).take(np.unique(np.concatenate([o.configuration for o in mine])))

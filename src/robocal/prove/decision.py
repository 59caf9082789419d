"""What is decided of a machine from its measurements, as the checks of a proof see it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robocal._types import Array, Bools
from robocal.diagnose.check_registry import Context, M_co
from robocal.diagnose.limits import FINEST_ERROR
from robocal.diagnose.rounding import rounding_rms
from robocal.fit.baseline import Baseline
from robocal.fit.estimators import estimator
from robocal.fit.misfit import by_unit
from robocal.fit.noise import owners
from robocal.fit.options import Options
from robocal.prove.evidence import Evidence, Gain
from robocal.prove.judge import Proof, absolute_observations, constant_of, drawn, units_of, unseen_of
from robocal.prove.prove import Proven
from robocal.prove.statistics import Statistic

__all__ = ["Decision"]


@dataclass(frozen=True)
class Decision(Context[M_co]):
    """A fit to all measurements but gross rows, which `data` marks, from `start` (1, P), the baseline beside it, and what was
    proven; the options are those that were used."""

    start: Array | None = None
    proven: Proven | None = None

    @property
    def proof(self) -> Proof | None:
        """The proof that the verdict takes."""
        return self.need_proofs.best

    @property
    def need_proofs(self) -> Proven:
        """The proofs, where they were made."""
        assert self.proven is not None
        return self.proven

    @property
    def chosen(self) -> Options:
        """The options that were used."""
        assert self.options is not None
        return self.options

    @property
    def need_baseline(self) -> Baseline:
        """The baseline of all measurements."""
        assert self.base is not None
        return self.base

    @property
    def unit(self) -> str:
        """The SI unit in which the verdict is found: the first that was measured."""
        return units_of(self.need_proofs.base)[0]

    @cached_property
    def errors(self) -> tuple[Array, Array, Bools]:
        """Unseen errors (N,) of baseline and identified model, and which rows prove something."""
        assert self.proof is not None
        return self.proof.errors(self.unit)

    @cached_property
    def digits(self) -> float | None:
        """What rounding leaves (m), where one of the two models is so good that it matters; see `digits`."""
        before, after, counted = self.errors
        if self.unit != "m" or min(rms(before[counted]), rms(after[counted])) >= FINEST_ERROR:
            return None
        return rounding_rms(self.model, self.need_data, self.need_proofs.part, counted)

    @cached_property
    def evidence(self) -> Evidence | None:
        """What unseen measurements say; None where nothing was measured there."""
        proof, unit, part, base = self.proof, self.unit, self.need_proofs.part, self.need_proofs.base
        if proof is None or not self.errors[2].any():
            return None
        before, after, counted = self.errors
        owner = by_unit(base.terms, [np.full(len(t.index), i) for i, t in owners(self.need_data, base)], unit)
        at = np.concatenate([r.configuration for r in base.residuals(base.start) for *_, u in r.parts if u == unit])
        stated = [g.stated for g in part.groups if g.unit == "m" and g.stated is not None]
        return Evidence(
            before[counted],
            after[counted],
            constant_of(self.need_data, base, proof) if unit == "m" else None,
            drawn(proof.split, self.places, at[counted]),
            blind=part.identifiability.blind,
            # Some methods end after as many steps as were asked for.
            converged=part.solution.reasons[0].converged or estimator(self.chosen.method).finite,
            seed=self.chosen.seed,
            kind=proof.split.how,
            stated=float(np.sqrt(3) * stated[0]) if stated else None,
            unit=unit,
            everything=proof.errors(unit, everything=True) if proof.aside[unit].any() else None,
            located=after[counted & np.isin(owner, absolute_observations(self.need_data))],
        )

    @property
    def gain(self) -> Gain | None:
        """The gain on unseen measurements."""
        return None if self.evidence is None else self.evidence.gain

    @property
    def improvement(self) -> bool:
        """Whether it is proven."""
        return self.gain is not None and self.gain.proven

    @cached_property
    def corrected(self) -> M_co:
        """The model with what was found."""
        return self.model.with_values({n: v for n, v in self.values.items() if n in self.model.table})

    def unseen(self, unit: str) -> tuple[Statistic, Statistic] | None:
        """The errors, before and after, of what was held out, or else left out one by one; None where nothing was."""
        proofs = self.need_proofs.proofs
        for name in ("held_out", "leave_one_out"):
            before, after = unseen_of(proofs[name], unit) if name in proofs else (None, None)
            if before is not None and after is not None:
                return before, after
        return None


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))

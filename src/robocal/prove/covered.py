"""Whether the bands of a fit hold the measurements that it had not seen, and why that was not asked."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import special

from robocal._types import Ints
from robocal.diagnose.check_registry import Finding, When, check, doubt, note, once
from robocal.diagnose.limits import BAND_CHANCE
from robocal.fit.estimators import estimator
from robocal.fit.fit import Fit
from robocal.measure.machine import Model
from robocal.prove.bands import coverage, row_bands, total_of
from robocal.prove.decision import Decision
from robocal.prove.statistics import Coverage
from robocal.remarks.code import Code

__all__ = ["coverage_of", "unseen_coverage"]

WHOLE = {"position": "positions", "orientation": "orientations"}


@once
def unseen_coverage(context: Decision[Model]) -> tuple[Coverage, ...]:
    """That of the fit that was judged, on what was held out."""
    return coverage_of(context.need_proofs.part, context.need_proofs.held_out)


@check("narrow-bands", When.FIT, order=260, needs=("proven",))
def narrow_bands(context: Decision[Model]) -> Iterator[Finding]:
    """Bands that miss so many unseen measurements as hardly an honest one would."""
    if estimator(context.chosen.method).blind:
        return
    for c in unseen_coverage(context):
        if c.quantity in WHOLE and special.bdtr(round(c.whole * c.n), c.n, c.level) < BAND_CHANCE:
            yield doubt(Code.BAND_TOO_NARROW, whole=c.whole, n=c.n, quantity=WHOLE[c.quantity])


@check("coverage", When.FIT, order=240, needs=("proven",))
def bands_without_check(context: Decision[Model]) -> Iterator[Finding]:
    """Why the bands were not checked, where they were not."""
    part, held = context.need_proofs.part, context.need_proofs.held_out
    if estimator(context.chosen.method).blind or unseen_coverage(context):
        return
    if part.problem.blocks:
        yield note(Code.BAND_PROFILED)
    elif len(held):
        yield note(Code.BAND_BLIND, names=unmet(part)[:6])
    else:
        yield note(Code.BAND_UNCHECKED)


def coverage_of(found: Fit, held: Ints) -> tuple[Coverage, ...]:
    """Whether the bands of a fit hold the measurements of configurations that it had not seen."""
    # A pose that is found from the very rows that are to be predicted leaves nothing to predict.
    if not len(held) or found.problem.blocks:
        return ()
    off = total_of(found)
    return coverage(row_bands(found.problem, found.solution.x, off, held, unmet(found)), off.dof)


def unmet(found: Fit) -> tuple[str, ...]:
    """Parameters that no fitted row depends on: a frame that only held-out rows see (a new marker) was fitted to nothing,
    and its rows have no band worth the name. What is nearly unseen is as uncertain as expected, and that is a band."""
    alone = tuple(c.name for c in found.identifiability.combinations if not c.partners)
    some = found.problem.with_free(alone)
    seen = np.diag(some.normal(found.solution.x).a[0]) if some.n else np.zeros(0)
    return tuple(n for n, s in zip(some.free, seen, strict=True) if s == 0)

"""What is told beside a verdict, with the words that a reader should not miss: how linear an identification was (the step that was
needed, the step that all free parameters would have taken, the curvature within the sigmas), whether the bands of a fit hold the
measurements that it had not seen, and rows that do not belong to the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal.diagnose.check_registry import Finding, When, check, doubt, note, once
from robocal.diagnose.exchanged_views import exchanged_views
from robocal.diagnose.growth import at_end, drift_of_file, error_growth, largest_growth
from robocal.diagnose.limits import BAND_CHANCE, CURVATURE, STEP_MISLEADS
from robocal.diagnose.outliers import Outlier, name_outliers
from robocal.diagnose.studentised import far_from
from robocal.estimate.elimination import triangle
from robocal.estimate.linearity import Curvature, Step, curvature, one_step, rows_triangle
from robocal.fit.estimators import estimator
from robocal.fit.fit import Fit
from robocal.measure.machine import Model
from robocal.prove.bands import coverage, row_bands
from robocal.prove.decision import Decision
from robocal.prove.judge import units_of
from robocal.prove.pose_from_lengths import pose_from_lengths
from robocal.prove.statistics import Coverage
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["GROWTH", "Linearity", "linearity_of", "outliers", "unseen_coverage"]


@record
class Linearity:
    """One linear step from the baseline in the fitted parameters, and one in everything free without priors (the seed's
    linear estimate), and the curvature at the solution."""

    fitted: Step
    everything: Step | None
    bend: Curvature | None

    @property
    def unit(self) -> str:
        """The SI unit of both steps."""
        return self.fitted.unit

    @property
    def curvature(self) -> float | None:
        """The largest relative curvature within one sigma."""
        return None if self.bend is None else self.bend.value

    @property
    def curvature_parameter(self) -> str:
        """What such a step moves most."""
        return "" if self.bend is None else self.bend.parameter

    @property
    def misleads(self) -> bool:
        """Whether one step in the fitted parameters leaves clearly more than it promises and than the noise is."""
        return not self.fitted.left <= STEP_MISLEADS * max(self.fitted.promised, self.fitted.noise)

    @property
    def ruins(self) -> bool:
        """Whether one step in everything that is free leaves more than there was before."""
        e = self.everything
        return e is not None and not e.left <= max(e.before, e.noise)


@once
def linearity_of(context: Decision[Model]) -> Linearity | None:
    """Of the fit to everything, with the covariance of its method where that has one of its own, in the first SI unit that was measured;
    None with local blocks."""
    fit, units, u = context.need_fit, units_of(context.proven.base.problem), context.uncertainty
    if not units or fit.problem.blocks:
        return None
    loose = replace(fit.problem, priors=False).with_free(fit.problem.table.free)
    # What overflows or cannot be factored tells nothing; the verdict says what is wrong with such numbers.
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        lin = loose.with_weights(None).linearize(context.start)
        root = rows_triangle(lin, loose.in_use[lin.configuration])
        own = loose.column_of[fit.problem.index]
        part = triangle(root[:, np.append(own, loose.n)])
        fitted = one_step(fit.problem, context.start, units[0], lin, part, own)
        if fitted is not None:
            bend = curvature(fit.problem, fit.solution.x, u.covariance * u.factor**2)
            return Linearity(fitted, one_step(loose, context.start, units[0], lin, root), bend)
    return None


@check("linearity", When.FIT, order=190, needs=("proven",))
def doubt_linearity(context: Decision[Model]) -> Iterator[Finding]:
    """What one linear step would have done, where it would mislead."""
    found = linearity_of(context)
    if found is None:
        return

    def amounts(step: Step) -> dict[str, Quantity]:
        return {"promised": Quantity(step.promised, step.unit), "left": Quantity(step.left, step.unit)}

    if found.misleads:
        yield note(Code.NOT_LINEAR, **amounts(found.fitted), before=None)
    if found.ruins and found.everything is not None:
        before = Quantity(found.everything.before, found.fitted.unit)
        yield note(Code.ONE_STEP_MISLEADS, **amounts(found.everything), before=before)
    if found.curvature is not None and found.curvature > CURVATURE:
        yield doubt(Code.CURVED, curvature=found.curvature, parameter=found.curvature_parameter)


GROWTH = declare(
    "residual-grows",
    "{group}: what is left grows along the file, by {size:.3g} from its first row to its last ({share:.0%} of the squared residuals): "
    "something warmed up or settled[; the mean error on unseen measurements is {left:.3g} over the file, and claimed to be {after:.3g} at "
    "its end]",
    "Measure once the machine and the instrument are warm, or record the temperature (a temperature column). Measure a few places of "
    "the beginning again at the end: the difference is the drift.",
)


@check("growth", When.FIT, order=172, needs=("proven",))
def growth(context: Decision[Model]) -> Iterator[Finding]:
    """What drifted along the file, of the instrument that shows most of it: by how much, and which error is claimed at its end."""
    drift = drift_of_file(context)
    if drift is None:
        return
    group, unit, size = largest_growth(context, drift)
    left, after = _claim(context)
    yield doubt(GROWTH, group=group, size=Quantity(size, unit), left=left, after=after, share=drift.share)


def _claim(context: Decision[Model]) -> tuple[Quantity | None, Quantity | None]:
    """The mean error of the first figure of unseen measurements, and the same at the end of the file; None where nothing was unseen."""
    posed, proof = pose_from_lengths(context), context.proof
    if posed is not None and posed.end is not None:
        told = next(s for s in (posed.position.held_out, posed.position.k_fold, posed.position.leave_one_out) if s)
        return Quantity(told.mean), Quantity(posed.end)
    if proof is None or not (counted := context.errors[2]).any():
        return None, None
    after = context.errors[1]
    end = at_end(after, error_growth(context), context.unit)
    return Quantity(float(after[counted].mean()), context.unit), Quantity(float(end[counted].mean()), context.unit)


NAMED = 12  # grid: views of a sentence
WHOLE = {"position": "positions", "orientation": "orientations"}


@once
def unseen_coverage(context: Decision[Model]) -> tuple[Coverage, ...]:
    """Whether the bands of the fit that was judged hold the measurements of configurations that it had not seen."""
    found, held = context.proven.part, context.proven.held_out
    # A pose that is found from the very rows that are to be predicted leaves nothing to predict.
    if not len(held) or found.problem.blocks:
        return ()
    return coverage(row_bands(found.problem, found.solution.x, found.total, held, unmet(found)), found.total.dof)


@check("narrow-bands", When.FIT, order=260, needs=("proven",))
def narrow_bands(context: Decision[Model]) -> Iterator[Finding]:
    """Bands that miss so many unseen measurements as hardly an honest one would."""
    if estimator(context.chosen.method).blind:
        return
    held = context.proven.held_out
    # Visits of one place miss together.
    alone = len(np.unique(context.places[held])) / max(len(held), 1)
    for c in unseen_coverage(context):
        n = round(alone * c.n)
        if c.quantity in WHOLE and scipy.special.bdtr(round(c.whole * n), n, c.level) < BAND_CHANCE:
            yield doubt(Code.BAND_TOO_NARROW, whole=c.whole, n=c.n, quantity=WHOLE[c.quantity])


@check("coverage", When.FIT, order=240, needs=("proven",))
def bands_without_check(context: Decision[Model]) -> Iterator[Finding]:
    """Why the bands were not checked, where they were not."""
    part, held = context.proven.part, context.proven.held_out
    if estimator(context.chosen.method).blind or unseen_coverage(context):
        return
    if part.problem.blocks:
        yield note(Code.BAND_PROFILED)
    elif len(held):
        yield note(Code.BAND_BLIND, names=unmet(part)[:6])
    else:
        yield note(Code.BAND_UNCHECKED)


def unmet(found: Fit) -> tuple[str, ...]:
    """Parameters that no fitted row depends on: a frame that only held-out rows see (a new marker) was fitted to nothing,
    and its rows have no band worth the name. What is nearly unseen is as uncertain as expected, and that is a band."""
    alone = tuple(c.name for c in found.identifiability.combinations if not c.partners)
    some = found.problem.with_free(alone)
    seen = np.diag(some.normal(found.solution.x).a[0]) if some.n else np.zeros(0)
    return tuple(n for n, s in zip(some.free, seen, strict=True) if s == 0)


@once
def outliers(context: Decision[Model]) -> tuple[Outlier, ...]:
    """Rows that are far from a fit to all others, of the fit that excluded more of them."""
    whole, part, best = context.need_fit, context.proven.part, context.proof
    seen = max(whole, part, key=lambda f: f.problem.aside)
    counted = {u: best.errors(u)[2] for u in units_of(context.proven.base.problem)} if best else None
    data, x = context.need_data, seen.solution.x
    away = context.leverage if seen is whole else far_from(data, seen.problem, x, np.arange(len(data.configurations)))
    return name_outliers(context.model, data, seen.problem, x, away, counted)


@check("outliers", When.FIT, order=160, needs=("proven",))
def doubt_outliers(context: Decision[Model]) -> Iterator[Finding]:
    """Rows that were excluded, and rows that are far and were used all the same."""
    for group in dict.fromkeys(o.group for o in outliers(context)):
        mine = [o for o in outliers(context) if o.group == group]
        total = sum(len(t.configuration) for t in context.need_fit.problem.terms if t.group == group)
        for code, some in (
            (Code.OUTLIERS, [o for o in mine if o.set_aside]),
            (Code.STRANGE, [o for o in mine if not o.set_aside]),
        ):
            if some:
                first, far = some[0].configuration, some[0].distance if np.isfinite(some[0].distance) else None
                counted = sum(o.rows for o in some if o.counted) if code is Code.OUTLIERS else 0
                rows, views = sum(o.rows for o in some), [o.configuration for o in some if o.view]
                more = [f"{len(views) - NAMED} more"] if len(views) > NAMED else []
                yield doubt(
                    code, group=group, count=rows, total=total, views=len(views) or None, configuration=first, distance=far,
                    names=(*views[:NAMED], *more) or None, counted=counted or None,
                )  # fmt: skip


@check("views", When.FIT, order=15, needs=("proven",))
def doubt_views(context: Decision[Model]) -> Iterator[Finding]:
    """Views that are exchanged."""
    yield from exchanged_views(context.need_data, outliers(context))

"""The scale of an arm: one factor on all free lengths, which contacts and cameras see only through a stated length.

    delta = s a + noise + R m,    R = I + B (rows of what was fitted),    a = R n
    s = (a^T V^-1 delta) / (a^T V^-1 a),    V = C + R S^2 R^T,    sigma^2 = b^2 / (a^T V^-1 a) = fit^2 + making^2
    b^2 = max(1, chi^2 / (k - 1)),    chi^2 = (delta - s a)^T V^-1 (delta - s a)

delta are the changes of the fitted lengths, n the nominal lengths, C the noise of the fit (that of a stated bar included),
B the estimate's answer to the truth (`Total`: a length that was not fitted shows in its partners), S the errors that
making leaves. An arm errs in each of its lengths on its own; all of them together by a factor that making does not leave
is the length that was stated, or the instrument, not the arm. Where one length alone (column i of R instead of a) explains
delta better, and leaves nothing for a factor beside it, it is that length. Lengths that err by more than S lets them, as where a
prior was stated too tight, say as much less of a factor (b, where chi^2 is no chance; no further than to a sigma of SCALE_WIDEST, or an
arm that was bent to nothing would be as uncertain as it is bent). Generalised least squares: Aitken (1935);
the ratio b: Birge (1932).
"""

from __future__ import annotations

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Level, check_fit_twice, of_remarks, once
from robocal.fit.scale import without_scales
from robocal.measure.base import Rows
from robocal.measure.machine import Model
from robocal.measure.rows import scale_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Scale", "common_scale"]


@record
class Scale:
    """The lengths are 1 + `factor` times the nominal ones, within `sigma`; its parts: what the fit and a stated length leave
    open, and what making leaves. `stated` says that the data have no other scale than a stated length, `common` that the factor
    explains the changes better than one length does, `known` that the scale of every instrument is."""

    factor: float
    sigma: float
    fit: float
    making: float
    stated: bool
    common: bool
    known: bool = False

    @property
    def observable(self) -> bool:
        """Whether the data know it at all."""
        return self.sigma <= limits.SCALE_OPEN

    @property
    def _notable(self) -> bool:
        return self.common and abs(self.factor) > limits.SCALE_LEAST

    @property
    def implausible(self) -> bool:
        """Whether no arm's making leaves that."""
        return (
            self._notable
            and abs(self.factor) > (limits.SCALE_READ_SIGMA if self.known else limits.SCALE_SIGMA) * self.sigma
        )

    @property
    def unusual(self) -> bool:
        """Whether it is not as expected."""
        return self._notable and abs(self.factor) > limits.SCALE_DOUBT_SIGMA * self.sigma

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What is said of it: nothing of a scale that is as expected."""
        numbers = {"factor": self.factor, "sigma": self.sigma}
        if self.stated and not self.observable and not self.implausible:
            return (Remark.of(Code.SCALE_OPEN, sigma=self.sigma),)
        if not self.unusual:
            return ()
        if self.implausible:
            return (Remark.of(Code.SCALE_WRONG, **numbers),)
        return (Remark.of(Code.SCALE_DOUBTED if self.stated else Code.SCALED, **numbers),)


@once
def common_scale(context: Context[Model]) -> Scale | None:
    """The common scale of the lengths that were fitted to everything; None where none was fitted."""
    model, fit, off = context.model, context.need_fit, without_scales(context.need_fit.total)
    table, x = fit.problem.table, fit.solution.x[0]
    fitted = set(fit.problem.free)
    long = [n for n in off.names if n in model.lengths]
    kept = [off.names.index(n) for n in long if n in fitted]
    if not kept:
        return None
    nominal = np.array([model.table[n].value if n in long else 0.0 for n in off.names])
    change = np.array([x[table.index[off.names[i]]] for i in kept]) - nominal[kept]
    shows = (np.eye(len(off.names)) + off.response)[kept]
    size = off.expected[kept]
    a, delta, each = shows @ nominal / size, change / size, shows / size[:, None]
    made = (shows * off.expected if off.root is None else shows @ off.root) / size[:, None]
    making, noise = made @ made.T, off.noise[np.ix_(kept, kept)] / np.outer(size, size)
    values, vectors = np.linalg.eigh(making + noise)
    known = values > 1e-12 * values[-1]
    root = vectors[:, known] / np.sqrt(values[known])
    along, white = root.T @ a, root.T @ delta
    information = float(along @ along)
    if not information > 0:
        return None
    weight = root @ along / information
    common = _common(along, root.T @ each, white)
    narrow = information**-0.5
    wider = min(_wider(white - along * float(weight @ delta)), max(1.0, limits.SCALE_WIDEST / narrow))
    fitted_part, making_part = (wider * float(np.sqrt(max(weight @ c @ weight, 0.0))) for c in (noise, making))
    stated = not any(t.metric for t in fit.problem.terms if isinstance(t, Rows))
    seen = context.need_data.observations
    known = not any(scale_of(o) for o in seen) and (not stated or all(o.scale is not None for o in seen))
    return Scale(float(weight @ delta), wider * narrow, fitted_part, making_part, stated, common, known)


def _wider(left: Array) -> float:
    """How many times as large as expected are the changes (k,) that a factor leaves; 1 where that may be chance."""
    dof, chi2 = len(left) - 1, float(left @ left)
    return float(np.sqrt(chi2 / dof)) if dof > 0 and chi2 > scipy.special.chdtri(dof, limits.SCALE_CHANCE) else 1.0


def _common(factor: Array, each: Array, change: Array) -> bool:
    """Whether one factor explains white changes better than one length does, or is needed beside the best of them."""
    size = np.linalg.norm(each, axis=0)
    alone = np.where(size > 0, np.abs(each.T @ change) / np.where(size > 0, size, 1.0), 0.0)
    best = int(np.argmax(alone))
    if abs(factor @ change) / np.linalg.norm(factor) >= alone[best]:
        return True
    other = each[:, best] / size[best]
    rest = factor - other * (other @ factor)
    left = float(np.linalg.norm(rest))
    return left > 1e-9 * float(np.linalg.norm(factor)) and abs(float(rest @ change)) > limits.SCALE_SIGMA * left


@check_fit_twice(doubt=("scale", 210), refuse=("wrong-scale", 140))
def report_scale(context: Context[Model]) -> list[Finding]:
    """A scale that is open, or worth a remark; of one that no making leaves, what gives it is wrong."""
    scale = common_scale(context)
    return [] if scale is None else of_remarks(scale.remarks, Level.REFUSE if scale.implausible else Level.DOUBT)

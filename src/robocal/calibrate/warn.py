"""What a careful colleague would say about the data and the fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS, parallel_axes
from robocal.calibrate.estimators import estimator
from robocal.calibrate.evidence import SHOWN
from robocal.calibrate.outliers import Outlier
from robocal.geometry import fits
from robocal.measure.data import DataSet

if TYPE_CHECKING:
    from robocal.calibrate.fit import Fit

__all__ = ["common_scale", "data_warnings", "implausible"]

IMPLAUSIBLE = 20.0  # times what was expected: 20 mm, 6 deg
UNLIKE, ALIKE = 5.0, 0.3  # a common scale: how many expected errors it is, and how much of the changes it may leave
LONG = 50.0  # expected errors: lengths that show a scale
DRIFT = 6.0  # standard deviations
FLAT = 0.02  # thickness of the measured points against their extent


def data_warnings(
    model: Chain, data: DataSet, fit: Fit, units: NDArray[np.int64], method: str = "lm", strange: Sequence[Outlier] = ()
) -> tuple[str, ...]:
    """Single-plane data, too few poses, identical poses, restarts, model error far above the stated noise."""
    out = []
    rows = sum(t.scale.size for t in fit.problem.terms)
    known = CONVENTIONS.get(model.convention)
    parallel = parallel_axes(model) if known is not None and not known.complete else ()
    if parallel:
        pairs = ", ".join(f"{a} and {b}" for a, b in parallel)
        out.append(
            f"{model.convention} cannot write a small tilt between the parallel axes {pairs}: use a convention with beta"
        )
    if rows < 2 * fit.problem.n:
        out.append(
            f"few measurements: {rows} numbers for {fit.problem.n} parameters; more poses would narrow the result"
        )
    q = data.configurations.joints
    q = None if q is None else q[np.isfinite(q).all(axis=1)]
    if q is not None and len(q) > 1 and np.ptp(q, axis=0).max(initial=0.0) < 1e-9:
        out.append("all configurations are equal: this shows repeatability, not geometry")
    elif q is not None and len(q) > 1:
        still = [n for n, s in zip(model.joint_names, np.ptp(q, axis=0), strict=True) if s < 1e-9]
        if still:
            out.append(f"these joints never move: {', '.join(still)}")
    for obs in data.observations:
        if obs.kind in ("position", "pose") and len(obs) > 3 and obs.value.ndim == 2:
            points = obs.value[:, :3]
            extent = float(np.linalg.norm(np.ptp(points, axis=0)))
            off = float(np.abs(fits.plane(points)[2]).max())
            if extent > 0 and off < FLAT * extent:
                out.append(
                    f"all points of {obs.label} lie in one plane (within {off * 1e3:.3g} mm): parameters across it are poorly seen"
                )
    for g in fit.groups:
        if g.stated is not None and g.tau > 3 * g.stated and g.unit in SHOWN:
            scale, unit = SHOWN[g.unit]
            out.append(
                f"{g.name}: the model leaves {g.rms * scale:.3g} {unit} per axis where {g.stated * scale:.3g} {unit} of noise was stated; "
                "uncertainties are those of the fit"
            )
    rows_of = [fit.problem.table[n] for n in fit.problem.free]
    if estimator(method).blind and any(p.prior or np.isfinite([p.lower, p.upper]).any() for p in rows_of):
        out.append(f"{method} takes no notice of priors and bounds")
    out.extend(fit.notes)
    out.extend(implausible(model, fit))
    out.extend(_scaled(model, fit))
    out.extend(_outliers(strange, fit))
    out.extend(_drift(fit))
    if fit.restarted:
        out.append(f"the first fit was not acceptable; {fit.restarted} further starts were tried")
    return tuple(out)


def _outliers(strange: Sequence[Outlier], fit: Fit) -> list[str]:
    """Rows that do not belong to the others, counted by instrument."""
    out = []
    for group in dict.fromkeys(o.group for o in strange):
        mine = [o for o in strange if o.group == group]
        total = sum(len(t.unit) for t in fit.problem.terms if t.group == group)
        out.append(
            f"{group}: {len(mine)} of {total} observations lie far outside the noise (the farthest at configuration "
            f"{mine[0].configuration}); a robust loss (--loss huber) gives them less weight"
        )
    return out


def implausible(model: Chain, fit: Fit) -> list[str]:
    """Changes that no arm's making leaves: the nominal model, the order or the signs of the joints are likelier wrong."""
    names = [n for n in fit.problem.free if n in model.geometric]
    table = fit.problem.table
    x = fit.solution.x[0]
    found = []
    for n in names:
        change = abs(x[table.index[n]] - model.table[n].value)
        if change > IMPLAUSIBLE * model.table[n].scale:
            unit, size = ("mm", 1e3) if table[n].unit == "m" else ("deg", 180 / np.pi)
            found.append((change / model.table[n].scale, f"{n} by {change * size:.3g} {unit}"))
    if not found:
        return []
    worst = ", ".join(words for _, words in sorted(found, reverse=True)[:3])
    return [
        f"implausible changes ({worst}): check the nominal model, the order, signs and units of the joints; "
        "a model that is bent to wrong data can fit well and still be wrong elsewhere"
    ]


def common_scale(model: Chain, fit: Fit) -> float:
    """By how much all long free lengths grew together, 0 where they did not: an arm errs in each on its own."""
    table, x = fit.problem.table, fit.solution.x[0]
    names = [n for n in fit.problem.free if n in model.geometric and model.table[n].unit == "m"]
    nominal = np.array([model.table[n].value for n in names])
    change = np.array([x[table.index[n]] for n in names]) - nominal
    expected = np.array([model.table[n].scale for n in names])
    long = np.abs(nominal) > LONG * expected
    if long.sum() < 2:
        return 0.0
    a, b = nominal[long] / expected[long], change[long] / expected[long]
    factor = float(a @ b / (a @ a))
    # How far one factor is from none, in expected errors of the lengths, and how much of the changes it leaves.
    if abs(factor) * np.linalg.norm(a) < UNLIKE or np.linalg.norm(b - factor * a) > ALIKE * np.linalg.norm(b):
        return 0.0
    return factor


def _scaled(model: Chain, fit: Fit) -> list[str]:
    """All lengths longer or shorter by one factor: that is no arm, but the length that gave the scale."""
    factor = common_scale(model, fit)
    if not factor:
        return []
    return [
        f"the free lengths all change by {factor:+.2%}: an arm errs in each on its own; check the distance, bar, radius or "
        "speed that gives the scale, and its unit"
    ]


def _drift(fit: Fit) -> list[str]:
    """Residuals that resemble those measured just before: something moved while measuring, or like poses were grouped."""
    out = []
    for r in fit.problem.residuals(fit.solution.x):
        w = (r.value * r.scale)[np.argsort(r.unit, kind="stable")]
        if len(w) < 20 or not (w * w).sum() > 0:
            continue
        # Under independence the normalised lag-one product has a variance of one over its number of terms.
        z = float((w[1:] * w[:-1]).sum() / (w * w).sum() * np.sqrt(w.size))
        if z > DRIFT:
            out.append(
                f"{r.group}: errors follow those measured just before (z = {z:.0f}): a target that slipped, an instrument or arm "
                "that warmed up, or like poses measured together; held-out errors may then flatter"
            )
    return out

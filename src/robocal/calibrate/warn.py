"""What a careful colleague would say about the data and the fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS, parallel_axes
from robocal.geometry import fits
from robocal.measure.data import DataSet

if TYPE_CHECKING:
    from robocal.calibrate.fit import Fit

__all__ = ["data_warnings"]

FLAT = 0.02  # thickness of the measured points against their extent


def data_warnings(
    model: Chain, data: DataSet, fit: Fit, units: NDArray[np.int64], method: str = "lm"
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
        if g.stated is not None and g.tau > 3 * g.stated and g.unit in ("m", "rad"):
            scale, unit = (1e3, "mm") if g.unit == "m" else (180 / np.pi, "deg")
            out.append(
                f"{g.name}: the model leaves {g.rms * scale:.3g} {unit} per axis where {g.stated * scale:.3g} {unit} of noise was stated; "
                "uncertainties are those of the fit"
            )
    rows_of = [fit.problem.table[n] for n in fit.problem.free]
    if method in ("pinv", "lse") and any(p.prior or np.isfinite([p.lower, p.upper]).any() for p in rows_of):
        out.append(f"{method} takes no notice of priors and bounds")
    out.extend(_outliers(data, fit))
    if fit.restarted:
        out.append(f"the first fit was not acceptable; {fit.restarted} further starts were tried")
    return tuple(out)


def _outliers(data: DataSet, fit: Fit) -> list[str]:
    """Observations so far from the fit that Gaussian noise would show fewer than one of them in a hundred data sets."""
    out = []
    rows: dict[str, list[tuple[NDArray[np.float64], NDArray[np.int64], int]]] = {}
    for r in fit.problem.residuals(fit.solution.x):
        whitened = np.sum((r.value * r.scale) ** 2, axis=1)
        rows.setdefault(r.group, []).append((whitened, r.unit, r.value.shape[1]))
    for group, parts in rows.items():
        total = sum(len(w) for w, _, _ in parts)
        far = [
            (float(w[i]), int(u[i])) for w, u, d in parts for i in np.flatnonzero(w > special.chdtri(d, 0.01 / total))
        ]
        if far:
            worst = data.configurations.ids[max(far)[1]]
            out.append(
                f"{group}: {len(far)} of {total} observations lie far outside the noise (the farthest at configuration {worst}); "
                "a robust loss (--loss huber) gives them less weight"
            )
    return out

"""What each group of sensors, and what was stated beforehand, says of the others.

A group of sensors is asked by its chi2 against its own noise. What was stated of a lens, a place, a print or the robot is a sensor too:

    chi2 = d^T (S - C)^-1 d        of what moved, d, from its stated values of covariance S

C is the covariance after the fit, so that S - C is that of the way which the others may move it. Only directions count of which the
others say something; each is a degree of freedom. The rms of a group is told as a length at the machine: of pixels, at the distance of
the points that they show.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.fit.fit import Fit
from robocal.measure.machine import Model
from robocal.measure.pixels import PixelRows
from robocal.parameters import FRAME_SYMBOLS, ParameterTable
from robocal.prove.decision import Decision

__all__ = ["GroupAgreement", "agreement_of"]

LEAST = 0.3  # tolerance: of the prior: where data say less, a model that is not linear may have moved it as far
ROBOT = "robot"


@record
class GroupAgreement:
    """A group, its kind, how many numbers it states, its chi2 and degrees of freedom, its rms as a length (m), and of what was stated
    the number that is farthest off and by how many sigma; None where there is none."""

    name: str
    kind: str
    n: int
    chi2: float | None
    dof: float
    length: float | None = None
    unit: str = "m"
    farthest: str = ""
    z: float | None = None


def agreement_of(made: Decision[Model]) -> tuple[GroupAgreement, ...]:
    """The sensors in the order of the fit, then what was stated, by owner."""
    fit = made.need_fit
    lengths = _lengths(fit)
    sensors = (
        GroupAgreement(g.name, g.kind, g.n, g.chi2, g.dof, lengths.get(g.name, g.rms if g.unit == "m" else None))
        for g in fit.groups
    )
    return (*sensors, *_stated(made.model, fit))


def _lengths(fit: Fit) -> dict[str, float]:
    """Rms of pixels as lengths at the points that they show, by group."""
    x = fit.solution.x
    found: dict[str, list[Array]] = {}
    for term, r in zip(fit.problem.terms, fit.problem.residuals(fit.solution.x), strict=True):
        if isinstance(term, PixelRows):
            across = r.value * term.metres_per_pixel(x)[:, None]
            found.setdefault(r.group, []).append(across[term.used].ravel())
    return {name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) for name, parts in found.items()}


def _stated(model: Model, fit: Fit) -> list[GroupAgreement]:
    """What was stated of numbers that are free."""
    table, total, moved = fit.problem.table, fit.total, fit.problem.difference(fit.solution.x)[0]
    change = dict(zip(fit.problem.free, moved.tolist(), strict=True))
    owners: dict[str, list[str]] = {}
    for name in total.names:
        if name in change and table[name].prior is not None and table[name].prior_informs:
            owners.setdefault(ROBOT if name in model.table else name.rpartition(".")[0], []).append(name)
    cameras = {str(o.options.get("camera", "")) for o in fit.data.observations}
    out = []
    for owner, names in owners.items():
        at = [total.names.index(n) for n in names]
        before, after = _prior(table, names), total.covariance[np.ix_(at, at)]
        d, sigma = np.array([change[n] for n in names]), np.sqrt(np.diag(before))
        chi2, dof = _contradiction(d / sigma, before / np.outer(sigma, sigma), after / np.outer(sigma, sigma))
        way = np.sqrt(np.maximum(1 - np.diag(after) / sigma**2, LEAST**2))
        z = np.abs(d) / sigma / way
        far = int(np.argmax(z))
        symbol = names[0].rpartition(".")[2]
        kind = (
            "robot"
            if owner == ROBOT
            else "lens"
            if owner in cameras
            else "place"
            if symbol in FRAME_SYMBOLS
            else "size"
        )
        out.append(GroupAgreement(owner, kind, len(names), chi2, dof, farthest=names[far], z=float(z[far])))
    return out


def _prior(table: ParameterTable, names: list[str]) -> Array:
    """The covariance (k, k) of what was stated of these names."""
    out = np.diag([float(table[n].prior or 0.0) ** 2 for n in names])
    for shared in table.together:
        mine = [(i, shared.names.index(n)) for i, n in enumerate(names) if n in shared.names]
        if mine:
            own, theirs = zip(*mine, strict=True)
            out[np.ix_(own, own)] = np.array(shared.covariance)[np.ix_(theirs, theirs)]
    return out


def _contradiction(d: Array, before: Array, after: Array) -> tuple[float, float]:
    """Chi2 and degrees of freedom of a change d (k,) between two covariances (k, k), in units of the first's sigmas."""
    root = np.linalg.cholesky(before)
    white = np.linalg.solve(root, d)
    half = np.linalg.solve(root, before - after)
    share, along = np.linalg.eigh(np.linalg.solve(root, half.T))
    told = share > LEAST**2
    return float(np.sum((white @ along[:, told]) ** 2 / share[told])), float(told.sum())

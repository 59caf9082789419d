"""Motions of the frames in which a machine is told that nothing measured shows: where its base lies, or which way it looks.

Such a motion m of the machine's parameters, with whatever change c of the other columns (an instrument's frame, the zero of an
encoder) goes along with it, leaves every residual where it was: R_m m + R_c c = 0 with R^T R = J^T J.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._types import Array
from robocal.diagnose.check_registry import Context, Finding, Level, Machines, When, check, doubt, of_remarks
from robocal.diagnose.limits import MOTION_UNSEEN
from robocal.estimate.identifiability import Identifiability
from robocal.fit.fit import Fit
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["describe_motions", "lacking", "open_motions", "open_remarks"]

ABSOLUTE = ("position", "pose")  # kinds that read coordinates
DEPENDENT = 1e-6  # tolerance: of a motion of length 1, what others leave of it


def open_motions(model: Model, seen: Identifiability) -> dict[str, Array]:
    """The motions of a machine that its data cannot tell, by what people call them, with their rates of what is free (n,); none of
    them follows from those before it."""
    names = {n: i for i, n in enumerate(seen.names)}
    table = seen.problem.table
    there = model.with_values({n: float(seen.x[0, table.index[n]]) for n in model.table.names if n in table})
    others = [i for n, i in names.items() if n not in model.table]
    # A motion of which a part is held is not open.
    every = () if there.mechanism is None else there.mechanism.motions.items()
    whole = [(what, rates) for what, rates in every if set(rates) <= set(names)]
    rows = np.zeros((len(whole), len(seen.names)))
    for row, (_, rates) in zip(rows, whole, strict=True):
        row[[names[n] for n in rates]] = list(rates.values())
        row /= np.linalg.norm(row)
    beside = seen.root @ rows.T
    if others and whole:
        beside -= seen.root[:, others] @ np.linalg.lstsq(seen.root[:, others], beside, rcond=1e-12)[0]
    out: dict[str, Array] = {}
    span = np.zeros((len(seen.names), 0))
    for (what, rates), rate, left in zip(whole, rows, beside.T, strict=True):
        new = rate - span @ (span.T @ rate)
        size = float(np.linalg.norm(seen.root[:, [names[n] for n in rates]]))
        if size > 0 and np.linalg.norm(left) <= MOTION_UNSEEN * size and np.linalg.norm(new) > DEPENDENT:
            span = np.column_stack([span, new / np.linalg.norm(new)])
            out[what] = rate
    return out


def open_remarks(model: Model, fit: Fit) -> tuple[Remark, ...]:
    """What is said of them: which, and the parameters that stay where they were for it."""
    motions = tuple(open_motions(model, fit.identifiability))
    if not motions:
        return ()
    out = [describe_motions(model, fit.identifiability, motions)]
    sigma, expected = _bare(model, fit, motions)
    if len(sigma) and np.median(sigma) > expected and lacking(model, fit) is None:
        low, high, usual = (Quantity(float(v)) for v in (sigma.min(), sigma.max(), expected))
        out.append(Remark.of(Code.WORSE_THAN_UNMEASURED, count=len(motions), low=low, high=high, expected=usual))
    return tuple(out)


def describe_motions(model: Model, seen: Identifiability, motions: tuple[str, ...]) -> Remark:
    """Which motions are open, and what stays where it was for it."""
    held = tuple(n for n in seen.dropped if n in model.table)
    return Remark.of(Code.MOTIONS_UNSEEN, motions=motions, count=len(motions), held=held)


def lacking(model: Model, fit: Fit) -> Remark | None:
    """What refuses a fit whose configurations leave fewer numbers, beyond their own poses, than there are to be found; None where
    they suffice or priors that were stated fill the gap."""
    seen, problem = fit.identifiability, fit.problem
    moves = model.mechanism is not None and model.mechanism.motions
    if not (problem.families and moves and seen.names) or problem.has_prior.any():
        return None
    used = problem.numbers > 0
    unknown, over = len(seen.names) - len(open_motions(model, seen)), fit.spare
    left = int(over[used].sum())
    if left >= unknown or not used.any():
        return None
    each = float(over[used].mean())
    needed = int(np.ceil(unknown / each)) if each > 0 else None
    return Remark.of(Code.TOO_FEW_POSES, poses=int(used.sum()), left=max(left, 0), unknown=unknown, needed=needed)


def _bare(model: Model, fit: Fit, motions: tuple[str, ...]) -> tuple[Array, float]:
    """Standard deviations (m) of what the measurements alone tell of a machine's own lengths where as many numbers are held as there
    are open motions, chosen by QR with pivoting; and the error that was expected of them before."""
    from scipy.linalg import qr

    seen, table = fit.identifiability, fit.problem.table
    scaled = seen.root / np.maximum(np.linalg.norm(seen.root, axis=0), 1e-300)
    chosen = qr(scaled, mode="r", pivoting=True)[1][: len(seen.names) - len(motions)]
    sigma = np.sqrt((np.linalg.pinv(seen.root[:, chosen], rcond=1e-14) ** 2).sum(axis=1))
    rows = [table[seen.names[i]] for i in chosen]
    own = [k for k, p in enumerate(rows) if p.name in model.geometric and p.unit == "m" and p.expected]
    return sigma[own], float(np.median([rows[k].expected for k in own])) if own else np.inf


@check("place", When.FIT, order=110, machines=Machines.POSED, needs=("fit",))
def open_place(context: Context[Model]) -> Iterator[Finding]:
    """A machine that stands where its own sensors say has coordinates only as far as something sees them."""
    if not any(o.frame or o.targets or o.kind in ABSOLUTE for o in context.need_data.observations):
        yield doubt(Code.PLACE_OPEN)


@check("open-motions", When.FIT, order=120, needs=("fit",))
def doubt_motions(context: Context[Model]) -> Iterator[Finding]:
    """Motions of the whole machine that its own sensors cannot see."""
    yield from of_remarks(open_remarks(context.model, context.need_fit), Level.DOUBT)


@check("too-few-poses", When.PROOF, order=130, needs=("fit",))
def too_few_poses(context: Context[Model]) -> Iterator[Finding]:
    """Configurations that leave fewer numbers than there are to be found."""
    few = lacking(context.model, context.need_fit)
    if few is not None:
        yield from of_remarks((few,), Level.REFUSE)

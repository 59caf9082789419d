"""Numbers of a machine that nobody freed, such as the anchors on a platform: which kind of them explains what a fit leaves.

All numbers of one kind (`bx, by, bz` of every cable) are one step: with Q an orthonormal basis of what was fitted and of local poses, and
C_ = (I - Q Q^T) C of theirs, each held softly,

    share = |P r|^2 / |r|^2,    P the projection on the columns of C_
"""

from __future__ import annotations

import numpy as np

from robocal import _scipy as scipy
from robocal._types import Array
from robocal.diagnose.check_registry import Context, once
from robocal.diagnose.limits import NUMBER_SHARE, SCALE_CHANCE
from robocal.diagnose.stated_numbers import HOLD
from robocal.estimate.elimination import beside_blocks, block_columns
from robocal.measure.machine import Model

__all__ = ["names_to_free"]

AXES = "xyz"
HIDDEN = 1e-6  # tolerance: of a column that those fitted leave over: rounding


@once
def names_to_free(context: Context[Model]) -> str | None:
    """The names to free in place of those that were, where a kind of held number explains most, and much, of what is left; None where
    none does."""
    fit, model = context.need_fit, context.model
    free = fit.identifiability.names
    held = [n for n in model.geometric if n not in free]
    if not held or fit.problem.loss != "none":
        return None
    made = fit.problem.with_free([*fit.problem.free, *held])
    lin = made.linearize(fit.solution.x)
    _, left = beside_blocks(lin)
    fitted = np.isin(made.free, fit.problem.free)
    soft = made.scales * HOLD
    q = _basis(left[:, fitted], soft[fitted])
    r = np.concatenate([lin.r, np.zeros(int(fitted.sum()))])
    best, most = "", NUMBER_SHARE
    kinds: dict[str, list[int]] = {}
    for i in np.flatnonzero(~fitted):
        if np.linalg.norm(left[:, i]) > 0:
            kinds.setdefault(_kind(made.free[i]), []).append(int(i))
    for kind, some in kinds.items():
        c = np.vstack([left[:, some], np.zeros((int(fitted.sum()), len(some)))])
        c = c - q @ (q.T @ c)
        c = c[:, np.linalg.norm(c, axis=0) > HIDDEN * np.linalg.norm(left[:, some], axis=0)]
        along = np.linalg.lstsq(c, r, rcond=HIDDEN)[0]
        share = float(1 - np.linalg.norm(r - c @ along) ** 2 / (r @ r))
        dof = len(lin.r) - made.repeated - block_columns(lin) - int(fitted.sum()) - c.shape[1]
        if (
            dof > 0
            and share > most
            and scipy.special.fdtrc(c.shape[1], dof, share / (1 - share) * dof / c.shape[1]) < SCALE_CHANCE
        ):
            best, most = kind, share
    if not best:
        return None
    names = [n for n in (*free, *(made.free[i] for i in kinds[best])) if n in model.table]
    return ",".join(dict.fromkeys(_short(model, names)))


def _basis(j: Array, soft: Array) -> Array:
    return np.asarray(np.linalg.qr(np.vstack([j, np.diag(1 / soft)]))[0])


def _kind(name: str) -> str:
    """What a number is called but for its owner and its axis."""
    return name.rpartition(".")[2].rstrip(AXES) or name.rpartition(".")[2]


def _short(model: Model, names: list[str]) -> list[str]:
    """Symbols of which all owners are named, else the names themselves."""
    every = [n for n in model.geometric if n in model.table]
    out = []
    for name in names:
        symbol = name.rpartition(".")[2]
        whole = {n for n in every if n.rpartition(".")[2] == symbol} <= set(names)
        out.append(symbol if whole else name)
    return out

"""Parts of result.json that stand beside an identification: how linear it was, and what other estimators make of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from robocal.files.parts import Number
from robocal.quantities import Amount, Mean, ShownUnit

__all__ = ["Compared", "Comparison", "LinearStep", "Linearity"]


@dataclass(frozen=True, kw_only=True)
class LinearStep:
    """One linear step, rms per component: before, what the linear equation promises, what the model leaves, the neglected
    terms of second order and beyond, and their share of the step's effect."""

    before: Amount | None
    promised: Amount | None
    left: Amount | None
    neglected: Amount | None
    share: Number
    noise: Amount | None


@dataclass(frozen=True, kw_only=True)
class Linearity:
    """One linear step from the baseline in the fitted parameters and in everything free (no priors), and the largest
    relative curvature within one sigma of the solution, with the parameter that such a step moves most."""

    unit: ShownUnit
    fitted: LinearStep
    everything: LinearStep | None = None
    curvature: Number = None
    curvature_parameter: str = ""
    misleads: bool = False
    ruins: bool = False


@dataclass(frozen=True, kw_only=True)
class Compared:
    """One estimator: mean errors, verdict, the parameter that ends farthest from the reference in sigmas, seconds; stopped: it
    ended without converging; failed says why there is nothing."""

    method: str
    title: str
    verdict: Literal["improved", "not_improved", "refused", ""] = ""
    reason: str = ""
    stopped: bool = False
    after: Mean | None = None
    held_out: Mean | None = None
    leave_one_out: Mean | None = None
    k_fold: Mean | None = None
    farthest: str = ""
    sigmas: Number = None
    seconds: Number = None
    failed: str = ""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Estimators on the same data and split, the reference first, with the frames-only model and predicting the mean."""

    unit: ShownUnit
    reference: str
    methods: list[Compared] = field(default_factory=list)
    before: Mean | None = None
    held_out_before: Mean | None = None
    leave_one_out_before: Mean | None = None
    constant: Mean | None = None
    k_fold_before: Mean | None = None

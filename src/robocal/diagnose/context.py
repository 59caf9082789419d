"""What checks look at: a machine, its data and a fit to them, with everything that several checks ask, computed once.

What a check needs is loaded when it is asked for: rows of a file are checked long before anything is fitted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch

if TYPE_CHECKING:
    from robocal.diagnose.studentised import StudentisedResiduals
    from robocal.estimate.terms import Linear, Residuals
    from robocal.estimate.uncertainty import Total
    from robocal.fit.baseline import Baseline
    from robocal.fit.fit import Fit
    from robocal.fit.options import Options

__all__ = ["Context", "M_co", "once"]

M_co = TypeVar("M_co", bound=Model, covariant=True)
C = TypeVar("C", bound="Context[Model]")
T = TypeVar("T")


@dataclass(frozen=True)
class Context(Generic[M_co]):
    """A machine, and what there is beside it: measurements, the baseline, a fit to all of them with its options."""

    model: M_co
    data: DataSet | None = None
    base: Baseline | None = None
    fit: Fit | None = None
    options: Options | None = None
    watch: Watch | None = field(default=None, compare=False)
    memo: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)  # what `once` has computed

    @property
    def improvement(self) -> bool:
        """Whether unseen measurements prove a gain: not known before there is a proof."""
        return False

    @property
    def need_data(self) -> DataSet:
        """The data, where there must be some."""
        assert self.data is not None
        return self.data

    @property
    def need_fit(self) -> Fit:
        """The fit, where there must be one."""
        assert self.fit is not None
        return self.fit

    @cached_property
    def residuals(self) -> list[Residuals]:
        """What the fit leaves of every term, (m, d)."""
        return self.need_fit.problem.residuals(self.need_fit.solution.x)

    @cached_property
    def jacobian(self) -> Linear:
        """The whitened rows of the fit at its solution, and their Jacobian."""
        return self.need_fit.problem.linearize(self.need_fit.solution.x)

    @cached_property
    def leverage(self) -> StudentisedResiduals:
        """How far every row is from the fit without it, and its leverage."""
        from robocal.diagnose.studentised import far_from

        data = self.need_data
        return far_from(data, self.need_fit.problem, self.need_fit.solution.x, np.arange(len(data.configurations)))

    @cached_property
    def rates(self) -> tuple[Array, bool] | None:
        """The rate of every joint along a path, (m, n), and whether it is per second; None where there is no path."""
        from robocal.diagnose.paths import joint_rates

        return joint_rates(self.need_fit.data.configurations)

    @cached_property
    def places(self) -> NDArray[np.int64]:
        """A number for every configuration, equal where the machine stood at the same place."""
        from robocal.fit.repeats import places

        return places(self.need_data.configurations)

    @property
    def total(self) -> Total:
        """What the parameters may be off by, hidden partners included."""
        return self.need_fit.total

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters: of the fit, else of the baseline."""
        if self.fit is not None:
            names, x = self.fit.problem.table.names, self.fit.solution.x
        else:
            assert self.base is not None
            names, x = self.base.problem.table.names, self.base.x
        return dict(zip(names, map(float, x[0]), strict=False))

    @property
    def numbers(self) -> tuple[int, int]:
        """How many numbers were measured, and how many parameters are looked for."""
        if self.fit is not None:
            return int(self.fit.problem.numbers.sum()), self.fit.problem.n
        free = 0 if self.base is None else len(self.base.problem.table.free)
        return sum(o.value.size for o in self.need_data.observations), free


def once(make: Callable[[C], T]) -> Callable[[C], T]:
    """A function of a context that is computed once for each context."""
    key = f"{make.__module__}.{make.__qualname__}"

    @wraps(make)
    def recall(context: C) -> T:
        if key not in context.memo:
            context.memo[key] = make(context)
        known: T = context.memo[key]
        return known

    return recall

"""What an identification returns: the corrected model with all of its evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.diagnose.check_registry import Finding
from robocal.diagnose.outliers import Outlier
from robocal.diagnose.scale import Scale
from robocal.diagnose.scatter import WhitenedRows
from robocal.estimate.identifiability import Identifiability
from robocal.estimate.least_squares import Reason
from robocal.estimate.uncertainty import Total
from robocal.fit.noise import NoiseGroup
from robocal.fit.options import Options
from robocal.measure.machine import Model
from robocal.parameters import ParameterTable
from robocal.prove.beside_verdict import Linearity
from robocal.prove.bootstrap import Resampled
from robocal.prove.offsets import OffsetsAlone
from robocal.prove.region import Holds
from robocal.prove.statistics import Coverage, Stages
from robocal.prove.verdict import Verdict
from robocal.remarks.remark import Remark

__all__ = ["Band", "Identification", "ParameterResult", "RowTable"]

M_co = TypeVar("M_co", bound=Model, covariant=True)


@dataclass(frozen=True)
class ParameterResult:
    """One parameter before and after (SI).

    `sigma` is as fitted and includes what its hidden partners may be off by; `sigma_conditional` would hold if every
    dropped parameter were exactly at its nominal value, `sigma_instrument` if the stated noise were all there is as well.
    """

    name: str
    unit: str
    nominal: float
    identified: float
    delta: float  # identified minus nominal; sigma and interval are of the same number
    sigma: float | None
    sigma_instrument: float | None
    sigma_conditional: float | None
    status: str  # identified | prior | dropped | fixed
    data_share: float | None
    remarks: tuple[Remark, ...] = ()
    interval: tuple[float, float] | None = None  # 95 %, from `sigma`
    expected: float | None = None  # standard deviation of its error before anything was measured

    @property
    def note(self) -> str:
        """The remarks in one line."""
        return "; ".join(map(str, self.remarks))


@dataclass(frozen=True)
class Band:
    """Predicted error of the identified model away from the data: one standard deviation over sampled joint
    configurations (m), `left` (m) of it at every pose: what the model does not describe."""

    mean: float
    p95: float
    max: float
    n: int
    region: str
    left: float = 0.0


@dataclass(frozen=True)
class RowTable:
    """One row per observation, SI: what residuals.csv and the pictures are made of."""

    configuration: tuple[str, ...]
    held_out: NDArray[np.bool_]
    group: tuple[str, ...]
    kind: tuple[str, ...]
    target: tuple[str, ...]
    place: Array  # (N, 3) predicted position, NaN where the kind has none
    before: Array  # (N, d) residual of the baseline
    after: Array  # (N, d) residual of the identified model, from the fit that had not seen it when held out
    parts: tuple[tuple[tuple[int, int, str], ...], ...]
    unseen: Array  # (N,) error when not used for fitting: held out or left one out, NaN otherwise
    unseen_turn: Array  # (N,) [rad] the same of its angle, NaN where it has none
    aside: NDArray[np.bool_]  # (N,) gross rows: neither fitted nor in the means of held-out ones
    mark: NDArray[np.uint64]  # (N,) which measurement it is, in whatever file


@dataclass(frozen=True)
class Identification(Generic[M_co]):
    """Nominal and corrected model, per-parameter results, identifiability, errors, noise groups, verdict and recipe."""

    nominal: M_co
    corrected: M_co
    table: ParameterTable  # of the whole problem, at the solution
    options: Options
    parameters: tuple[ParameterResult, ...]
    identifiability: Identifiability
    stages: tuple[Stages, ...]
    groups: tuple[NoiseGroup, ...]
    verdict: Verdict
    rows: RowTable
    fit_ids: tuple[str, ...]
    held_out_ids: tuple[str, ...]
    iterations: int
    reason: Reason
    history: tuple[float, ...]
    chi2: float
    dof: int
    correlation_names: tuple[str, ...]
    correlation: Array
    covariance: Array  # as fitted, of correlation_names
    band: Band | None
    findings: tuple[Finding, ...] = ()  # doubts and notes beside the verdict
    embargoed_ids: tuple[str, ...] = ()  # neither fitted nor held out: tied to what is held out
    how: str = ""  # in words, how the unseen measurements were chosen
    extra: Mapping[str, object] = field(default_factory=dict)
    total: Total | None = None  # what the parameters may be off by, hidden partners included
    baseline: ParameterTable | None = None  # the nominal model with frames and tool fitted
    coverage: tuple[Coverage, ...] = ()  # of the bands, on what was held out
    joints: Array | None = None  # (n, 2) the range in which each joint was measured
    linearity: Linearity | None = None  # what one linear step would have done
    outliers: tuple[Outlier, ...] = ()
    conditions: Mapping[str, float] = field(default_factory=dict)  # mean of every other recorded column
    resampled: Resampled | None = None  # the bootstrap, where it was asked for
    offsets: OffsetsAlone | None = None  # the joint offsets alone; None where no joint's zero may move
    holds: Holds | None = None  # over the working range
    scale: Scale | None = None  # of the fitted lengths, all together
    whitened_rows: WhitenedRows | None = None  # the rows at the solution, for a comparison with another run

    @property
    def warnings(self) -> tuple[Remark, ...]:
        """The doubts and notes for people."""
        return tuple(f.remark for f in self.findings)

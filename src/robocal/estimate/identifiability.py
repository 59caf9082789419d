"""What the data can tell: rank, the columns to keep, and the combinations in which the others hide.

The whitened Jacobian is scaled column by column with the error expected of that parameter without data (or its stated
prior), and divided by the noise as fitted. A singular value s of that matrix then says: the data know this
combination to 1 / s of what was expected. A combination is *seen* when s exceeds SEEN = 1, so the decision is
relative to the measurement noise and never to machine precision. Columns are kept by QR with pivoting on the same
matrix with the stated priors as further rows, which count like any others: a prior on one column also keeps those that
hide behind it. What is left over is dropped and stays at its nominal value. Which of several columns that say the same is kept
is then a matter of preference (`Parameter.preference`): a kept column is exchanged for a preferred one wherever nothing
that was seen is lost by it. References: Pashkevich, Computer-aided generation
of complete irreducible models (2011); Gautier and Khalil (1990) for base parameters; Borm and Menq (1991), Driels and
Pathre (1990), Nahvi and Hollerbach (1996), Sun and Hollerbach (2008) for the observability indices.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.estimate.choosing.choice import OBSERVABLE, STRUCTURAL, Choice, Combination, chosen
from robocal.estimate.elimination import Squares, squares
from robocal.estimate.problem import Problem

__all__ = ["OBSERVABLE", "Combination", "Identifiability", "analyse", "observability"]

ROUNDING = 1e-12
# Of what is known of a parameter, from data: 1 - 1/4, so its sigma is half of what was expected.
CLAIM = 0.75  # tolerance: see above


@record
class Identifiability:
    """What the free columns of a `problem` mean at x (1, P), where `root` (n, n) is R with R^T R = J^T J and `noise` multiplies the
    stated sigma: rank relative to noise, structural rank, kept and dropped names, singular values (scaled, descending), indices
    O1 to O5. Each is worked out when it is asked for.

    `fitted` is the choice that a fit has made before; else what is kept is chosen here: seen above `level`.
    """

    problem: Problem
    x: Array
    root: Array
    noise: float = 1.0
    level: float = OBSERVABLE
    fitted: Choice | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The free columns."""
        return self.problem.free

    @property
    def basis(self) -> tuple[str, ...]:
        """The names that are kept."""
        return self._choice.basis

    @property
    def dropped(self) -> tuple[str, ...]:
        """The names that stay where they are."""
        return self._choice.dropped

    @property
    def loose(self) -> tuple[str, ...]:
        """Those of them that nothing but what is expected of them holds."""
        return self._choice.loose

    @property
    def combinations(self) -> tuple[Combination, ...]:
        """What takes the place of every dropped name."""
        return self._choice.combinations

    @property
    def _choice(self) -> Choice:
        return self.fitted or self._own

    @cached_property
    def _own(self) -> Choice:
        return chosen(self.problem, self.x, self._root, self.level)

    @cached_property
    def _root(self) -> Array:
        return np.asarray(self.root / self.noise)

    @cached_property
    def _spectrum(self) -> tuple[Array, Array]:
        """Singular values (k,) and vectors (k, n) in units of what is expected."""
        if not self.problem.n:
            return np.zeros(0), np.zeros((0, 0))
        _, values, vt = np.linalg.svd(self._root @ self.problem.spread_root)
        return values, vt

    @property
    def singular_values(self) -> Array:
        """Scaled, descending."""
        return self._spectrum[0]

    @property
    def rank(self) -> int:
        """Of what is seen above the noise."""
        return int((self._spectrum[0] > self.level).sum())

    @property
    def blind(self) -> bool:
        """Whether nothing is seen above the noise: no column by itself, nor several together."""
        alone = np.linalg.norm(self._root @ self.problem.spread_root, axis=0)
        return not alone.max(initial=0.0) > self.level and self.rank == 0

    @cached_property
    def structural_rank(self) -> int:
        """Of what is not exactly dependent to first order."""
        scaled = self._root * self.problem.scales
        norms = np.linalg.norm(scaled, axis=0)
        # A column that is nothing but rounding counts as zero.
        unit = scaled / np.where(norms > ROUNDING * norms.max(initial=0.0), norms, np.inf)
        ones = _singular(unit)
        return int((ones > STRUCTURAL * max(ones.max(initial=0.0), 1e-300)).sum())

    @cached_property
    def _final(self) -> Array:
        return _singular((self._root * self.problem.scales)[:, list(self._own.at)])

    @property
    def condition(self) -> float:
        """Of the scaled columns that are kept."""
        final = self._final
        return float(final[0] / final[-1]) if len(final) and final[-1] > 0 else float("inf")

    @property
    def indices(self) -> dict[str, float]:
        """O1 to O5."""
        return observability(self._final, int((self.problem.numbers[self.problem.in_use] > 0).sum()))

    @cached_property
    def posterior(self) -> Array:
        """The covariance (n, n) in SI of the expected errors and the data, with all other parameters unknown too."""
        # (S^T S + I)^-1 from the singular values: squaring S would lose what is known to better than 1e-8 of what was
        # expected.
        (values, vt), expected = self._spectrum, self.problem.spread_root
        return np.asarray(expected @ (vt.T / (1.0 + values**2)) @ vt @ expected.T)

    @property
    def share(self) -> Array:
        """The part (n,) of each parameter's knowledge that comes from data: 1 - (posterior / expected sigma)^2."""
        return np.asarray(1.0 - np.diag(self.posterior) / self.problem.scales**2)

    @property
    def identified(self) -> tuple[str, ...]:
        """The parameters that the data, with everything else unknown too, narrow to half of what was expected."""
        return tuple(n for n, s in zip(self.names, self.share, strict=True) if s >= CLAIM)


def _singular(matrix: Array) -> Array:
    return np.asarray(np.linalg.svd(matrix, compute_uv=False)) if matrix.shape[1] else np.zeros(0)


def observability(values: Array, poses: int) -> dict[str, float]:
    """O1 to O5 of singular values (descending) of the scaled Jacobian of so many poses."""
    if not len(values) or values[-1] <= 0:
        return dict.fromkeys(("O1", "O2", "O3", "O4", "O5"), 0.0)
    return {
        "O1": float(np.exp(np.log(values).mean()) / np.sqrt(poses)),
        "O2": float(values[-1] / values[0]),
        "O3": float(values[-1]),
        "O4": float(values[-1] ** 2 / values[0]),
        "O5": float(1 / np.sum(1 / values)),
    }


def analyse(
    problem: Problem, x: Array, *, noise: float = 1.0, seen: float = OBSERVABLE, known: Squares | None = None
) -> Identifiability:
    """What the free columns of a problem mean at x; `noise` multiplies the stated sigma (sqrt(chi2 / dof) when the
    model leaves more).

    Rank, singular values, indices and shares describe the data in units of the expected errors; what is kept is seen by data and
    stated priors together. So what has a prior is always kept, unless that is so wide that it says nothing
    (`Parameter.believed`). `known` are the squares of the free columns at x, where the caller has them.
    """
    # What is weighed down by a loss says as much as anything else of what could be seen.
    rows = squares(problem.with_loss("none"), x) if known is None or problem.loss != "none" else known
    return Identifiability(problem, np.atleast_2d(x), rows.root, noise, seen)

"""What makes one set of measurements better than another: functions of the information matrix M, larger is better.

    D    log det M                              O1   as D (the geometric mean of the singular values)
    A    -trace M^-1                            O2   s_min / s_max
    I    -mean_t trace T_t M^-1 T_t^T           O3   s_min
    G    -max_t  trace T_t M^-1 T_t^T           O4   s_min^2 / s_max
    E    smallest eigenvalue of M               O5   1 / sum_i 1 / s_i

s are the singular values of the whitened Jacobian, s^2 the eigenvalues of M; T_t (d, n) is the Jacobian of what is to
be predicted at test t. D, A and I of M + s A^T A follow from M^-1 by the matrix inversion lemma, for all candidates at
once. The others have no such form; their cheap upper bound over all candidates leaves few to be worked out. References:
Fedorov, Theory of optimal experiments (1972); Borm and Menq (1991), Driels and Pathre (1990), Nahvi and Hollerbach
(1996) for O1 to O4; Sun and Hollerbach, Observability index selection (2008) for O5 and how they relate to A, D and E.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError, look_up

__all__ = ["CRITERIA", "Criterion", "criterion_of", "information"]

# So many extreme eigenvectors, or worst tests, make the cheap bound of a criterion that has no closed form.
EXTREMES = 8
WORST = 48


def information(blocks: Array) -> Array:
    """A^T A of every block: (m, d, n) -> (m, n, n)."""
    return np.asarray(np.swapaxes(blocks, -1, -2) @ blocks)


class Criterion(ABC):
    """A measure of information matrices (larger is better).

    `tight` says that `bound` is the value itself, `weakest` that a direction which nothing can see would decide alone.
    """

    tight = False
    weakest = False
    most = 1024  # candidates worth working out where the bound is not tight, best bounds first

    @abstractmethod
    def value(self, m: Array) -> Array:
        """The criterion of information matrices (..., n, n) -> (...)."""

    def after(self, m: Array, blocks: Array, sign: float) -> Array:
        """value(m + sign A^T A) of every block, (k,)."""
        return self.value(m + sign * information(blocks))

    def slope(self, m: Array) -> Array | None:
        """F (n, q) with F F^T the derivative by M of a criterion that is concave; None where no formula exists."""
        return None

    @abstractmethod
    def bound(self, m: Array, blocks: Array, sign: float) -> Array:
        """No less than value(m + sign A^T A) of every block A: m (n, n), blocks (k, d, n) -> (k,)."""


def _lemma(m: Array, blocks: Array, sign: float) -> tuple[Array, Array]:
    """W = A M^-1 (k, d, n) and S = I + sign A M^-1 A^T (k, d, d)."""
    k, d, n = blocks.shape
    w = (blocks.reshape(k * d, n) @ np.linalg.inv(m)).reshape(k, d, n)
    return w, np.eye(d) + sign * (w @ np.swapaxes(blocks, 1, 2))


class Determinant(Criterion):
    """D: log det M; log det (M + s A^T A) = log det M + log det S."""

    tight = True

    def value(self, m: Array) -> Array:
        sign, log = np.linalg.slogdet(m)
        return np.where(sign > 0, log, -np.inf)

    def slope(self, m: Array) -> Array:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(m)).T)

    def bound(self, m: Array, blocks: Array, sign: float) -> Array:
        _, s = _lemma(m, blocks, sign)
        return self.value(m) + self.value(s)


class Variance(Criterion):
    """A and I: -trace F M^-1 F^T, with F (q, n) what is to be known."""

    tight = True

    def __init__(self, wanted: Array) -> None:
        # Only F^T F counts, so n rows are enough.
        self.wanted = np.asarray(np.linalg.qr(wanted, mode="r")) if len(wanted) > wanted.shape[1] else wanted

    def value(self, m: Array) -> Array:
        return -np.asarray(np.einsum("qi,...ij,qj->...", self.wanted, np.linalg.inv(m), self.wanted, optimize=True))

    def slope(self, m: Array) -> Array:
        return np.asarray(np.linalg.solve(m, self.wanted.T))

    def bound(self, m: Array, blocks: Array, sign: float) -> Array:
        w, s = _lemma(m, blocks, sign)
        k, d, n = w.shape
        g = (w.reshape(k * d, n) @ self.wanted.T).reshape(k, d, -1)
        less = np.trace(np.linalg.solve(s, g @ np.swapaxes(g, 1, 2)), axis1=1, axis2=2)
        return np.asarray(self.value(m) + sign * less)


class Largest(Criterion):
    """G: minus the largest variance over tests T (t, d, n); the bound looks at the tests that are worst now."""

    most = 64

    def __init__(self, tests: Array) -> None:
        self.tests = tests

    def _variance(self, m: Array) -> Array:
        c = np.linalg.inv(m)
        t, d, n = self.tests.shape
        flat = self.tests.reshape(t * d, n)
        square = np.sum((flat @ c) * flat, axis=-1)
        return np.asarray(square.reshape(*m.shape[:-2], t, d).sum(axis=-1))

    def value(self, m: Array) -> Array:
        return np.asarray(-self._variance(m).max(axis=-1))

    def bound(self, m: Array, blocks: Array, sign: float) -> Array:
        return self._largest(m, blocks, sign, WORST)

    def after(self, m: Array, blocks: Array, sign: float) -> Array:
        return self._largest(m, blocks, sign, len(self.tests))

    def _largest(self, m: Array, blocks: Array, sign: float, count: int) -> Array:
        """Minus the largest variance over the `count` tests that are worst now."""
        w, s = _lemma(m, blocks, sign)
        k, d, n = w.shape
        now = self._variance(m)
        worst = np.argsort(-now)[:count]
        tests = self.tests[worst]
        g = (w.reshape(k * d, n) @ tests.reshape(-1, n).T).reshape(k, d, -1)
        less = np.sum(g * (np.linalg.inv(s) @ g), axis=1).reshape(k, len(worst), -1).sum(axis=-1)
        return -np.asarray((now[worst] - sign * less).max(axis=1))


class Spectrum(Criterion):
    """E, O2, O3, O4: what the smallest and largest eigenvalue make; Ritz values on the extreme eigenvectors bound
    both."""

    weakest = True

    def __init__(self, of: Callable[[Array, Array], Array]) -> None:
        self.of = of

    def value(self, m: Array) -> Array:
        e = np.linalg.eigvalsh(m)
        return self.of(np.maximum(e[..., 0], 0.0), np.maximum(e[..., -1], 1e-300))

    def bound(self, m: Array, blocks: Array, sign: float) -> Array:
        e, v = np.linalg.eigh(m)
        some = min(EXTREMES, len(m))
        low = np.diag(e[:some]) + sign * information(blocks @ v[:, :some])
        high = e[-1] + sign * np.sum((blocks @ v[:, -1]) ** 2, axis=1)
        return self.of(np.maximum(np.linalg.eigvalsh(low)[:, 0], 0.0), np.maximum(high, 1e-300))


class HarmonicCriterion(Criterion):
    """O5: 1 / trace M^-1/2; by the inequality of Peierls and Bogoliubov the diagonal in any basis bounds the trace."""

    weakest = True

    def value(self, m: Array) -> Array:
        e = np.linalg.eigvalsh(m)
        return np.where(e[..., 0] > 0, 1 / np.sum(1 / np.sqrt(np.maximum(e, 1e-300)), axis=-1), 0.0)

    def bound(self, m: Array, blocks: Array, sign: float) -> Array:
        e, v = np.linalg.eigh(m)
        diagonal = e + sign * np.sum((blocks @ v) ** 2, axis=1)
        return np.asarray(1 / np.sum(1 / np.sqrt(np.maximum(diagonal, 1e-300)), axis=1))


def _tests(name: str, tests: Array | None) -> Array:
    if tests is None or not len(tests):
        raise ModelError("this criterion needs test poses", key="criterion", found=name, expected="D, A, E or O1 to O5")
    return tests


# A maker takes the number of columns and the tests (t, d, n) or None.
CRITERIA: dict[str, Callable[[int, Array | None], Criterion]] = {
    "I": lambda n, t: Variance(_tests("I", t).reshape(-1, n) / np.sqrt(len(_tests("I", t)))),
    "D": lambda n, t: Determinant(),
    "A": lambda n, t: Variance(np.eye(n)),
    "E": lambda n, t: Spectrum(lambda low, high: low),
    "G": lambda n, t: Largest(_tests("G", t)),
    "O1": lambda n, t: Determinant(),
    "O2": lambda n, t: Spectrum(lambda low, high: np.sqrt(low / high)),
    "O3": lambda n, t: Spectrum(lambda low, high: np.sqrt(low)),
    "O4": lambda n, t: Spectrum(lambda low, high: low / np.sqrt(high)),
    "O5": lambda n, t: HarmonicCriterion(),
}


def criterion_of(name: str, columns: int, tests: Array | None = None) -> Criterion:
    """The criterion of this name for so many columns. Raises ModelError for an unknown name, or for tests that are
    missing."""
    return look_up(CRITERIA, name, "unknown criterion", "criterion")(columns, tests)

"""Currents of winches that hold a platform at rest, or nearly: tensions without load cells, and the friction between.

    t_i = (n / R) (k i_i + c_i sgn(v_i) + b_i w_i),    w_i = n v_i / R
    r = (k_0 / k) C^-1 (W t + w), as of load cells (`measure/load.py`)

extra["current"] (k, m) in A, of a motor that pulls; extra["speed"] (k, m) in m/s is how fast the cable runs out, or ran out last: friction
then holds a part of the tension, and takes a part of the torque where the cable is wound in. k (N m/A) is the torque constant of all
motors, c_i (N m) and b_i (N m s/rad) Coulomb and viscous friction of each at its motor; n is the gear's ratio, R the drum's radius in m.
options["winches"] names their owner: `winches.kt`, `winches.c1.coulomb`, `winches.c1.viscous`; options["cables"] names the cables,
options["ratio"] is n / R. sigma (k, 1) is that of a tension, n k_0 / R times that of a current, at the stated constant k_0.

Rows are k_0 / k of what is out of balance, so that the noise of a current is the same in them whatever k is. Without this factor a smaller
k has less noise, and N rows of noise s with the squares of the load, S = sum |C^-1 w|^2, make k too small by its share N s^2 / S.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._record import replace
from robocal._types import Array, Ints
from robocal.measure.builder import Builder
from robocal.measure.cable.cable_names import cable_names
from robocal.measure.cable.winch_tensions import FRICTION, KT, RATIO, friction_columns, ratio_of, winch_names
from robocal.measure.data import Observations
from robocal.measure.load import BODY, LoadRows, of_platform
from robocal.measure.rows import Kind, Rows, numbers, register
from robocal.parameters import Parameter

__all__ = ["WINCHES", "fit_friction", "number_of", "numbers_of"]

KT_USUAL, KT_EXPECTED = 1.0, 0.1  # N m/A
WINCH = "a winch for every cable"
UNITS, EXPECTED = ("N m", "N m s/rad"), (0.1, 0.01)


def number_of(obs: Observations, symbol: str) -> float:
    """What is stated of a number of the winches."""
    return _table(obs, "values").get(symbol, KT_USUAL if symbol == KT else 0.0)


def numbers_of(obs: Observations) -> Mapping[str, float]:
    """All that is stated of the winches, by symbol."""
    return _table(obs, "values")


class WinchRows(LoadRows):
    """The rows of all configurations, whose tensions follow from currents and from the numbers of the winches."""

    def __init__(self, builder: Builder, obs: Observations) -> None:
        super().__init__(builder, obs)
        current, speed = self.of_places(obs, "current"), self.of_places(obs, "speed")
        self.columns_of = friction_columns(obs, current, speed)
        self.stated, self.constant = number_of(obs, KT), 6 * current.shape[1] + len(BODY)  # which of the numbers k is

    def more(self, obs: Observations) -> Sequence[str]:
        return winch_names(obs)

    def of_places(self, obs: Observations, what: str) -> Array:
        return super().of_places(obs, "current" if what == "tension" else what)

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        r, jac, local = super().evaluate(x, which, first, rows)
        k = x[:, self.numbers[self.constant]][:, None, None]
        r, jac, local = (v * (self.stated / k)[(..., *(None,) * (v.ndim - 3))] for v in (r, jac, local))
        free = np.flatnonzero(self.own == self.constant)
        if len(free):
            jac[..., jac.shape[3] - len(self.own) + int(free[0])] -= r / k
        return r, jac, local

    def pulls(self, x: Array, part: slice) -> tuple[Array, Array]:
        by_k, by_c, by_b = (c[part] for c in self.columns_of)
        m = by_k.shape[1]
        own = x[:, self.numbers[6 * m + len(BODY) :]]
        each = own[:, 1:].reshape(len(x), 1, m, 2)
        slopes = np.zeros((*by_k.shape, 1 + 2 * m))
        slopes[..., 0] = by_k
        at = np.arange(m)
        slopes[:, at, 1 + 2 * at], slopes[:, at, 2 + 2 * at] = by_c, by_b
        return own[:, :1, None] * by_k + each[..., 0] * by_c + each[..., 1] * by_b, slopes[None]


def parameters(obs: Observations) -> list[Parameter]:
    """The platform's mass and centre, the torque constant, and friction of each winch, which begins where it is stated of all."""
    body = numbers(_of_body(obs), BODY)
    known, priors, free, own = (
        _table(obs, "values"),
        _table(obs, "priors"),
        obs.options.get("free"),
        str(obs.options["winches"]),
    )
    loose = free if isinstance(free, tuple) else ()

    def row(name: str, symbol: str, unit: str, usual: float, expected: float | None) -> Parameter:
        return Parameter(name, known.get(symbol, usual), unit, symbol in loose, priors.get(symbol), expected=expected)

    made = [row(f"{own}.{KT}", KT, "N m/A", KT_USUAL, KT_EXPECTED)]
    body.append(Parameter(f"{own}.{RATIO}", ratio_of(obs), "1/m", False))
    for cable in cable_names(obs, WINCH):
        made += [row(f"{own}.{cable}.{s}", s, u, 0.0, e) for s, u, e in zip(FRICTION, UNITS, EXPECTED, strict=True)]
    return [*body, *made]


def _table(obs: Observations, key: str) -> Mapping[str, float]:
    """What the options say of numbers by symbol."""
    found = obs.options.get(key)
    return {str(k): float(v) for k, v in found.items()} if isinstance(found, Mapping) else {}


def _of_body(obs: Observations) -> Observations:
    """The same observations that speak of the platform alone."""
    mine, free = {n.symbol for n in BODY}, obs.options.get("free")
    cut: dict[str, object] = {k: {s: v for s, v in _table(obs, k).items() if s in mine} for k in ("values", "priors")}
    cut["free"] = tuple(s for s in free if s in mine) if isinstance(free, tuple) else ()
    return replace(obs, options={**obs.options, **cut})


def fit_friction(obs: Observations, structure: Array, wrench: Array, current: Array, speed: Array) -> Array:
    """Tensions (k, m) in N from currents (k, m), with those numbers of the winches that best hold a wrench (k, d) by W (k, d, m), linear
    least squares under the priors that are stated; numbers that are not free stay."""
    by_k, by_c, by_b = friction_columns(obs, current, speed)
    m, table = by_k.shape[1], parameters(obs)[-(1 + 2 * by_k.shape[1]) :]
    root = np.linalg.cholesky(structure @ structure.swapaxes(-1, -2))
    base = np.linalg.solve(root, structure)  # C^-1 W
    cells = np.zeros((*by_k.shape, 1 + 2 * m))
    at = np.arange(m)
    cells[..., 0] = by_k
    cells[:, at, 1 + 2 * at], cells[:, at, 2 + 2 * at] = by_c, by_b
    value = np.array([p.value for p in table])
    free = [i for i, p in enumerate(table) if p.free]
    columns = (base @ cells).reshape(-1, 1 + 2 * m)
    load = np.linalg.solve(root, wrench[..., None]).ravel()
    left = -load - columns @ value
    sigma = 1.0 if obs.sigma is None else float(obs.sigma[0, 0])
    held = [(i, p.prior) for i, p in enumerate(table) if p.free and p.prior is not None]
    soft = np.zeros((len(held), len(free)))
    for row, (i, prior) in enumerate(held):
        soft[row, free.index(i)] = 1 / prior
    rows = np.concatenate([columns[:, free] / sigma, soft])
    value[free] += np.linalg.lstsq(rows, np.concatenate([left / sigma, np.zeros(len(held))]), rcond=None)[0]
    return np.asarray(cells @ value)


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term for all configurations."""
    return of_platform(builder, obs, WinchRows)


WINCHES = register(
    Kind("winches", 1, terms, parameters, parts=((0, 1, "N"),), numbers=BODY, unstated=1.0, owner="winches")
)

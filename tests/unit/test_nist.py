"""Certified: the nonlinear regression sets of NIST StRD through the same solver that calibrates robots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from unit.plain_terms import Plain, plain_problem

from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import uncertainty


def read_sets():
    sets, name = {}, ""
    for line in (Path(__file__).parent / "nist" / "strd.txt").read_text().splitlines():
        if line.startswith("["):
            name = line[1:-1]
            sets[name] = {}
        elif line and not line.startswith("#"):
            key, _, numbers = line.partition(":")
            sets[name][key] = np.array(numbers.split(), float)
    return sets


SETS = read_sets()


def exponentials(x, b, pairs, offset):
    """Value and Jacobian of b0 + sum b_i exp(-b_j x)."""
    value, j = np.full(len(x), b[0] if offset else 0.0), np.zeros((len(x), len(b)))
    if offset:
        j[:, 0] = 1
    for i, k in pairs:
        e = np.exp(-b[k] * x)
        value = value + b[i] * e
        j[:, i], j[:, k] = e, -b[i] * x * e
    return value, j


def misra1d(x, b):
    d = 1 + b[1] * x
    return b[0] * b[1] * x / d, np.stack([b[1] * x / d, b[0] * x / d**2], 1)


def rat42(x, b):
    e = np.exp(b[1] - b[2] * x)
    return b[0] / (1 + e), np.stack([1 / (1 + e), -b[0] * e / (1 + e) ** 2, b[0] * x * e / (1 + e) ** 2], 1)


def mgh10(x, b):
    f = 1 / (x + b[2])
    e = np.exp(b[1] * f)
    return b[0] * e, np.stack([e, b[0] * f * e, -b[0] * b[1] * f**2 * e], 1)


def boxbod(x, b):
    e = np.exp(-b[1] * x)
    return b[0] * (1 - e), np.stack([1 - e, b[0] * x * e], 1)


def mgh09(x, b):
    top, d = x**2 + x * b[1], x**2 + x * b[2] + b[3]
    return b[0] * top / d, np.stack([top / d, b[0] * x / d, -b[0] * top * x / d**2, -b[0] * top / d**2], 1)


def thurber(x, b):
    top, d = b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3, 1 + b[4] * x + b[5] * x**2 + b[6] * x**3
    powers = np.stack([x**0, x, x**2, x**3], 1)
    return top / d, np.concatenate([powers / d[:, None], -(top / d**2)[:, None] * powers[:, 1:]], 1)


def rat43(x, b):
    e = np.exp(b[1] - b[2] * x)
    p = (1 + e) ** (-1 / b[3])
    slope = -b[0] / b[3] * e * p / (1 + e)
    return b[0] * p, np.stack([p, slope, -x * slope, b[0] * p * np.log1p(e) / b[3] ** 2], 1)


def eckerle4(x, b):
    u = (x - b[2]) / b[1]
    e = np.exp(-0.5 * u**2)
    return b[0] / b[1] * e, np.stack([e / b[1], b[0] * e * (u**2 - 1) / b[1] ** 2, b[0] * e * u / b[1] ** 2], 1)


def bennett5(x, b):
    base = b[1] + x
    e = base ** (-1 / b[2])
    return b[0] * e, np.stack([e, -b[0] * e / b[2] / base, b[0] * e * np.log(base) / b[2] ** 2], 1)


MODELS = {
    "Misra1d": misra1d,
    "Lanczos1": lambda x, b: exponentials(x, b, [(0, 1), (2, 3), (4, 5)], False),
    "Rat42": rat42,
    "MGH10": mgh10,
    "BoxBOD": boxbod,
    "MGH17": lambda x, b: exponentials(x, b, [(1, 3), (2, 4)], True),
    "MGH09": mgh09,
    "Thurber": thurber,
    "Rat43": rat43,
    "Eckerle4": eckerle4,
    "Bennett5": bennett5,
}


def problem_of(name, start):
    data, model = SETS[name], MODELS[name]
    x, y = data["x"], data["y"]

    def quiet(b, which):
        # A wild trial step may overflow; the solver must see the infinity and refuse it.
        with np.errstate(all="ignore"):
            return model(x, b)[which]

    # Unknown scale of y: the expected errors only decide when a step is called zero.
    term = Plain(lambda b: (quiet(b, 0) - y)[:, None], lambda b: quiet(b, 1)[:, None, :], (len(y), 1))
    return plain_problem(term, data[start], expected=list(np.abs(data[start])))


def digits(found, certified):
    """Correct significant digits, the fewest of all."""
    return float(-np.log10(np.max(np.abs(found - certified) / np.abs(certified)) + 1e-16))


def test_every_set_has_a_model():
    assert set(SETS) == set(MODELS) and len(SETS) >= 8


@pytest.mark.parametrize("name", SETS)
def test_certified_values_are_those_of_the_data(name):
    """Guards the transcription: the certified parameters give the certified sum of squares."""
    value = MODELS[name](SETS[name]["x"], SETS[name]["certified"])[0]
    rss = float(np.sum((value - SETS[name]["y"]) ** 2))
    assert rss == pytest.approx(SETS[name]["rss"][0], rel=1e-7, abs=1e-18)


# From these starts the first undamped step leaps onto a plateau, so the solver is told to begin carefully, as MINPACK
# must be (its `factor`).
CAREFUL = {("BoxBOD", "start1"): 100.0, ("MGH17", "start1"): 1e-3}
# One valley that no damping of this solver leaves in time; MINPACK needs 284 steps.
LOST = ("MGH10", "start1")


@pytest.mark.parametrize("start", ["start1", "start2"])
@pytest.mark.parametrize("name", SETS)
def test_six_digits_from_both_starts(name, start):
    p = problem_of(name, start)
    damping = CAREFUL.get((name, start), 1e-6)
    s = least_squares(p, max_iterations=2500, cost_tolerance=1e-20, damping=damping)
    if (name, start) == LOST:
        assert not s.reasons[0].converged
        return
    assert s.reasons[0].converged, s.reasons
    assert digits(s.x[0], SETS[name]["certified"]) > 6, s.x
    if name != "Lanczos1":  # its residuals are rounding: 1e-25
        assert digits(2 * s.cost, SETS[name]["rss"]) > 6
        assert (np.diff(s.history[:, 0]) <= 0).all()


@pytest.mark.parametrize("name", [n for n in SETS if "deviation" in SETS[n]])
def test_certified_standard_deviations(name):
    p = problem_of(name, "start2")
    u = uncertainty(p, least_squares(p, cost_tolerance=1e-20).x, estimated=True)
    assert digits(u.sigma, SETS[name]["deviation"]) > 5
    assert u.dof == len(SETS[name]["y"]) - p.n

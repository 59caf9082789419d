"""How near the held-out share of a sweep can be to that of the truth, whoever computes it: information, and a simulation that shares
no line with robocal.

    python scripts/drive_bound.py [--seeds 200]       # 60 s

The sweep is that of `drive_coverage.py`: orders and amplitudes of `motor-sim.yaml`, 3 deg/s, both directions, white noise of 0.02 N m. Its
numbers are p = (offset, friction, a_n, b_n, lag, s^2), its rows y = f(p) + s e. The share of new sweeps of one motor is

    share = 1 - u,   u = s^2 / (S + s^2),   S = sum (a_n^2 + b_n^2) / 2

*Information.* The Fisher matrix of the rows is J^T J / s^2 of the means and N / (2 s^4) of s^2, and no estimate without a bias has a
smaller variance than g^T F^-1 g, g the gradient of the share. Worked out, that is u^2 2 (1 - u^2) / N: the table prints both.
*Simulation.* Arcs of 30 degrees are held out one after the other, in both directions; harmonics of the known orders with the known lag are
fitted by least squares to the rest (numpy alone). Nobody knows more of a motor than its orders and its lag.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.stats import norm

ORDERS, AMPLITUDES = np.array([4, 8, 12, 24]), np.array([0.060, 0.030, 0.020, 0.012])
COULOMB, NOISE, SPEED, LAG, ASKED, SWEEPS = 0.10, 0.02, np.radians(3.0), np.radians(0.5), 0.3, 200


def rows(rate: float, turns: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles and directions."""
    way = np.arange(0, 2 * np.pi * turns, SPEED / rate)
    return np.concatenate([way, way[::-1]]), np.repeat([1.0, -1.0], len(way))


def columns(angle: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """1, d, cosines and sines."""
    turned = np.outer(angle - direction * LAG, ORDERS)
    return np.column_stack([np.ones(len(angle)), direction, np.cos(turned), np.sin(turned)])


def bound(rate: float, turns: float, phase: np.ndarray, known_noise: bool = False) -> tuple[float, float]:
    """The least standard deviation of the share, in points: by the Fisher matrix of all numbers, and by the formula."""
    angle, direction = rows(rate, turns)
    a, b = AMPLITUDES * np.cos(phase), AMPLITUDES * np.sin(phase)
    x = columns(angle, direction)
    turned = np.outer(angle - direction * LAG, ORDERS)
    by_lag = direction * ((a * ORDERS) * np.sin(turned) - (b * ORDERS) * np.cos(turned)).sum(axis=1)
    j = np.column_stack([x, by_lag])
    signal, n = float(np.sum(AMPLITUDES**2) / 2), len(angle)
    total = signal + NOISE**2
    fisher = np.zeros((j.shape[1] + 1, j.shape[1] + 1))
    fisher[:-1, :-1] = j.T @ j / NOISE**2
    fisher[-1, -1] = np.inf if known_noise else n / (2 * NOISE**4)
    g = np.concatenate([[0, 0], NOISE**2 * a / total**2, NOISE**2 * b / total**2, [0.0], [-signal / total**2]])
    covariance = np.zeros_like(fisher)
    covariance[:-1, :-1] = np.linalg.inv(fisher[:-1, :-1])
    covariance[-1, -1] = 1 / fisher[-1, -1]
    u = NOISE**2 / total
    return 100 * float(np.sqrt(g @ covariance @ g)), 100 * u * float(np.sqrt(2 * (1 - u**2) / n))


def simulate(rate: float, turns: float, seeds: int) -> tuple[np.ndarray, np.ndarray]:
    """Share less that of new sweeps of this motor, and less that of the true curve in the same rows, in points."""
    angle, direction = rows(rate, turns)
    x = columns(angle, direction)
    arc = np.floor(np.mod(angle, 2 * np.pi) / (np.pi / 6)).astype(int) % 12
    every = [np.flatnonzero(arc == k) for k in range(12)]
    squares = [x[r].T @ x[r] for r in every]
    whole, ways = sum(squares), [direction == d for d in (1.0, -1.0)]
    truth = 1 - NOISE**2 / (NOISE**2 + float(np.sum(AMPLITUDES**2) / 2))
    new, same = np.empty(seeds), np.empty(seeds)
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        phase = rng.uniform(-np.pi, np.pi, len(ORDERS))
        beta = np.concatenate([[0.0, COULOMB], AMPLITUDES * np.cos(phase), AMPLITUDES * np.sin(phase)])
        noise = NOISE * rng.standard_normal(len(angle))
        y = x @ beta + noise
        right = [x[r].T @ y[r] for r in every]
        total, left = sum(right), 0.0
        for r, s, v in zip(every, squares, right, strict=True):
            left += float(np.sum((y[r] - x[r] @ np.linalg.solve(whole - s, total - v)) ** 2))
        centred = sum(float(np.sum((y[w] - y[w].mean()) ** 2)) for w in ways)
        share = 1 - left / centred
        own = 1 - sum(float(np.sum((noise[w] - noise[w].mean()) ** 2)) for w in ways) / centred
        new[seed], same[seed] = 100 * (share - truth), 100 * (share - own)
    return new, same


def main() -> None:
    """A line for each sweep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=SWEEPS)
    o = parser.parse_args()
    phase = np.random.default_rng(1).uniform(-np.pi, np.pi, len(ORDERS))
    print(
        f"asked: the held-out share within {ASKED} points of the truth; chances are of all {SWEEPS} sweeps, sigma in points"
    )
    print(
        "rows/s turns     rows   least sigma   formula   chance   simulated sigma   worst   beyond   of the same rows, worst"
    )
    for rate, turns in ((50, 2), (100, 2), (50, 4), (50, 5), (100, 5)):
        least, formula = bound(rate, turns, phase)
        chance = (1 - 2 * norm.sf(ASKED / least)) ** SWEEPS
        new, same = simulate(rate, turns, o.seeds)
        print(
            f"{rate:6} {turns:5} {len(rows(rate, turns)[0]):8} {least:13.4f} {formula:9.4f} {100 * chance:6.1f} %"
            f" {np.sqrt(np.mean(new**2)):15.4f} {np.abs(new).max():10.3f} {int((np.abs(new) > ASKED).sum()):4} of {o.seeds}"
            f" {np.abs(same).max():12.4f}"
        )
    known, _ = bound(50, 2, phase, known_noise=True)
    print(
        f"whoever were told the noise beforehand would have {known:.4f} at 50 rows/s and two turns; a log does not tell it"
    )


if __name__ == "__main__":
    main()

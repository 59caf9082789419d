"""Three robots of the catalogue with an instrument, and many copies of one experiment as one batch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.files.robot import open_robot
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

ROBOTS = ("rv-2aj", "ur10", "panda")
TRACKER = Frame("tracker", (1.5, -0.8, 0.4, 0.1, 0.2, 1.0), (True,) * 6)
SIGMA = {"position": (5e-5,) * 3, "pose": (5e-5,) * 3 + (1e-4,) * 3}  # m, rad
CHUNK = 500


def joints(robot, rng, m):
    """Configurations within the limits; two thirds of a turn to either side where a joint may turn further."""
    low, high = np.clip(robot.limits, -2.1, 2.1).T
    return Configurations(tuple(f"p{i}" for i in range(m)), rng.uniform(low, high, (m, len(low))))


def observations(kind, m):
    sigma = np.tile(SIGMA[kind], (m, 1))
    return Observations(kind, np.arange(m), np.zeros_like(sigma), sigma, TRACKER)


def perturbed(robot, rng, share=1.0):
    """A true robot: every free parameter off by what one expects of it, but the tool, which is known to a millimetre."""
    table = robot.table
    moved = {
        n: table[n].value + share * rng.normal(0, min(table[n].scale, 5e-3 if table[n].unit == "rad" else 1e-3))
        for n in table.free
    }
    return robot.with_values(moved)


class Experiment:
    """One robot, one instrument, clean measurements; `batch` gives noisy copies of them as one problem."""

    def __init__(self, name, kind, m, seed=1):
        self.rng = np.random.default_rng(seed)
        self.robot, self.kind, self.m = open_robot(name).chain, kind, m
        self.data = synthesise(self.robot, DataSet(joints(self.robot, self.rng, m), (observations(kind, m),)))
        made = problem(self.robot, self.data)
        self.kept = analyse(made, made.start).basis
        self.clean = made.with_free(self.kept)

    def batch(self, count):
        """`count` noisy copies."""
        obs = self.data.observations[0]
        kind = self.kind
        noise = obs.sigma * self.rng.standard_normal((count, *obs.sigma.shape))
        from robocal.measure.base import kind_of

        value = kind_of(obs).disturb(np.broadcast_to(obs.value, noise.shape), noise)
        assert value.shape == noise.shape and kind == obs.kind
        made = problem(self.robot, replace(self.data, observations=(replace(obs, value=value),)), free=self.kept)
        return made

    def trials(self, count):
        """Tangent errors (count, n) of the estimates and chi2 (count,), from one start that is wrong by what is expected."""
        start = self.clean.retract(
            self.clean.start, 0.3 * self.rng.normal(size=(1, self.clean.n)) * np.minimum(self.clean.scales, 5e-3)
        )
        errors, chi2 = [], []
        for first in range(0, count, CHUNK):
            some = min(CHUNK, count - first)
            made = self.batch(some)
            found = least_squares(made, np.repeat(start, some, axis=0))
            assert all(r.converged for r in found.reasons)
            errors.append(self.clean.difference(found.x))
            chi2.append(2 * found.cost)
        return np.concatenate(errors), np.concatenate(chi2)

    def information(self, step=1e-6):
        """Fisher information at the truth by central differences of what is predicted: nothing of the solver's."""
        columns = []
        for i in range(self.clean.n):
            move = np.zeros((1, self.clean.n))
            move[0, i] = step
            ends = [self.clean.residuals(self.clean.retract(self.clean.start, s * move)) for s in (1, -1)]
            columns.append(
                np.concatenate([((a.value - b.value) * a.scale).ravel() for a, b in zip(*ends, strict=True)])
            )
        j = np.stack(columns, axis=1) / (2 * step)
        return j.T @ j

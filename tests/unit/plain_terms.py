"""Least-squares problems from plain functions, so that solvers are tested without a robot."""

from __future__ import annotations

import numpy as np
import scipy.optimize

from robocal.estimate.families import Family
from robocal.estimate.problem import Problem
from robocal.parameters import Parameter, ParameterTable


class Plain:
    """A term from fn(x) -> r (m, d) and jac(x) -> J (m, d, P), x (P,); `local` adds a linear local block of l
    columns."""

    group, kind, parts, lever, reading, view = "plain", "plain", ((0, 1, "m"),), None, True, None

    def __init__(self, fn, jac, shape, *, sigma=1.0, configuration=None, local=None, block=None):
        m, d = shape
        self.fn, self.jac = fn, jac
        self.scale = np.ascontiguousarray(1.0 / np.broadcast_to(np.asarray(sigma, float), (m, d)))
        self.used = np.ones(m, dtype=bool)
        self.configuration = np.arange(m) if configuration is None else np.asarray(configuration)
        none = np.full(m, -1)
        self.local = (none if local is None else np.asarray(local), none)
        self.touches, self.pairs, self.pair = (local is not None, False), np.zeros((0, 2), dtype=np.int64), none
        self.block = np.zeros((m, d, 0)) if block is None else np.asarray(block, float)
        self.columns = np.empty(0, dtype=np.int64)
        self.rows = self.columns

    @property
    def plain(self):
        return self

    def bind(self, column_of):
        other = object.__new__(Plain)
        other.__dict__.update(self.__dict__)
        other.rows = np.flatnonzero(column_of >= 0)
        other.columns = column_of[other.rows]
        other.size = len(column_of)
        return other

    def hold(self, family):
        raise NotImplementedError

    def accumulate(self, *_):
        return False

    def evaluate(self, x, which, first, rows):
        part = slice(first, first + rows)
        n, size = self.size, self.block.shape[2]
        r, j = [], []
        for row in x:
            value = np.array(self.fn(row[:n]), float)[part]
            if size:
                blocks = row[n:].reshape(-1, size)
                value = value + np.einsum("mdl,ml->md", self.block[part], blocks[self.local[0][part]])
            r.append(value)
            j.append(np.asarray(self.jac(row[:n]), float)[part][:, :, self.rows])
        jl = np.repeat(self.block[None, part], len(x), axis=0)
        return np.array(r), np.ascontiguousarray(j), jl


def plain_problem(terms, start, *, configurations=None, blocks=0, block_size=0, names=None, local_start=None, **more):
    """A problem over parameters b1 ... bP that start at `start`; `more` holds per-parameter lists: prior, lower,
    upper, expected."""
    terms = terms if isinstance(terms, (list, tuple)) else [terms]
    names = names or [f"b{i + 1}" for i in range(len(start))]
    rows = [
        Parameter(name, float(v), "1", True, **{k: w[i] for k, w in more.items()})
        for i, (name, v) in enumerate(zip(names, start, strict=True))
    ]
    configurations = max(int(t.configuration.max()) + 1 for t in terms) if configurations is None else configurations
    given = np.zeros((blocks, block_size)) if local_start is None else np.asarray(local_start, float)
    family = Family(given.reshape(blocks, block_size), tuple(range(block_size))) if blocks else None
    return Problem(
        ParameterTable(tuple(rows)),
        tuple(names),
        () if family is None else (family,),
        terms=tuple(terms),
        configurations=configurations,
    )


def linear(a, y, **more):
    """The term r = A x - y, row by row; a (m, P), y (m,)."""
    a, y = np.asarray(a, float), np.asarray(y, float)
    return Plain(lambda x: (a @ x - y)[:, None], lambda x: a[:, None, :], (len(y), 1), **more)


def curved(rng, m=30, n=4, noise=0.05):
    """A smooth nonlinear fit y = sum_k x_k sin(a_ik x_k + c_ik) with its functions."""
    a, c = rng.uniform(0.2, 1, (m, n)), rng.uniform(-1, 1, (m, n))
    truth = rng.uniform(0.5, 1.5, n)

    def value(x):
        return (x * np.sin(a * x + c)).sum(axis=1)

    y = value(truth) + rng.normal(scale=noise, size=m)

    def fn(x):
        return (value(x) - y)[:, None]

    def jac(x):
        return (np.sin(a * x + c) + a * x * np.cos(a * x + c))[:, None, :]

    return truth, fn, jac


def scipy_solution(fn, jac, start, **more):
    return scipy.optimize.least_squares(
        lambda x: fn(x).ravel(), start, lambda x: jac(x).reshape(-1, len(x)), xtol=1e-14, ftol=1e-14, gtol=1e-14, **more
    )

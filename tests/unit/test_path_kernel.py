"""The compiled path against a plain NumPy twin: random element lists of every axis, with constants, shared parameters
and columns."""

from __future__ import annotations

import numpy as np
import pytest
from laws import check_jacobian
from scipy.linalg import expm

from robocal.errors import ModelError
from robocal.geometry import so3
from robocal.geometry.path.program import AXES, Element, Term, compile_path, frame_element
from robocal.parameters import Parameter, ParameterTable, frame_parameters

COLUMNS = ("q1", "q2", "temperature")
SCREWS = {axis: np.eye(6)[i] for i, axis in enumerate(AXES[:6])}


def random_path(rng, count):
    """Elements of every axis; parameters p0 ... p7 are shared, two frames stand in between, one of them twice."""
    names = [f"p{i}" for i in range(8)]
    rows = [Parameter(n, float(rng.uniform(-1, 1)), "1", True) for n in names]
    for owner in ("f", "g", "still"):
        value = np.zeros(6) if owner == "still" else rng.normal(size=6)
        rows += frame_parameters(owner, value, free=True)
    elements = [frame_element("f"), frame_element("still")]
    for _ in range(count):
        axis = str(rng.choice(AXES[:7]))
        terms = []
        for _ in range(rng.integers(0, 4)):
            column = str(rng.choice(["1", *COLUMNS]))
            terms.append(Term(str(rng.choice(names)), column, float(rng.choice([1.0, -1.0, 0.5]))))
        constant = float(rng.choice([0.0, rng.uniform(-1, 1)]))
        screw = tuple(rng.normal(size=6)) if axis == "screw" else (0.0,) * 6
        elements.append(Element(axis, tuple(terms), constant, screw))
    elements += [
        frame_element("g"),
        Element("screw", (Term("p0"),), 0.1, (*rng.normal(size=3), 0, 0, 0)),
        frame_element("g"),
    ]
    return elements, ParameterTable(tuple(rows))


def twin(elements, table, theta, phi):
    """T (4, 4) of one row, by matrix exponentials; phi maps column names to numbers."""
    t = np.eye(4)
    for e in elements:
        step = np.eye(4)
        if e.axis == "frame":
            x = [theta[table.index[term.parameter]] for term in e.terms]
            step[:3, :3], step[:3, 3] = so3.exp(x[3:]), x[:3]
        else:
            value = e.constant + sum(s.factor * theta[table.index[s.parameter]] * phi[s.column] for s in e.terms)
            screw = np.asarray(e.screw) if e.axis == "screw" else SCREWS[e.axis]
            m = np.zeros((4, 4))
            m[:3, :3], m[:3, 3] = so3.skew(screw[3:]), screw[:3]
            step = expm(value * m)
        t = t @ step
    return t


def phi_of(rng, program, m):
    values = {"1": np.ones(m), **{c: rng.normal(size=m) for c in COLUMNS}}
    return values, np.stack([values[c] for c in program.columns], axis=-1) if program.columns else np.zeros((m, 0))


@pytest.mark.parametrize("seed", range(12))
def test_pose_equals_the_twin(seed):
    rng = np.random.default_rng(seed)
    elements, table = random_path(rng, 15)
    program = compile_path(elements, table)
    values, phi = phi_of(rng, program, 5)
    theta = np.stack([table.values, rng.normal(size=len(table))])
    pose, _ = program.run(theta, np.ascontiguousarray(phi[None]))
    late, _ = program.run(theta, np.ascontiguousarray(phi[None]), first=3, rows=2)
    for b in range(2):
        for m in range(5):
            expected = twin(elements, table, theta[b], {k: v[m] for k, v in values.items()})
            np.testing.assert_allclose(pose[b, m], expected, atol=1e-11)
    np.testing.assert_array_equal(late, pose[:, 3:])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("turn", [True, False])
def test_jacobian_of_a_random_path(seed, turn):
    rng = np.random.default_rng(100 + seed)
    elements, table = random_path(rng, 12)
    program = compile_path(elements, table)
    _, phi = phi_of(rng, program, 1)
    phi = np.ascontiguousarray(phi[None])
    used = program.parameters
    output = np.full(len(table), -1)
    output[used] = np.arange(len(used))
    entries = program.entries(output)

    def add(x, step):
        out = x.copy()
        out[used] += step
        full = np.zeros(len(table))
        full[used] = step
        for t in table.turns:
            out[t : t + 3] = so3.log(so3.exp(full[t : t + 3]) @ so3.exp(x[t : t + 3]))
        return out

    def subtract(a, b):
        w = so3.log(a[:3, :3] @ b[:3, :3].T)
        return np.concatenate([a[:3, 3] - b[:3, 3], w] if turn else [a[:3, 3] - b[:3, 3]])

    def pose_of(step):
        return program.run(add(table.values, step)[None], phi)[0][0, 0]

    def jacobian(step):
        return program.run(add(table.values, step)[None], phi, entries, len(used), turn=turn)[1][0, 0]

    check_jacobian(pose_of, jacobian, np.zeros(len(used)), subtract=subtract, tolerance=1e-8)


def test_a_batch_of_columns(rng):
    """phi may carry a batch of its own: problem b reads row b."""
    elements, table = random_path(rng, 8)
    program = compile_path(elements, table)
    phi = rng.normal(size=(3, 4, len(program.columns)))
    theta = np.repeat(table.values[None], 3, axis=0)
    together, _ = program.run(theta, phi)
    for b in range(3):
        np.testing.assert_array_equal(together[b], program.run(theta[:1], np.ascontiguousarray(phi[[b]]))[0][0])


def test_what_a_path_cannot_mean():
    table = ParameterTable((Parameter("p0"),))
    with pytest.raises(ModelError, match="did you mean 'rx'"):
        compile_path([Element("rxx")], table)
    with pytest.raises(ModelError, match="unknown parameter"):
        compile_path([Element("rx", (Term("p1"),))], table)

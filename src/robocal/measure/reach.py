"""Where a machine's frame is at joint values or poses that need no measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array, Bools
from robocal.estimate.terms import spread
from robocal.geometry.path.program import compile_path
from robocal.measure.builder import Builder
from robocal.measure.data import Configurations
from robocal.measure.machine import Mechanism, Model, freedom_of, joints_of

__all__ = ["limits_of", "names_of", "nominal_poses", "place_is_known", "places_by_joints", "reach", "size_of"]

CHUNK = 2048  # configurations whose columns are held at once
DRAWN = 256  # configurations that show how far an arm reaches


def reach(
    machine: Model, joints: Array, names: Sequence[str] = (), columns: Mapping[str, ArrayLike] | None = None,
    *, turn: bool = True,
) -> tuple[Array, Array]:  # fmt: skip
    """T_base_tool (m, 4, 4) at joint values (m, n), and how named parameters move it, J (m, 6, k): (v, w) in base axes,
    without `turn` (m, 3, k) of v alone. `columns` are whatever else the model reads, numbers or (m,)."""
    q, m = np.asarray(joints, float), len(joints)
    recorded = {k: np.broadcast_to(np.asarray(v, float), (m,)) for k, v in (columns or {}).items()}
    column_of = np.full(len(machine.table), -1, dtype=np.int64)
    for i, name in enumerate(names):
        column_of[machine.table.index[name]] = i
    nothing = frozenset(machine.table.names[i] for i in np.flatnonzero((machine.table.values == 0) & (column_of < 0)))
    poses, jacobians = np.empty((m, 4, 4)), np.zeros((m, 6 if turn else 3, len(names)))
    for first in range(0, m, CHUNK):
        some = slice(first, min(first + CHUNK, m))
        count = some.stop - first
        where = Configurations(("",) * count, q[some], {k: v[some] for k, v in recorded.items()})
        builder = Builder(machine, machine.table, where, nothing=nothing)
        carrier = builder.tool(np.arange(count)).bind(column_of)
        pose, jacobian, _ = carrier.pose(machine.table.values[None], 0, count, turn)
        poses[some] = pose[0]
        jacobians[some] = spread(jacobian[0], carrier.columns, len(names))
    return poses, jacobians


def places_by_joints(machine: Mechanism, joints: Array) -> Array:
    """Where the tool is in base coordinates, (m, 3), at joint values (m, n) without what bends, grows or ripples: millimetres
    off, and many times faster where such columns would have to be computed."""
    from robocal._jit import as_kernel_array

    alone = {"1", *names_of(machine)}
    elements = [replace(e, terms=tuple(t for t in e.terms if t.column in alone)) for e in machine.elements]
    program = compile_path(elements, machine.table)
    x, places = machine.table.values[None], np.empty((len(joints), 3))
    own = [names_of(machine).index(c) for c in program.columns]
    moving = as_kernel_array(joints if own == list(range(joints.shape[1])) else joints[:, own])
    for first in range(0, len(joints), CHUNK):
        some = slice(first, first + CHUNK)
        phi = moving[None, some]
        places[some] = program.run(x, phi, trig=program.cosines(phi, rough=True))[0][0, :, :3, 3]
    return places


def size_of(machine: Mechanism) -> float:
    """How large a machine is (m), wherever its base is: the mean distance of the points of its frame from their middle; of an arm how
    far its tool gets from the middle of where it gets, with every joint turned all round. Zero where nothing says it."""
    points = machine.frame_points
    if len(points):
        return float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean())
    if not joints_of(machine):
        return 0.0
    ends = [(j.lower, j.upper) if j.type == "prismatic" else (-np.pi, np.pi) for j in joints_of(machine)]
    low, high = np.nan_to_num(np.array(ends), posinf=0.0, neginf=0.0).T
    places = places_by_joints(machine, low + np.random.default_rng(0).random((DRAWN, len(low))) * (high - low))
    return float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())


def place_is_known(machine: Model, configurations: Configurations) -> Bools | None:
    """Of which configurations (U,) it is known where the machine is believed to stand; None where of none."""
    c = configurations
    if c.joints is None and (freedom_of(machine) is None or c.start is None):
        return None
    known = np.ones(len(c), dtype=np.bool_) if c.joints is None else np.isfinite(c.joints).all(axis=1)
    if freedom_of(machine) is not None and c.start is not None:
        known = known & np.isfinite(c.start).all(axis=1)
    return np.asarray(known)


def nominal_poses(machine: Model, configurations: Configurations) -> Array | None:
    """T_base_tool (U, 4, 4) where the machine is believed to stand, NaN where that is not known; None where it is of no
    configuration."""
    c, known = configurations, place_is_known(machine, configurations)
    if known is None:
        return None
    out = np.full((len(c), 4, 4), np.nan)
    some = np.flatnonzero(known)
    if len(some):
        builder = Builder(machine, machine.table, c.take(some))
        x = np.concatenate([machine.table.values, builder.configurations.starts.ravel()])[None]
        out[some] = builder.tool(np.arange(len(some))).pose(x, 0, len(some))[0][0]
    return out


def limits_of(machine: Model) -> Array:
    """Joint limits in rad or m, (n, 2)."""
    return np.array([(j.lower, j.upper) for j in joints_of(machine)]).reshape(-1, 2)


def names_of(machine: Model) -> tuple[str, ...]:
    """The names of the joints."""
    return tuple(j.name for j in joints_of(machine))

"""A chain: a serial arm as a path of elementary transforms (`geometry.path`), its joints and its parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import field, record, replace
from robocal._types import Array, Ints
from robocal.arms.columns import ChainColumn
from robocal.errors import ModelError, nearest, one_of
from robocal.geometry.axes import line_along, lines_of_axes
from robocal.geometry.gravity import GRAVITY
from robocal.geometry.path.program import Element, Joint, Program, Term, Zero, compile_path, offset_matrix
from robocal.geometry.path.unjointed import Whole
from robocal.parameters import ParameterTable
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Chain", "Extra", "Group", "drive_term", "joint_offsets", "with_offsets"]

CHUNK = 2048  # configurations
WIDEST = 1000.0  # m or rad
Extra = Mapping[str, ArrayLike] | None  # columns by name, numbers or (m,)


@record
class Group:
    """What was added to a chain beyond geometry: its name, the options that it was added with, its parameters."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    parameters: tuple[str, ...] = ()


@record
class Chain(Whole):
    """A serial arm: elements from the base to the tool, its joints, and its parameter table (SI, rad).

    `geometric` names the parameters that describe the joints' geometry: no gains, no base, no tool. `derived` are
    columns that are computed from a configuration (`columns.py`), `groups` what was added beyond geometry
    (`groups.py`). `upright`: its convention cannot tilt parallel axes; `better` is one that can, where there is one.
    """

    name: str
    elements: tuple[Element, ...]
    joints: tuple[Joint, ...]
    table: ParameterTable
    convention: str = "elements"
    source: str = ""
    meta: Mapping[str, object] = field(default_factory=dict, compare=False)
    geometric: tuple[str, ...] = ()
    derived: tuple[ChainColumn, ...] = ()
    groups: tuple[Group, ...] = ()
    upright: bool = False
    better: str = ""

    @property
    def freedom(self) -> None:
        """An arm has no pose of its own: its joints say where it is."""
        return None

    @cached_property
    def program(self) -> Program:
        """The compiled path."""
        return compile_path(self.elements, self.table)

    @property
    def gravity(self) -> tuple[float, float, float]:
        """As a group states it, else with z up."""
        stated = (g.options["gravity"] for g in self.groups if "gravity" in g.options)
        x, y, z = next(stated, GRAVITY)
        return x, y, z

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints from base to tool."""
        return tuple(j.name for j in self.joints)

    @property
    def limits(self) -> Array:
        """Joint limits, shape (n, 2); those beyond 1000 m or rad are none, as programs write that nobody bounds a joint."""
        found = np.array([(j.lower, j.upper) for j in self.joints], dtype=float).reshape(-1, 2)
        return np.where(np.abs(found) < WIDEST, found, np.copysign(np.inf, found))

    def with_values(self, values: Mapping[str, float] | Array) -> Chain:
        """The same arm with other parameter values; columns that depend on them are taken anew."""
        table = self.table.with_values(values)
        return replace(self, table=table, derived=tuple(c.at(table) for c in self.derived))

    def with_table(self, table: ParameterTable) -> Chain:
        """The same arm with another table of the same values."""
        return replace(self, table=table)

    def phi(self, joints: ArrayLike, extra: Extra = None, program: Program | None = None) -> Array:
        """The columns (m, C) that a program reads: joint values (m, n), named extras (m,), and what follows from them."""
        q = np.atleast_2d(np.asarray(joints, float))
        if q.shape[1] != len(self.joints):
            expected = f"{len(self.joints)} for {self.name}"
            raise ModelError("wrong number of joint values", found=q.shape[1], expected=expected)
        known = {name: q[:, i] for i, name in enumerate(self.joint_names)}
        known.update(_columns(extra, len(q)))
        columns = (program or self.program).columns
        for made in self.derived:
            if any(name in columns for name in made.names):
                known.update(made.columns(q, known))
        for column in columns:
            if column not in known:
                message = "the model needs a column that the configurations lack"
                raise ModelError(message, key=column, suggestion=nearest(column, known))
        if not columns:
            return np.empty((len(q), 0))
        return np.ascontiguousarray(np.stack([known[c] for c in columns], axis=-1))

    def run(
        self, joints: ArrayLike, extra: Extra = None, entries: tuple[Ints, Array] | None = None, width: int = 0
    ) -> tuple[Array, Array]:
        """T_base_tool (m, 4, 4) and J (m, 6, width) of some entries of the program, so many configurations at a time that
        their columns stay in the cache."""
        q = np.atleast_2d(np.asarray(joints, float))
        recorded = _columns(extra, len(q))
        theta, parts = self.table.values[None], []
        for first in range(0, max(len(q), 1), CHUNK if self.derived else max(len(q), 1)):
            some = slice(first, first + (CHUNK if self.derived else len(q)))
            phi = self.phi(q[some], {k: v[some] for k, v in recorded.items()})
            poses, columns = self.program.run(theta, phi[None], entries, width)
            parts.append((poses[0], columns[0]))
        pose, jacobian = (p[0] if len(p) == 1 else np.concatenate(p) for p in zip(*parts, strict=True))
        return pose, jacobian

    def pose(self, joints: ArrayLike, extra: Extra = None) -> Array:
        """Forward kinematics T_base_tool, (m, 4, 4), for joint values (m, n) in rad or m."""
        return self.run(joints, extra)[0]

    def jacobian(self, joints: ArrayLike, extra: Extra = None) -> Array:
        """Geometric Jacobian (m, 6, n) of the tool: rows (v, w) in base coordinates, one column per joint."""
        return self.run(joints, extra, self.program.joint_entries(self.joint_names), len(self.joints))[1]

    def parameter_jacobian(self, joints: ArrayLike, names: Sequence[str] | None = None, extra: Extra = None) -> Array:
        """Jacobian (m, 6, k) with respect to named parameters (all by default); frames in their tangent (dv, dw)."""
        wanted = self.table.names if names is None else tuple(names)
        return self.run(joints, extra, self.entries(wanted), len(wanted))[1]

    def entries(self, names: Sequence[str]) -> tuple[Ints, Array]:
        """The entries of the Jacobian with respect to named parameters, one column each."""
        column_of = np.full(len(self.table), -1, dtype=np.int64)
        for i, name in enumerate(names):
            _ = self.table[name]
            column_of[self.table.index[name]] = i
        return self.program.entries(column_of)

    @property
    def usual(self) -> tuple[str, ...]:
        """The parameters that an identification frees by default: the joints' geometry and the tool, in table
        order.

        Never gains, joint offsets that the geometry repeats, the home pose, or the base (an instrument's frame says the
        same).
        """
        wanted = {*self.geometric, *(n for n in self.table.names if n.startswith("tool."))}
        return tuple(n for n in self.table.names if n in wanted)

    def parallel_axes(self, tolerance: float = 0.05) -> tuple[tuple[str, str], ...]:
        """Pairs of consecutive joints whose axes are parallel within `tolerance` rad: where a model without Hayati's beta
        is incomplete.

        The angle is atan2(|a x b|, |a . b|) between the axes at zero; it does not depend on the joint values.
        """
        j = self.jacobian(np.zeros((1, len(self.joints))))[0]
        axes = [j[3:, i] if joint.type == "revolute" else j[:3, i] for i, joint in enumerate(self.joints)]
        angles = [math.atan2(np.linalg.norm(np.cross(a, b)), abs(a @ b)) for a, b in pairwise(axes)]
        pairs = zip(pairwise(self.joint_names), angles, strict=True)
        return tuple(pair for pair, angle in pairs if angle < tolerance)

    @cached_property
    def lengths(self) -> tuple[str, ...]:
        """The lengths of the geometry, which share the scale of the arm."""
        return tuple(n for n in self.geometric if self.table[n].unit == "m")

    # --- what an identification asks of any machine -------------------------------------------------------------------------

    @property
    def parts(self) -> Mapping[str, tuple[str, ...]]:
        """The names of its joints."""
        return {"joint": self.joint_names}

    def remarks(self) -> tuple[Remark, ...]:
        """What its geometry shows before anything is measured: parallel axes that the convention cannot tilt, where any of it is free."""
        parallel = self.parallel_axes() if self.upright and set(self.table.free) & set(self.geometric) else ()
        if not parallel:
            return ()
        pairs = tuple(f"{a} and {b}" for a, b in parallel)
        told = {"convention": self.convention, "pairs": pairs, "better": self.better or None}
        return (Remark.of(Code.PARALLEL_AXES, **told),)

    def lines(self, joints: Array | None, poses: Array, extra: Extra = None, /) -> Mapping[str, Array]:
        """The way from the base along its axes to the tool, without a name."""
        q = np.array(joints, float)
        names = self.joint_names
        for joint, others in self.shares.items():
            # What one joint adds to another moves the other's axis with it: each for itself has an axis of its own.
            q[:, names.index(joint)] += sum(c * q[:, names.index(o)] for o, c in others.items() if o in names)
        alone = self.without_shares() if self.shares else self
        end = poses[:, :3, 3]
        points, directions = lines_of_axes(alone.jacobian(q, extra), end)
        base = [self.table[n].value if (n := f"base.{s}") in self.table else 0.0 for s in "xyz"]
        return {"": line_along(points, directions, np.broadcast_to(np.array(base), end.shape), end)}

    @cached_property
    def anywhere(self) -> frozenset[str]:
        """Geometric parameters whose change says nothing of how the arm was made: a joint's zero may be anywhere; and where
        parallel axes are written without Hayati's beta, a small tilt moves lengths along them by metres."""
        names = self.joint_names
        driven = [e for e in self.elements if any(t.column in names for t in e.terms)]
        found = {t.parameter for e in driven for t in e.terms if t.column == "1"}
        if self.upright:
            loose = {joint for pair in self.parallel_axes() for joint in pair}
            found |= {n for n in self.geometric if n.rpartition(".")[0] in loose}
        return frozenset(found)

    @property
    def zeros(self) -> tuple[Zero, ...]:
        """The zeros of the joints, from base to tool; a joint without one is left out.

        The element that a joint q drives has the value drive * gain * q + own * p. Moving p by c is the same as adding
        own c / (drive gain) to q before the model: a joint offset, the one number that every controller takes.
        """
        out = []
        for joint in self.joints:
            for element in self.elements:
                drive = drive_term(element, joint.name)
                own = next((t for t in element.terms if t.column == "1"), None)
                gain = 0.0 if drive is None else drive.factor * self.table[drive.parameter].value
                if drive is not None and own is not None and gain:
                    others = tuple(self.shares.get(joint.name, {}).items())
                    out.append(Zero(joint.name, own.parameter, gain / own.factor, others))
                    break
        return tuple(out)

    @cached_property
    def shares(self) -> dict[str, dict[str, float]]:
        """The joints that count with others: how much of each is added to the joint's own value."""
        out: dict[str, dict[str, float]] = {}
        for joint in self.joint_names:
            drives = ((e, t) for e in self.elements if (t := drive_term(e, joint)) is not None)
            for element, drive in drives:
                added = (t for t in element.terms if t.parameter == drive.parameter and t.column not in ("1", joint))
                mine = {t.column: t.factor / drive.factor for t in added}
                out |= {joint: mine} if mine else {}
        return out

    def without_shares(self) -> Chain:
        """The same arm where each joint counts for itself."""
        shared = {(f"{joint}.gain", other) for joint, own in self.shares.items() for other in own}
        bare = (tuple(t for t in e.terms if (t.parameter, t.column) not in shared) for e in self.elements)
        return replace(self, elements=tuple(replace(e, terms=t) for e, t in zip(self.elements, bare, strict=True)))

    @property
    def open_zeros(self) -> tuple[Zero, ...]:
        """The zeros that an identification may move: those that are free, and where a convention holds them because its frames
        say the same (a URDF, cpc, poe), those of joints of which anything is free."""
        usual, free = set(self.usual), set(self.table.free)
        owners = {n.rpartition(".")[0] for n in free if n in self.geometric}
        return tuple(
            z
            for z in self.zeros
            if z.parameter in free or (z.parameter not in usual and z.parameter.rpartition(".")[0] in owners)
        )


def _columns(extra: Extra, m: int) -> dict[str, Array]:
    """Columns (m,) by name, of numbers too."""
    arrays = {k: np.asarray(v, float) for k, v in (extra or {}).items()}
    return {k: v if v.shape == (m,) else np.broadcast_to(v, (m,)) for k, v in arrays.items()}


def drive_term(element: Element, joint: str) -> Term | None:
    """The term by which a joint moves an element that is its own; others may count with its value."""
    return next((t for t in element.terms if t.column == joint and t.parameter == f"{joint}.gain"), None)


def joint_offsets(nominal: Chain, corrected: Mapping[str, float]) -> list[tuple[str, float]]:
    """What to add to every joint value (rad or m) before the nominal model, from corrected parameter values in SI."""
    zeros = nominal.zeros
    moved = np.array([corrected[z.parameter] - nominal.table[z.parameter].value for z in zeros])
    return [(z.joint, float(v)) for z, v in zip(zeros, np.linalg.solve(offset_matrix(zeros), moved), strict=True)]


def with_offsets(nominal: Chain, offsets: Mapping[str, float]) -> Chain:
    """The chain whose joints count from elsewhere: its pose at q is that of `nominal` at q + offset (rad or m, by joint).

    Raises ModelError for a joint that it does not have.
    """
    known = {z.joint: z for z in nominal.zeros}
    for name in offsets:
        if name not in known:
            facts = one_of(name, known) if known else {}
            raise ModelError("the robot has no such joint", key=name, **facts)
    zeros = tuple(known.values())
    moved = offset_matrix(zeros) @ np.array([float(offsets.get(z.joint, 0.0)) for z in zeros])
    table = nominal.table
    return nominal.with_values(
        {z.parameter: table[z.parameter].value + v for z, v in zip(zeros, moved, strict=True) if v}
    )

"""A chain: a serial arm as a path of elementary transforms (`geometry.path`), its joints and its parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal.arms.columns import Column
from robocal.errors import ModelError, nearest
from robocal.geometry.path.program import Element, Program, compile_path
from robocal.parameters import Table

__all__ = ["Chain", "Group", "Joint"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """A driven axis: its column phi is called `name`; limits in rad or m."""

    name: str
    type: str = "revolute"
    lower: float = -math.inf
    upper: float = math.inf


@dataclass(frozen=True)
class Group:
    """What was added to a chain beyond geometry: its name, the options that it was added with, its parameters."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    parameters: tuple[str, ...] = ()


@dataclass(frozen=True)
class Chain:
    """A serial arm: elements from the base to the tool, its joints, and its parameter table (SI, rad).

    `geometric` names the parameters that describe the joints' geometry: no gains, no base, no tool. `derived` are
    columns that are computed from a configuration (`columns.py`), `groups` what was added beyond geometry
    (`groups.py`).
    """

    name: str
    elements: tuple[Element, ...]
    joints: tuple[Joint, ...]
    table: Table
    convention: str = "elements"
    source: str = ""
    meta: Mapping[str, object] = field(default_factory=dict, compare=False)
    geometric: tuple[str, ...] = ()
    derived: tuple[Column, ...] = ()
    groups: tuple[Group, ...] = ()

    @cached_property
    def program(self) -> Program:
        """The compiled path."""
        return compile_path(self.elements, self.table)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints from base to tool."""
        return tuple(j.name for j in self.joints)

    @property
    def limits(self) -> Array:
        """Joint limits, shape (n, 2)."""
        return np.array([(j.lower, j.upper) for j in self.joints]).reshape(-1, 2)

    def with_values(self, values: Mapping[str, float] | Array) -> Chain:
        """The same arm with other parameter values; columns that depend on them are taken anew."""
        table = self.table.with_values(values)
        return replace(self, table=table, derived=tuple(c.at(table) for c in self.derived))

    def phi(
        self, joints: ArrayLike, extra: Mapping[str, ArrayLike] | None = None, program: Program | None = None
    ) -> Array:
        """The columns (m, C) that a program reads: joint values (m, n), named extras (m,), and what follows from them."""
        q = np.atleast_2d(np.asarray(joints, float))
        if q.shape[1] != len(self.joints):
            raise ModelError(
                "wrong number of joint values", found=q.shape[1], expected=f"{len(self.joints)} for {self.name}"
            )
        known = {name: q[:, i] for i, name in enumerate(self.joint_names)}
        known.update({k: np.broadcast_to(np.asarray(v, float), (len(q),)) for k, v in (extra or {}).items()})
        columns = (program or self.program).columns
        for made in self.derived:
            if any(name in columns for name in made.names):
                known.update(made.columns(q, known))
        for column in columns:
            if column not in known:
                raise ModelError(
                    "the model needs a column that the configurations lack",
                    key=column,
                    suggestion=nearest(column, known),
                )
        return (
            np.ascontiguousarray(np.stack([known[c] for c in columns], axis=-1)) if columns else np.empty((len(q), 0))
        )

    def pose(self, joints: ArrayLike, extra: Mapping[str, ArrayLike] | None = None) -> Array:
        """Forward kinematics T_base_tool, (m, 4, 4), for joint values (m, n) in rad or m."""
        pose: Array = self.program.run(self.table.values[None], self.phi(joints, extra)[None])[0][0]
        return pose

    def jacobian(self, joints: ArrayLike, extra: Mapping[str, ArrayLike] | None = None) -> Array:
        """Geometric Jacobian (m, 6, n) of the tool: rows (v, w) in base coordinates, one column per joint."""
        entries = self.program.joint_entries(self.joint_names)
        jac: Array = self.program.run(
            self.table.values[None], self.phi(joints, extra)[None], entries, len(self.joints)
        )[1][0]
        return jac

    def parameter_jacobian(
        self, joints: ArrayLike, names: Sequence[str] | None = None, extra: Mapping[str, ArrayLike] | None = None
    ) -> Array:
        """Jacobian (m, 6, k) with respect to named parameters (all by default); frames in their tangent (dv, dw)."""
        wanted = self.table.names if names is None else tuple(names)
        column_of = np.full(len(self.table), -1, dtype=np.int64)
        for i, name in enumerate(wanted):
            _ = self.table[name]
            column_of[self.table.index[name]] = i
        entries = self.program.entries(column_of)
        jac: Array = self.program.run(self.table.values[None], self.phi(joints, extra)[None], entries, len(wanted))[1][
            0
        ]
        return jac

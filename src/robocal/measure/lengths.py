"""Cable lengths: r = l_i(T_base_platform) - y, one row per cable and configuration.

value (k, 1) in m; extra["cable"] (k,) is the cable's number from 0; the cable's anchors and sensor zero are the
machine's parameters; its pulley, if any, is taken as stated.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import SYMBOLS, CableRobot, lengths
from robocal.cables.pulley import Pulleys
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.machine import Machine
from robocal.measure.rows import Kind, Rows, register

__all__ = ["LENGTHS", "located"]

Array = NDArray[np.float64]
UNSTATED = (1e-3,)


class LengthRows(Rows):
    """The rows of one cable; columns are the carrier's, then the cable's free numbers."""

    def __init__(
        self,
        builder: Builder,
        obs: Observations,
        name: str,
        index: NDArray[np.int64],
        pulley: Pulleys | None,
    ) -> None:
        cable = builder.rows(f"{name}.{s}" for s in SYMBOLS)
        super().__init__(builder.tool(obs.configuration[index]), obs, index, UNSTATED, cable)
        self.pulley = pulley

    def evaluate(self, x: Array, which: NDArray[np.int64], first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows)
        length, by_pose, by_cable = lengths(t, x[:, self.numbers], self.pulley)
        row = by_pose[:, :, None, :]
        jac = np.concatenate([row @ j, by_cable[:, :, None, self.own]], axis=-1)
        return length[..., None] - self.measured(which, first, rows), jac, row @ jl


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per cable."""
    machine = builder.machine
    cables: tuple[str, ...] = getattr(machine, "cables", ())
    if not cables:
        raise ModelError("cable lengths need a cable robot", found=machine.name, expected="kind: cable")
    pulley: Callable[[int], Pulleys | None] = getattr(machine, "pulley")  # noqa: B009
    number = obs.extra["cable"].astype(np.int64)
    if len(number) and not 0 <= number.min() <= number.max() < len(cables):
        raise ModelError(
            "no such cable",
            key="cable",
            found=[int(number.min()), int(number.max())],
            expected=f"0 to {len(cables) - 1}",
        )
    return [
        LengthRows(builder, obs, name, np.flatnonzero(number == i), pulley(i))
        for i, name in enumerate(cables)
        if (number == i).any()
    ]


def located(machine: Machine, obs: Observations, wanted: NDArray[np.bool_]) -> Array:
    """T_base_platform (U, 4, 4) of the wanted configurations (U,) by forward kinematics, NaN where a length is missing or
    the lengths do not tell."""
    from robocal.cables.forward import forward

    out = np.full((len(wanted), 4, 4), np.nan)
    robot = cast(CableRobot, machine)
    table = np.full((len(wanted), len(robot.cables)), np.nan)
    table[obs.configuration, obs.extra["cable"].astype(np.int64)] = obs.value[:, 0]
    some = np.flatnonzero(wanted & np.isfinite(table).all(axis=1))
    if len(some) and len(robot.cables) >= len(robot.axes):
        found = forward(robot, table[some])
        good = found.converged & np.isfinite(found.pose).all(axis=(1, 2))
        out[some[good]] = found.pose[good]
    return out


LENGTHS = register(Kind("lengths", 1, terms, parts=((0, 1, "m"),), metric=True))

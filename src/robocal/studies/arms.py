"""Trials of whole identifications of arms: another true robot, another set of configurations and other noise in each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robocal.calibrate.identify import identify
from robocal.calibrate.options import Options
from robocal.files.robot import open_robot
from robocal.files.studyfile import Point
from robocal.measure.data import DataSet
from robocal.planning.candidates import joint_range
from robocal.simulation.hiding import hidden
from robocal.simulation.rigs import STANDS, Instrument, measure

__all__ = ["ArmTrials"]

Array = NDArray[np.float64]
NOISE = 5e-5  # m, of a tracker that nobody stated


class ArmTrials:
    """One point of a study: of every trial whether the model improved (1 or 0), and the mean errors (m) of what was held out, or left out
    one by one, before and after.

    A tracker that stands somewhere measures positions with normal noise; so large a share of the configurations as `gross` says has an
    error of its size on top.
    """

    outputs = {"improved": "1", "before": "m", "after": "m"}  # noqa: RUF012

    def __init__(self, point: Point) -> None:
        self.point = point
        self.arm = open_robot(point["robot"])
        self.options = Options(
            loss=point["options.loss"], method=point["options.method"], hold_out=point["options.hold_out"]
        )

    def run(self, count: int, rng: np.random.Generator) -> dict[str, Array]:
        """The outputs of so many trials, (count,)."""
        out = {name: np.full(count, np.nan) for name in self.outputs}
        for i, own in enumerate(rng.spawn(count)):
            found = identify(self.arm.chain, self._data(own), self.options)
            stage = next(s for s in found.stages if s.unit == "m")
            before, after = stage.held_out_before or stage.leave_one_out_before, stage.held_out or stage.leave_one_out
            out["improved"][i] = found.verdict.status == "improved"
            if before is not None and after is not None:
                out["before"][i], out["after"][i] = before.mean, after.mean
        return out

    def _data(self, rng: np.random.Generator) -> DataSet:
        chain, p = self.arm.chain, self.point
        size = {"m": p["errors.length"], "rad": p["errors.angle"]}
        moved = {n: chain.table[n].value + rng.normal() * size.get(chain.table[n].unit, 0.0) for n in chain.geometric}
        low, high = joint_range(chain).T
        q = rng.uniform(low, high, (p["poses.count"], len(low)))
        noise = NOISE if p["noise.position"] is None else p["noise.position"]
        data = hidden(measure(chain.with_values(moved), q, Instrument("position", noise, frame=STANDS), rng))
        bad = rng.uniform(size=len(q)) < p["gross.share"]
        along = rng.normal(size=(len(q), 3))
        along *= bad[:, None] * p["gross.size"] / np.linalg.norm(along, axis=1, keepdims=True)
        (obs,) = data.observations
        return replace(data, observations=(replace(obs, value=obs.value + along[obs.configuration]),))

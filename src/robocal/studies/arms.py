"""Trials of whole identifications of arms: another true robot, another set of configurations and other noise in each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.files.robot import open_robot
from robocal.files.studyfile import Point
from robocal.fit.options import Options
from robocal.measure.data import DataSet, Frame
from robocal.planning.candidates import joint_range
from robocal.prove.decide import decide
from robocal.prove.identify import identify
from robocal.prove.verdict import verdict_of
from robocal.simulation.hiding import hidden
from robocal.simulation.rigs import STANDS, Instrument, measure
from robocal.studies.arm_poses import ArmPoses
from robocal.studies.true_robots import coverage, elsewhere

__all__ = ["ArmTrials"]

UNITS = {"improved": "1", "before": "m", "after": "m", "elsewhere": "m", "coverage": "1"}
NOISE = 5e-5  # m, of a tracker that nobody stated


class ArmTrials:
    """One point of a study: of every trial whether the model improved (1 or 0), the mean errors (m) of what was held out, or left out
    one by one, before and after, that of the identified model at other poses, and the share of its intervals that hold the truth.

    A tracker that stands somewhere measures positions with normal noise, or full poses where a noise of orientations is said; so large
    a share of the configurations as `gross` says has an error of its size on top.
    """

    def __init__(self, point: Point, seed: int = 0) -> None:
        self.point = point
        self.outputs = {name: UNITS[name] for name in point["outputs"]}
        self.arm = open_robot(point["robot"])
        self.options = Options(
            loss=point["options.loss"], method=point["options.method"], hold_out=point["options.hold_out"]
        )
        self.tracker = _tracker(point["noise.position"], point["noise.orientation"])
        middle = joint_range(self.arm.chain).mean(axis=1)
        seen = measure(self.arm.chain, middle[None], self.tracker, np.random.default_rng(0))
        self.poses = ArmPoses(point, self.arm.chain, seen.observations, seed)

    def run(self, count: int, rng: np.random.Generator) -> dict[str, Array]:
        """The outputs of so many trials, (count,)."""
        out = {name: np.full(count, np.nan) for name in UNITS}
        for i, own in enumerate(rng.spawn(count)):
            truth, frame, data = self._measure(own)
            found = decide(self.arm.chain, data, self.options)
            out["improved"][i] = verdict_of(found, over_range=False).status == "improved"
            if (unseen := found.unseen("m")) is not None:
                out["before"][i], out["after"][i] = (errors.mean for errors in unseen)
            # Streams of their own: what is judged does not change what is measured.
            if "elsewhere" in self.outputs:
                out["elsewhere"][i] = elsewhere(found, truth, self.poses.draw_tests(own.spawn(1)[0]), frame)
            if "coverage" in self.outputs:
                out["coverage"][i] = coverage(identify(self.arm.chain, data, self.options), truth, frame)
        return {name: out[name] for name in self.outputs}

    def _measure(self, rng: np.random.Generator) -> tuple[Chain, Frame, DataSet]:
        """A true arm, where the tracker stands, and what is handed in of what it measured."""
        p = self.point
        truth = self._true(rng)
        q = self.poses.draw_joints(rng)
        data = measure(truth, q, self.tracker, rng)
        bad = rng.uniform(size=len(q)) < p["gross.share"]
        along = rng.normal(size=(len(q), 3))
        along *= bad[:, None] * p["gross.size"] / np.linalg.norm(along, axis=1, keepdims=True)
        (obs,) = data.observations
        assert obs.frame is not None
        value = np.array(obs.value)
        value[:, :3] += along[obs.configuration]
        told = replace(obs, value=value, sigma=obs.sigma if p["noise.stated"] else None)
        return truth, obs.frame, hidden(replace(data, observations=(told,)))

    def _true(self, rng: np.random.Generator) -> Chain:
        chain, p = self.arm.chain, self.point
        size = {"m": p["errors.length"], "rad": p["errors.angle"]}
        tool = [n for n in chain.table.free if n.startswith("tool.")] if p["errors.tool"] else []
        names = [*chain.geometric, *tool]
        return chain.with_values(
            {n: chain.table[n].value + rng.normal() * size.get(chain.table[n].unit, 0.0) for n in names}
        )


def _tracker(noise: float | None, turn: float | None) -> Instrument:
    """Of positions (noise in m), or of full poses where a noise of orientations (rad) is said."""
    plain = Instrument(noise=NOISE if noise is None else noise, frame=STANDS)
    return plain if turn is None else replace(plain, kind="pose", angle_noise=turn)

"""Trials of whole identifications of arms: another true robot, another set of configurations and other noise in each.

Where the arms of a study are measured, and at which other poses they are judged.

What only a simulation can say of an identified arm: how far it is from the true one, and whether its intervals hold the truth.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.files.pose_table import read_poses
from robocal.files.robot import open_robot
from robocal.files.studyfile import Point
from robocal.fit.options import Options
from robocal.measure.base import problem
from robocal.measure.data import DataSet, Frame
from robocal.parameters import FRAME_SYMBOLS
from robocal.planning.candidates import Template, joint_range
from robocal.planning.pose_selection import PlanOptions, plan
from robocal.prove.decision import Decision, decide
from robocal.prove.identify import Identification, identify
from robocal.prove.verdict import verdict_of
from robocal.simulation.rigs import STANDS, Instrument, hidden, measure

__all__ = ["ArmTrials", "coverage"]


def coverage(found: Identification[Chain], truth: Chain, frame: Frame) -> float:
    """Share of the fitted parameters whose 95 % interval, that of result.json, holds the true value; those of the instrument's frame are
    among them. NaN where nothing was fitted."""
    real = {p.name: p.value for p in (*truth.table.rows, *frame.parameters)}
    told = [(p.interval, real[p.name]) for p in found.parameters if p.interval is not None]
    return float(np.mean([low <= value <= high for (low, high), value in told])) if told else float("nan")


def elsewhere(found: Decision[Chain], truth: Chain, q: Array, frame: Frame) -> float:
    """Mean distance (m) between the tool points of the identified and of the true arm at joint values q (m, n), as the instrument whose
    true frame this is would see them: its place is identified with the arm."""
    data = measure(truth, q, Instrument("position", frame=frame.value, name=frame.name), None)
    (obs,) = data.observations
    at = Frame(frame.name, tuple(found.values[f"{frame.name}.{s}"] for s in FRAME_SYMBOLS))
    made = problem(found.corrected, replace(data, observations=(replace(obs, frame=at),)))
    return float(np.linalg.norm(made.residuals(made.start)[0].value, axis=-1).mean())


JUDGED = 300  # poses at which a trial is judged, where no list says which


class ArmPoses:
    """The poses of one point: a list, so many drawn within the joint limits in every trial, or so many that `plan` chooses once, with its
    defaults and the study's seed, for an instrument like the template's.

    Where a list says at which poses the robot has to be accurate (`tests`), its first, third, ... are planned for and those between are
    judged; otherwise poses drawn within the joint limits are, others for either.
    """

    def __init__(self, point: Point, chain: Chain, template: Template, seed: int) -> None:
        self.point, self.chain, self.template, self.seed = point, chain, template, seed
        # Read at once, so that a list that is not there is told before the first trial, whatever the trials say of it.
        self.listed = self._list("poses.file")
        self.tests = self._list("poses.tests")  # where the robot has to be accurate, (t, n)

    @cached_property
    def common(self) -> Array | None:
        """What is measured in every trial, (m, n); None where every trial draws its own."""
        if self.listed is not None:
            return self.listed
        p = self.point
        if p["poses.choose"] == "random":
            return None
        options = PlanOptions(p["poses.count"], p["poses.criterion"], seed=self.seed)
        wanted = None if self.tests is None else self.tests[::2]
        return plan(self.chain, self.template, options, tests=wanted).q

    def draw_joints(self, rng: np.random.Generator) -> Array:
        """The joint values of one trial, (m, n)."""
        return self._drawn(self.point["poses.count"], rng) if self.common is None else self.common

    def draw_tests(self, rng: np.random.Generator) -> Array:
        """Joint values (t, n) that were neither measured nor planned for."""
        return self._drawn(JUDGED, rng) if self.tests is None else self.tests[1::2]

    def _drawn(self, count: int, rng: np.random.Generator) -> Array:
        low, high = joint_range(self.chain).T
        return rng.uniform(low, high, (count, len(low)))

    def _list(self, key: str) -> Array | None:
        return None if self.point[key] is None else read_poses(self.point[key], self.chain)[1]


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
        self.options = Options(**{name: point[f"options.{name}"] for name in ("loss", "method", "hold_out")})
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
        rows = (chain.table[name] for name in (*chain.geometric, *tool))
        return chain.with_values({r.name: r.value + rng.normal() * size.get(r.unit, 0.0) for r in rows})


def _tracker(noise: float | None, turn: float | None) -> Instrument:
    """Of positions (noise in m), or of full poses where a noise of orientations (rad) is said."""
    plain = Instrument(noise=NOISE if noise is None else noise, frame=STANDS)
    return plain if turn is None else replace(plain, kind="pose", angle_noise=turn)

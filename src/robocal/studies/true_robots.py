"""What only a simulation can say of an identified arm: how far it is from the true one, and whether its intervals hold the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.measure.base import problem
from robocal.measure.data import Frame
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.decision import Decision
from robocal.prove.identification import Identification
from robocal.simulation.rigs import Instrument, measure

__all__ = ["coverage", "elsewhere"]


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

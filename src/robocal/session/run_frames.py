"""Frames and numbers of instruments as a run found them, for data of a rig whose poses are known: nothing else of it was to be found."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from robocal._record import replace
from robocal.files.runfolder import find_run
from robocal.files.units import UNITS
from robocal.measure.data import Frame, Observations
from robocal.measure.machine import freedom_of, joints_of
from robocal.measure.rows import number_names
from robocal.parameters import FRAME_SYMBOLS
from robocal.session.opened import Inputs

__all__ = ["with_frames_of_run"]


def with_frames_of_run(robot: str | os.PathLike[str], inputs: Inputs) -> Inputs:
    """The data with frames, targets and numbers fixed where the run folder of such a rig has them; of anything else the same. Raises as
    `open_run`."""
    machine = inputs.opened.machine
    if not Path(robot).exists() or freedom_of(machine) != () or joints_of(machine):
        return inputs
    run = find_run(Path(robot))
    if run is None:
        return inputs
    known = {p.name: UNITS[p.unit].to_si(p.identified) for p in run.result.parameters if p.identified is not None}
    seen = tuple(_fixed(obs, known) for obs in inputs.data.observations)
    return inputs.with_data(replace(inputs.data, observations=seen))


def _fixed(obs: Observations, known: Mapping[str, float]) -> Observations:
    def fix(frame: Frame) -> Frame:
        names = [f"{frame.name}.{s}" for s in FRAME_SYMBOLS]
        if not set(names) & set(known):
            return frame
        value = tuple(known.get(n, v) for n, v in zip(names, frame.value, strict=True))
        return replace(frame, value=value, free=(False,) * 6, prior=None)

    options = dict(obs.options)
    own = {n.rpartition(".")[2]: known[n] for n in number_names(obs) if n in known}
    if own:
        stated = options.get("values")
        options |= {"values": {**(stated if isinstance(stated, dict) else {}), **own}, "free": ()}
    frame = None if obs.frame is None else fix(obs.frame)
    return replace(obs, frame=frame, targets=tuple(map(fix, obs.targets)), options=options)

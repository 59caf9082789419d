"""What an instrument shows at one configuration: from a data file, from measurements, or from its kind alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.errors import ModelError, nearest
from robocal.files.robot import Robot
from robocal.fit.fit import fit
from robocal.fit.options import Options
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.planning.candidates import Template
from robocal.prove.identify import baseline
from robocal.session.inputs import Inputs
from robocal.session.simulated_robot import sample_joints
from robocal.session.simulator import parse_frame
from robocal.session.watching import Watch
from robocal.simulation.rigs import CONTACTS, RIGS, Instrument, measure

__all__ = ["template", "template_from_data"]

SAMPLE = 40  # poses that say where an instrument may stand that only its kind describes


def template(
    arm: Robot, done: Inputs | None, given: Inputs | None, kind: str, noise: float | None, frame: str
) -> Template:
    """What one configuration shows: of the data file, else of what was measured before, else by its kind."""
    source = given or done
    if source is not None:
        return _typical(source.data, noise)
    if kind not in RIGS or kind in CONTACTS:
        fitting = [k for k in RIGS if k not in CONTACTS]
        raise ModelError(
            "this kind needs a data file that describes it", key="--kind", found=kind,
            expected=f"{', '.join(fitting)}, or DATA", suggestion=nearest(kind, fitting),
        )  # fmt: skip
    plainly = Instrument(kind, frame=parse_frame(frame, arm.units))
    plainly = plainly if noise is None else replace(plainly, noise=noise)
    rng = np.random.default_rng(0)
    return _typical(measure(arm.chain, sample_joints(arm.chain, SAMPLE, rng), plainly, rng), None)


def _typical(data: DataSet, noise: float | None) -> Template:
    """The rows of the configuration that shows most, with the sigma that is typical of each instrument."""
    if any(o.second is not None for o in data.observations):
        kind = next(o.kind for o in data.observations if o.second is not None)
        raise ModelError(
            "this kind compares two configurations, and poses are planned one by one", found=kind,
            expected="a plan for positions: the same poses serve",
        )  # fmt: skip
    counts = np.sum(
        [np.bincount(o.configuration, minlength=len(data.configurations)) for o in data.observations], axis=0
    )
    found = data.take(np.flatnonzero(counts == counts.max())[:1])
    out = []
    for obs in found.observations:
        whole = [
            o.sigma for o in data.observations if o.label == obs.label and o.kind == obs.kind and o.sigma is not None
        ]
        usual = None if not whole else np.median(np.concatenate(whole), axis=0)
        if noise is not None:
            usual = np.full(obs.value.shape[-1], 1e-4) if usual is None else np.array(usual)
            for start, stop, unit in kind_of(obs).parts:
                usual[start:stop] = noise if unit == "m" else usual[start:stop]
        out.append(replace(obs, sigma=None if usual is None else np.tile(usual, (len(obs), 1))))
    return tuple(out)


def template_from_data(
    arm: Robot, shown: Template, done: Inputs | None, given: Inputs | None, watch: Watch | None
) -> tuple[Template, DataSet | None, dict[str, float] | None]:
    """What was measured with the noise that it showed, and the values of parameters and frames that were fitted to
    it."""
    source = done or given
    if source is None:
        return shown, None, None
    everyone = np.arange(len(source.data.configurations))
    problem, x = baseline(arm.chain, source.data, everyone, watch)
    if done is None:
        # The file only says what the instrument is and where it stands.
        own = {n: float(v) for n, v in zip(problem.table.names, x[0], strict=False) if n not in arm.chain.table}
        return shown, None, own
    fitted = fit(arm.chain, done.data, everyone, Options(), x, watch)
    values = {n: float(v) for n, v in zip(fitted.problem.table.names, fitted.solution.x[0], strict=False)}
    used = {(o.kind, o.label): o for o in fitted.data.observations}
    out = []
    for obs in shown:
        same = used.get((obs.kind, obs.label))
        if same is not None and same.sigma is not None:
            # Of one instrument the noise is what the fit left, not what the file states.
            obs = replace(obs, frame=same.frame, sigma=np.tile(np.median(same.sigma, axis=0), (len(obs), 1)))
        out.append(obs)
    return tuple(out), fitted.data, values

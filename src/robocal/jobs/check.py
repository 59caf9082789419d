"""The verb `check`: what robot and data files say and what they can tell, before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS, parallel_axes
from robocal.calibrate.identify import baseline
from robocal.estimate.identifiability import Identifiability, analyse
from robocal.files.dataset import InputFile
from robocal.files.robot import Robot
from robocal.geometry import fits
from robocal.jobs.inputs import Watch, computable, open_arm, read_inputs, robot_files
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet

__all__ = ["Checked", "check"]


@dataclass(frozen=True)
class Checked:
    """What was found: the robot, the instruments (one mapping each), what the data can tell at the nominal model, and
    warnings."""

    robot: Robot
    data: DataSet | None
    instruments: tuple[dict[str, Any], ...]
    free: tuple[str, ...]
    seen: Identifiability | None
    misfit: float | None  # mean error of the nominal model with fitted frames (m)
    assumed: bool  # whether some noise had to be assumed
    warnings: tuple[str, ...]
    inputs: tuple[InputFile, ...]

    @property
    def document(self) -> dict[str, Any]:
        """The same for machines."""
        chain, seen = self.robot.chain, self.seen
        joints = [{"name": j.name, "type": j.type, "lower": j.lower, "upper": j.upper} for j in chain.joints]
        told = None
        if seen is not None:
            told = {
                "rank": seen.rank,
                "n_free": len(seen.names),
                "structural_rank": seen.structural_rank,
                "condition": seen.condition,
                "kept": list(seen.kept),
                "dropped": list(seen.dropped),
                "combinations": [c.text for c in seen.combinations],
                "observability": seen.indices,
                "sigma_assumed": self.assumed,
            }
        return {
            "robot": {"name": chain.name, "convention": chain.convention, "joints": joints, "source": chain.source},
            "instruments": list(self.instruments),
            "configurations": None if self.data is None else len(self.data.configurations),
            "free": list(self.free),
            "identifiability": told,
            "baseline_mean_error_mm": None if self.misfit is None else self.misfit * 1e3,
            "warnings": list(self.warnings),
            "inputs": [{"file": str(i.file), "sha256": i.sha256} for i in self.inputs],
        }


def check(
    robot: str, data: Sequence[str] = (), *, base: str | None = None, tip: str | None = None, watch: Watch | None = None
) -> Checked:
    """Reads a robot, and data files when there are any. Raises InputError for whatever is wrong with them."""
    if not data:
        arm = open_arm(robot, base=base, tip=tip)
        warnings = (*arm.warnings, *_model_warnings(arm.chain))
        return Checked(arm, None, (), arm.chain.table.free, None, None, False, warnings, robot_files(arm, robot))
    inputs = read_inputs(robot, data, base=base, tip=tip, watch=watch)
    chain, measured = inputs.robot.chain, inputs.data
    with computable(robot, *data):
        problem, x = baseline(chain, measured, np.arange(len(measured.configurations)), watch)
        free = problem.table.free
        seen = analyse(problem.with_free(free), x) if free else None
    lengths = [np.linalg.norm(r.value[:, a:b], axis=1) for r in problem.residuals(x) for a, b, u in r.parts if u == "m"]
    misfit = float(np.concatenate(lengths).mean()) if lengths else None
    assumed = any(o.sigma is None for o in measured.observations)
    rows = sum(o.value.size for o in measured.observations)
    own = [f"few measurements: {rows} numbers for {len(free)} free parameters"] if rows < 2 * len(free) else []
    warnings = (*inputs.warnings, *_model_warnings(chain), *_data_warnings(chain, measured), *own)
    return Checked(inputs.robot, measured, _instruments(measured), free, seen, misfit, assumed, warnings, inputs.files)


def _model_warnings(chain: Chain) -> tuple[str, ...]:
    out = []
    rule = CONVENTIONS.get(chain.convention)
    pairs = parallel_axes(chain)
    if pairs and rule is not None and not rule.complete:
        names = "; ".join(f"{a} and {b}" for a, b in pairs)
        better = (
            f"{chain.convention}-hayati"
            if f"{chain.convention}-hayati" in CONVENTIONS
            else "a convention with Hayati's beta"
        )
        out.append(f"parallel axes ({names}): {chain.convention} cannot say how they tilt to each other; {better} can")
    if not chain.table.free:
        out.append("nothing of the robot is free: there is nothing to identify")
    return tuple(out)


def _data_warnings(chain: Chain, data: DataSet) -> tuple[str, ...]:
    out = []
    q = data.configurations.joints
    if q is not None and len(q) > 1:
        still = [n for n, s in zip(chain.joint_names, np.ptp(q, axis=0), strict=True) if s < 1e-9]
        if len(still) == len(chain.joints):
            out.append("all configurations are equal: this shows repeatability, not geometry")
        elif still:
            out.append(f"these joints never move: {', '.join(still)}")
    for obs in data.observations:
        if obs.kind in ("position", "pose") and len(obs) > 3:
            points = obs.value[:, :3]
            extent, off = float(np.linalg.norm(np.ptp(points, axis=0))), float(np.abs(fits.plane(points)[2]).max())
            if extent > 0 and off < 0.02 * extent:
                out.append(
                    f"all points of {obs.label} lie in one plane (within {off * 1e3:.3g} mm): parameters across it are poorly seen"
                )
    return tuple(out)


def _instruments(data: DataSet) -> tuple[dict[str, Any], ...]:
    out = []
    for obs in data.observations:
        sigma = {} if obs.sigma is None else {
            unit: float(np.sqrt(np.mean(obs.sigma[:, a:b] ** 2))) for a, b, unit in kind_of(obs).parts
        }  # fmt: skip
        out.append(
            {
                "name": obs.label,
                "kind": obs.kind,
                "source": obs.source,
                "rows": len(obs),
                "configurations": len(np.unique(obs.configuration)),
                "sigma_source": "stated" if sigma else "estimated from the residuals",
                "sigma_m": sigma.get("m"),
                "sigma_rad": sigma.get("rad"),
                "sigma_px": sigma.get("px"),
                "frame": "none"
                if obs.frame is None
                else "free"
                if all(obs.frame.free)
                else "known"
                if not any(obs.frame.free)
                else "partly free",
                "targets": [t.name for t in obs.targets],
                "places": [f.name for f in kind_of(obs).frames(obs)],
            }
        )
    return tuple(out)

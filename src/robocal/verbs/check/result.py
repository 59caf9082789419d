"""What robot and data files say and what they can tell, before anything is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robocal.diagnose.context import Context
from robocal.diagnose.gross import sift
from robocal.diagnose.moved import moved
from robocal.diagnose.outliers import Outlier, named
from robocal.diagnose.registry import When, run
from robocal.estimate.identifiability import Identifiability, analyse
from robocal.files.parts import hashes
from robocal.files.text import InputFile
from robocal.fit.baseline import Baseline
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, joints_of
from robocal.prove.identify import baseline
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, told
from robocal.session.inputs import open_machine, read_inputs
from robocal.session.opened import Inputs, Opened
from robocal.session.strange import outlier
from robocal.session.watching import Watch, computable

__all__ = ["Checked", "checked"]


@dataclass(frozen=True)
class Checked:
    """What was found: the robot, the instruments (one mapping each), what the data can tell at the nominal model, and
    warnings."""

    robot: Opened[Any]
    data: DataSet | None
    instruments: tuple[dict[str, Any], ...]
    free: tuple[str, ...]
    seen: Identifiability | None
    misfit: float | None  # mean error of the nominal model with fitted frames (m), gross rows not counted
    assumed: bool  # whether some noise had to be assumed
    warnings: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    strange: tuple[Outlier, ...] = ()  # rows that do not belong to the others
    misfit_of_all: float | None = None  # the mean error with gross rows

    @property
    def document(self) -> dict[str, Any]:
        """The same for machines."""
        machine, seen = self.robot.machine, self.seen
        joints = [
            {"name": j.name, "type": j.type, "lower": j.lower, "upper": j.upper} for j in joints_of(self.robot.machine)
        ]
        found = None
        if seen is not None:
            found = {
                "rank": seen.rank,
                "n_free": len(seen.names),
                "structural_rank": seen.structural_rank,
                "condition": seen.condition,
                "kept": list(seen.kept),
                "dropped": list(seen.dropped),
                "combinations": [c.remark.sentence for c in seen.combinations],
                "observability": seen.indices,
                "sigma_assumed": self.assumed,
            }
        return {
            "robot": {
                "name": machine.name,
                "convention": self.robot.convention,
                "joints": joints,
                "source": self.robot.source,
            }
            | dict(self.robot.facts),
            "instruments": list(self.instruments),
            "configurations": None if self.data is None else len(self.data.configurations),
            "free": list(self.free),
            "identifiability": found,
            "baseline_mean_error_mm": None if self.misfit is None else self.misfit * 1e3,
            "baseline_mean_error_of_all_rows_mm": None if self.misfit_of_all is None else self.misfit_of_all * 1e3,
            **told(self.warnings),
            "outliers": [outlier(o) for o in self.strange],
            "inputs": hashes(self.inputs),
        }


def checked(o: Any, watch: Watch | None = None) -> Checked:
    """A robot, and with data what they can tell, by the options of the verb. Raises InputError for whatever is wrong with them."""
    if not o.data:
        return unmeasured(open_machine(o.robot, base=o.base, tip=o.tip))
    inputs = read_inputs(o.robot, o.data, base=o.base, tip=o.tip, exclude=o.exclude, watch=watch)
    with computable(o.robot, *o.data):
        return examined(inputs, watch)


def unmeasured(opened: Opened[Any]) -> Checked:
    """A machine alone: what its file says, and what its geometry shows."""
    machine: Model = opened.machine
    # A cable robot's file need not say what is free.
    findings = (f for f in run(When.DATA, Context(machine)) if opened.arm or f.code != Code.NOTHING_FREE)
    remarks = (*opened.warnings, *(f.remark for f in findings))
    return Checked(opened, None, (), machine.table.free, None, None, False, remarks, opened.inputs)


def examined(inputs: Inputs, watch: Watch | None = None) -> Checked:
    """A machine with data: what they can tell at the nominal model, rows that do not belong, and remarks."""
    opened, measured = inputs.opened, inputs.data
    machine: Model = opened.machine
    everyone = np.arange(len(measured.configurations))
    sifted = sift(machine, measured, everyone, watch)
    problem, x = baseline(machine, sifted.data, everyone, watch)
    free = problem.table.free
    seen = analyse(problem.with_free(free), x) if free else None
    context = Context(machine, measured, Baseline(problem, x), watch=watch)
    findings = [*run(When.DATA, context), *moved.run(context)]
    strange = named(machine, sifted.data, sifted.problem, sifted.x, sifted.away)
    lengths = [
        (np.linalg.norm(r.value[:, a:b], axis=1), r.used)
        for r in problem.residuals(x)
        for a, b, u in r.parts
        if u == "m"
    ]
    misfit = float(np.concatenate([v[used] for v, used in lengths]).mean()) if lengths else None
    whole = float(np.concatenate([v for v, _ in lengths]).mean()) if lengths else None
    assumed = any(o.sigma is None for o in measured.observations)
    warnings = tuple(dict.fromkeys((*inputs.warnings, *(f.remark for f in findings))))
    seen_by = _instruments(measured)
    return Checked(opened, measured, seen_by, free, seen, misfit, assumed, warnings, inputs.files, strange, whole)


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

"""The verb `check`: what robot and data files say and what they can tell, before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robocal.arms.chain import Chain
from robocal.calibrate.gross import sift
from robocal.calibrate.identify import baseline
from robocal.calibrate.outliers import Outlier, named
from robocal.calibrate.segments.find import find_segments, segment_remarks
from robocal.calibrate.warn import few_numbers, input_remarks
from robocal.estimate.identifiability import Identifiability, analyse
from robocal.files.dataset import InputFile
from robocal.files.robot import Robot
from robocal.jobs.inputs import Watch, computable, open_arm, read_inputs, robot_files
from robocal.jobs.strange import outlier
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, told

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
    misfit: float | None  # mean error of the nominal model with fitted frames (m), gross rows not counted
    assumed: bool  # whether some noise had to be assumed
    warnings: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    strange: tuple[Outlier, ...] = ()  # rows that do not belong to the others
    misfit_of_all: float | None = None  # the mean error with gross rows

    @property
    def document(self) -> dict[str, Any]:
        """The same for machines."""
        chain, seen = self.robot.chain, self.seen
        joints = [{"name": j.name, "type": j.type, "lower": j.lower, "upper": j.upper} for j in chain.joints]
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
            "robot": {"name": chain.name, "convention": chain.convention, "joints": joints, "source": chain.source},
            "instruments": list(self.instruments),
            "configurations": None if self.data is None else len(self.data.configurations),
            "free": list(self.free),
            "identifiability": found,
            "baseline_mean_error_mm": None if self.misfit is None else self.misfit * 1e3,
            "baseline_mean_error_of_all_rows_mm": None if self.misfit_of_all is None else self.misfit_of_all * 1e3,
            **told(self.warnings),
            "outliers": [outlier(o).model_dump(mode="json") for o in self.strange],
            "inputs": [{"file": str(i.file), "sha256": i.sha256} for i in self.inputs],
        }


def check(
    robot: str,
    data: Sequence[str] = (),
    *,
    base: str | None = None,
    tip: str | None = None,
    exclude: Sequence[str] = (),
    watch: Watch | None = None,
) -> Checked:
    """Reads a robot, and data files when there are any. Raises InputError for whatever is wrong with them."""
    if not data:
        arm = open_arm(robot, base=base, tip=tip)
        warnings = (*arm.warnings, *input_remarks(arm.chain), *_free(arm.chain))
        return Checked(arm, None, (), arm.chain.table.free, None, None, False, warnings, robot_files(arm, robot))
    inputs = read_inputs(robot, data, base=base, tip=tip, exclude=exclude, watch=watch)
    chain, measured = inputs.robot.chain, inputs.data
    with computable(robot, *data):
        everyone = np.arange(len(measured.configurations))
        sifted = sift(chain, measured, everyone, watch)
        problem, x = baseline(chain, sifted.data, everyone, watch)
        free = problem.table.free
        seen = analyse(problem.with_free(free), x) if free else None
        moved = find_segments(chain, measured, dict(zip(problem.table.names, map(float, x[0]), strict=False)))
    strange = named(chain, sifted.data, sifted.problem, sifted.x, sifted.away)
    lengths = [
        (np.linalg.norm(r.value[:, a:b], axis=1), r.used)
        for r in problem.residuals(x)
        for a, b, u in r.parts
        if u == "m"
    ]
    misfit = float(np.concatenate([v[used] for v, used in lengths]).mean()) if lengths else None
    whole = float(np.concatenate([v for v, _ in lengths]).mean()) if lengths else None
    assumed = any(o.sigma is None for o in measured.observations)
    rows = sum(o.value.size for o in measured.observations)
    said = (*input_remarks(chain, measured), *few_numbers(rows, len(free)), *_free(chain), *segment_remarks(moved))
    warnings = tuple(dict.fromkeys((*inputs.warnings, *said)))
    seen_by = _instruments(measured)
    return Checked(inputs.robot, measured, seen_by, free, seen, misfit, assumed, warnings, inputs.files, strange, whole)


def _free(chain: Chain) -> tuple[Remark, ...]:
    return () if chain.table.free else (Remark.of(Code.NOTHING_FREE),)


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

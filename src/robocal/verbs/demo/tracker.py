"""Demo: a six-axis arm with typical factory errors, measured with a laser tracker; simulated, and labelled so."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from robocal._types import Array
from robocal.session.identify_outcome import IdentifyOutcome
from robocal.session.simulated_robot import sample_joints
from robocal.session.watching import Watch
from robocal.verbs import identify, simulate
from robocal.verbs.demo.case import Case, CaseStep, chain_of

__all__ = ["TRACKER"]


def run(folder: Path, seed: int, watch: Watch | None = None) -> Iterator[CaseStep]:
    """80 poses, 0.05 mm of noise, 0.3 mm and 1 mrad of geometric errors; nobody says where the tracker stands."""
    noise = simulate.Options("irb-120", folder, noise=0.05, length_error=0.3, angle_error=0.0573, seed=seed, force=True)
    made: simulate.Simulated = simulate.run(noise, watch).result
    files = str(folder / "robot.yaml"), str(folder / "data.yaml")
    command = f"robocal identify {files[0]} {files[1]}"
    asked = identify.Options(files[0], (files[1],), output=folder / "run", force=True, seed=seed)
    outcome: IdentifyOutcome = identify.run(asked, watch, command).result
    before, held = outcome.result.residuals.held_out_before, outcome.result.residuals.held_out
    facts = []
    if before and held and before.mean and held.mean:
        facts.append(
            f"on 16 poses that were not used for fitting the error falls from {before.mean:.2f} to {held.mean:.3f} mm"
        )
    corrected, truth = chain_of(outcome.identification.corrected), chain_of(made.truth)
    q = sample_joints(truth, 1000, np.random.default_rng(3))
    # Seen from the tracker, as everything is: a shift of the whole robot is nobody's error.
    gap = _distances_after_fit(corrected.pose(q)[:, :3, 3], truth.pose(q)[:, :3, 3])
    facts.append(
        f"all over the workspace the corrected model is {gap.mean() * 1e3:.3f} mm from the truth (1000 configurations that nobody measured)"
    )
    facts.append("where the tracker stands was found from the data alone")
    yield CaseStep("80 poses, 0.05 mm of tracker noise", outcome, tuple(facts), "improved", outcome.improved, command)


def _distances_after_fit(a: Array, b: Array) -> Array:
    """Distances after the best rigid fit of a on b."""
    from robocal.geometry import fits

    t = fits.rigid(a, b)
    return np.asarray(np.linalg.norm(a @ t[:3, :3].T + t[:3, 3] - b, axis=1))


TRACKER = Case(
    "tracker",
    "ABB IRB 120, six axes, typical factory errors",
    "Every length is off by about 0.3 mm and every angle by about 1 mrad; a laser tracker reads 80 poses.",
    True,
    run,
)

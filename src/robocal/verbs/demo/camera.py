"""Demo: ten real camera measurements of a small arm that carries the camera; they do not support a calibration, and it
is refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from robocal.session.identify_outcome import IdentifyOutcome
from robocal.session.watching import Watch
from robocal.verbs import identify
from robocal.verbs.demo.case import Case, CaseStep, copy_example

__all__ = ["CAMERA"]


def run(folder: Path, seed: int, watch: Watch | None = None) -> Iterator[CaseStep]:
    """Copies the example and identifies it as anybody would."""
    copy_example("arm-with-camera", folder)
    files = str(folder / "robot.yaml"), str(folder / "data.yaml")
    command = f"robocal identify {files[0]} {files[1]}"
    asked = identify.Options(files[0], (files[1],), output=folder / "run", force=True, seed=seed)
    outcome: IdentifyOutcome = identify.run(asked, watch, command).result
    left = outcome.result.residuals
    facts = []
    if left.after and left.leave_one_out and left.after.mean is not None and left.leave_one_out.mean is not None:
        facts.append(f"the model bends to the ten poses until {left.after.mean:.0f} mm are left")
        facts.append(
            f"a pose that it has not seen is missed by {left.leave_one_out.mean:.0f} mm, so nothing is claimed"
        )
    refused = outcome.result.verdict.status == "refused"
    yield CaseStep("ten poses, read by a camera on the hand", outcome, tuple(facts), "refused", refused, command)


CAMERA = Case(
    "camera",
    "a small arm with a camera on its hand, really measured",
    "Ten readings from a thesis: real numbers, printed as they are, and too few.",
    False,
    run,
)

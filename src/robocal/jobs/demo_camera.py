"""Demo: ten real camera measurements of a small arm that carries the camera; they do not support a calibration, and it
is refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from robocal.jobs.demo_case import Case, Finding
from robocal.jobs.examples import copy_example
from robocal.jobs.identify import Choices, identify
from robocal.jobs.inputs import Watch

__all__ = ["CAMERA"]


def run(folder: Path, seed: int, watch: Watch | None = None) -> Iterator[Finding]:
    """Copies the example and identifies it as anybody would."""
    copy_example("arm-with-camera", folder)
    files = str(folder / "robot.yaml"), str(folder / "data.yaml")
    command = f"robocal identify {files[0]} {files[1]}"
    outcome = identify(
        files[0], [files[1]], Choices(seed=seed), output=folder / "run", force=True, command=command, watch=watch
    )
    left = outcome.result.residuals
    facts = []
    if left.after and left.leave_one_out and left.after.mean is not None and left.leave_one_out.mean is not None:
        facts.append(f"the model bends to the ten poses until {left.after.mean:.0f} mm are left")
        facts.append(
            f"a pose that it has not seen is missed by {left.leave_one_out.mean:.0f} mm, so nothing is claimed"
        )
    refused = outcome.result.verdict.status == "refused"
    yield Finding("ten poses, read by a camera on the hand", outcome, tuple(facts), "refused", refused, command)


CAMERA = Case(
    "camera",
    "a small arm with a camera on its hand, really measured",
    "Ten readings from a thesis: real numbers, printed as they are, and too few.",
    False,
    run,
)

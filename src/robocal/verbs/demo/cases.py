"""The cases of the demo: arms that a stranger can watch being calibrated, two simulated and one really measured.

Every case is a function that yields what it finds, so that the story can be told while it happens, each with whether
it came out as it should.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from robocal.errors import ModelError, nearest
from robocal.session.watching import Watch
from robocal.verbs.demo.camera import CAMERA
from robocal.verbs.demo.case import Case, CaseStep
from robocal.verbs.demo.rv2aj import RV2AJ
from robocal.verbs.demo.tracker import TRACKER

__all__ = ["CASES", "Case", "CaseStep", "cases", "demo"]


def cases(name: str | None = None) -> tuple[Case, ...]:
    """The case of this name, or all. Raises ModelError with the nearest name."""
    known = {case.name: case for case in (RV2AJ, CAMERA, TRACKER)}
    if name is None:
        return tuple(known.values())
    if name not in known:
        raise ModelError("unknown demo", found=name, expected=", ".join(known), suggestion=nearest(name, known))
    return (known[name],)


def demo(name: str | None, output: Path, seed: int, watch: Watch | None = None) -> Iterator[tuple[Case, CaseStep]]:
    """Runs cases one after the other, each into its own folder, and yields every finding."""
    for case in cases(name):
        for finding in case.run(output / case.name, seed, watch):
            yield case, finding


CASES = ("rv-2aj", "camera", "tracker")

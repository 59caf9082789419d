"""The verb `demo`: arms that a stranger can watch being calibrated, two simulated and one really measured.

Every case is a function that yields what it finds, so that the story can be told while it happens, each with whether
it came out as it should.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from robocal.errors import ModelError, nearest
from robocal.jobs.inputs import Watch
from robocal.jobs.outcome import Outcome

__all__ = ["CASES", "Case", "Finding", "cases", "demo"]


@dataclass(frozen=True)
class Finding:
    """One step of a case: what was done in words, its outcome, facts worth telling, and whether it is as expected."""

    title: str
    outcome: Outcome
    facts: tuple[str, ...]
    expected: str
    ok: bool
    repeat: str = ""


@dataclass(frozen=True)
class Case:
    """A case by name: its title, the story before it starts, where the numbers come from, and the function that does
    it."""

    name: str
    title: str
    story: str
    simulated: bool
    run: Callable[[Path, int, Watch | None], Iterator[Finding]] = field(repr=False)


def cases(name: str | None = None) -> tuple[Case, ...]:
    """The case of this name, or all. Raises ModelError with the nearest name."""
    from robocal.jobs.demo_camera import CAMERA
    from robocal.jobs.demo_rv2aj import RV2AJ
    from robocal.jobs.demo_tracker import TRACKER

    known = {case.name: case for case in (RV2AJ, CAMERA, TRACKER)}
    if name is None:
        return tuple(known.values())
    if name not in known:
        raise ModelError("unknown demo", found=name, expected=", ".join(known), suggestion=nearest(name, known))
    return (known[name],)


def demo(
    name: str | None, output: Path, *, seed: int = 0, watch: Watch | None = None
) -> Iterator[tuple[Case, Finding]]:
    """Runs cases one after the other, each into its own folder, and yields every finding."""
    for case in cases(name):
        for finding in case.run(output / case.name, seed, watch):
            yield case, finding


CASES = ("rv-2aj", "camera", "tracker")

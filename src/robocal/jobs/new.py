"""The verb `new`: files to start from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from robocal.arms import catalog
from robocal.arms.conventions import CONVENTIONS
from robocal.errors import ModelError, nearest
from robocal.files.templates import convention_chain, templates
from robocal.files.text import write_files
from robocal.jobs.rigs import RIGS
from robocal.jobs.simulate import refuse_existing

__all__ = ["Listing", "New", "listing", "new"]


@dataclass(frozen=True)
class New:
    """What the files are of, and where they lie."""

    name: str
    convention: str
    written: tuple[Path, ...]


@dataclass(frozen=True)
class Listing:
    """The catalogue (name, robot, convention, joints, source) and the conventions (name, formula, complete, source)."""

    robots: tuple[tuple[str, str, str, int, str], ...]
    conventions: tuple[tuple[str, str, bool, str], ...]


def listing() -> Listing:
    """What `new` can start from."""
    arms = [(name, catalog.get(name)) for name in catalog.names()]
    robots = tuple((name, arm.name, arm.convention, len(arm.joints), arm.source) for name, arm in arms)
    return Listing(robots, tuple((c.name, c.formula, c.complete, c.source) for c in CONVENTIONS.values()))


def new(robot: str, output: Path, *, joints: int = 6, kind: str = "position", force: bool = False) -> New:
    """Writes robot.yaml, data.yaml and measurements.csv. Raises ModelError for an unknown name, FileError for a file
    that exists."""
    if kind not in RIGS:
        raise ModelError(
            "unknown kind", key="--kind", found=kind, expected=", ".join(RIGS), suggestion=nearest(kind, RIGS)
        )
    if robot in catalog.names():
        arm = catalog.get(robot)
    elif robot in CONVENTIONS:
        arm = convention_chain(robot, joints)
    else:
        known = [*catalog.names(), *CONVENTIONS]
        raise ModelError(
            "neither a robot of the catalogue nor a convention",
            found=robot,
            expected="see robocal new --list",
            suggestion=nearest(robot, known),
        )
    texts = templates(arm, kind=kind)
    refuse_existing(output, list(texts), force)
    return New(arm.name, arm.convention, write_files(output, texts))

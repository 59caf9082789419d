"""A rig that was opened: instruments fixed to one another, and no robot. Nothing of its own is identified, so its file stays as it is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import ClassVar

from robocal._record import record, replace
from robocal.files.rig import read_rig
from robocal.files.runfolder import ROBOTS, find_run
from robocal.measure.machine import Rig
from robocal.prove.identify import Identification
from robocal.session.opened import Opened, Rendered

__all__ = ["OpenedRig", "open_rig"]


@record
class OpenedRig(Opened[Rig]):
    """Instruments fixed to one another."""

    noun: ClassVar[str] = "rig"

    @property
    def yaml(self) -> str:
        """Its file."""
        return self.file.text

    def render(self, found: Identification[Rig]) -> Rendered:
        """Its file: frames of instruments are in the result, not in the machine."""
        return Rendered(self.file.text)


def open_rig(name: str | os.PathLike[str]) -> OpenedRig:
    """A rig from its file, or from a run folder. Raises InputError."""
    place = Path(name)
    run = find_run(place) if place.exists() else None
    file = read_rig(place / ROBOTS[0] if place.is_dir() else place)
    return OpenedRig(file if run is None else replace(file, warnings=(*file.warnings, *run.remarks)), os.fspath(name))

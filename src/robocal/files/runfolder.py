"""A run folder is one thing: result.json records what the other files were when it was written, and whoever reads one of them
reads all of them as they were.

report.html is not recorded, for `report` writes it again. Files with other names are nobody's business here.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from robocal.errors import FileError, InputError
from robocal.files.covariance import COVARIANCE
from robocal.files.journal import JOURNAL
from robocal.files.layerfile import LAYER
from robocal.files.result import Result, read_result
from robocal.files.text import read_bytes
from robocal.files.writing import LEFT
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["ACCURACY", "PARTS", "REPORT", "RESIDUALS", "RESULT", "ROBOTS", "Run", "find_run", "obstacle", "open_run"]

RESULT, RESIDUALS, REPORT, ACCURACY = "result.json", "residuals.csv", "report.html", "accuracy_map.csv"
ROBOTS = ("calibrated.yaml", "calibrated.urdf")
PARTS = (*ROBOTS, RESIDUALS, COVARIANCE, ACCURACY, LAYER)  # what result.json records


@dataclass(frozen=True)
class Run:
    """A run folder whose files are those that its run wrote; `recorded` is their SHA-256 by name, None in folders of earlier
    versions, where nobody can tell."""

    folder: Path
    result: Result
    recorded: Mapping[str, str] | None

    def part(self, name: str) -> Path | None:
        """One of its files; None where the run has none of that name."""
        place = self.folder / name
        return place if place.is_file() else None

    @property
    def robot(self) -> Path | None:
        """The calibrated robot."""
        return next((place for name in ROBOTS if (place := self.part(name))), None)

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What is to be said of the folder."""
        return () if self.recorded is not None else (Remark.of(Code.RUN_UNRECORDED, run=str(self.folder)),)


def open_run(folder: str | os.PathLike[str]) -> Run:
    """Opens a run folder. Raises FileError where there is none, or where a file is missing, was changed or comes from
    another run, and FormatError for a broken result.json."""
    home = Path(folder)
    place = home / RESULT
    if not place.is_file():
        raise FileError(
            "this is not a run folder", file=home, expected=f"a folder with {RESULT}, as robocal identify -o writes it"
        )
    result = read_result(place)
    run = Run(home, result, result.files)
    if run.recorded is not None:
        for name in PARTS:
            _check(home / name, run.recorded.get(name))
    return run


def find_run(path: str | os.PathLike[str]) -> Run | None:
    """The run of a folder, or of one of its files; None where there is no run. Raises as `open_run` does."""
    place = Path(path)
    folder = place if place.is_dir() else place.parent if place.name in PARTS else None
    return open_run(folder) if folder is not None and (folder / RESULT).is_file() else None


def obstacle(folder: Path) -> FileError | None:
    """None where a run may be written without a question: an empty folder, a run as it was written, or one that was interrupted;
    otherwise what is in the way."""
    if not folder.is_dir():
        return None
    own = {RESULT, REPORT, *PARTS, JOURNAL, f"{JOURNAL}.new"}
    for entry in sorted(folder.iterdir()):
        left = LEFT.fullmatch(entry.name)
        if entry.name not in own and not (left and left["name"] in own):
            return _in_the_way("the folder holds other files", entry)
    if (folder / JOURNAL).is_file():
        return None
    there = [name for name in (RESULT, *PARTS) if (folder / name).exists()]
    if not there:
        return None
    try:
        run = open_run(folder)
    except InputError as error:
        return _in_the_way(f"the folder holds no untouched run: {error.message}", error.file or folder)
    return None if run.recorded is not None else _in_the_way("nobody can tell whether this run was changed", folder)


def _in_the_way(message: str, place: object) -> FileError:
    return FileError(message, file=place, expected="--force to write the run there all the same, or a new name")


def _check(place: Path, recorded: str | None) -> None:
    """Raises FileError where a file is not what its run wrote."""
    there = place.is_file()
    if recorded is None:
        if there:
            raise FileError(
                "this file does not belong to the run beside it", file=place, expected=f"what its {RESULT} records"
            )
        return
    if not there:
        raise FileError("a file of this run is missing", file=place, expected=f"what its {RESULT} records")
    if hashlib.sha256(read_bytes(place)).hexdigest() != recorded:
        raise FileError(
            "this file was changed, or belongs to another run", file=place,
            expected=f"what its {RESULT} records; a copy outside of the folder may be edited",
        )  # fmt: skip

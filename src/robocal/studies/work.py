"""One chunk of a study's trials: what is drawn hangs on the seed and the chunk alone, whoever works on it and when. All points of a sweep
draw the same numbers: what they differ by is what was varied."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.errors import FileError, FormatError, ModelError
from robocal.files.studyfile import Study
from robocal.files.writing import write_bytes

__all__ = ["Work", "chunks", "computed", "do", "drawn", "packed", "trials_of", "unpacked"]

Array = NDArray[np.float64]
THEORY = 1 << 30  # the chunk whose stream draws the lists of which theory is asked


@dataclass(frozen=True)
class Work:
    """So many trials of a point from the first, and the file that they become."""

    study: Study
    point: int
    chunk: int
    count: int
    place: Path


def chunks(study: Study, parts: Path) -> list[Work]:
    """All of a study, in order."""
    return [
        Work(study, p, c, min(study.chunk, study.trials - c * study.chunk), parts / f"{p:05d}-{c:06d}.npz")
        for p in range(len(study.points))
        for c in range(-(-study.trials // study.chunk))
    ]


@lru_cache(maxsize=4)
def _trials(study: Study, point: int) -> Any:
    if study.of == "cable-calibration":
        from robocal.studies.cables import CableTrials

        return CableTrials(study.points[point])
    from robocal.studies.arms import ArmTrials

    return ArmTrials(study.points[point], study.seed)


def trials_of(study: Study, point: int) -> Any:
    """The trials of a point of a study."""
    return _trials(study, point)


def drawn(study: Study, chunk: int = THEORY) -> np.random.Generator:
    """The random numbers of a chunk."""
    return np.random.default_rng(np.random.SeedSequence(study.seed, spawn_key=(chunk,)))


def do(work: Work) -> Path:
    """Runs the trials of a chunk and writes them whole, or not at all."""
    return write_bytes(work.place, computed(work))


def computed(work: Work) -> bytes:
    """The trials of a chunk as an .npz. Raises FormatError for settings of the study with which nothing can be worked out."""
    try:
        found = trials_of(work.study, work.point).run(work.count, drawn(work.study, work.chunk))
    except ModelError as error:
        at = ", ".join(f"{k}: {v}" for k, v in work.study.points[work.point].varied)
        where = f" (at {at})" if at else ""
        raise FormatError(
            f"{error.message}{where}", file=work.study.path, key=error.key, found=error.found, expected=error.expected
        ) from None
    return packed(found)


def packed(arrays: dict[str, Array]) -> bytes:
    """Arrays as the bytes of an .npz, the same for the same numbers."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as file:
        for name, array in arrays.items():
            content = io.BytesIO()
            np.lib.format.write_array(content, np.ascontiguousarray(array), allow_pickle=False)
            file.writestr(zipfile.ZipInfo(f"{name}.npy"), content.getvalue())
    return out.getvalue()


def unpacked(place: Path) -> dict[str, Array]:
    """The arrays of an .npz. Raises FileError for what is none."""
    try:
        with np.load(place, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise FileError(f"not a part of a study: {error}", file=place) from None

"""One chunk of a study's trials: what is drawn hangs on the seed and the chunk alone, whoever works on it and when. All points of a sweep
draw the same numbers: what they differ by is what was varied."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import FileError, FormatError, ModelError
from robocal.files.studyfile import Point, Study
from robocal.files.text import read_text
from robocal.files.writing import write_bytes

__all__ = ["Setting", "Work", "chunks", "compute", "do", "drawn", "pack", "trials_of", "unpack"]

THEORY = 1 << 30  # the chunk whose stream draws the lists of which theory is asked


@record
class Setting:
    """One point of a study and what its trials need of the rest: of a sweep of thousands of points, the others are not sent. `read` are
    the files of this point with their SHA-256."""

    path: Path
    of: str
    seed: int
    point: Point
    read: tuple[tuple[str, str], ...]


@record
class Work:
    """So many trials of a point from the first, and the file that they become."""

    setting: Setting
    chunk: int
    count: int
    place: Path


def _setting(study: Study, point: int) -> Setting:
    p = study.points[point]
    own = set(p.files)
    return Setting(study.path, study.of, study.seed, p, tuple(r for r in study.read if r[0] in own))


def chunks(study: Study, parts: Path) -> list[Work]:
    """All of a study, in order."""
    return [
        Work(setting, c, min(study.chunk, study.trials - c * study.chunk), parts / f"{p:05d}-{c:06d}.npz")
        for p, setting in enumerate(_setting(study, p) for p in range(len(study.points)))
        for c in range(-(-study.trials // study.chunk))
    ]


@lru_cache(maxsize=4)
def _trials(setting: Setting) -> Any:
    """Raises FileError where a file is no longer as it was when the study began: chunks of two robots are no study."""
    if setting.of == "cable-calibration":
        from robocal.studies.cables import CableTrials

        made: Any = CableTrials(setting.point)
    else:
        from robocal.studies.arms import ArmTrials

        made = ArmTrials(setting.point, setting.seed)
    for name, digest in setting.read:
        if read_text(name).sha256 != digest:
            raise FileError("changed while the study ran", file=name, expected="--force to begin anew")
    return made


@contextmanager
def _name_point(setting: Setting) -> Iterator[None]:
    """What is wrong is said of the study's file and of the point."""
    try:
        yield
    except ModelError as error:
        at = ", ".join(f"{k}: {v}" for k, v in setting.point.varied)
        message = error.message + (f" (at {at})" if at else "")
        raise FormatError(
            message, file=setting.path, key=error.key, found=error.found, expected=error.expected
        ) from None


def trials_of(study: Study, point: int) -> Any:
    """The trials of a point of a study. Raises InputError for a robot, a list or settings of which there are none."""
    setting = _setting(study, point)
    with _name_point(setting):
        return _trials(setting)


def drawn(seed: int, chunk: int = THEORY) -> np.random.Generator:
    """The random numbers of a chunk."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(chunk,)))


def do(work: Work) -> Path:
    """Runs the trials of a chunk and writes them whole, or not at all."""
    return write_bytes(work.place, compute(work))


def compute(work: Work) -> bytes:
    """The trials of a chunk as an .npz. Raises FormatError for settings of the study with which nothing can be worked out."""
    with _name_point(work.setting):
        return pack(_trials(work.setting).run(work.count, drawn(work.setting.seed, work.chunk)))


def pack(arrays: dict[str, Array]) -> bytes:
    """Arrays as the bytes of an .npz, the same for the same numbers."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as file:
        for name, array in arrays.items():
            content = io.BytesIO()
            np.lib.format.write_array(content, np.ascontiguousarray(array), allow_pickle=False)
            file.writestr(zipfile.ZipInfo(f"{name}.npy"), content.getvalue())
    return out.getvalue()


def unpack(place: Path) -> dict[str, Array]:
    """The arrays of an .npz. Raises FileError for what is none: whatever a damaged file makes numpy say."""
    try:
        with zipfile.ZipFile(place) as file:
            named = [(name, io.BytesIO(file.read(name))) for name in file.namelist()]
        return {n.removesuffix(".npy"): np.lib.format.read_array(f, allow_pickle=False) for n, f in named}
    except (OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise FileError(f"not a part of a study: {error}", file=place) from None

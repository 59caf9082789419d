"""Files that exist while something reads them, for readers that take files alone."""

from __future__ import annotations

import atexit
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp

__all__ = ["is_scratch", "keep_file", "scratch_files"]


@contextmanager
def scratch_files(texts: Mapping[str, str]) -> Iterator[Path]:
    """A folder with these texts by name, which is removed."""
    with TemporaryDirectory(prefix="robocal") as place:
        folder = Path(place)
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        yield folder


def keep_file(name: str, text: str, *, alone: bool = False) -> Path:
    """A file with this text that stays until the program ends: the same text has the same place, unless it is to be `alone` there."""
    folder = Path(mkdtemp(dir=_folder())) if alone else _folder() / sha256(text.encode()).hexdigest()[:12]
    place = folder / name
    if not place.exists():
        place.parent.mkdir(exist_ok=True)
        place.write_text(text, encoding="utf-8")
    return place


def is_scratch(path: object) -> bool:
    """Whether a file is one that `keep_file` made."""
    return str(path).startswith(str(_folder()) + os.sep)


@cache
def _folder() -> Path:
    """One folder of this process, removed at its end."""
    folder = TemporaryDirectory(prefix="robocal")
    atexit.register(folder.cleanup)
    return Path(folder.name)

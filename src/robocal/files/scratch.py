"""Files that exist while something reads them, for readers that take files alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

__all__ = ["scratch_files"]


@contextmanager
def scratch_files(texts: Mapping[str, str]) -> Iterator[Path]:
    """A folder with these texts by name, which is removed."""
    with TemporaryDirectory(prefix="robocal") as place:
        folder = Path(place)
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        yield folder

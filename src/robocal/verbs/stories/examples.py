"""Where the examples lie: inside an installed package, else beside the sources."""

from __future__ import annotations

from pathlib import Path

from robocal.errors import FileError
from robocal.files.text import read_bytes
from robocal.files.writing import write_files

__all__ = ["copy_example", "example_folder"]


def example_folder(name: str) -> Path:
    """The folder of one example. Raises FileError when this installation has none."""
    package = Path(__file__).resolve().parents[2]
    for root in (package / "_examples", package.parent.parent / "examples"):
        if (root / name).is_dir():
            return root / name
    raise FileError(
        "this installation has no such example",
        file=name,
        expected="a package with its examples, or a clone of the project",
    )


def copy_example(name: str, folder: Path) -> None:
    """Copies the files of an example that a person would edit (YAML, CSV, Markdown) into a folder, all or none. Raises
    FileError."""
    source = example_folder(name)
    chosen = [p for p in sorted(source.iterdir()) if p.is_file() and p.suffix in (".yaml", ".csv", ".md")]
    write_files(folder, {p.name: read_bytes(p) for p in chosen})

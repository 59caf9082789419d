"""What a case of the demo is, what each of its steps finds, and the examples that it copies."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from robocal.arms.chain import Chain
from robocal.errors import FileError
from robocal.files.text import read_bytes
from robocal.files.writing import write_files
from robocal.measure.machine import Model
from robocal.session.identify_outcome import IdentifyOutcome
from robocal.session.watching import Watch

__all__ = ["Case", "CaseStep", "chain_of", "copy_example", "example_folder"]


@dataclass(frozen=True)
class CaseStep:
    """One step of a case: what was done in words, its outcome, facts worth telling, and whether it is as expected."""

    title: str
    outcome: IdentifyOutcome
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
    run: Callable[[Path, int, Watch | None], Iterator[CaseStep]] = field(repr=False)


def chain_of(model: Model) -> Chain:
    """The arm of a demo."""
    chain = model.part(Chain)
    assert chain is not None
    return chain


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

"""`warm-up`: all kernels compiled before anybody waits for one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.resources import files
from pathlib import Path

from robocal.progress import tell
from robocal.report.sections import Section, Text
from robocal.verbs.option import BaseOptions, arg
from robocal.verbs.outcome import Outcome, Watch

__all__ = ["LIST", "Options", "run", "sections"]

LIST = "kernels.txt"  # a kernel with the types of what it is given, as numba writes them, on each line


@dataclass(frozen=True)
class Options(BaseOptions):
    """Compile all kernels now, into the cache, so that no later command waits: for containers, CI and whoever installs for others.

    \b
    robocal warm-up
    robocal warm-up geometry measure estimate     what arms need

    ROBOCAL_CACHE_DIR is where the cache lies, if not in the user's own folder.
    """

    packages: tuple[str, ...] = arg((), "[PACKAGE]...", "Kernels of these packages only.")


@dataclass(frozen=True)
class WarmUp:
    """How many kernels are ready, and the folder in which they are kept; none where no folder can be written."""

    kernels: int
    cache: Path | None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[WarmUp]:
    """Compiles what the list names, or finds it in the cache. Raises ModelError for a package without kernels."""
    from robocal._jit import cache_folder
    from robocal.errors import require_one_of

    every = [line for line in files("robocal").joinpath(LIST).read_text("utf-8").splitlines() if line]
    known = sorted({line.partition(".")[0] for line in every})
    for package in o.packages:
        require_one_of(package, known, "no kernels are in this package")
    wanted = [line for line in every if not o.packages or line.partition(".")[0] in o.packages]
    for done, line in enumerate(wanted):
        tell(watch, "compile", done=done, total=len(wanted))
        compile_line(line)
    made = WarmUp(len(wanted), cache_folder())
    return Outcome(made, lambda: made)


def compile_line(line: str) -> None:
    """Compiles one kernel of the list for its types."""
    from robocal._jit import compile_for

    name, _, types = line.partition("(")
    module, _, function = name.rpartition(".")
    compile_for(getattr(import_module(f"robocal.{module}._kernels"), function), f"({types}")


def sections(made: Outcome[WarmUp]) -> Iterator[Section]:
    """How many there are, and where."""
    found = made.result
    where = "for this process alone: no folder can be written" if found.cache is None else f"in {found.cache}"
    yield Section.of("", Text.of(f"{found.kernels} kernels are compiled, {where}."))

"""`warm-up`: all kernels compiled before anybody waits for one."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.resources import files
from pathlib import Path

from robocal._record import record
from robocal.progress import tell
from robocal.report.sections import Section, Text
from robocal.verbs.option import BaseOptions, arg
from robocal.verbs.outcome import Outcome, Watch

__all__ = ["LIST", "Options", "beside", "compile_beside", "kernel_lists", "run", "sections"]

# A kernel with the types of what it is given, as numba writes them, on each line. Each paragraph but the last is what one kind of
# command compiles when nothing is cached, in the order of need.
LIST = "kernels.txt"
BEGIN = (
    "import sys; sys.path[:] = sys.argv[4:]; from robocal.verbs.warm_up import beside; "
    "beside(sys.argv[1], int(sys.argv[2]), sys.argv[3])"
)
# How other processes go through a list: one from its end, another from its second line, one kernel ahead of the command.
WAYS: dict[str, Callable[[list[str]], list[str]]] = {"end": lambda lines: lines[::-1], "ahead": lambda lines: lines[1:]}


@record
class Options(BaseOptions):
    """Compile all kernels now, into the cache, so that no later command waits: for containers, CI and whoever installs for others.

    \b
    robocal warm-up
    robocal warm-up geometry measure estimate     what arms need

    ROBOCAL_CACHE_DIR is where the cache lies, if not in the user's own folder.
    """

    packages: tuple[str, ...] = arg((), "PACKAGE...", "Kernels of these packages only.")


@record
class WarmUp:
    """How many kernels are ready, and the folder in which they are kept; none where no folder can be written."""

    kernels: int
    cache: Path | None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[WarmUp]:
    """Compiles what the list names, or finds it in the cache. Raises ModelError for a package without kernels."""
    from robocal._jit import cache_folder
    from robocal.errors import require_one_of

    every = list(dict.fromkeys(line for lines in kernel_lists() for line in lines))
    known = sorted({line.partition(".")[0] for line in every})
    for package in o.packages:
        require_one_of(package, known, "no kernels are in this package")
    wanted = [line for line in every if not o.packages or line.partition(".")[0] in o.packages]
    for done, line in enumerate(wanted):
        tell(watch, "compile", done=done, total=len(wanted))
        compile_line(line)
    made = WarmUp(len(wanted), cache_folder())
    return Outcome(made, lambda: made)


def kernel_lists() -> list[list[str]]:
    """The paragraphs of the list, as lines."""
    return [part.splitlines() for part in files("robocal").joinpath(LIST).read_text("utf-8").split("\n\n")]


def compile_beside(first: str) -> list[subprocess.Popen[bytes]]:
    """Other processes for what a command that begins by compiling the kernel `first` will need: one for every core beyond its own, two
    at most. None where there is no second core, no cache to meet in, or no list that begins so."""
    from robocal._jit import cache_folder

    known = any(lines[0].startswith(f"{first}(") for lines in kernel_lists()[:-1])
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not known or cache_folder() is None:
        return []
    nothing, begun = subprocess.DEVNULL, []
    for way in list(WAYS)[: cores - 1]:
        command = [sys.executable, "-P", "-c", BEGIN, first, str(os.getpid()), way, *sys.path]
        try:
            begun.append(
                subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing, start_new_session=True)
            )
        except OSError:  # no more processes, or no memory for one: the command compiles alone
            break
    return begun


def beside(first: str, parent: int, way: str) -> None:
    """Compiles the list that begins with `first`, while the process `parent` lives and compiles it from the beginning."""
    for line in WAYS[way](next(lines for lines in kernel_lists() if lines[0].startswith(f"{first}("))):
        if os.getppid() != parent:
            return
        compile_line(line, wait=False)


def compile_line(line: str, wait: bool = True) -> None:
    """Compiles one kernel of the list for its types."""
    from robocal._jit import compile_for

    name, _, types = line.partition("(")
    module, _, function = name.rpartition(".")
    compile_for(getattr(import_module(f"robocal.{module}._kernels"), function), f"({types}", wait)


def sections(made: Outcome[WarmUp]) -> Iterator[Section]:
    """How many there are, and where."""
    found = made.result
    where = "for this process alone: no folder can be written" if found.cache is None else f"in {found.cache}"
    yield Section.of("", Text.of(f"{found.kernels} kernels are compiled, {where}."))

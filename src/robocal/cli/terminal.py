"""What a person sees while and after a command runs: a progress bar on stderr, tables or one JSON document on stdout.

The bar appears when something takes over two seconds and a person is looking; what it says comes from the events of
long functions.
"""

from __future__ import annotations

import gc
import json
import os
import re
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from robocal.cli.guard import complain, stop_requested, verbose_wanted, wants_colour
from robocal.cli.timings import Timings
from robocal.errors import Cancelled
from robocal.progress import on_compile

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.progress import Progress

    from robocal.report.sections import Section

__all__ = ["Terminal", "command_line"]

PATIENCE = 2.0
COMPILING = (
    "compiling kernels, once for this version and machine (up to 20 s; robocal warm-up compiles all of them ahead)"
)
STAGES = {
    "compile": "compiling kernels, once for this version and machine",
    "read": "reading",
    "start": "finding where the instruments stand",
    "iterate": "fitting",
    "filter": "filtering, one configuration after the other",
    "particles": "moving particles",
    "compare": "comparing",
    "round": "fitting",
    "bootstrap": "drawing configurations again",
    "leave-one-out": "leaving every configuration out once",
    "folds": "holding out everything once",
    "judge": "judging",
    "check": "judging",
    "finding": "judging",
    "groups": "trying what lies beyond geometry",
    "layer": "trying a residual layer",
    "report": "writing the report",
    "target": "finding out what the target is",
    "detect": "finding corners",
    "write": "writing",
}


def command_line() -> str:
    """The command as it was typed, for the recipe."""
    import shlex

    return shlex.join(["robocal", *sys.argv[1:]])


class Terminal:
    """Where one command writes; `json` sends a document to stdout and everything else to stderr."""

    def __init__(self, *, json: bool = False) -> None:
        self.json = json
        self._console: Console | None = None

    @property
    def console(self) -> Console:
        """stdout for people, or stderr when stdout carries JSON."""
        if self._console is None:
            from rich.console import Console

            stream = sys.stderr if self.json else sys.stdout
            # Without a terminal there is no width to respect: wide enough for any table, as a log wants it.
            width = None if stream.isatty() or "COLUMNS" in os.environ else 120
            plain = None if wants_colour(stream) else True
            self._console = Console(
                file=stream, highlight=False, markup=False, width=width, no_color=plain, emoji=False
            )
            # rich would leave with status 1, a fault of ours; the guard knows better what a reader that has gone means.
            self._console.on_broken_pipe = _raise_broken_pipe  # type: ignore[method-assign]
        return self._console

    def show(self, *parts: RenderableType) -> None:
        """Writes for people; with JSON wanted, nothing."""
        if self.json:
            return
        if self.console.is_terminal:
            for part in parts:
                self.console.print(part)
            return
        # In a file nobody wants the blanks that fill a line of a terminal.
        with self.console.capture() as held:
            for part in parts:
                self.console.print(part)
        self.console.file.write(re.sub(" +\n", "\n", held.get()))

    def draw(self, sections: Iterable[Section]) -> None:
        """Writes sections for people; with JSON wanted, nothing."""
        from robocal.cli.draw import drawn

        self.show(*drawn(sections, verbose_wanted()))

    def document(self, value: Any) -> None:
        """The one JSON document, when it is wanted."""
        if self.json:
            from robocal.files.plain import plain

            told = plain(value)
            if (timings := Timings.current) and isinstance(told, dict):
                told["timings"] = timings.document()
            sys.stdout.write(json.dumps(told, indent=2, ensure_ascii=False, allow_nan=False) + "\n")

    @contextmanager
    def watching(self) -> Iterator[Bar]:
        """Something that may take long: gives the `watch` for it, and says once when kernels are compiled, by several processes."""
        bar, others = Bar(self), ExitStack()

        def compiling(first: str) -> None:
            from robocal.verbs.warm_up import compile_beside

            complain(COMPILING, kind="note")
            for helper in compile_beside(first):
                others.callback(helper.wait)
                others.callback(helper.kill)

        on_compile(compiling)
        try:
            yield bar
        finally:
            on_compile(None)
            others.close()
            bar.close()
            if timings := Timings.current:
                timings.take("write")  # what follows is told


def _raise_broken_pipe() -> None:
    """Passes on, from inside rich's handler of it, that nobody reads our output any more."""
    raise BrokenPipeError


class Bar:
    """A `watch` that shows a progress bar on stderr after two seconds, and stops the work when somebody asked for
    it."""

    def __init__(self, terminal: Terminal) -> None:
        self.terminal = terminal
        self.text = "working"
        self.share: float | None = None
        self._progress: Progress | None = None
        self._task: Any = None
        self._lock = threading.Lock()
        self._timer: threading.Timer | None = None
        self._arm()

    def _arm(self) -> None:
        if sys.stderr.isatty():
            self._timer = threading.Timer(PATIENCE, self._open)
            self._timer.daemon = True
            self._timer.start()

    def __call__(self, event: dict[str, object]) -> None:
        if stop_requested():
            raise Cancelled("stopped")
        if not gc.isenabled():
            gc.freeze()  # what was imported stays: the collector need not look through it again and again
            gc.enable()
        if isinstance(told := event.get("sections"), list):
            self._tell(told)
        stage = str(event.get("stage", ""))
        if timings := Timings.current:
            timings.take(stage)
        self.text = STAGES.get(stage, stage) + (f": {event['what']}" if "what" in event else "")
        if stage == "leave-one-out" and "configurations" in event:
            self.text += f" ({event['configurations']})"
        done, total = event.get("done"), event.get("total")
        self.share = (
            done / total if isinstance(done, int | float) and isinstance(total, int | float) and total else None
        )
        with self._lock:
            if self._progress is not None:
                total_, completed = (1.0, self.share) if self.share is not None else (None, 0.0)
                self._progress.update(self._task, description=self.text, total=total_, completed=completed)

    def _open(self) -> None:
        from rich import progress
        from rich.console import Console

        with self._lock:
            if self._timer is None:
                return
            console = Console(stderr=True, no_color=None if wants_colour(sys.stderr) else True)
            # Share and time left stay empty where nobody knows them.
            left = progress.TimeRemainingColumn(compact=True, elapsed_when_finished=True)
            share = (progress.BarColumn(24), progress.TaskProgressColumn(), progress.TimeElapsedColumn(), left)
            self._progress = progress.Progress(
                progress.TextColumn("{task.description}"), *share, console=console, transient=True
            )
            self._task = self._progress.add_task(self.text, total=None if self.share is None else 1.0)
            self._progress.start()

    def _tell(self, sections: list[Section]) -> None:
        """Draws what was found meanwhile; the bar comes back with the next thing that takes long."""
        self.close()
        self.terminal.draw(sections)
        self.terminal.show("")
        self._arm()

    def close(self) -> None:
        """Takes the bar away."""
        with self._lock:
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
            if self._progress is not None:
                self._progress.stop()
                self._progress = None

"""From whatever happens to one exit status and at most one message: nobody who uses robocal ever sees a traceback.

0 done    2 the input is wrong, nothing written    3 it ran, but the result must not be trusted    130 Ctrl-C    1 a
fault of ours

What a command line says in another way is put into the words that click reads (`complete`).
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

from robocal.cli.timings import timed
from robocal.errors import CONTROL, MESSAGE_LIMIT, Cancelled, InputError, MissingExtra, ToWrite, printable, shorten

__all__ = [
    "DONE",
    "FAULT",
    "INPUT",
    "STOPPED",
    "UNTRUSTED",
    "complain",
    "complete",
    "run",
    "stop_requested",
    "verbose_wanted",
]

DONE, FAULT, INPUT, UNTRUSTED, STOPPED = 0, 1, 2, 3, 130
IDENTIFY = (["calibrate"], ["cable", "calibrate"], ["cable", "identify"])  # no commands, but often typed for `identify`
ANYWHERE = {  # words of robocal itself, heard wherever they stand
    "--debug": "Show tracebacks. Accepted anywhere.",
    "--timings": "Say where the time went. Accepted anywhere.",
    "--verbose": "Say all that a page would. Accepted anywhere.",
}
_received: list[int] = []
_heard: set[str] = set()  # those of ANYWHERE in the command that runs


def run(arguments: Sequence[str] | None, build: Callable[[], Any]) -> int:
    """Parses and runs a command line by the application that `build` makes for it; see the module for what it returns."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    _heard.clear()
    _heard.update(w for w in words if w in ANYWHERE)
    debug = "--debug" in _heard or bool(os.environ.get("ROBOCAL_DEBUG"))
    with timed("--timings" in _heard) as timings:
        status = _run(complete([w for w in words if w not in ANYWHERE]), build, debug)
        if timings:
            complain(str(timings), kind="timings")
    return status


def _run(words: list[str], build: Callable[[], Any], debug: bool) -> int:
    """Runs a command line in which words of robocal itself have been heard."""
    _open_streams()
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, ValueError, OSError):
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    with _signals(), warnings.catch_warnings():
        if not debug:
            # Overflow in a hopeless fit is for the verdict to say, not for a line of Python's on the terminal.
            warnings.simplefilter("ignore")
        try:
            status = _dispatch(words, build)
            sys.stdout.flush()
            return status
        except (KeyboardInterrupt, Cancelled):
            return _stop()
        except BrokenPipeError:
            # Whoever read our output has gone, as `head` does: not worth a word.
            _silence(sys.stdout)
            return 128 + 13
        except MemoryError:
            complain("not enough memory for this; fewer rows or fewer free parameters need less")
            return INPUT
        except Exception as error:
            if debug:
                raise
            return _status_of(error, words)


def _open_streams() -> None:
    """Gives closed streams (`>&-`) a place that swallows what is written: else the next file that is opened would receive it."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), "r" if name == "stdin" else "w"))


def _status_of(error: Exception, words: Sequence[str]) -> int:
    """Says what is wrong; the exit status of it."""
    if isinstance(error, InputError | MissingExtra):
        complain(str(error), whole=True)
        _document(words, error)
        return INPUT
    if isinstance(error, OSError):
        _document(words, error)
        _silence(sys.stdout)
        where = f"{error.filename}: " if error.filename else ""
        complain(f"{where}{(error.strerror or str(error)).lower()}")
        return INPUT
    if _received:
        return _stop()
    first = next(iter(str(error).strip().splitlines()), "no message")
    complain(f"a fault in robocal itself: {type(error).__name__}: {first[:200]}")
    complain("please report it, with the output of the same command and --debug", kind="note")
    return FAULT


def _dispatch(words: list[str], build: Callable[[], Any]) -> int:
    """Lets click read the words, then does what they say; click's complaints become ours.

    A verb only says what is to be done, and is done out here: inside, click has its own ideas about Ctrl-C and closed
    pipes.
    """
    import click

    try:
        app = build()
        with app.make_context("robocal", list(words)) as context:
            task = app.invoke(context)
    except click.exceptions.Exit as leaving:
        task = leaving.exit_code
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        path = context.command_path if context is not None else "robocal"
        if type(error).__name__ == "NoArgsIsHelpError":
            sys.stdout.write(f"{error.format_message()}\n")
            return INPUT
        typed = [w for w in words if not w.startswith("-")][:2]
        wrong = next((w for w in IDENTIFY if typed[: len(w)] == w), None)
        text = _plain(error)
        if wrong:
            near = "'robocal identify ROBOT DATA'"
            text = f"no such command {wrong[-1]!r}. Did you mean {near}? It serves cable robots too"
        complain(text, kind=path)
        _document(words, text)
        sys.stderr.write(f"Try: {'robocal identify' if wrong else path} --help\n")
        return INPUT
    status = task() if callable(task) else task
    return status if isinstance(status, int) else DONE


def _document(words: Sequence[str], error: Exception | str) -> None:
    """With --json, an error is a document too."""
    if "--json" not in words:
        return
    import json

    from robocal.files.plain import plain

    keys = ("message", "file", "row", "column", "key", "found", "expected", "suggestion")
    told: dict[str, Any] = {k: plain(getattr(error, k, None)) for k in keys}
    if isinstance(error, OSError):
        told |= {"message": (error.strerror or str(error)).lower(), "file": plain(error.filename)}
    told["message"] = told["message"] or str(error)
    for key, value in told.items():
        if isinstance(getattr(error, key, None), ToWrite):
            continue
        if key != "file" and len(text := value if isinstance(value, str) else json.dumps(value)) > MESSAGE_LIMIT:
            told[key] = shorten(text, MESSAGE_LIMIT)
    lines = json.dumps({"error": told}, indent=2, ensure_ascii=False, allow_nan=False).split("\n")
    with suppress(OSError, ValueError):
        # JSON spells out most control characters, but not those that terminals of eight bits obey.
        sys.stdout.write("\n".join(CONTROL.sub(lambda c: f"\\u{ord(c[0]):04x}", line) for line in lines) + "\n")
        sys.stdout.flush()


def _plain(error: Any) -> str:
    """A complaint about the command line, with the nearest known word."""
    text = " ".join(str(error.format_message()).split())
    options = getattr(error, "possibilities", None)
    if type(error).__name__ == "NoSuchOption":
        from robocal.errors import nearest

        name, context = str(error.option_name), getattr(error, "ctx", None)
        parameters = () if context is None else context.command.params
        known = [o for p in parameters for o in p.opts if o.startswith("--")]
        guess = nearest(name, known) or next(iter(options or ()), None)
        text = f"there is no option {name}" + (f"; did you mean {guess}?" if guess else "")
    return text[0].lower() + text[1:] if text else type(error).__name__


def complain(text: str, kind: str = "error", *, whole: bool = False) -> None:
    """One message on stderr, in colour where a person reads it; an error is one line of less than 400 characters, but for what
    is to be copied from it (`whole`: it is short already)."""
    whole = whole or kind in ("note", "warning", "timings")
    text = printable(text) if whole else shorten(printable(text), MESSAGE_LIMIT - 1)
    colours = {"error": 31, "warning": 33, "note": 36, "timings": 36}
    label = f"{kind}:" if kind in colours else f"{kind}: error:"
    if wants_colour(sys.stderr):
        label = f"\033[1;{colours.get(kind, 31)}m{label}\033[0m"
    with suppress(OSError, ValueError):
        sys.stderr.write(f"{label} {text}\n")
        sys.stderr.flush()


def wants_colour(stream: Any) -> bool:
    """Whether a stream is a terminal that wants colour."""
    if not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb":
        with suppress(AttributeError, ValueError):
            return bool(stream.isatty())
    return False


# --- stopping ---------------------------------------------------------------------------------------------------------------


def stop_requested() -> bool:
    """Whether somebody asked us to stop."""
    return bool(_received)


def verbose_wanted() -> bool:
    """Whether the command that runs is to say all that it knows."""
    return "--verbose" in _heard


def _stop() -> int:
    number = _received[0] if _received else int(signal.SIGINT)
    complain("stopped; nothing was left half-written", kind="note")
    return 128 + number


@contextmanager
def _signals() -> Iterator[None]:
    """Ctrl-C and SIGTERM raise KeyboardInterrupt, and are remembered: inside a callback of compiled code Python
    swallows exceptions."""
    _received.clear()
    before: dict[int, Any] = {}

    def stop(number: int, frame: FrameType | None) -> None:
        _received.append(number)
        raise KeyboardInterrupt

    hook = sys.unraisablehook

    def quiet(event: Any) -> None:
        if not isinstance(event.exc_value, KeyboardInterrupt):
            hook(event)

    sys.unraisablehook = quiet
    for number in (int(signal.SIGINT), int(signal.SIGTERM)):
        with suppress(ValueError):  # not in the main thread, as in a notebook or a test
            if signal.getsignal(number) is not signal.SIG_IGN:  # nohup, and background jobs of a shell
                before[number] = signal.signal(number, stop)
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in before.items():
            with suppress(ValueError):
                signal.signal(number, handler)


def _silence(stream: Any) -> None:
    """Lets what is still buffered go nowhere, so that the interpreter does not stumble over it at its end."""
    with suppress(OSError, ValueError, AttributeError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)


OLD = {"--group": "--group-by"}  # spellings of the release before, still understood


def complete(words: Sequence[str]) -> list[str]:
    """The command line in today's spelling, with `--compare all` for a `--compare` that no method follows: a word with a comma or
    one of the estimators' names is its value, anything else is not."""
    out: list[str] = []
    for i, word in enumerate(words):
        name, sign, value = word.partition("=")
        out.append(OLD.get(name, name) + sign + value)
        if word == "--compare":
            from robocal.verbs.identify import METHODS

            following = words[i + 1] if i + 1 < len(words) else ""
            if not ("," in following or following in (*METHODS, "all")):
                out.append("all")
    return out

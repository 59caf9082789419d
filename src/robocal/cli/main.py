"""The way in. Nothing heavy is imported before a command needs it."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from types import ModuleType
from typing import Any, NoReturn

__all__ = ["main", "run_command"]

RARELY = 10_000  # new objects between two looks for garbage: a command makes few circles


PLUGINS = "pydantic.plugin._loader"


class _NoPlugins(ModuleType):
    """What finds no plugins for pydantic, and so needs nothing of `importlib.metadata`, which is 20 modules. Asked for anything else, it
    gives way to the module whose name it has."""

    def get_plugins(self) -> tuple[()]:
        """None."""
        return ()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        sys.modules.pop(PLUGINS, None)
        return getattr(import_module(PLUGINS), name)


def _build() -> Any:
    from robocal.cli.app import build

    return build()


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status: 0 done, 2 wrong input, 3 not to be trusted, 130 stopped, 1 a fault
    of ours."""
    if "numpy" not in sys.modules:
        # The matrices of a command are small: more threads of BLAS only wait for each other, at half as much processor time again.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Else it looks for some in every package that is installed.
    if os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__") == "__all__":
        sys.modules.setdefault(PLUGINS, _NoPlugins(PLUGINS))
    gc.disable()  # what is imported stays; the progress bar's first event puts the collector back to work
    usual = gc.get_threshold()
    gc.set_threshold(RARELY, *usual[1:])
    try:
        from robocal.cli.guard import run

        return run(arguments, _build)
    except KeyboardInterrupt:  # before the guard stands, or after it
        return 130
    finally:
        if arguments is None:
            gc.freeze()  # the process ends: what it leaves need not be looked through for garbage
        else:
            gc.unfreeze()
            gc.set_threshold(*usual)
        gc.enable()


def run_command() -> NoReturn:
    """Runs the command of this process, and ends it without taking apart all that was imported (0.03 s). Who watches the process, as a
    profiler does, still hears of its end."""
    status = main()
    monitoring = getattr(sys, "monitoring", None)  # from Python 3.12 on
    tools = monitoring and any(map(monitoring.get_tool, range(6)))
    if not (tools or sys.gettrace() or sys.getprofile()):
        with suppress(OSError, ValueError, AttributeError):  # else the interpreter says what it makes of its streams
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    sys.exit(status)

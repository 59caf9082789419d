"""The way in. Nothing heavy is imported before a command needs it."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from typing import Any

__all__ = ["main"]

RARELY = 10_000  # new objects between two looks for garbage: a command makes few circles


def _build(words: Sequence[str]) -> Any:
    from robocal.cli.app import build

    return build(words)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status: 0 done, 2 wrong input, 3 not to be trusted, 130 stopped, 1 a fault
    of ours."""
    if "numpy" not in sys.modules:
        # The matrices of a command are small: more threads of BLAS only wait for each other, at half as much processor time again.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
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

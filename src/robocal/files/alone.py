"""One process at a time in a folder."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from robocal.errors import FileError, reason_of

try:
    import fcntl
except ImportError:  # Windows: nothing holds others back
    fcntl = None  # type: ignore[assignment]

__all__ = ["LOCK", "alone"]

LOCK = "lock"
TRIES = 100  # of a folder that others make and do away with


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Keeps a folder, which is made where it is missing, for this process until the end; it goes then where it is empty, and with it those
    around it that were made for it.

    Whatever ends the process gives the folder free: the system does. Raises FileError where another process has it, or where it cannot
    be made.
    """
    made = [p for p in folder.parents if not p.exists()]  # the innermost first
    held = _acquire_lock(folder)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            (folder / LOCK).unlink()
        with contextlib.suppress(OSError):
            for place in (folder, *made):
                place.rmdir()
        os.close(held)


def _acquire_lock(folder: Path) -> int:
    """The open lock. What was locked may be gone from the folder by then, with whoever had it: only what is there counts."""
    place = folder / LOCK
    for _ in range(TRIES):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            held = os.open(place, os.O_RDWR | os.O_CREAT, 0o666)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise FileError(f"the folder cannot be made: {reason_of(error)}", file=folder) from None
        try:
            if fcntl is not None:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(held), place.stat()):
                return held
        except FileNotFoundError:
            pass
        except BlockingIOError:
            os.close(held)
            raise FileError(
                "another process writes here", file=folder, expected="the end of that process, or another -o"
            ) from None
        except OSError as error:
            os.close(held)
            message = f"the folder cannot be locked: {reason_of(error)}"
            raise FileError(message, file=folder, expected="-o on another disk") from None
        os.close(held)
    raise FileError("the folder cannot be made: another process removes it", file=folder)

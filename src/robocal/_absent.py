"""Packages that others import wherever they are installed, and that nobody needs here."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator

__all__ = ["absent"]


@contextlib.contextmanager
def absent(*names: str) -> Iterator[None]:
    """Modules that nobody has imported cannot be imported within."""
    hidden = [name for name in names if name not in sys.modules]
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]  # None: "there is no such module"
    try:
        yield
    finally:
        for name in hidden:
            del sys.modules[name]

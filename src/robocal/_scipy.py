"""scipy, whose package `special` is not imported for a quantile.

That package brings array interfaces, f2py and numpy's tests along (0.1 s, 100 modules). The functions of distributions lie
in one compiled module of it, which needs none of these.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from importlib import import_module
from types import ModuleType
from typing import Any

import scipy

__all__: list[str] = []


def __getattr__(name: str) -> Any:
    found = _special() if name == "special" else getattr(scipy, name)
    globals()[name] = found
    return found


def _special() -> Any:
    """The compiled functions of `scipy.special`; the whole package where they do not load without it."""
    whole = "scipy.special"
    if whole not in sys.modules:
        empty = ModuleType(whole)
        empty.__path__ = [f"{folder}/special" for folder in scipy.__path__]
        sys.modules[whole] = empty
        try:
            with suppress(ImportError, AttributeError):
                return import_module(f"{whole}._ufuncs")
        finally:
            del sys.modules[whole]  # whoever needs the package still gets the whole of it
    return import_module(whole)

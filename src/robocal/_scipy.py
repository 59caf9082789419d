"""scipy, whose packages `special` and `linalg` are not imported for a quantile or a Cholesky factor.

They bring array interfaces, f2py and numpy's tests along (0.1 s, 100 modules). The functions of distributions lie in one compiled
module of the one, LAPACK's in one of the other (`lapack`), which need none of these.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from importlib import import_module
from types import ModuleType
from typing import Any

import scipy

__all__: list[str] = []

# What has the functions, and the compiled module in which they lie.
ALONE = {
    "special": ("scipy.special", "scipy.special._ufuncs"), "lapack": ("scipy.linalg.lapack", "scipy.linalg._flapack"),
}  # fmt: skip


def __getattr__(name: str) -> Any:
    found = _alone(*ALONE[name]) if name in ALONE else getattr(scipy, name)
    globals()[name] = found
    return found


def _alone(whole: str, compiled: str) -> Any:
    """The compiled functions of a package; the whole of it where they do not load without it."""
    package = compiled.rpartition(".")[0]
    if package not in sys.modules:
        empty = ModuleType(package)
        empty.__path__ = [f"{folder}/{package.rpartition('.')[2]}" for folder in scipy.__path__]
        sys.modules[package] = empty
        try:
            with suppress(ImportError, AttributeError):
                return import_module(compiled)
        finally:
            del sys.modules[package]  # whoever needs the package still gets the whole of it
    return import_module(whole)

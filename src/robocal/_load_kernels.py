"""How machine code from numba's cache enters a process: with less work than by numba's own way, in versions of numba whose inside was
read for it. In any other version by numba's own way, since a symbol that the linker was not told of ends the process.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numba
from numba.core.runtime import rtsys

__all__ = ["prepare", "rebuild"]

KNOWN = ("0.68",)


def prepare(target_context: Any) -> None:
    """Makes numba's runtime known to the linker.

    numba's own way in first registers all that it can compile (0.25 s) and compiles its runtime's counters (0.02 s), which machine
    code has no use for. What is not in the cache is compiled by a compiler that does both then.
    """
    if _is_known():
        _tell_runtime()
    else:
        rtsys.initialize(target_context)


def rebuild(usual: Callable[[Any, Any], Any], target_context: Any, payload: Any) -> Any:
    """A kernel from what the cache has of it, without reading what only another kernel that takes it in has a use for (two thirds of
    the time)."""
    if not _is_known():
        return usual(target_context, payload)
    (name, kind, (code, unread)), *more = payload
    # The linker looks for no function that it has not heard of.
    target_context.codegen()._engine._defined_symbols.update(
        {more[0].llvm_func_name, more[0].llvm_cpython_wrapper_name}
    )
    found = usual(target_context, ((name, kind, (code, _nothing())), *more))
    found.library.__class__, found.library.unread = _library(), unread
    return found


def _is_known() -> bool:
    return numba.__version__.rpartition(".")[0] in KNOWN


@functools.cache
def _tell_runtime() -> None:
    from numba.core.codegen import ll as llvm
    from numba.core.runtime import _nrt_python

    for name, address in _nrt_python.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


@functools.cache
def _library() -> type[Any]:
    """The class of a kernel from the cache, whose source for others is read when one of them asks."""
    from numba.core.codegen import JITCodeLibrary
    from numba.core.codegen import ll as llvm

    class Library(JITCodeLibrary):
        unread: bytes | None

        def _get_module_for_linking(self) -> Any:
            if self.unread is not None:
                self._shared_module, self.unread = llvm.parse_bitcode(self.unread), None
                self._codegen._engine._load_defined_symbols(self._shared_module)
            return super()._get_module_for_linking()

    return Library


@functools.cache
def _nothing() -> bytes:
    """A module without functions."""
    from numba.core.codegen import ll as llvm

    made: bytes = llvm.parse_assembly("").as_bitcode()
    return made

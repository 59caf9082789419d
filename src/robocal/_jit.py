"""The one boundary to compiled code: how kernels are called, where their machine code is kept, and how arrays enter.

Three traps are closed here and in `_compiler.py`, so that no kernel file needs to know of them:

- numba notices an edit of the file that a kernel lies in, but not of a callee in another file, and would go on using the
  old machine code. So the cache folder is named by a digest of *every* `_kernels.py` of the package (and of the files of this boundary,
  whose flags numba does not look at either). Constants of a kernel must therefore come from kernel files;
  `tests/unit/test_jit.py` holds them to it.
- numba raises at import when it finds no folder to write to, and in the middle of a call when the disk fills up.
- a read-only, strided or integer array compiles one more signature. `as_kernel_array` and `as_kernel_indices` let in one kind of
  array only.

What was compiled before is called without numba (`_machine_code.py`), whose import takes longer than most commands compute.

Environment: ROBOCAL_CACHE_DIR overrides the user's cache folder; NUMBA_DISABLE_JIT=1 leaves the kernels plain Python.
"""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _machine_code
from ._cache_folder import Store, find_store

__all__ = ["as_kernel_array", "as_kernel_indices", "cache_folder", "compile_for", "kernel"]

P = ParamSpec("P")
R = TypeVar("R")
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ROOT = Path(__file__).resolve().parent
_BOUNDARY = ("_jit.py", "_compiler.py", "_machine_code.py")
_lock = threading.RLock()
_kernels: list[_Kernel] = []


# Kernels


@overload
def kernel(fn: Callable[P, R], /) -> Callable[P, R]: ...
@overload
def kernel(*, inline: bool = False) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def kernel(fn: Callable[..., Any] | None = None, /, *, inline: bool = False) -> Any:
    """Compile `fn` at its first call, or take its machine code from where it is kept; with `inline`, kernels that call it take its body
    and compile it once, with their own."""
    if fn is None:
        return functools.partial(kernel, inline=inline)
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return fn
    _store()  # before the first call: whoever edits a file now has not edited what was read here
    return _Kernel(fn, inline)


class _Kernel:
    """A compiled function. What it is called with decides whose code runs: that of a file for these types, else that of numba."""

    def __init__(self, fn: Callable[..., Any], inline: bool) -> None:
        functools.update_wrapper(self, fn)
        self.py_func, self.inline = fn, inline
        self.ready: dict[_machine_code.Types, Callable[..., Any]] = {}
        self.made: Any = None  # numba's compiler of it, once it is needed
        self.enter: Callable[..., Any] = self._choose
        _kernels.append(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return _kernel_of, (self.__module__, self.py_func.__name__)

    def __call__(self, *args: Any, **named: Any) -> Any:
        return self.enter(*args, **named)

    def _choose(self, *args: Any, **named: Any) -> Any:
        """Runs the machine code for these types, which the next call finds first."""
        types = None if named or self.py_func.__defaults__ or self.made is not None else _machine_code.types_of(args)
        code = None if types is None else self.ready.get(types) or self._load(types)
        if code is None:
            return self.dispatcher(*args, **named)
        return code(*args)

    def _load(self, types: _machine_code.Types) -> Callable[..., Any] | None:
        store = _store()
        path = None
        if store is not None and _real_path(self.py_func.__code__.co_filename) in store.sources and store.is_current():
            path = _machine_code.file_of(store.folder, self.py_func, _machine_code.notation(types))
        with _lock:
            if path is None or types in self.ready:
                return self.ready.get(types)
            code = _machine_code.load(path, self.py_func)
            if code is not None and self.made is None:
                self.ready[types] = code
                self.enter = _machine_code.guard(self.ready, self._choose)
            return code

    @property
    def dispatcher(self) -> Any:
        """numba's compiler of it, which takes over."""
        with _lock:
            if self.made is None:
                from ._compiler import dispatcher_of

                for each in _kernels:
                    if each.made is None:
                        each.made = dispatcher_of(each.py_func, each.inline, _store)
                        each.enter = each.made
                for each in _kernels:
                    each.tell_callees()
        return self.made

    @property
    def signatures(self) -> list[str]:
        """The types, in words, for which it has machine code."""
        ready = [_machine_code.notation(types) for types in self.ready]
        if self.made is not None:
            from ._compiler import signatures_of

            ready += signatures_of(self.made)
        return list(dict.fromkeys(ready))

    def tell_callees(self) -> None:
        """numba knows a kernel that its function calls by its compiler."""
        known = self.py_func.__globals__
        for name in self.py_func.__code__.co_names:
            if isinstance(called := known.get(name), _Kernel):
                known[name] = called.made
        for cell in self.py_func.__closure__ or ():
            if isinstance(cell.cell_contents, _Kernel):
                cell.cell_contents = cell.cell_contents.made


def _kernel_of(module: str, name: str) -> Any:
    """The kernel of a name in another process."""
    return getattr(import_module(module), name)


def compile_for(kernel: Any, types: str, wait: bool = True) -> None:
    """Compiles a kernel for the types of its arguments, as numba writes them, or finds it in the cache: "(f8[:,::1], i8)".
    Without `wait`, one that another process is compiling is left to it."""
    words = types.removeprefix("(").removesuffix(")")
    if isinstance(kernel, _Kernel):
        store = _store()
        path = store and _machine_code.file_of(store.folder, kernel.py_func, words)
        if path is None or not path.exists():
            from ._compiler import compile_types

            compile_types(kernel.dispatcher, words, wait)


# Arrays

_FLOAT = np.dtype(np.float64)
_INT = np.dtype(np.int64)


@overload
def as_kernel_array(array: ArrayLike, /) -> Floats: ...
@overload
def as_kernel_array(array: ArrayLike, second: ArrayLike, /, *more: ArrayLike) -> tuple[Floats, ...]: ...
def as_kernel_array(*arrays: Any) -> Any:
    """C-contiguous, writable float64 arrays, the only kind that kernels see; one in, one out; several in, a tuple out.

    An array that is already so passes through untouched (about 0.1 us each). Anything else is copied (about 1 us and the
    copy), a read-only array too: numba types an array by whether it could be written to. Let in what stays the same
    once, outside the loop. Complex numbers, strings and objects raise TypeError.
    """
    for a in arrays:
        if type(a) is not np.ndarray or a.dtype is not _FLOAT or not a.flags.carray:
            arrays = tuple([_enter(a, _FLOAT) for a in arrays])
            break
    return arrays if len(arrays) != 1 else arrays[0]


@overload
def as_kernel_indices(array: ArrayLike, /) -> Ints: ...
@overload
def as_kernel_indices(array: ArrayLike, second: ArrayLike, /, *more: ArrayLike) -> tuple[Ints, ...]: ...
def as_kernel_indices(*arrays: Any) -> Any:
    """As `as_kernel_array`, for int64: indices, kinds, flags. Fractions raise TypeError."""
    for a in arrays:
        if type(a) is not np.ndarray or a.dtype is not _INT or not a.flags.carray:
            arrays = tuple([_enter(a, _INT) for a in arrays])
            break
    return arrays if len(arrays) != 1 else arrays[0]


def _enter(array: Any, dtype: np.dtype[Any]) -> Any:
    if type(array) is np.ndarray and array.dtype is dtype and array.flags.carray:
        return array
    given = np.asarray(array)
    if given.size == 0 and not isinstance(array, np.ndarray):
        given = given.astype(dtype)  # an empty list has no type of its own; numpy calls it float
    return given.astype(dtype, order="C", casting="same_kind", subok=False, copy=True)


# The cache


def cache_folder() -> Path | None:
    """Where machine code is kept; None where it cannot be."""
    store = _store()
    return None if store is None else store.folder


@functools.cache
def _real_path(name: str) -> Path:
    return Path(name).resolve()


@functools.cache
def _store() -> Store | None:
    """The folder for the kernels as they are now."""
    # What changes the machine code without changing the sources, and is not in numba's own key.
    settings = f"{np.__version__} {os.environ.get('NUMBA_BOUNDSCHECK', '')}"
    sources = [*(_ROOT / name for name in _BOUNDARY), *sorted(_kernel_files())]
    return find_store(_ROOT, sources, settings, _machine_code.compiler_version())


def _kernel_files() -> Iterator[Path]:
    for folder, below, names in os.walk(_ROOT):
        below[:] = [name for name in below if name != "__pycache__"]
        if "_kernels.py" in names:
            yield Path(folder, "_kernels.py")

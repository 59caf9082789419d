"""The one boundary to numba: how kernels are compiled, where the machine code is kept, and how arrays enter.

Three traps are closed here, so that no kernel file needs to know of them:

- numba notices an edit of the file that a kernel lies in, but not of a callee in another file, and would go on using the
  old machine code. So the cache folder is named by a digest of *every* `_kernels.py` of the package (and of this file,
  whose flags numba does not look at either). Constants of a kernel must therefore come from kernel files;
  `tests/unit/test_jit.py` holds them to it.
- numba raises at import when it finds no folder to write to, and in the middle of a call when the disk fills up. Here a
  kernel without a cache only compiles again in each process.
- a read-only, strided or integer array compiles one more signature. `as_kernel_array` and `as_kernel_indices` let in one kind of
  array only.

Environment: ROBOCAL_CACHE_DIR overrides the user's cache folder; NUMBA_DISABLE_JIT=1 leaves the kernels plain Python.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any, ParamSpec, TypeVar, overload

import numba
import numpy as np
from numba import prange
from numba.core import config, event, sigutils
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaWarning
from numba.core.types import unliteral
from numpy.typing import ArrayLike, NDArray

from ._cache_folder import Store, find_store
from ._load_kernels import prepare, rebuild
from .progress import tell_of_compilation

__all__ = ["as_kernel_array", "as_kernel_indices", "cache_folder", "compile_for", "kernel", "prange"]

P = ParamSpec("P")
R = TypeVar("R")
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# No 'nnan' and no 'ninf': a NaN or an infinity that enters a kernel must be seen at its end.
_FASTMATH = {"contract", "reassoc", "nsz", "arcp", "afn"}
_ROOT = Path(__file__).resolve().parent
_PATIENCE, _GLANCE = 60.0, 0.01  # s, of waiting for a kernel that another process compiles, and between two looks
_cache_dir_lock = threading.Lock()


# Kernels


@overload
def kernel(fn: Callable[P, R], /) -> Callable[P, R]: ...
@overload
def kernel(*, parallel: bool = False, inline: bool = False) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def kernel(fn: Callable[..., Any] | None = None, /, *, parallel: bool = False, inline: bool = False) -> Any:
    """Compile `fn` at its first call, or fetch it from the cache; with `parallel`, loops over `prange` run on all cores; with
    `inline`, kernels that call it take its body and compile it once, with their own."""
    if fn is None:
        return functools.partial(kernel, parallel=parallel, inline=inline)
    flags: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": _FASTMATH, "parallel": parallel}
    flags |= {"inline": "always" if inline else "never", "no_cfunc_wrapper": True}  # nobody enters from C
    compiled = numba.njit(**flags)(fn)
    if isinstance(compiled, Dispatcher):  # not so under NUMBA_DISABLE_JIT=1
        cache = _cache_of(fn)
        if cache is not None:
            compiled._cache = cache
        # A number that stands in a caller has a type of its own for numba, which would compile what takes it once more.
        template = compiled.get_call_template
        compiled.get_call_template = lambda args, kws: template(tuple([unliteral(a) for a in args]), kws)  # type: ignore[method-assign]
        _ours.add(fn)
    return compiled


def compile_for(kernel: Any, types: str, wait: bool = True) -> None:
    """Compiles a kernel for the types of its arguments, as numba writes them, or finds it in the cache: "(f8[:,::1], i8)".
    Without `wait`, one that another process is compiling is left to it."""
    if isinstance(kernel, Dispatcher) and (
        wait or not (isinstance(kernel._cache, _Cache) and kernel._cache.is_taken())
    ):
        kernel.compile(sigutils.normalize_signature(f"{types.removesuffix(')')},)")[0])  # a tuple, of one type too


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


# Saying that a compilation takes time

_ours: set[Callable[..., Any]] = set()


class _Announcer(event.Listener):
    """Hears numba start a compilation, which it does only when the cache has nothing.

    A compiler makes a million small objects and throws few away: without the collector of garbage it takes an eighth less.
    """

    deep = 0
    collects = False

    def on_start(self, happening: Any) -> None:
        self.deep += 1
        if self.deep == 1:
            self.collects = gc.isenabled()
            gc.disable()
        fn = happening.data["dispatcher"].py_func
        if fn in _ours:
            tell_of_compilation(
                f"{fn.__module__}.{fn.__name__}".removeprefix(f"{_ROOT.name}.").replace("._kernels.", ".")
            )

    def on_end(self, happening: Any) -> None:
        self.deep -= 1
        if self.deep == 0 and self.collects:
            gc.enable()


event.register("numba:compile", _Announcer())


# The cache


class _Place(UserProvidedCacheLocator):
    """The folder of the kernels of one file: `find_store` has seen that it can be written to."""

    def ensure_cache_path(self) -> None:
        os.makedirs(self.get_cache_path(), exist_ok=True)


class _Kept(CompileResultCacheImpl):
    """What is kept of a compiled kernel."""

    _locator_classes = [_Place]  # noqa: RUF012 - as numba has it

    def reduce(self, cres: Any) -> Any:
        """Without the environments of functions that take no constant from them: to make these again imports numba's arrays (25 ms)."""
        *kept, environments = super().reduce(cres)
        return (*kept, tuple(e for e in environments if e.consts))

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        return rebuild(super().rebuild, target_context, payload)


class _Cache(FunctionCache):
    """numba's cache, which here never raises: without it a kernel is compiled again, which is slow and right.

    Of several processes that want a kernel one compiles it, and the others wait for what it saves.
    """

    _impl_class = _Kept
    _lock: IO[bytes] | None = None  # held while this process compiles the kernel

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = self._load(sig, target_context)
        if found is None and self._take():
            found = self._load(sig, target_context)  # it may have been saved meanwhile
            if found is not None:
                self._give_back()
        return found

    def _load(self, sig: Any, target_context: Any) -> Any:
        store = _store()
        if store is None or not store.is_current():
            return None
        try:
            prepare(target_context)
            found = self._load_overload(sig, target_context)
        except Exception:  # a torn file can raise anything
            with contextlib.suppress(Exception):
                self.flush()
            return None
        # Two processes that save two signatures at one moment can leave one's code under the other's name.
        if found is not None and tuple(found.signature.args) != tuple(getattr(sig, "args", sig)):
            return None
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        store = _store()
        try:
            if store is not None and store.is_current():
                super().save_overload(sig, data)
        except NumbaWarning:  # warnings are errors in the tests: "this kernel cannot be cached" is its author's to know
            raise
        except Exception:  # a full disk, a folder that went away
            pass
        finally:
            self._give_back()

    def _take(self, patience: float = _PATIENCE) -> bool:
        """Takes the kernel's lock, waiting for whoever has it; False where there are no locks, and when patience ends."""
        self._give_back()
        until = time.monotonic() + patience
        try:
            import fcntl

            self._lock = open(f"{self._cache_file._index_path}.lock", "ab")  # noqa: SIM115 - held until the kernel is saved
            while True:
                try:
                    fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    return True
                except BlockingIOError:
                    if time.monotonic() >= until:
                        raise
                time.sleep(_GLANCE)
        except (ImportError, OSError):
            self._give_back()
            return False

    def _give_back(self) -> None:
        lock, self._lock = self._lock, None
        if lock is not None:
            lock.close()

    def is_taken(self) -> bool:
        """Whether another process is compiling the kernel."""
        free = self._take(0.0)
        self._give_back()
        return not free


def _cache_of(fn: Callable[..., Any]) -> _Cache | None:
    """The cache of one kernel; None when there is no folder, or when `fn` lies in a file that does not name the folder."""
    store = _store()
    if store is None or _real_path(fn.__code__.co_filename) not in store.sources:
        return None
    # numba chooses the folder when the cache object is made, so its setting is ours for this moment only.
    with _cache_dir_lock:
        before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(store.folder), ""
        try:
            return _Cache(fn)
        except Exception:  # "cannot cache function: no locator available", a folder lost since
            return None
        finally:
            config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before


@functools.cache
def _real_path(name: str) -> Path:
    return Path(name).resolve()


def cache_folder() -> Path | None:
    """Where machine code is kept; None where it cannot be."""
    store = _store()
    return None if store is None else store.folder


@functools.cache
def _store() -> Store | None:
    """The folder for the kernels as they are now."""
    # What changes the machine code without changing the sources, and is not in numba's own key.
    settings = f"{np.__version__} {config.BOUNDSCHECK}"
    return find_store(_ROOT, [_real_path(__file__), *sorted(_kernel_files())], settings, numba.__version__)


def _kernel_files() -> Iterator[Path]:
    for folder, below, names in os.walk(_ROOT):
        below[:] = [name for name in below if name != "__pycache__"]
        if "_kernels.py" in names:
            yield Path(folder, "_kernels.py")

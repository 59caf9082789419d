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
import hashlib
import os
import re
import shutil
import stat
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, TypeVar, overload

import numba
import numpy as np
from numba import prange
from numba.core import config, event, sigutils
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaWarning
from numba.core.runtime import rtsys
from numpy.typing import ArrayLike, NDArray

from ._version import __version__
from .progress import tell_of_compilation

__all__ = ["as_kernel_array", "as_kernel_indices", "cache_folder", "compile_for", "kernel", "prange"]

P = ParamSpec("P")
R = TypeVar("R")
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# No 'nnan' and no 'ninf': a NaN or an infinity that enters a kernel must be seen at its end.
_FASTMATH = {"contract", "reassoc", "nsz", "arcp", "afn"}
_ROOT = Path(__file__).resolve().parent
_KEEP = 3  # cache folders: this one and what was used last before it
_FOLDER_NAME = re.compile(r"robocal-[^/]+-numba-[^/]+-[0-9a-f]{16}")
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
        _ours.add(fn)
    return compiled


def compile_for(kernel: Any, types: str) -> None:
    """Compiles a kernel for the types of its arguments, as numba writes them, or finds it in the cache: "(f8[:,::1], i8)"."""
    if isinstance(kernel, Dispatcher):
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
        if happening.data["dispatcher"].py_func in _ours:
            tell_of_compilation()

    def on_end(self, happening: Any) -> None:
        self.deep -= 1
        if self.deep == 0 and self.collects:
            gc.enable()


event.register("numba:compile", _Announcer())


# The cache


class _Store(NamedTuple):
    folder: Path
    sources: dict[Path, tuple[int, int]]  # each kernel file's time and size when the folder's name was computed

    def is_current(self) -> bool:
        """Whether the sources are still those that named the folder: an edit under a running process ends its use of the cache."""
        try:
            return all(_stamp(path) == stamp for path, stamp in self.sources.items())
        except OSError:
            return False


class _Cache(FunctionCache):
    """numba's cache, which here never raises: without it a kernel is compiled again, which is slow and right."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        store = _store()
        if store is None or not store.is_current():
            return None
        try:
            # numba's own way in first registers all that it can compile (0.25 s), which machine code has no use for: its
            # runtime is enough. What is not in the cache is compiled by a compiler that registers it then.
            rtsys.initialize(target_context)
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
        if store is None or not store.is_current():
            return
        try:
            super().save_overload(sig, data)
        except NumbaWarning:  # warnings are errors in the tests: "this kernel cannot be cached" is its author's to know
            raise
        except Exception:  # a full disk, a folder that went away
            pass


def _cache_of(fn: Callable[..., Any]) -> _Cache | None:
    """The cache of one kernel; None when there is no folder, or when `fn` lies in a file that does not name the folder."""
    store = _store()
    if store is None or Path(fn.__code__.co_filename).resolve() not in store.sources:
        return None
    # numba chooses the folder when the cache object is made, so its setting is ours for this moment only.
    with _cache_dir_lock:
        before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(store.folder), ""
        try:
            cache = _Cache(fn)
        except Exception:  # "cannot cache function: no locator available", a folder lost since
            return None
        finally:
            config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before
    # When the folder cannot be written to any more, numba falls back on one that our digest does not name.
    return cache if Path(cache.cache_path).is_relative_to(store.folder) else None


def cache_folder() -> Path | None:
    """Where machine code is kept; None where it cannot be."""
    store = _store()
    return None if store is None else store.folder


@functools.cache
def _store() -> _Store | None:
    """The folder for the kernels as they are now, made if need be; older ones are pruned when a new one is made."""
    try:
        sources = {path: _stamp(path) for path in [Path(__file__).resolve(), *sorted(_ROOT.rglob("_kernels.py"))]}
        name = _folder_name(list(sources))
    except OSError:  # no sources to read, as in a zip archive
        return None
    for base in _bases():
        folder = base / name
        new = not os.path.exists(folder)  # Path.exists raises where it may not look
        if _is_writable(folder):
            with contextlib.suppress(OSError):
                os.utime(folder)
                if new:
                    _prune(base, folder)
            return _Store(folder, sources)
    return None


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_mtime_ns, status.st_size


def _folder_name(sources: list[Path]) -> str:
    digest = hashlib.sha256()
    # What changes the machine code without changing the sources, and is not in numba's own key.
    digest.update(f"{np.__version__} {config.BOUNDSCHECK}".encode())
    for path in sources:
        content = path.read_bytes()
        digest.update(f"\n{path.relative_to(_ROOT).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    return f"robocal-{__version__}-numba-{numba.__version__}-{digest.hexdigest()[:16]}"


def _bases() -> Iterator[Path]:
    """Where cache folders may lie, best first: the user's cache, then a temporary folder; only such as `_is_private`."""
    override = os.environ.get("ROBOCAL_CACHE_DIR")
    xdg = os.environ.get("XDG_CACHE_HOME", "")
    home = os.path.expanduser("~")
    wanted: list[Path] = []
    if override:
        wanted.append(Path(override).absolute() / "kernels")
    elif os.path.isabs(xdg):
        wanted.append(Path(xdg) / "robocal" / "kernels")
    elif os.path.isabs(home):  # "~" itself when nobody knows the user's home
        wanted.append(Path(home) / ".cache" / "robocal" / "kernels")
    with contextlib.suppress(OSError, AttributeError):  # no temporary folder at all; no user numbers, as on Windows
        private = Path(tempfile.gettempdir()) / f"robocal-{os.getuid()}"
        if _is_private(private):
            wanted.append(private / "kernels")
    yield from (base for base in wanted if _is_private(base))


def _is_private(folder: Path) -> bool:
    """Makes a folder if need be; whether machine code may be loaded from it: nobody else can have put it there.

    It is a folder of the user's own, no link, which nobody else can write to; and none above it is one that a stranger owns
    or that everybody may rename things in.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not hasattr(os, "getuid"):
            return True
        status, ours = folder.lstat(), (0, os.getuid())
        if not stat.S_ISDIR(status.st_mode) or status.st_uid != ours[1] or status.st_mode & 0o022:
            return False
        for above in folder.resolve().parents:
            found = above.stat()
            if found.st_uid not in ours or (found.st_mode & 0o002 and not found.st_mode & stat.S_ISVTX):
                return False
        if status.st_mode & 0o077:
            folder.chmod(0o700)
    except OSError:
        return False
    return True


def _is_writable(folder: Path) -> bool:
    if not _is_private(folder):
        return False
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(bytes(4096))
    except OSError:
        return False
    return True


def _prune(base: Path, current: Path) -> None:
    others = [path for path in base.iterdir() if _FOLDER_NAME.fullmatch(path.name) and path != current]
    others.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    for path in others[_KEEP - 1 :]:
        shutil.rmtree(path, ignore_errors=True)

"""numba, where a kernel has to be compiled: how, and its own cache, which meets the processes that compile at one time.

Imported when the first kernel is not among the files of machine code. Two traps are closed here:

- numba raises at import when it finds no folder to write to, and in the middle of a call when the disk fills up. Here a
  kernel without a cache only compiles again in each process.
- numba notices an edit of the file that a kernel lies in, but not of a callee in another file: `_jit._store` names the folder by all.
"""

from __future__ import annotations

import contextlib
import gc
import os
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import IO, Any

import numba
from numba.core import config, event, sigutils, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator
from numba.core.errors import NumbaWarning
from numba.core.runtime import rtsys
from numba.core.types import unliteral

from . import _machine_code
from ._cache_folder import Store
from .progress import tell_of_compilation

__all__ = ["compile_types", "dispatcher_of", "signatures_of"]

# No 'nnan' and no 'ninf': a NaN or an infinity that enters a kernel must be seen at its end.
FASTMATH = {"contract", "reassoc", "nsz", "arcp", "afn"}
PATIENCE, GLANCE = 60.0, 0.01  # s, of waiting for a kernel that another process compiles, and between two looks
SCALARS = {types.int64: "i8", types.float64: "f8", types.boolean: "b1", types.none: "none"}
_cache_dir_lock = threading.Lock()
_ours: set[Callable[..., Any]] = set()


def dispatcher_of(function: Callable[..., Any], inline: bool, store: Callable[[], Store | None]) -> Any:
    """numba's compiler of a function, which keeps what it makes in the store, if that knows the function's file."""
    flags: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": FASTMATH}
    flags |= {"inline": "always" if inline else "never", "no_cfunc_wrapper": True}  # nobody enters from C
    made = numba.njit(**flags)(function)
    found = store()
    if found is not None and Path(function.__code__.co_filename).resolve() in found.sources:
        cache = _cache_of(function, store)
        if cache is not None:
            made._cache = cache
    # A number that stands in a caller has a type of its own for numba, which would compile what takes it once more.
    template = made.get_call_template
    made.get_call_template = lambda args, kws: template(tuple([unliteral(a) for a in args]), kws)
    _ours.add(function)
    return made


def compile_types(dispatcher: Any, words: str, wait: bool = True) -> None:
    """Compiles for types in words, "f8[:,::1], i8", or finds it in the cache. Without `wait`, what another process is compiling is left
    to it."""
    if wait or not (isinstance(dispatcher._cache, _Cache) and dispatcher._cache.is_taken()):
        dispatcher.compile(sigutils.normalize_signature(f"({words},)")[0])  # a tuple, of one type too


def signatures_of(dispatcher: Any) -> list[str]:
    """The types, in words, for which numba has compiled."""
    return [_words(types) or ", ".join(map(str, types)) for types in dispatcher.signatures]


def _words(kinds: Iterable[Any]) -> str | None:
    """Types in words; None for one that no file of machine code is for."""
    words = [_word(kind) for kind in kinds]
    return None if None in words else ", ".join(words)  # type: ignore[arg-type]


def _word(kind: Any) -> str | None:
    if isinstance(kind, types.Array):
        whole = kind.layout == "C" and kind.mutable and kind.aligned and kind.ndim > 0
        dtype = SCALARS.get(kind.dtype)
        return f"{dtype}[{':,' * (kind.ndim - 1)}::1]" if whole and dtype else None
    if isinstance(kind, types.Tuple | types.UniTuple):
        parts = [_word(part) for part in kind.types]
        return None if None in parts else _machine_code.tuple_notation(parts)  # type: ignore[arg-type]
    return SCALARS.get(kind)


# Saying that a compilation takes time


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
                f"{fn.__module__}.{fn.__name__}".removeprefix(f"{__package__}.").replace("._kernels.", ".")
            )

    def on_end(self, happening: Any) -> None:
        self.deep -= 1
        if self.deep == 0 and self.collects:
            gc.enable()


event.register("numba:compile", _Announcer())


# numba's cache


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
        """The kernel; its object code, of which a library that was loaded keeps nothing, is told by `code`."""
        self.code = payload[0][-1][0]
        return super().rebuild(target_context, payload)


class _Cache(FunctionCache):
    """numba's cache, which here never raises: without it a kernel is compiled again, which is slow and right.

    Of several processes that want a kernel one compiles it, and the others wait for what it saves.
    """

    _impl_class = _Kept
    _lock: IO[bytes] | None = None  # held while this process compiles the kernel
    store: Callable[[], Store | None]
    function: Callable[..., Any]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = self._load(sig, target_context)
        if found is None and self._take():
            found = self._load(sig, target_context)  # it may have been saved meanwhile
            if found is not None:
                self._give_back()
        return found

    def _load(self, sig: Any, target_context: Any) -> Any:
        store = self.store()
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
        if found is None or tuple(found.signature.args) != tuple(getattr(sig, "args", sig)):
            return None
        with contextlib.suppress(Exception):  # of ours beside it nothing may be left
            self._save_code(store.folder, found, self._impl.code)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        store = self.store()
        try:
            if store is not None and store.is_current():
                super().save_overload(sig, data)
                self._save_code(store.folder, data, data.library.serialize_using_object_code()[-1][0])
        except NumbaWarning:  # warnings are errors in the tests: "this kernel cannot be cached" is its author's to know
            raise
        except Exception:  # a full disk, a folder that went away
            pass
        finally:
            self._give_back()

    def _save_code(self, folder: Path, made: Any, code: bytes) -> None:
        """Beside numba's file one of machine code alone, where the code needs nothing but what is in it."""
        words = _words(made.signature.args)
        path = None if words is None else _machine_code.file_of(folder, self.function, words)
        if path is None or path.exists():
            return
        held = [made.environment, *made._find_referenced_environments()]
        if made.lifted or made.reload_init or any(e.consts for e in held):
            return
        facts = made.fndesc
        _machine_code.save(path, code, facts.llvm_cpython_wrapper_name, made.target_context.get_env_name(facts))

    def _take(self, patience: float = PATIENCE) -> bool:
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
                time.sleep(GLANCE)
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


def _cache_of(function: Callable[..., Any], store: Callable[[], Store | None]) -> _Cache | None:
    """The cache of one kernel; None when there is no folder."""
    found = store()
    assert found is not None
    # numba chooses the folder when the cache object is made, so its setting is ours for this moment only.
    with _cache_dir_lock:
        before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(found.folder), ""
        try:
            made = _Cache(function)
        except Exception:  # "cannot cache function: no locator available", a folder lost since
            return None
        finally:
            config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before
    made.store, made.function = store, function
    return made

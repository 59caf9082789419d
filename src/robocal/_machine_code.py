"""Machine code of kernels in files of our own, called without importing the compiler (0.2 s of every command).

A file has one kernel for one list of types, in the words of the list of kernels: "f8[:,::1], i8". It is numba's object code, which
numba's own small extension modules make callable. Only what was read for it is done so: versions of numba in KNOWN, ELF (Linux), no
setting of numba's in the environment, and code whose every symbol is known, since the linker ends the process where it misses one.
"""

from __future__ import annotations

import builtins
import ctypes
import functools
import hashlib
import importlib.util
import json
import os
import struct
import sys
import threading
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

__all__ = ["Types", "compiler_version", "file_of", "guard", "load", "notation", "save", "tuple_notation", "types_of"]

KNOWN = ("0.68",)
MARK = b"robocal machine code 1\n"
SETTINGS = ("NUMBA_", "LLVM")  # the beginnings of variables that change what is compiled, or how
THREADS = ("NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER")  # but not these: kernels are sequential
EXTENSIONS = ("_dynfunc", "_helperlib", "core/runtime/_nrt_python")
SCALARS = {int: "i8", float: "f8", bool: "b1", np.int64: "i8", np.float64: "f8", np.bool_: "b1", type(None): "none"}
ARRAYS = {np.dtype(np.float64): "f8", np.dtype(np.int64): "i8", np.dtype(np.bool_): "b1"}
TESTS = {"f8": "isinstance({0}, float)", "i8": "type({0}) in ints", "b1": "type({0}) in bools", "none": "{0} is None"}
Types: TypeAlias = "tuple[str | Types, ...]"  # of arguments; a tuple within is one argument
_lock = threading.Lock()


def types_of(values: tuple[Any, ...]) -> Types | None:
    """The types of arguments; None for one that no kernel's file is for."""
    found = []
    for value in values:
        kind = types_of(value) if type(value) is tuple else _type(value)
        if kind is None:
            return None
        found.append(kind)
    return tuple(found)


def _type(value: Any) -> str | None:
    if type(value) is np.ndarray:
        dtype = ARRAYS.get(value.dtype)
        whole = value.ndim > 0 and value.flags.carray
        return f"{dtype}[{':,' * (value.ndim - 1)}::1]" if dtype and whole else None
    return SCALARS.get(type(value))


def notation(types: Types) -> str:
    """Types in the words of the list of kernels."""
    return ", ".join([t if isinstance(t, str) else tuple_notation([notation((p,)) for p in t]) for t in types])


def tuple_notation(parts: list[str]) -> str:
    """The word for a tuple, which has another name where all its parts are of one type."""
    if parts and all(p == parts[0] for p in parts):
        return f"UniTuple({parts[0]}, {len(parts)})"
    return f"Tuple(({', '.join(parts)}))"


def guard(ready: Mapping[Types, Callable[..., Any]], other: Callable[..., Any]) -> Callable[..., Any]:
    """A function that runs what is ready for the types of its arguments, else `other`: wrappers of machine code do not look at types."""
    first = next(iter(ready))
    if any(len(types) != len(first) for types in ready):
        return other
    names = ", ".join([f"a{k}" for k in range(len(first))])
    lines = [f"def enter({names}):"]
    for k, types in enumerate(ready):
        tests = [test for i, kind in enumerate(types) for test in _tests(f"a{i}", kind)]
        lines += [f"    if {' and '.join(tests) or 'True'}:", f"        return run{k}({names})"]
    lines.append(f"    return other({names})")
    known: dict[str, Any] = {f"run{k}": code for k, code in enumerate(ready.values())}
    known |= {name: dtype for dtype, name in ARRAYS.items()} | {"array": np.ndarray, "other": other}
    known |= {"ints": (int, np.int64), "bools": (bool, np.bool_)}
    exec("\n".join(lines), known)
    made: Callable[..., Any] = known["enter"]
    return made


def _tests(name: str, kind: str | Types) -> list[str]:
    if isinstance(kind, str):
        if "[" in kind:
            dtype, dimensions = kind[:2], 1 + kind.count(",")
            return [
                f"type({name}) is array and {name}.dtype is {dtype} and {name}.ndim == {dimensions} and {name}.flags.carray"
            ]
        return [TESTS[kind].format(name)]
    return [
        f"type({name}) is tuple and len({name}) == {len(kind)}",
        *[test for i, part in enumerate(kind) for test in _tests(f"{name}[{i}]", part)],
    ]


@functools.cache
def compiler_version() -> str:
    """The version of numba, from the name of its folder: to import it is what is saved here."""
    spec = importlib.util.find_spec("numba")
    if spec is not None and spec.origin is not None and "numba" not in sys.modules:
        found = list(Path(spec.origin).parent.parent.glob("numba-*.dist-info"))
        if len(found) == 1:
            return found[0].name.removeprefix("numba-").removesuffix(".dist-info")
    import numba

    version: str = numba.__version__
    return version


@functools.cache
def _is_known() -> bool:
    ours = compiler_version().rpartition(".")[0] in KNOWN and sys.platform == "linux"
    return ours and not any(n.startswith(SETTINGS) and not n.startswith(THREADS) for n in os.environ)


@functools.cache
def _machine() -> str:
    """What else the code depends on: interpreter, processor and its features."""
    import llvmlite.binding as llvm

    told = (sys.implementation.cache_tag, llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())
    return hashlib.sha256(repr(told).encode()).hexdigest()[:12]


def file_of(folder: Path, function: Callable[..., Any], types: str) -> Path | None:
    """Where the machine code of a function for these types is, or would be; None where none is written."""
    if not _is_known():
        return None
    name = f"{function.__module__}.{function.__qualname__}".replace("<", "").replace(">", "")
    digest = hashlib.sha256(f"{function.__code__.co_firstlineno} {types}".encode()).hexdigest()[:12]
    return folder / f"{name}-{digest}-{_machine()}.code"


def save(path: Path, code: bytes, wrapper: str, environment: str) -> None:
    """Writes object code whose symbols are all known, whole or not at all."""
    if not all(s in _symbols() or _is_in_process(s) for s in _wanted(code)):
        return
    head = json.dumps({"wrapper": wrapper, "environment": environment, "size": len(code), "sum": zlib.crc32(code)})
    part = path.with_name(f"{path.name}.{os.getpid()}")
    with suppress(OSError):
        part.write_bytes(MARK + head.encode() + b"\n" + code)
        os.replace(part, path)


def load(path: Path, function: Callable[..., Any]) -> Callable[..., Any] | None:
    """What calls the machine code of a file; None where there is none, or what there was was torn: it is made anew."""
    try:
        told = path.read_bytes()
    except OSError:
        return None
    try:
        mark, line, code = told.split(b"\n", 2)
        head = json.loads(line)
        whole = mark + b"\n" == MARK and head["size"] == len(code) and head["sum"] == zlib.crc32(code)
        wrapper, place_of = str(head["wrapper"]), str(head["environment"])
    except (ValueError, KeyError, TypeError):
        whole = False
    if not whole:
        with suppress(OSError):
            path.unlink()
        return None
    with _lock:
        import llvmlite.binding as llvm

        engine, dynfunc = _engine(), _extension("_dynfunc")
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        address = engine.get_function_address(wrapper)
        place = engine.get_global_value_address(place_of)
        if not address or not place:
            return None
        environment = dynfunc.Environment(function.__globals__)
        (ctypes.c_void_p * 1).from_address(place)[0] = id(environment)
        name, module = function.__name__, sys.modules[function.__module__]
        made: Callable[..., Any] = dynfunc.make_function(module, name, "", address, environment, (engine,))
        return made


@functools.cache
def _extension(name: str) -> Any:
    """One of numba's extension modules, without numba; under its own name, so that numba takes the same one if it is imported later."""
    full = f"numba.{name.replace('/', '.')}"
    if full in sys.modules:
        return sys.modules[full]
    root = importlib.util.find_spec("numba")
    assert root is not None and root.origin is not None
    path = next(Path(root.origin).parent.joinpath(name).parent.glob(f"{Path(name).name}.*.so"))
    spec = importlib.util.spec_from_file_location(full, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[full] = module
    spec.loader.exec_module(module)
    return module


@functools.cache
def _symbols() -> dict[str, int]:
    """What object code may ask for, and where it is: as numba tells its own linker."""
    dynfunc, helpers, runtime = map(_extension, EXTENSIONS)
    known = {"_Py_NoneStruct": id(None)}
    for module in (helpers, dynfunc):
        known |= {f"numba_{name}": at for name, at in module.c_helpers.items()}
    known |= {name if name.startswith("_") else f"NRT_{name}": at for name, at in runtime.c_helpers.items()}
    for value in vars(builtins).values():
        if isinstance(value, type) and issubclass(value, BaseException):
            known[f"PyExc_{value.__name__}"] = id(value)
    return known


@functools.cache
def _engine() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for name, address in _symbols().items():
        llvm.add_symbol(name, address)
    target = llvm.Target.from_default_triple()
    reloc = "static" if target.name.startswith("x86") else "default"
    machine = target.create_target_machine(cpu=llvm.get_host_cpu_name(), reloc=reloc, codemodel="jitdefault", jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


@functools.cache
def _process() -> Any:
    return ctypes.CDLL(None)


def _is_in_process(symbol: str) -> bool:
    return hasattr(_process(), symbol)


def _wanted(code: bytes) -> Iterator[str]:
    """The symbols that ELF object code takes from elsewhere. One that cannot be read wants what nobody has."""
    if code[:6] != b"\x7fELF\x02\x01":
        yield "no ELF of 64 bits"
        return
    (start,) = struct.unpack_from("<Q", code, 0x28)
    size, count = struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", code, start + k * size) for k in range(count)]
    for _, kind, _, _, offset, length, link, _, _, entry in sections:
        if kind != 2:  # the table of symbols
            continue
        names = sections[link][4]
        for at in range(offset + entry, offset + length, entry):
            name, _, _, where, _, _ = struct.unpack_from("<IBBHQQ", code, at)
            if where == 0 and name:
                yield code[names + name : code.index(b"\0", names + name)].decode()

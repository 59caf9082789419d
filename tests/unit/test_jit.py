"""The boundary to numba: no stale machine code, no failure for want of a cache, one signature per kernel."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

import robocal
from robocal import _cache_folder, _compiler, _jit, _machine_code, progress
from robocal._jit import as_kernel_array, as_kernel_indices, kernel

compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT leaves kernels uncompiled")
KERNEL_FILES = sorted(Path(robocal.__file__).parent.rglob("_kernels.py"))

# A package of two kernel files, where the caller's file does not change when the callee's does.
INNER = "from tiny._jit import kernel\n@kernel\ndef factor(x, power=1):\n    return {factor} * x ** power\n"
OUTER = """
from tiny._jit import kernel
from tiny.inner._kernels import factor
@kernel
def total(x):
    s = 0.0
    for i in range(x.shape[0]):
        s += factor(x[i])
    return s
"""
PLAIN = """
import numba
def kernel(f=None, **options):
    return numba.njit(cache=True, **options)(f) if f else numba.njit(cache=True, **options)
"""
REPORT = """
import numba
import numpy as np
from tiny import _jit, progress
compilations = []
progress.on_compile(lambda name: compilations.append(1))
{between}
from tiny.outer._kernels import total
store = _jit._store()
print(json.dumps(dict(value=total(np.ones(1)), compilations=len(compilations),
    folder=store and str(store.folder), numba_folder=numba.config.CACHE_DIR)))
"""


class Tiny:
    """The package on disk; `run` imports and calls it in a process of its own."""

    def __init__(self, folder: Path, jit: str) -> None:
        self.folder = folder
        self.edit(2.0)
        for room, source in (("outer", OUTER), ("inner", None)):
            (folder / "tiny" / room / "__init__.py").parent.mkdir(exist_ok=True)
            (folder / "tiny" / room / "__init__.py").write_text("")
            if source:
                (folder / "tiny" / room / "_kernels.py").write_text(source)
        (folder / "tiny" / "__init__.py").write_text("")
        (folder / "tiny" / "_version.py").write_text("__version__ = '7'\n")
        (folder / "tiny" / "progress.py").write_text(Path(progress.__file__).read_text())
        (folder / "tiny" / "_jit.py").write_text(jit)
        for module in (_cache_folder, _compiler, _machine_code):
            name = Path(module.__file__ or "").name
            (folder / "tiny" / name).write_text(Path(module.__file__ or "").read_text())

    @property
    def inner(self) -> Path:
        return self.folder / "tiny" / "inner" / "_kernels.py"

    def edit(self, factor: float) -> None:
        self.inner.parent.mkdir(parents=True, exist_ok=True)
        self.inner.write_text(INNER.format(factor=factor))

    def run(self, code: str = REPORT, first: str = "", between: str = "", **environment: str) -> Any:
        # No .pyc: Python itself takes a file of equal size that is edited within a second for unchanged.
        path = os.pathsep.join([str(self.folder), *sys.path])
        keep = {"PATH": os.environ.get("PATH", ""), "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": path}
        default = {"ROBOCAL_CACHE_DIR": str(self.folder / "cache"), "TMPDIR": str(self.folder)}
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", "import json\n" + first + code.replace("{between}", between)],
            env=keep | default | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)


@pytest.fixture
def tiny(tmp_path: Path) -> Tiny:
    return Tiny(tmp_path, Path(_jit.__file__).read_text())


def files(folder: Path, pattern: str) -> list[Path]:
    return sorted(folder.rglob(pattern))


def test_an_edited_callee_is_never_stale(tiny: Tiny) -> None:
    first, again = tiny.run(), tiny.run()
    assert first["value"] == again["value"] == 2.0
    assert (first["compilations"], again["compilations"]) == (1, 0)  # told once, and only when something compiles
    assert first["numba_folder"] == ""
    assert Path(first["folder"]).is_relative_to(tiny.folder / "cache")
    tiny.edit(3.0)
    assert tiny.run()["value"] == 3.0


WITHOUT = """
import sys
{between}
import numpy as np
from tiny import _jit
from tiny.outer._kernels import total
value = total(np.array([1.0, 2.0]))
registered = "numba.np.npyimpl" in sys.modules, "numba" in sys.modules
@_jit.kernel
def twice(x):
    return 2.0 * total(np.sqrt(x))
print(json.dumps([value, *registered, twice(np.array([4.0, 9.0]))]))
"""


@pytest.mark.slow
@compiled
def test_what_is_in_the_cache_wakes_no_compiler_and_a_new_kernel_does(tiny: Tiny) -> None:
    """The second process takes machine code from the cache without what numba registers to compile; a kernel that calls
    that code compiles beside it all the same."""
    assert tiny.run(WITHOUT) == [6.0, True, True, 20.0]
    assert tiny.run(WITHOUT) == [6.0, False, False, 20.0]
    # A version of numba that nobody read loads them by numba's own way.
    assert tiny.run(WITHOUT, between="from tiny import _machine_code\n_machine_code.KNOWN = ()") == [
        6.0,
        False,
        True,
        20.0,
    ]


ONE = """
from tiny import _jit, progress
compilations = []
progress.on_compile(compilations.append)
from tiny.outer._kernels import total
print(json.dumps([total(__import__("numpy").ones(1)), compilations]))
"""


@pytest.mark.slow
@compiled
def test_of_two_processes_one_compiles_and_the_other_waits(tiny: Tiny) -> None:
    with ThreadPoolExecutor(2) as both:
        told = list(both.map(lambda _: tiny.run(ONE), range(2)))
    assert sorted(told) == [[2.0, []], [2.0, ["outer.total"]]]


@pytest.mark.slow
@compiled
def test_nobody_waits_for_a_process_that_died(tiny: Tiny) -> None:
    """Its lock went with it, and the file of the lock means nothing."""
    die = "import os; from numba.core import event; from tiny import _jit\n"
    die += "class Die(event.Listener):\n    on_start = on_end = lambda self, happening: os._exit(0)\n"
    tiny.run(f"{die}print('null', flush=True); event.register('numba:compile', Die())\n{ONE}")
    assert files(tiny.folder / "cache", "*.lock") and tiny.run(ONE) == [2.0, ["outer.total"]]


@pytest.mark.slow
def test_numba_alone_would_be_stale(tmp_path: Path) -> None:
    """The reason for the test above; when this one fails, numba has learned better and `_jit` can be simpler."""
    plain = Tiny(tmp_path, PLAIN)
    code = "from tiny.outer._kernels import total\nimport numpy as np\nprint(json.dumps(total(np.ones(1))))"
    assert plain.run(code, NUMBA_CACHE_DIR=str(tmp_path / "cache")) == 2.0
    plain.edit(3.0)
    assert plain.run(code, NUMBA_CACHE_DIR=str(tmp_path / "cache")) == 2.0


@pytest.mark.slow
def test_an_edit_under_a_running_process_is_not_saved_under_the_old_name(tiny: Tiny) -> None:
    """The process has read the callee as it was and must neither save its code nor mix it with saved code."""
    edit = f"import tiny.inner._kernels\nopen({str(tiny.inner)!r}, 'w').write({INNER.format(factor=3.0)!r})"
    assert tiny.run(between=edit)["value"] == 2.0
    assert files(tiny.folder / "cache", "*.nbc") == []
    assert tiny.run()["value"] == 3.0


@pytest.mark.slow
@pytest.mark.parametrize("damage", [b"", b"not a pickle"])
def test_torn_files_are_compiled_over(tiny: Tiny, damage: bytes) -> None:
    assert tiny.run()["value"] == 2.0
    for path in files(tiny.folder / "cache", "*.nb[ci]"):
        path.write_bytes(damage)
    assert tiny.run()["value"] == 2.0
    assert tiny.run()["compilations"] == 0


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda told: b"",
    "half": lambda told: told[: len(told) // 2],
    "all but the last byte": lambda told: told[:-1],
    "another byte of the code": lambda told: told[:-99] + bytes([told[-99] ^ 1]) + told[-98:],
    "another version": lambda told: told.replace(b"machine code 1", b"machine code 0", 1),
    "a head that is none": lambda told: told.replace(b"{", b"[", 1),
    "a head without its words": lambda told: told.replace(b'"wrapper"', b'"warpper"', 1),
}


@pytest.mark.slow
@compiled
def test_damaged_machine_code_says_the_same_and_is_made_anew(tiny: Tiny) -> None:
    assert tiny.run(WITHOUT) == [6.0, True, True, 20.0]
    (path,) = (p for p in files(tiny.folder / "cache", "*.code") if ".total-" in p.name)
    whole = path.read_bytes()
    for what, damage in DAMAGES.items():
        torn = damage(whole)
        assert torn != whole
        path.write_bytes(torn)
        assert tiny.run(WITHOUT)[::3] == [6.0, 20.0], what
        assert path.read_bytes() == whole, what
    assert tiny.run(WITHOUT) == [6.0, False, False, 20.0]


MIXED = """
import sys
import numpy as np
from tiny import _jit
from tiny.mixed._kernels import mixed
a, told = np.array([1.0, 2.0]), []
given = [((a, 3), 0.5, None, True), ((a, 3), 0.5, 2.0, True), ((a, 3), np.float64(0.5), None, np.bool_(False))]
for one in [*given, *given, ((a, 3), 2, None, True), ((a, 3.5), 0.5, None, True), ((a[::-1], 3), 0.5, None, True), *given]:
    told.append([mixed(*one), "numba" in sys.modules])
print(json.dumps(told))
"""
MIXED_KERNEL = """
from tiny._jit import kernel
@kernel
def mixed(pair, by, more, flag):
    a, n = pair
    s = 0.0
    for i in range(a.shape[0]):
        s += a[i] * (i + 1)
    s = s * by + n
    if more is not None:
        s += 100.0 * more
    return -s if flag else s
"""


@pytest.mark.slow
@compiled
def test_tuples_numbers_and_none_go_to_the_code_for_them(tiny: Tiny) -> None:
    """What is compiled goes without numba, what is not with it, and what comes after is told as before."""
    room = tiny.folder / "tiny" / "mixed"
    room.mkdir()
    (room / "__init__.py").write_text("")
    (room / "_kernels.py").write_text(MIXED_KERNEL)
    known = [-5.5, -205.5, 5.5]
    right = [*known, *known, -13.0, -6.0, -5.0, *known]
    told = tiny.run(MIXED)
    assert [value for value, _ in told] == right
    assert tiny.run(MIXED) == [[value, False] for value in right[:8]] + told[8:]


POOL = {
    "f8[:,::1]": np.zeros((2, 3)), "f8[::1]": np.zeros(3), "i8[::1]": np.zeros(3, np.int64), "b1[::1]": np.zeros(3, np.bool_),
    "f8": 1.5, "i8": 2, "b1": True, "none": None,
    "UniTuple(f8, 2)": (1.0, 2.0), "UniTuple(f8, 3)": (1.0, 2.0, 3.0), "Tuple((f8, i8))": (1.0, 2),
    "Tuple((f8[::1], Tuple((i8, none))))": (np.zeros(2), (1, None)),
}  # fmt: skip
ALSO: list[tuple[Any, str | None]] = [
    (np.float64(1.5), "f8"), (np.int64(2), "i8"), (np.bool_(True), "b1"), (np.ones((1, 0)), "f8[:,::1]"),
    (np.asfortranarray(np.ones((2, 3))), None), (np.zeros(4)[::2], None), (np.broadcast_to(np.zeros(3), (2, 3)), None),
    (np.zeros(3, ">f8"), None), (np.zeros(3, np.float32), None), (np.frombuffer(bytes(25), np.float64, 3, 1), None),
    (np.array(1.0), None), (np.zeros((2, 3)).view(np.matrix), None), (np.int32(2), None), (np.float32(1.5), None), (1j, None),
    ("1", None), ([1.0], None), ((1.0, "1"), None), ((), None), (2**70, "i8"),
]  # fmt: skip


def test_a_guard_lets_in_its_own_types_and_nothing_else() -> None:
    everything = [*((v, words) for words, v in POOL.items()), *ALSO]
    kinds = {words: _machine_code.types_of((v,)) or () for words, v in POOL.items()}
    for words, own in kinds.items():
        assert _machine_code.notation(own) == words
        # Of different counts of arguments none goes in.
        assert _machine_code.guard({own: says("one"), (*own, *own): says("two")}, says("other"))(POOL[words]) == "other"
        for other, others in kinds.items():
            # Alone, as the second of two arguments, and where the code of another type is asked first.
            alone = _machine_code.guard({own: says("ready")}, says("other"))
            after = _machine_code.guard({others: says(other), own: says("ready")}, says("other"))
            beside = _machine_code.guard({(*others, *own): says("ready")}, says("other"))
            for value, mine in everything:
                right = "ready" if mine == words else "other"
                assert alone(value) == beside(POOL[other], value) == right, (words, value)
                assert after(value) == (other if mine == other != words else right), (words, other, value)


def says(word: str) -> Callable[..., str]:
    return lambda *args: word


def test_no_folder_anywhere(tiny: Tiny) -> None:
    nowhere = "import tempfile; tempfile.tempdir = '/dev/null/nowhere'\n"
    told = tiny.run(first=nowhere, HOME="/dev/null/nowhere", ROBOCAL_CACHE_DIR="")
    assert (told["value"], told["folder"], told["compilations"]) == (2.0, None, 1)


@pytest.mark.slow
def test_a_full_disk(tiny: Tiny) -> None:
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000))\n"
    assert tiny.run(first=full)["value"] == 2.0
    assert tiny.run()["compilations"] == 1


@pytest.mark.slow
def test_a_read_only_cache_folder_gives_way_to_a_private_temporary_one(tiny: Tiny) -> None:
    (tiny.folder / "file").write_text("")
    caches = [tiny.folder / "file"]
    if os.getuid() != 0:  # the superuser may write to a read-only folder, but not to a file as if it were one
        for mode in (0o500, 0o000):
            caches.append(tiny.folder / f"mode{mode}")
            caches[-1].mkdir(mode=mode)
    for cache in caches:
        told = tiny.run(ROBOCAL_CACHE_DIR=str(cache))
        private = tiny.folder / f"robocal-{os.getuid()}"
        assert told["value"] == 2.0
        assert Path(told["folder"]).is_relative_to(private)
        assert private.stat().st_mode & 0o777 == 0o700


def test_plain_python_without_the_compiler(tiny: Tiny) -> None:
    told = tiny.run(NUMBA_DISABLE_JIT="1")
    assert (told["value"], told["compilations"]) == (2.0, 0)


@pytest.fixture
def somewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for name in ("ROBOCAL_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    return tmp_path


def test_where_the_cache_may_lie(somewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    private = somewhere / f"robocal-{os.getuid()}" / "kernels"
    assert list(_cache_folder._bases()) == [somewhere / "home" / ".cache" / "robocal" / "kernels", private]
    monkeypatch.setenv("XDG_CACHE_HOME", "relative/is/ignored")
    assert next(_cache_folder._bases()) == somewhere / "home" / ".cache" / "robocal" / "kernels"
    monkeypatch.setenv("XDG_CACHE_HOME", str(somewhere / "xdg"))
    assert next(_cache_folder._bases()) == somewhere / "xdg" / "robocal" / "kernels"
    monkeypatch.setenv("ROBOCAL_CACHE_DIR", str(somewhere / "mine"))
    assert list(_cache_folder._bases()) == [somewhere / "mine" / "kernels", private]


def test_a_temporary_folder_that_others_can_write_to_is_refused(somewhere: Path) -> None:
    private = somewhere / f"robocal-{os.getuid()}"
    private.mkdir()
    private.chmod(0o777)
    assert private / "kernels" not in list(_cache_folder._bases())
    private.rmdir()
    (somewhere / "elsewhere").mkdir(mode=0o700)
    private.symlink_to(somewhere / "elsewhere")
    assert private / "kernels" not in list(_cache_folder._bases())


GIVEN = {"ROBOCAL_CACHE_DIR": "", "XDG_CACHE_HOME": "robocal", "HOME": ".cache/robocal"}


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="this system has no user numbers")
@pytest.mark.parametrize("name", GIVEN)
def test_a_folder_that_the_environment_names_is_the_users_own(
    somewhere: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Model code is never loaded from where somebody else can have put it."""
    monkeypatch.setenv(name, str(somewhere / "given"))
    base = somewhere / "given" / GIVEN[name] / "kernels"
    assert next(_cache_folder._bases()) == base and base.stat().st_mode & 0o777 == 0o700
    base.chmod(0o755)  # as earlier versions made it: it was always written by its user alone
    assert next(_cache_folder._bases()) == base and base.stat().st_mode & 0o777 == 0o700
    for mode in (0o720, 0o702, 0o777):
        base.chmod(mode)
        assert base not in list(_cache_folder._bases()), oct(mode)
    base.rmdir()
    (somewhere / "elsewhere").mkdir(mode=0o700)
    base.symlink_to(somewhere / "elsewhere")
    assert base not in list(_cache_folder._bases())
    base.unlink()
    (somewhere / "given").chmod(0o777)  # anybody can put another folder in its place
    assert base not in list(_cache_folder._bases())
    (somewhere / "given").chmod(0o1777)
    assert base in list(_cache_folder._bases())
    own = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: own + 1)
    assert base not in list(_cache_folder._bases())


def test_a_kernel_folder_with_a_strangers_files_is_not_used(somewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOCAL_CACHE_DIR", str(somewhere / "given"))
    store = _jit._store.__wrapped__()
    assert store is not None and store.folder.parent == somewhere / "given" / "kernels"
    store.folder.chmod(0o777)
    again = _jit._store.__wrapped__()
    assert again is not None and again.folder.parent == somewhere / f"robocal-{os.getuid()}" / "kernels"


def test_old_folders_go_and_strangers_stay(tmp_path: Path) -> None:
    ours = [tmp_path / f"robocal-0.{i}-numba-0.60-{i:016x}" for i in range(5)]
    for i, folder in enumerate([*ours, tmp_path / "not-ours"]):
        folder.mkdir()
        os.utime(folder, (i, i))
    _cache_folder._prune(tmp_path, ours[0])
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["not-ours", *(ours[i].name for i in (0, 3, 4))])


@compiled
@pytest.mark.parametrize(
    "make",
    [
        lambda a: a,
        lambda a: np.broadcast_to(a, a.shape),  # read-only
        np.asfortranarray,
        lambda a: np.repeat(a, 2, axis=1)[:, ::2],
        lambda a: a[::-1][::-1].view(np.matrix),
        lambda a: a.astype(">f8"),
        lambda a: a.astype(np.float32),
        lambda a: a.astype(np.int32),
        lambda a: np.frombuffer(b"\0" + a.tobytes(), dtype=np.float64, offset=1).reshape(a.shape),  # unaligned
        np.ndarray.tolist,
    ],
)
def test_one_signature_for_whatever_comes_in(make: Callable[[Any], Any]) -> None:
    numbers = np.arange(6).reshape(2, 3)
    assert (
        weighted(
            as_kernel_array(make(numbers.astype(float))),
            as_kernel_indices(np.broadcast_to(numbers.astype(np.uint8), (2, 3))),
        )
        == 55.0
    )
    assert len(weighted.signatures) == 1  # type: ignore[attr-defined]


@kernel
def weighted(a, n):
    s = 0.0
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            s += a[i, j] * n[i, j]
    return s


@compiled
def test_a_number_in_a_caller_is_no_type_of_its_own() -> None:
    a, n = np.ones((1, 1)), np.ones((1, 1), np.int64)
    assert scaled(a, n) == 6.0 and len(times.signatures) == 1  # type: ignore[attr-defined]


@kernel
def times(a, n, by):
    return by * a[0, 0] * n[0, 0]


@kernel
def scaled(a, n):
    count = n.shape[0]
    return times(a, n, 2) + times(a, n, 3) + times(a, n, count)


def test_the_door_passes_what_is_right_and_copies_what_is_not() -> None:
    a, n = np.zeros((2, 3)), np.zeros(4, np.int64)
    assert as_kernel_array(a) is a
    assert as_kernel_indices(n) is n
    assert as_kernel_array(a, a)[1] is a
    frozen = a.copy()
    frozen.flags.writeable = False
    entered = as_kernel_array(frozen, a)
    assert entered[0].flags.writeable
    assert entered[0] is not frozen
    assert entered[1] is a
    assert as_kernel_indices([]).dtype == np.int64
    for wrong in ([1j], ["1"], [None]):
        with pytest.raises(TypeError):
            as_kernel_array(wrong)
    with pytest.raises(TypeError):
        as_kernel_indices([0.5])


@compiled
def test_fast_arithmetic_still_sees_nan_and_infinity() -> None:
    @kernel
    def what(x):
        s = 0.0
        for v in x:
            s += v
        return s, np.isnan(s), s != s, np.isinf(s)

    assert what(np.array([1.0, np.nan]))[1:] == (True, True, False)
    assert what(np.array([1.0, np.inf]))[1:] == (False, False, True)
    assert what(np.array([np.inf, -np.inf]))[1:] == (True, True, False)


@pytest.mark.parametrize("path", KERNEL_FILES, ids=lambda p: p.parent.name)
def test_kernel_files_take_nothing_from_files_outside_the_digest(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or "."]
        for name in names:
            own = name == "robocal._jit" or (name.startswith("robocal.") and name.endswith("._kernels"))
            assert own or name in ("__future__", "math", "numpy"), f"line {node.lineno}: {name}"


def test_only_what_changes_the_code_asks_for_the_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """How many threads others may use is often set where many share a machine, and no kernel has any."""
    for name in [n for n in os.environ if n.startswith(_machine_code.SETTINGS)]:
        monkeypatch.delenv(name)
    known = _machine_code._is_known.__wrapped__
    before = known()
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    monkeypatch.setenv("NUMBA_THREADING_LAYER", "workqueue")
    assert known() == before
    monkeypatch.setenv("NUMBA_OPT", "1")
    assert not known()

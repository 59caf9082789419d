"""Processes that end in the middle of writing, and what may be found afterwards.

A command runs in a forked child (imports are paid once) that ends without a word at its n-th call of the system, or is killed
after some time. Then every file of the folder is as it was, or as the command writes it, or refused by every reader; what is not
ours is untouched; and the same command once more leaves what it always leaves, and nothing besides.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import signal
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from robocal.errors import InputError
from robocal.files.text import read_bytes

CALLS = ("link", "replace", "unlink", "fsync", "mkdir")
FOREIGN = {"notes.txt": b"mine", ".hidden": b"mine too", "result.json.bak": b"a copy"}


def count_calls(action: Callable[[], object]) -> int:
    """How many calls a whole command makes."""
    done = io.BytesIO(_child(action, stop_at=0))
    return int(done.read().decode() or 0)


def killed_at(action: Callable[[], object], number: int) -> None:
    """Runs a command that ends at its n-th call, before the call does anything."""
    _child(action, stop_at=number)


def left_before(action: Callable[[], object], folder: Path, numbers: Sequence[int], into: Path) -> list[Path]:
    """What a command would leave of a folder if it ended before its n-th call, for several n in one run: copies that are made at that
    moment. What the process has not handed to the system by then would be lost with it, and is in no copy."""
    into.mkdir()
    places = {number: into / str(number) for number in numbers}
    _child(action, stop_at=0, look=lambda number: number in places and shutil.copytree(folder, places[number]))
    return [places[number] for number in numbers]


def killed_after(action: Callable[[], object], seconds: float) -> None:
    """Runs a command and kills it."""
    pid = os.fork()
    if pid == 0:
        _run(action)
    time.sleep(seconds)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)


def duration(action: Callable[[], object]) -> float:
    """How long a command takes in a child."""
    begun = time.perf_counter()
    _child(action, stop_at=0)
    return time.perf_counter() - begun


def _child(action: Callable[[], object], stop_at: int, look: Callable[[int], object] = lambda number: None) -> bytes:
    read, write = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(read)
        made, busy = [0], []
        for name in CALLS:
            setattr(os, name, _counted(getattr(os, name), made, stop_at, look, busy))
        _run(action, lambda: os.write(write, str(made[0]).encode()))
    os.close(write)
    with os.fdopen(read, "rb") as stream:
        said = stream.read()
    os.waitpid(pid, 0)
    return said


def _counted(real, made, stop_at, look, busy):
    def call(*words, **more):
        if not busy:  # what the look itself calls is not of the command
            made[0] += 1
            if made[0] == stop_at:
                os._exit(137)
            busy.append(True)
            look(made[0])
            busy.clear()
        return real(*words, **more)

    return call


def _run(action: Callable[[], object], finish: Callable[[], object] = lambda: None) -> None:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            action()
            finish()
        finally:
            os._exit(0)


def readable(folder: Path) -> dict[str, bytes | None]:
    """Every file that is there by its path, None where it is refused."""
    out: dict[str, bytes | None] = {}
    for place in sorted(folder.rglob("*")):
        if place.is_file():
            try:
                out[str(place.relative_to(folder))] = read_bytes(place)
            except InputError:
                out[str(place.relative_to(folder))] = None
    return out


def judge(folder: Path, old: dict[str, bytes], new: dict[str, bytes]) -> str:
    """Which of old, new and refused a folder is, the worst of those in it. Raises AssertionError for a mixture, a lost file or
    a foreign one touched."""
    found = readable(folder)
    inside = {str(Path(n).parent) for n in {*old, *new}}
    states = [_judge(*({n: c for n, c in files.items() if str(Path(n).parent) == one} for files in (found, old, new)))
              for one in inside]  # fmt: skip
    return max(states, key=["new", "old", "refused"].index)


def _judge(found: dict[str, bytes | None], old: dict[str, bytes], new: dict[str, bytes]) -> str:
    for name, content in FOREIGN.items():
        assert name not in old or found.get(name) == content, f"{name} was touched"
    differ = [n for n in {*old, *new} if old.get(n) != new.get(n)]
    if any(n in found and found[n] is None for n in differ):
        assert not any(found.get(n) is not None and found.get(n) == old.get(n) for n in differ), "old ones can be read"
        return "refused"
    as_old = [n for n in differ if found.get(n) == old.get(n)]
    assert len(as_old) in (0, len(differ)), f"a mixture: {as_old} are old, of {differ}"
    if as_old:
        return "old"
    assert all(n in found for n in new), "a file was lost"
    return "new"

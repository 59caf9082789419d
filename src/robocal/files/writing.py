"""Writing files whole, whatever ends the process.

    1 clean      what an interrupted command left under these names
    2 prepare    every file under a temporary name, flushed to the disk
    3 announce   the journal names what is about to change, where that is more than one file
    4 replace    each by a rename, its old content kept under another name; when one fails, all get theirs back
    5 finish     the journal goes, then the old content

A process that ends before 3 leaves the old files, after 5 the new ones; in between nothing that the journal names can be read
(`guard`). Other files in the folder are never touched.

The journal is a line per file name. A process that ended in between left old and new files side by side, and only writing them
again makes them one thing: while a journal stands, none of the files that it names may be read.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
import signal
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

from robocal.errors import FileError, reason_of
from robocal.files.encoding import encode

try:
    import fcntl
except ImportError:  # Windows: nothing holds others back
    fcntl = None  # type: ignore[assignment]

__all__ = [
    "JOURNAL",
    "LOCK",
    "alone",
    "guard",
    "refuse_existing",
    "refuse_unwritable",
    "write_bytes",
    "write_files",
    "write_text",
]

# .NAME.PID-NUMBER.robocal is a file that is being written, with -old what it replaces.
LEFT = re.compile(r"\.(?P<name>.+)\.(?P<pid>\d+)-[0-9a-f]{8}\.robocal(-old)?", re.DOTALL)
OLD = "-old"
JOURNAL = ".robocal-writing"
LOCK = "lock"
TRIES = 100  # of a folder that others make and do away with


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Writes a whole text file, or nothing."""
    return write_bytes(path, encode(text))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> Path:
    """Writes a whole file, or nothing; its folder is made when it is missing."""
    place = Path(path)
    return write_files(place.parent, {place.name: data})[0]


def write_files(
    folder: str | os.PathLike[str], files: Mapping[str, bytes | str], *, remove: Collection[str] = ()
) -> tuple[Path, ...]:
    """Writes several files into a folder and removes those of the last time, all or nothing. Raises FileError; existing
    files of these names are replaced."""
    home = Path(folder)
    targets = tuple(home / name for name in files)
    made = _make_folder(home)
    temporary: list[Path] = []
    try:
        for target, content in zip(targets, files.values(), strict=True):
            refuse_unwritable(target)
            temporary.append(_temporary(target))
            write_through(temporary[-1], encode(content) if isinstance(content, str) else content, "xb")
        gone = [home / name for name in remove if name not in files and (home / name).is_file()]
        with _block_interrupts():
            _clean(home, {*files, *remove})
            _replace_all(home, temporary, targets, gone, {*files, *remove})
            made = []
    except (OSError, ValueError) as error:
        at = targets[max(len(temporary) - 1, 0)]
        raise FileError(f"cannot be written: {reason_of(error)}", file=at) from None
    finally:
        for leftover in temporary:
            leftover.unlink(missing_ok=True)
        for empty in made:
            with contextlib.suppress(OSError):
                empty.rmdir()
    return targets


def _temporary(target: Path) -> Path:
    return target.with_name(f".{target.name}.{os.getpid()}-{secrets.token_hex(4)}.robocal")


def refuse_unwritable(target: Path) -> None:
    """Raises FileError where something stands that no file can replace."""
    if target.is_dir():
        raise FileError("cannot be written: there is a folder of this name", file=target)
    if target.exists() and not target.is_file():
        # Renaming onto a device or a pipe would take it away from everybody.
        raise FileError("cannot be written: this is not an ordinary file", file=target)


def _make_folder(folder: Path) -> list[Path]:
    """Makes a folder with its parents; returns those that are new, innermost first."""
    try:
        missing = [at for at in (folder, *folder.parents) if not at.exists()]
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"the folder cannot be made: {reason_of(error)}", file=folder) from None
    return missing


def _clean(folder: Path, names: Collection[str]) -> None:
    """Removes what a process that has ended left under these names."""
    with os.scandir(folder) as entries:
        found = [(e.name, LEFT.fullmatch(e.name)) for e in entries]
    for name, match in found:
        if match and match["name"] in names and not _runs(int(match["pid"])):
            (folder / name).unlink(missing_ok=True)


def _runs(pid: int) -> bool:
    """Whether there is such a process; this one's files are its own affair."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # it is another user's
        pass
    return True


def _replace_all(
    folder: Path, temporary: list[Path], targets: tuple[Path, ...], gone: list[Path], names: Collection[str]
) -> None:
    """Replaces and removes; when one cannot be, all get their old content back. `names` are all that the command speaks of, those
    that are not there included."""
    several = len(targets) + len(gone) > 1
    old: list[tuple[Path, Path | None]] = []
    unfinished = announce(folder, [p.name for p in (*targets, *gone)]) if several else []
    try:
        for source, target in zip(temporary, targets, strict=True):
            old.append((target, _back_up(target, source.name) if several else None))
            os.replace(source, target)
        for target in gone:
            old.append((target, _back_up(target, _temporary(target).name)))
            target.unlink()
    except OSError:
        for target, before in old:
            if before is not None:
                os.replace(before, target)
                before.unlink(missing_ok=True)  # two names of one content stay two names
            elif several:
                target.unlink(missing_ok=True)
        if several:  # what was a mixture before is one again
            finish(folder, [n for n in names if n not in unfinished])
        raise
    if several:
        finish(folder, names)
    else:
        flush_folder(folder)
    for _, before in old:
        if before is not None:
            before.unlink(missing_ok=True)


def _back_up(target: Path, name: str) -> Path | None:
    """The old content of a file under another name; the file itself stays where it is until it is replaced."""
    if not target.exists():
        return None
    old = target.with_name(name + OLD)
    try:
        os.link(target, old)
    except OSError:
        shutil.copy2(target, old)
    return old


@contextlib.contextmanager
def _block_interrupts() -> Iterator[None]:
    """Holds Ctrl-C back while files are renamed: microseconds."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def refuse_existing(folder: Path | None, names: Sequence[str], force: bool) -> None:
    """Raises FileError when a file of a folder, or without names the file itself, would be replaced and nobody said so; where nothing
    is written nothing is asked."""
    if folder is None or force:
        return
    for place in [folder / name for name in names] or [folder]:
        if place.exists():
            expected = "--force to replace it, or another place"
            raise FileError("this file exists and was not replaced", file=place, expected=expected)


# --- the journal of a folder in which several files are replaced ------------------------------------------------------------


def announce(folder: Path, names: Iterable[str]) -> list[str]:
    """Says that these files are about to change, beside those that another command left unfinished, which it returns; on the disk
    before that."""
    before = _journal_names(folder)
    _write(folder, [*dict.fromkeys([*before, *names])])
    return before


def finish(folder: Path, names: Collection[str]) -> None:
    """Says that these have changed, all of them; what was renamed reaches the disk before the journal goes. What another command
    left unfinished stays named."""
    flush_folder(folder)
    left = [name for name in _journal_names(folder) if name not in names]
    if left:
        _write(folder, left)
    else:
        (folder / JOURNAL).unlink(missing_ok=True)
        flush_folder(folder)


def _journal_names(folder: Path) -> list[str]:
    """The names in the journal of a folder; none where there is no journal."""
    try:
        return (folder / JOURNAL).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return []


def _write(folder: Path, names: Sequence[str]) -> None:
    prepared = folder / (JOURNAL + ".new")
    try:
        write_through(prepared, "".join(f"{name}\n" for name in names).encode(), "wb")
        os.replace(prepared, folder / JOURNAL)
    except OSError:
        prepared.unlink(missing_ok=True)
        raise
    flush_folder(folder)


def write_through(path: Path, data: bytes, mode: Literal["wb", "xb"]) -> None:
    """Writes a file, which is on the disk when this returns; `xb` is for one that is not there yet."""
    with path.open(mode) as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def guard(path: Path) -> None:
    """Raises FileError for a file whose folder was being written when the process ended."""
    if path.name in _journal_names(path.parent):
        message = "the command that was writing this did not finish: old and new files may be mixed"
        raise FileError(message, file=path, expected="that command, once more")


def flush_folder(folder: Path) -> None:
    """The names in a folder reach the disk, where the system can do that."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


# --- one process at a time in a folder --------------------------------------------------------------------------------------


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Keeps a folder, which is made where it is missing, for this process until the end; it goes then where it is empty, and with it those
    around it that were made for it.

    Whatever ends the process gives the folder free: the system does. Raises FileError where another process has it, or where it cannot
    be made.
    """
    made = [p for p in folder.parents if not p.exists()]  # the innermost first
    held = _acquire_lock(folder)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            (folder / LOCK).unlink()
        with contextlib.suppress(OSError):
            for place in (folder, *made):
                place.rmdir()
        os.close(held)


def _acquire_lock(folder: Path) -> int:
    """The open lock. What was locked may be gone from the folder by then, with whoever had it: only what is there counts."""
    place = folder / LOCK
    for _ in range(TRIES):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            held = os.open(place, os.O_RDWR | os.O_CREAT, 0o666)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise FileError(f"the folder cannot be made: {reason_of(error)}", file=folder) from None
        try:
            if fcntl is not None:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(held), place.stat()):
                return held
        except FileNotFoundError:
            pass
        except BlockingIOError:
            os.close(held)
            expected = "the end of that process, or another -o"
            raise FileError("another process writes here", file=folder, expected=expected) from None
        except OSError as error:
            os.close(held)
            message = f"the folder cannot be locked: {reason_of(error)}"
            raise FileError(message, file=folder, expected="-o on another disk") from None
        os.close(held)
    raise FileError("the folder cannot be made: another process removes it", file=folder)

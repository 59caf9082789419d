"""Writing files whole, whatever ends the process.

    1 clean      what an interrupted command left under these names
    2 prepare    every file under a temporary name, flushed to the disk
    3 announce   the journal names what is about to change, where that is more than one file
    4 replace    each by a rename, its old content kept under another name; when one fails, all get theirs back
    5 finish     the journal goes, then the old content

A process that ends before 3 leaves the old files, after 5 the new ones; in between nothing that the journal names can be read
(see `journal`). Other files in the folder are never touched.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
import signal
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

from robocal.errors import FileError, reason_of
from robocal.files.journal import announce, finish, flush_folder, write_through

__all__ = ["refuse_existing", "refuse_unwritable", "write_bytes", "write_files", "write_text"]

# .NAME.PID-NUMBER.robocal is a file that is being written, with -old what it replaces.
LEFT = re.compile(r"\.(?P<name>.+)\.(?P<pid>\d+)-[0-9a-f]{8}\.robocal(-old)?", re.DOTALL)
OLD = "-old"


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Writes a whole UTF-8 file, or nothing."""
    return write_bytes(path, text.encode("utf-8"))


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
            temporary.append(target.with_name(f".{target.name}.{os.getpid()}-{secrets.token_hex(4)}.robocal"))
            write_through(temporary[-1], content.encode("utf-8") if isinstance(content, str) else content, "xb")
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


def refuse_unwritable(target: Path) -> None:
    """Raises FileError where something stands that no file can replace."""
    if target.is_dir():
        raise FileError("cannot be written: there is a folder of this name", file=target)
    if target.exists() and not target.is_file():
        # Renaming onto a device or a pipe would take it away from everybody.
        raise FileError("cannot be written: this is not an ordinary file", file=target)


def _make_folder(folder: Path) -> list[Path]:
    """Makes a folder with its parents; returns those that are new, innermost first."""
    missing: list[Path] = []
    try:
        at = folder
        while not at.exists():
            missing.append(at)
            at = at.parent
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
    except OSError:
        return True
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
            old.append((target, _back_up(target, f".{target.name}.{os.getpid()}-{secrets.token_hex(4)}.robocal")))
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

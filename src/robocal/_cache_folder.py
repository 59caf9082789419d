"""Where machine code is kept: a folder of the user's own, named by a digest of what it was made from."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from ._version import __version__

__all__ = ["Store", "find_store"]

_KEEP = 3  # cache folders: this one and what was used last before it
_FOLDER_NAME = re.compile(r"robocal-[^/]+-numba-[^/]+-[0-9a-f]{16}")


class Store(NamedTuple):
    folder: Path
    sources: dict[Path, tuple[int, int]]  # each kernel file's time and size when the folder's name was computed

    def is_current(self) -> bool:
        """Whether the sources are still those that named the folder: an edit under a running process ends its use of the cache."""
        try:
            return all(_stamp(path) == stamp for path, stamp in self.sources.items())
        except OSError:
            return False


def find_store(root: Path, sources: list[Path], settings: str, compiler: str) -> Store | None:
    """The folder for sources below root as they are now, with what else changes machine code, made if need be; older ones are pruned
    when a new one is made. None where there is none to write to."""
    try:
        known = {path: _stamp(path) for path in sources}
        name = _folder_name(root, sources, settings, compiler)
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
            return Store(folder, known)
    return None


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_mtime_ns, status.st_size


def _folder_name(root: Path, sources: list[Path], settings: str, compiler: str) -> str:
    digest = hashlib.sha256(settings.encode())
    for path in sources:
        content = path.read_bytes()
        digest.update(f"\n{path.relative_to(root).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    return f"robocal-{__version__}-numba-{compiler}-{digest.hexdigest()[:16]}"


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

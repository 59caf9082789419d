"""One environment per peer, from its pins in `peers/NAME.txt`, under `.envs/NAME`: their needs contradict each other.

`python benchmarks/environments.py` builds them all. An environment is rebuilt when its pins or its Python change.
"""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
PEERS = ("scipy", "pyceres", "pybotics", "figaroh", "cables")
# the pins exist as wheels for these: numpy 1.26 ends with 3.12, numpy 2.4 begins with 3.11
PYTHONS = ((3, 11), (3, 12))
INSTALL_LIMIT = 1200  # seconds


class Unavailable(Exception):
    """A peer that cannot be had here, and why."""


def _version(python: str) -> tuple[int, int] | None:
    """(major, minor) of an interpreter, None if it does not run."""
    try:
        out = subprocess.run(
            [python, "-c", "import sys; print(*sys.version_info[:2])"], capture_output=True, text=True, timeout=30
        )
        major, minor = out.stdout.split()
    except (OSError, ValueError, subprocess.TimeoutExpired):
        return None
    return int(major), int(minor)


def base_python() -> str:
    """The interpreter to build environments with: this one if the pins fit it, else another on the path."""
    if sys.version_info[:2] in PYTHONS:
        return sys.executable
    for major, minor in reversed(PYTHONS):
        found = shutil.which(f"python{major}.{minor}")
        if found and _version(found) == (major, minor):
            return found
    wanted = " or ".join(f"{major}.{minor}" for major, minor in PYTHONS)
    here = f"{sys.version_info[0]}.{sys.version_info[1]}"
    raise Unavailable(f"the pins need Python {wanted}; this is {here} and none is on the path")


def _run(command, what: str) -> None:
    """Run a command or say in one line why it failed."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_LIMIT)
    except subprocess.TimeoutExpired:
        raise Unavailable(f"{what} took more than {INSTALL_LIMIT} s") from None
    if done.returncode:
        errors = [line for line in (done.stderr + done.stdout).splitlines() if line.startswith("ERROR")]
        raise Unavailable(f"{what} failed: {(errors or ['no reason given'])[-1]}")


def ensure(name: str) -> Path:
    """The Python of a peer's environment, built if needed; raises `Unavailable`."""
    pins = HERE / "peers" / f"{name}.txt"
    folder = HERE / ".envs" / name
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    stamp = folder / "pins.sha256"
    base = base_python()
    key = hashlib.sha256(pins.read_bytes() + repr(_version(base)).encode()).hexdigest()
    if python.exists() and stamp.exists() and stamp.read_text() == key:
        return python
    print(f"building the environment of {name} (once)", file=sys.stderr, flush=True)
    _run([base, "-m", "venv", "--clear", str(folder)], f"making an environment for {name}")
    # wheels only: a source build would take long and measure something else than what users install
    options = ["--quiet", "--disable-pip-version-check", "--only-binary", ":all:"]
    _run([str(python), "-m", "pip", "install", *options, "-r", str(pins)], f"installing {name}")
    stamp.write_text(key)
    return python


if __name__ == "__main__":
    for peer in PEERS:
        try:
            ensure(peer)
            print(f"{peer}: ready")
        except Unavailable as why:
            print(f"{peer}: not available, {why}")

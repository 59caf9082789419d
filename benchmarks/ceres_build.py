"""Ceres in C++ without root: the packages of a Debian-like distribution, unpacked beside the benchmarks, and a program built with them."""

import hashlib
import shutil
import subprocess
from pathlib import Path

from environments import HERE, Unavailable

SOURCE = HERE / "peers" / "ceres_joint.cc"
FOLDER = HERE / ".cache" / "ceres"
PACKAGES = ("libceres-dev", "libgoogle-glog-dev", "libgflags-dev", "libeigen3-dev")
# What the library needs at run time, one name or another by release; those that are not there are not needed.
LIBRARIES = (
    "libceres3 libceres4 libgoogle-glog0v6 libgoogle-glog0v6t64 libgflags2.2 libspqr2 libspqr3 libspqr4 libcholmod3 libcholmod4 "
    "libcholmod5 libamd2 libamd3 libcamd2 libcamd3 libcolamd2 libcolamd3 libccolamd2 libccolamd3 libcxsparse3 libcxsparse4 "
    "libsuitesparseconfig5 libsuitesparseconfig7 libmetis5 libopenblas0-pthread libatlas3-base libgfortran5 libunwind8 libgomp1"
).split()
FLAGS = ("-O3", "-march=native", "-std=c++17", "-w")


def _run(command: list[str], where: Path, what: str) -> str:
    try:
        done = subprocess.run(command, cwd=where, capture_output=True, text=True, timeout=900)
    except (OSError, subprocess.TimeoutExpired) as why:
        raise Unavailable(f"{what}: {why}") from None
    if done.returncode:
        raise Unavailable(f"{what} failed: {(done.stderr.strip().splitlines() or ['no reason given'])[-1]}")
    return done.stdout


def libraries() -> str:
    """Where the program finds its libraries, OpenBLAS before others."""
    (folder,) = sorted((FOLDER / "root").glob("usr/lib/*/libceres.so.?"))[:1]
    return ":".join(str(p) for p in (folder.parent / "openblas-pthread", folder.parent, folder.parent / "atlas"))


def program() -> tuple[Path, str]:
    """The program, built if needed, and how it was built. Raises Unavailable with the reason where it cannot be."""
    tools = [t for t in ("g++", "apt-get", "dpkg-deb") if shutil.which(t) is None]
    if tools:
        raise Unavailable(f"Ceres in C++ needs {', '.join(tools)}")
    root, made, stamp = FOLDER / "root", FOLDER / "ceres_joint", FOLDER / "source.sha256"
    key = hashlib.sha256(SOURCE.read_bytes() + Path(__file__).read_bytes()).hexdigest()
    compiler = _run(["g++", "-dumpfullversion"], HERE, "asking g++ for its version").strip()
    how = f"C++, automatic differentiation, g++ {compiler} {' '.join(FLAGS[:2])}, the distribution's libceres"
    if made.exists() and stamp.exists() and stamp.read_text() == key:
        return made, how
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in PACKAGES:
        _run(["apt-get", "download", name], FOLDER, f"fetching {name}")
    for name in LIBRARIES:
        subprocess.run(["apt-get", "download", name], cwd=FOLDER, capture_output=True, check=False)
    for package in sorted(FOLDER.glob("*.deb")):
        _run(["dpkg-deb", "-x", str(package), str(root)], FOLDER, f"unpacking {package.name}")
    found = sorted(root.glob("usr/lib/*/libceres.so.?"))
    if not found:
        raise Unavailable("the packages hold no libceres")
    folder, glog = found[0].parent, sorted(found[0].parent.glob("libglog.so.?"))
    _run(
        [
            "g++", *FLAGS, "-I", str(root / "usr/include"), "-I", str(root / "usr/include/eigen3"), str(SOURCE), "-o", str(made),
            f"-L{folder}", "-Wl,--allow-shlib-undefined", f"-l:{found[0].name}",
            *(f"-l:{g.name}" for g in glog[:1]),
        ],
        FOLDER, "building with Ceres",
    )  # fmt: skip
    stamp.write_text(key)
    return made, how

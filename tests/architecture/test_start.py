"""What a command does before anything is loaded."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from cli.runs import small

ASKED = "import os, sys; from robocal.cli.main import main; main(['--version']); print(os.environ.get('OPENBLAS_NUM_THREADS'))"


@pytest.mark.parametrize(("before", "after"), [(None, "1"), ("3", "3")])
def test_a_command_has_one_thread_of_blas_unless_somebody_says_otherwise(before, after):
    env = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    if before:
        env["OPENBLAS_NUM_THREADS"] = before
    done = subprocess.run([sys.executable, "-c", ASKED], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == after


def test_the_threads_of_who_has_numpy_already_are_left_alone():
    env = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", "import numpy;" + ASKED], env=env, capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[-1] == "None"


# What a calibration never needs: what other packages bring along, the parts of scipy beyond its distribution functions, what numba only
# compiles with, and, of an arm, what draws it or is about cables.
HEAVY = {"numpy.f2py", "numpy.testing", "unittest", "cv2", "dask", "distributed", "matplotlib", "numba.np.arrayobj"}
HEAVY |= {"robocal.simulation.rigs", "robocal.cables.geometry", "robocal.files.group_block"}
HEAVY |= {"scipy.stats", "scipy.linalg", "scipy.optimize", "scipy.spatial", "scipy.sparse", "scipy.special"}
IDENTIFIED = """
import sys
from robocal.cli.main import main
status = main(["identify", *sys.argv[1:]])
print("loaded", *sys.modules)
"""
HELPED = "import sys; from robocal.cli.main import main; main(sys.argv[1:]); print('loaded', *sys.modules)"


def loaded(code, *words):
    environment = {k: v for k, v in os.environ.items() if not k.startswith("COV")}
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=True, env=environment
    )
    return set(done.stdout.split("loaded ")[-1].split())


def test_identify_imports_nothing_that_it_does_not_use(tmp_path):
    small(tmp_path)
    words = [str(tmp_path / "robot.yaml"), str(tmp_path / "data.yaml"), "-o", str(tmp_path / "run"), "--force"]
    loaded(IDENTIFIED, *words)  # who compiles needs more
    found = loaded(IDENTIFIED, *words)
    assert "robocal.prove.identify" in found and "scipy.special._ufuncs" in found
    assert not found & HEAVY


@pytest.mark.parametrize(
    "words", [["--help"], ["--version"], ["identify", "--help"], ["cable", "--help"]], ids=" ".join
)
def test_help_and_version_compute_nothing(words):
    heavy = {"numpy", "scipy", "numba", "rich", "ruamel"}
    assert not {name.partition(".")[0] for name in loaded(HELPED, *words)} & heavy


ENDED = """
import atexit, sys
from robocal.cli.main import run_command
atexit.register(print, "loaded end")
{watch}
sys.argv = ["robocal", *sys.argv[1:]]
run_command()
"""


@pytest.mark.parametrize(("word", "status"), [("--version", 0), ("--no-such", 2)])
@pytest.mark.parametrize("watch", ["", "sys.setprofile(lambda *told: None)", "sys.settrace(lambda *told: None)"])
def test_a_process_ends_with_its_command_unless_somebody_watches_it(word, status, watch):
    code = ENDED.format(watch=watch)
    done = subprocess.run([sys.executable, "-c", code, word], capture_output=True, text=True, check=False)
    assert done.returncode == status and bool(done.stdout if status == 0 else done.stderr)
    assert ("loaded end" in done.stdout) == bool(watch)


def test_distribution_functions_are_those_of_scipy():
    code = """
from robocal import _scipy
alone = _scipy.special.chdtri
import scipy.special, scipy.stats
print("loaded", alone is scipy.special.chdtri, scipy.special.logsumexp([0.0]) == 0.0, scipy.stats.chi2.ppf(0.5, 1) > 0)
"""
    assert loaded(code) == {"True"}

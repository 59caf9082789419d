"""What a command does before anything is loaded."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

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

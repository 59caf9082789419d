"""`warm-up` compiles what commands use: the list names every kernel, and what it compiled is compiled no more."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import numba
import pytest

import robocal
from robocal.errors import ModelError
from robocal.verbs.warm_up import LIST, Options, run

ROOT = Path(robocal.__file__).parent
compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT leaves kernels uncompiled")
USE = """
import sys
import numpy as np
from robocal import progress
happened = []
progress.on_compile(lambda: happened.append(1))
from robocal.geometry._kernels import left_inverse, turn_vectors, vector_from_rotation
vector_from_rotation(np.eye(3), np.empty(3))
left_inverse(np.ones(3), np.empty((3, 3)))
turn_vectors(np.zeros((1, 3)), np.zeros(1, np.int64), np.ones((1, 3)), np.array([[0, 1, 2]]))
print(len(happened))
"""


def kernels():
    for path in ROOT.rglob("_kernels.py"):
        package = path.parent.relative_to(ROOT).as_posix().replace("/", ".")
        for made in ast.parse(path.read_text("utf-8")).body:
            if isinstance(made, ast.FunctionDef):
                told = [ast.unparse(decorator) for decorator in made.decorator_list]
                if any(
                    d.startswith("kernel") and "inline=True" not in d for d in told
                ):  # an inlined one lies in others
                    yield f"{package}.{made.name}"


def test_the_list_names_every_kernel():
    listed = files("robocal").joinpath(LIST).read_text("utf-8").splitlines()
    assert {line.partition("(")[0] for line in listed} == set(kernels())
    assert len(set(listed)) == len(listed)


def test_a_package_without_kernels_is_refused():
    with pytest.raises(ModelError, match="no kernels") as caught:
        run(Options(packages=("geomtry",)))
    assert caught.value.suggestion == "geometry"


@compiled
@pytest.mark.slow
def test_what_is_warm_is_not_compiled_again(tmp_path):
    environment = {**os.environ, "ROBOCAL_CACHE_DIR": str(tmp_path)}

    def ran(*words):
        return subprocess.run(
            [sys.executable, *words], capture_output=True, text=True, env=environment, check=True
        ).stdout

    told = json.loads(ran("-m", "robocal", "warm-up", "geometry", "--json"))
    assert told["kernels"] > 5 and Path(told["cache"]).is_relative_to(tmp_path)
    assert ran("-c", USE).split() == ["0"]

"""`warm-up` compiles what commands use: the list names every kernel, and what it compiled is compiled no more."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import robocal
from robocal.errors import ModelError
from robocal.verbs.warm_up import WAYS, Options, beside, compile_beside, kernel_lists, run

ROOT = Path(robocal.__file__).parent
compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT leaves kernels uncompiled")
USE = """
import sys
import numpy as np
from robocal import progress
happened = []
progress.on_compile(lambda name: happened.append(1))
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
    listed = kernel_lists()
    assert {line.partition("(")[0] for lines in listed for line in lines} == set(kernels())
    assert all(len(set(lines)) == len(lines) for lines in listed)
    assert not set(listed[-1]) & {line for lines in listed[:-1] for line in lines}
    firsts = [lines[0].partition("(")[0] for lines in listed]
    assert len(set(firsts)) == len(firsts)


def test_a_package_without_kernels_is_refused():
    with pytest.raises(ModelError, match="no kernels") as caught:
        run(Options(packages=("geomtry",)))
    assert caught.value.suggestion == "geometry"


# An arm, a list of poses, and a cable robot: all that they take from the cache, or compile.
COMMANDS = """
import json, sys
from pathlib import Path
from robocal import _jit
from robocal.cli.main import main
from robocal.verbs.demo.cases import example_folder
out = Path(sys.argv[1])

arm, eight = example_folder("rv-2aj"), example_folder("cable-calibration") / "eight"
main(["identify", *(str(arm / f) for f in ("robot.yaml", "data.yaml")), "-o", str(out / "arm")])
main(["cable", "poses", str(example_folder("cable-laval") / "robot.yaml"), "-n", "5", "-o", str(out / "poses")])
main(["identify", *(str(eight / f) for f in ("robot.yaml", "lengths.yaml", "poses.yaml")), "-o", str(out / "cables")])
made = {
    f"{k.__module__.removeprefix('robocal.').removesuffix('_kernels')}{k.__name__}({types})"
    for k in _jit._kernels if not k.inline for types in k.signatures
}
print("\\n" + json.dumps(sorted(made)))
"""


@compiled
@pytest.mark.slow
def test_the_list_has_the_types_that_commands_use(tmp_path):
    """What three kinds of commands need stands in the list with its types, and no more stands in their own paragraphs."""
    command = [sys.executable, "-c", COMMANDS, str(tmp_path)]
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    made = set(json.loads(ran.stdout.splitlines()[-1]))
    *own, _ = listed = kernel_lists()
    assert {line for lines in own for line in lines} <= made <= {line for lines in listed for line in lines}


@compiled
@pytest.mark.parametrize(("cores", "most"), [(1, 0), (2, 1), (3, 2), (16, 2)])
def test_other_processes_help_where_they_know_what_is_needed(monkeypatch, cores, most):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)), raising=False)
    assert compile_beside("geometry.left_inverse") == []
    helpers = compile_beside("geometry.path.path_kernel")
    assert len(helpers) in (0, most)  # none without a folder to write to
    for helper in helpers:
        helper.kill()
        assert helper.wait() != 0


@pytest.mark.parametrize("way", WAYS)
def test_other_processes_end_with_the_first(monkeypatch, way):
    monkeypatch.setattr("robocal.verbs.warm_up.compile_line", lambda *_, **__: pytest.fail("nobody waits for it"))
    beside("geometry.path.path_kernel", -1, way)


@pytest.mark.parametrize("way", WAYS)
def test_other_processes_leave_the_first_kernel_to_the_last(monkeypatch, way):
    """It is the one that the command compiles when it asks for them."""
    told = []
    monkeypatch.setattr("robocal.verbs.warm_up.compile_line", lambda line, wait: told.append(line))
    beside("geometry.path.path_kernel", os.getppid(), way)
    own = kernel_lists()[0]
    assert set(own[1:]) <= set(told) <= set(own) and told[0] != own[0] and told.index(own[1]) in (0, len(own) - 2)


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


@compiled
def test_where_no_second_process_starts_the_command_compiles_alone(monkeypatch):
    def refuse(*args, **options):
        raise OSError("no more processes")

    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    monkeypatch.setattr(subprocess, "Popen", refuse)
    assert compile_beside("geometry.path.path_kernel") == []

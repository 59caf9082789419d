"""Documents and run folders of schema 1, written by robocal at commit 3c7281d into `old/`, with the commands of COMMANDS.

A run folder of then is read by every verb that reads one. Of each document whose keys changed the new one, as `scripts/schema_1.py` says
it in the old keys, has the same keys and numbers: nothing was lost, and the table of what changed is true.
"""

from __future__ import annotations

import importlib.util
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
from cli.runs import robocal

from robocal.files.covariance import read_covariance
from robocal.files.result import read_result
from robocal.files.runfolder import open_run

OLD = Path(__file__).parent / "old"
COMMANDS = {
    "check": "check sim/robot.yaml sim/data.yaml",
    "check-cable": "check cable/robot.yaml",
    "compensate": "compensate run q.csv",
    "contact": "cable contact cable/robot.yaml cable/poses.csv",
    "forward": "cable forward cable/robot.yaml cable/lengths.csv",
    "inverse": "cable inverse cable/robot.yaml cable/poses.csv",
    "plan": "plan rv-2aj -n 4 --draw 20",
    "poses": "cable poses cable/robot.yaml -n 4 --choose 3",
    "predict": "predict run q.csv",
    "require": "cable require cable/robot.yaml cable/poses.csv --sigma 1mm --accuracy 2mm",
    "simulate": "simulate rv-2aj -n 14 --seed 1 -o TMP/sim",
    "tension": "cable tension cable/robot.yaml cable/poses.csv",
    "validate": "validate run sim/data.yaml --against sim/robot.yaml",
    "verify": "verify tracker.csv robot.csv camera.csv",
    "workspace": "cable workspace cable/robot.yaml --cells 5 --rays 40",
}
# Sentences, what made it, paths; torques of joints and poses from lengths, which are new; `units` and `wrenches` said once which units the numbers are in, which now stand beside them.
ASIDE = re.compile(
    r"provenance|inputs|written|warnings|remarks|reasons|combinations|notes|units|wrenches|source|robocal|torque"
    r"|(position|orientation)_from_lengths"
)
# A unit in a key: of an amount, an area, a rate.
WITH_UNIT = re.compile(r"_(m|mm|m2|m3|m_s2|rad|deg|mrad|N|Nm|kg|s|px|ppm|1_N|N_m|si)$")


def _translator() -> Any:
    place = Path(__file__).parents[2] / "scripts" / "schema_1.py"
    spec = importlib.util.spec_from_file_location("schema_1", place)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.schema_1


def _same(path: str, old: Any, new: Any) -> None:
    if isinstance(old, dict):
        keys = {k for k in old if not ASIDE.fullmatch(k)}
        assert isinstance(new, dict) and keys == {k for k in new if not ASIDE.fullmatch(k)}, path
        for key in keys:
            _same(f"{path}.{key}", old[key], new[key])
    elif isinstance(old, list):
        assert isinstance(new, list) and len(old) == len(new), path
        for i, (a, b) in enumerate(zip(old, new, strict=True)):
            _same(f"{path}[{i}]", a, b)
    elif isinstance(old, float | int) and not isinstance(old, bool):
        assert math.isclose(old, new, rel_tol=1e-6, abs_tol=1e-9), (path, old, new)
    else:
        assert old == new, (path, old, new)


def _keys(value: Any) -> set[str]:
    if isinstance(value, dict):
        return set(value) | {k for key, v in value.items() if key not in ("remarks", "iso_9283") for k in _keys(v)}
    return {k for v in value for k in _keys(v)} if isinstance(value, list) else set()


@pytest.mark.parametrize("name", COMMANDS)
def test_a_document_says_what_it_said_in_schema_1(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(OLD)
    ran = robocal(*COMMANDS[name].replace("TMP", str(tmp_path)).split(), "--json")
    assert ran.status in (0, 3), ran.err
    old = json.loads((OLD / f"{name}.json").read_text())
    new = ran.document
    assert new["robocal"] == 2 and old.get("robocal", 1) == 1
    assert not {k for k in _keys(new) if WITH_UNIT.search(k)}, "no key has a unit in its name"
    _same(name, old, _translator()(new))


def test_a_run_folder_of_schema_1_is_read(tmp_path: Path) -> None:
    found = open_run(OLD / "run")
    assert found.result.verdict.status == read_result(OLD / "run" / "result.json").verdict.status == "improved"
    assert read_covariance(OLD / "run" / "covariance.json").total.names
    for words in (
        ("drift", OLD / "run", OLD / "run"),
        ("export", OLD / "run", "--format", "csv"),
        ("report", OLD / "run", "-o", tmp_path / "page.html"),
        ("predict", OLD / "run", OLD / "q.csv"),
        ("compensate", OLD / "run", OLD / "q.csv"),
    ):
        ran = robocal(*words)
        assert ran.status in (0, 3) and "error" not in ran.err, (words, ran.err)

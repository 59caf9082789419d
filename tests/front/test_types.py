"""What an editor knows of a result: the types of `found.result`, verb by verb."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import robocal

SCRIPT = """
import robocal as rc

reveal_type(rc.identify("a", "b").result.verdict.status)
reveal_type(rc.validate("a", "b").result.iso)
reveal_type(rc.cable.tension("a", "b").result.margin)
reveal_type(rc.cable.forward("a", "b").result.solution.converged)
reveal_type(rc.camera.detect("a", size=48.0).result.coverage)
"""
TYPES = (
    r"Literal\['improved'\] \| Literal\['located'\] \| Literal\['not_improved'\] \| Literal\['refused'\]|Literal\['improved', 'located', 'not_improved', 'refused'\]",
    r"Mapping\[str, Any\]|dict\[str, Any\]|Standard",
    r"ndarray\[.*float64\]\]",
    r"ndarray\[.*bool.*",
    r"float",
)


@pytest.mark.slow
def test_an_editor_knows_the_fields_of_a_result(tmp_path: Path) -> None:
    source = Path(robocal.__file__).parents[1]
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    words = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--config-file",
        str(source.parent / "pyproject.toml"),
        str(script),
    ]
    ran = subprocess.run(
        words,
        cwd=source.parent,
        env=os.environ | {"MYPYPATH": str(source)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    revealed = re.findall(r'Revealed type is "(.*)"', ran.stdout)
    assert len(revealed) == len(TYPES), ran.stdout
    for said, wanted in zip(revealed, TYPES, strict=True):
        assert re.search(wanted, said), (said, wanted)

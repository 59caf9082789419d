"""The examples in Python: ten lines from arrays with full poses to covariance and a figure, whose types an editor knows."""

from __future__ import annotations

import ast
import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "python"
SCRIPTS = ("arm_from_arrays", "cables_from_arrays")


@pytest.mark.parametrize("name", SCRIPTS)
def test_an_example_runs_in_ten_lines(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(FOLDER))
    source = (FOLDER / f"{name}.py").read_text()
    steps = [s for s in ast.parse(source).body[1:] if not isinstance(s, ast.Import)]
    assert len(steps) <= 10, len(steps)
    space = runpy.run_path(str(FOLDER / f"{name}.py"))
    found = space["found"]
    assert found.improved and "IMPROVED" in capsys.readouterr().out
    assert found.covariance.matrix.shape == (len(found.covariance.names),) * 2
    written = space["laboratory"].OUT
    assert list(written.glob("*.svg")) and not list(tmp_path.iterdir())


def test_the_page_shows_the_example() -> None:
    """What docs/python.md shows is what runs here."""
    page = (FOLDER.parents[1] / "docs" / "python.md").read_text()
    for name in SCRIPTS:
        lines = (FOLDER / f"{name}.py").read_text().split("import robocal as rc\n")[1].strip()
        assert lines in page, name


@pytest.mark.slow
def test_an_editor_knows_every_name_of_the_examples() -> None:
    root = FOLDER.parents[1]
    words = [
        "-m",
        "mypy",
        "--strict",
        "--config-file",
        str(root / "pyproject.toml"),
        *(str(f) for f in sorted(FOLDER.glob("*.py"))),
    ]
    place = os.environ | {"MYPYPATH": os.pathsep.join((str(root / "src"), str(FOLDER)))}
    ran = subprocess.run([sys.executable, *words], cwd=root, env=place, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr

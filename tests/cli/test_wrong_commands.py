"""Words that are no command, and the command that the answer names."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli.runs import robocal


@pytest.mark.parametrize("typed", ["calibrate", "cable identify", "cable calibrate"])
@pytest.mark.parametrize("rest", ["", "--help", "--json", "robot.yaml data.yaml -o run --debug"])
def test_words_often_typed_for_identify_name_it(case: Path, typed: str, rest: str) -> None:
    ran = robocal(*typed.split(), *rest.split())
    ran.assert_refused(f"no such command '{typed.split()[-1]}'", "robocal identify ROBOT DATA")
    assert ran.err.count("identify ROBOT DATA") == 1 and "validate" not in ran.err
    assert ran.err.endswith("Try: robocal identify --help\n")
    assert not (case / "run").exists()
    if rest == "--json":
        assert "robocal identify ROBOT DATA" in ran.document["error"]["message"]

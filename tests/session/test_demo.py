"""The demo: every case comes out as it should, for more than one seed."""

from __future__ import annotations

from pathlib import Path

import pytest

from robocal.errors import ModelError
from robocal.verbs.demo.cases import CASES, cases, demo


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", [0, 1, 7])
@pytest.mark.parametrize("name", CASES)
def test_every_case_comes_out_as_it_should(tmp_path: Path, name: str, seed: int) -> None:
    found = [finding for _, finding in demo(name, tmp_path, seed, None)]
    assert found and all(f.ok for f in found), [(f.title, f.facts, f.outcome.result.verdict) for f in found]
    for finding in found:
        folder = finding.outcome.written[0].parent
        assert {p.name for p in folder.iterdir()} >= {"result.json", "report.html", "residuals.csv"}
        assert finding.repeat.startswith("robocal identify ")


def test_names_of_cases() -> None:
    assert tuple(case.name for case in cases()) == tuple(CASES)
    with pytest.raises(ModelError, match="tracker"):
        cases("traker")

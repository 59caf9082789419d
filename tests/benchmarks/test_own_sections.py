"""robocal's own sections: what they run in processes of their own still imports."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize("name", ["COLD", "COLD_CABLES"])
def test_what_compilation_imports_is_there(monkeypatch, name):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    asked = [
        n
        for n in ast.parse(getattr(importlib.import_module("robocal_sections"), name)).body
        if isinstance(n, ast.ImportFrom)
    ]
    assert asked
    for line in asked:
        module = importlib.import_module(line.module)
        for part in line.names:
            assert hasattr(module, part.name) or importlib.import_module(f"{line.module}.{part.name}")

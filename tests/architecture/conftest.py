"""The programs of the package, read once for all laws of this folder."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "robocal"


@pytest.fixture(scope="package")
def programs() -> dict[str, ast.Module]:
    """Every file of the package, by its path below it."""
    paths = sorted(SOURCE.rglob("*.py"))
    return {p.relative_to(SOURCE).as_posix(): ast.parse(p.read_text(encoding="utf-8")) for p in paths}

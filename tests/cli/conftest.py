from __future__ import annotations

from pathlib import Path

import pytest
from cli.runs import small


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the small arm and its data, and the current one."""
    small(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


@pytest.fixture
def one_app(monkeypatch: pytest.MonkeyPatch) -> None:
    """Builds the command line once: a third of the time of a small run."""
    from robocal.cli import app

    built = app.build()
    monkeypatch.setattr(app, "build", lambda: built)

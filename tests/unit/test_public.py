"""Every public name exists, and the package itself stays cheap to import."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
from importlib.metadata import version

import pytest

import robocal

HEAVY = ("click", "cv2", "matplotlib", "numba", "numpy", "plotly", "pydantic", "rich", "scipy")


def modules() -> list[str]:
    return [robocal.__name__, *(found.name for found in pkgutil.walk_packages(robocal.__path__, "robocal."))]


@pytest.mark.parametrize("name", modules())
def test_all_lists_names_that_exist(name: str) -> None:
    module = importlib.import_module(name)
    names = getattr(module, "__all__", ())
    assert [n for n in names if not hasattr(module, n)] == []
    assert len(set(names)) == len(names)


def test_version_is_the_installed_one() -> None:
    assert robocal.__version__ == version("robocal")


def test_import_loads_nothing_heavy() -> None:
    code = f"import sys, robocal; print(*(m for m in {HEAVY} if m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split() == []

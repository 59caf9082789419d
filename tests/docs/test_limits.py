"""docs/verdicts.md has every limit, as the sources say it now."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

from robocal.diagnose import drive_limits, limits, vision_limits

PROJECT = Path(__file__).parents[2]


def script():
    spec = importlib.util.spec_from_file_location("limits_table", PROJECT / "scripts" / "limits_table.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_has_every_limit():
    page = script().PAGE.read_text(encoding="utf-8")
    assert page == script().renewed(page), "write it anew: python scripts/limits_table.py"
    for name in limits.LIMITS:
        assert page.count(f"| `{name}` |") == 1, name


def test_a_limit_has_its_own_name_and_a_reason():
    assert len(limits.LIMITS) > 100
    for name, entry in limits.LIMITS.items():
        home = next(h for h in (vision_limits, drive_limits, limits) if hasattr(h, name))
        assert getattr(home, name) is entry.value, name
        assert entry.unit and entry.source and entry.why.endswith(".") and len(entry.why.split()) <= 25, name


def test_a_limit_is_a_plain_number():
    numbers = [
        v for e in limits.LIMITS.values() for v in (e.value.values() if isinstance(e.value, dict) else [e.value])
    ]
    assert all(type(v) in (int, float) for v in numbers)


def test_every_limit_decides_something():
    sources = [
        p.read_text(encoding="utf-8") for p in (PROJECT / "src").rglob("*.py") if not p.name.endswith("limits.py")
    ]
    used = set(re.findall(r"\b[A-Z][A-Z_]+\b", "\n".join(sources)))
    assert set(limits.LIMITS) <= used, set(limits.LIMITS) - used

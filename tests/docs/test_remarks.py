"""docs/verdicts.md has every remark, as the table of words says it now."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from robocal.remarks.english import DECLARED, TABLE

PROJECT = Path(__file__).parents[2]


def script():
    spec = importlib.util.spec_from_file_location("remarks_table", PROJECT / "scripts" / "remarks_table.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_the_page_has_every_remark():
    page = script().PAGE.read_text(encoding="utf-8")
    assert page == script().renewed(page), "write it anew: python scripts/remarks_table.py"
    for code in (*TABLE, *DECLARED):
        assert page.count(f"| `{code}` |") == 1, code


def test_the_table_tells_names_for_numbers():
    shown = script().shown
    assert (
        shown("falls by {gain:.4g}, {low:.4g~} to {high:.4g}[; {n} lost]")
        == "falls by *gain*, *low* to *high*[; *n* lost]"
    )

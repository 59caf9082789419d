"""Writes the table of every limit into docs/verdicts.md, from diagnose/limits.py: python scripts/limits_table.py"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal.diagnose.limits import Limit, topics

PAGE = Path(__file__).parents[1] / "docs" / "verdicts.md"
BEGIN, END = "<!-- every limit: made by scripts/limits_table.py -->", "<!-- end of every limit -->"


def value(number: Any) -> str:
    """A number as people read it; of one for each unit, all."""
    if isinstance(number, dict):
        return ", ".join(f"{value(v)} {unit}" for unit, v in number.items())
    return f"{number:.4g}"


def row(name: str, limit: Limit) -> str:
    """One row of a table."""
    unit = "" if isinstance(limit.value, dict) else limit.unit
    return f"| `{name}` | {value(limit.value)} | {unit} | {limit.why} | {limit.source} |"


def table() -> str:
    """The tables of all topics, between their marks."""
    out = [BEGIN, ""]
    for title, limits in topics().items():
        out += [f"### {title}", "", "| limit | value | unit | why | source |", "|---|---|---|---|---|"]
        out += [row(name, limit) for name, limit in limits.items()]
        out.append("")
    return "\n".join([*out, END])


def renewed(page: str) -> str:
    """The page with the table as it is now."""
    head, _, rest = page.partition(BEGIN)
    return head + table() + rest.partition(END)[2]


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

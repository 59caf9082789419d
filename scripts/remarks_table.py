"""Writes the table of every remark into docs/verdicts.md, from the table of words: python scripts/remarks_table.py"""

from __future__ import annotations

import re
from pathlib import Path

from robocal.diagnose.check_registry import ALL, checks
from robocal.remarks.english import DECLARED, Code
from robocal.remarks.phrase import Phrase

PAGE = Path(__file__).parents[1] / "docs" / "verdicts.md"
BEGIN, END = "<!-- every remark: made by scripts/remarks_table.py -->", "<!-- end of every remark -->"
TITLES = (
    "The verdict of an identification",
    "An identification",
    "Single parameters, and non-geometric effects",
    "Files of arms and their data",
    "A model that is validated, used and exported",
    "Two runs of one robot",
    "Cable robots",
    "Images of a target",
    "Maps of markers, and cameras on robots",
    "Motors and their logs",
    "A rig at power-up and on its way",
)


def shown(template: str) -> str:
    """A template as people read it: *names* where numbers stand."""
    return re.sub(r"\{(\w+)[^}]*\}", r"*\1*", template).replace("|", "\\|")


def table() -> str:
    """The tables of all topics, between their marks."""
    for package in ALL:
        checks(package)  # their modules declare codes
    out = [BEGIN, ""]
    topics = [[(p.code, p) for p in vars(topic).values() if isinstance(p, Phrase)] for topic in Code.__bases__]
    topics.append(sorted(DECLARED.items()))
    for title, rows in zip((*TITLES, "Declared beside their checks"), topics, strict=True):
        out += [f"### {title}", "", "| code | sentence | advice |", "|---|---|---|"]
        out += [f"| `{code}` | {shown(w.sentence)} | {shown(w.advice)} |" for code, w in rows]
        out.append("")
    return "\n".join([*out, END])


def renewed(page: str) -> str:
    """The page with the table as it is now."""
    head, _, rest = page.partition(BEGIN)
    return head + table() + rest.partition(END)[2]


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

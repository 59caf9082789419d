"""The data.yaml of a table that somebody has: how it is written and what its columns mean, as its headers say."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.headers import self_description
from robocal.files.yamlio import quote
from robocal.measure.machine import Model

__all__ = ["UNSTATED", "describe_table"]

UNSTATED = "STATE_IT"  # where neither header nor robot says a unit; no reader takes it for one
HEAD = (
    "# How {file} is written and what its columns mean, read from its headers. Every key: docs/files.md\nrobocal: 1\n"
)


def describe_table(path: Path, machine: Model, kind: str | None, folder: Path) -> str:
    """The text of a data.yaml in `folder` for a table. Raises FileError or FormatError where the headers do not say enough."""
    table = read_csv(path)
    found = self_description(table, machine, kind)
    lines = [f"kind: {found.pop('kind')}", f"file: {quote(_relative(path, folder))}"]
    del found["robocal"], found["file"]
    needed = [
        c
        for key, part in found.items()
        if key != "configuration" and isinstance(part, dict)
        for c in part.get("columns", ())
    ]
    lines.append(_written(table, [c for c in needed if isinstance(c, str) and table.has(c)]))
    for key, part in found.items():
        if part:
            lines.append(f"{key}: {_flow(_with_units(_spell(part, table), table))}")
    return HEAD.format(file=path.name) + "\n".join(lines) + "\n"


def _spell(part: Any, table: CsvTable) -> Any:
    """A section with its columns as the headers of the table spell them."""
    if isinstance(part, dict):
        return {key: value if key == "form" else _spell(value, table) for key, value in part.items()}
    if isinstance(part, list):
        return [_spell(value, table) for value in part]
    return table.label(table.find(part)) if isinstance(part, str) and table.has(part) else part


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()


def _written(table: CsvTable, needed: list[str]) -> str:
    """The line that says how the table is written, and which rows lack a number."""
    style = {"separator": table.separator if table.separator != "\t" else "tab", "decimal": table.style.decimal}
    if table.style.thousands:
        style["thousands"] = table.style.thousands
    bare = table.lines[table.lacking(needed)]
    if not len(bare):
        return f"csv: {_flow(style)}"
    some = ", ".join(map(str, bare[:5])) + (", ..." if len(bare) > 5 else "")
    return f"csv: {_flow(style | {'missing': 'skip'})}    # left out, for something is missing: row {some}"


def _with_units(part: Any, table: CsvTable) -> Any:
    """A section with a unit to state where its headers have none."""
    if not isinstance(part, dict) or "columns" not in part or part.get("form") in ("quaternion_xyzw", "matrix"):
        return part
    columns = part["columns"]
    return part if all(table.unit(c) for c in columns) else part | {"unit": UNSTATED}


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return value if value == "skip" else quote(str(value))

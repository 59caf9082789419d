"""Findings that say the same of several instruments, as one."""

from __future__ import annotations

from collections.abc import Sequence

from robocal.diagnose.check_registry import Finding, refuse
from robocal.remarks.remark import Number, Quantity

__all__ = ["merge_findings"]


def merge_findings(found: Sequence[Finding]) -> list[Finding]:
    """One refusal for each code and shift, with all instruments, files and views."""
    out: dict[object, dict[str, Number]] = {}
    for f in found:
        numbers = f.numbers
        key = (f.code, numbers.get("shift"), numbers.get("where"))
        known = out.setdefault(key, {})
        for name, value in numbers.items():
            old = known.get(name)
            if name in ("instruments", "files", "views") and isinstance(old, tuple) and isinstance(value, tuple):
                known[name] = tuple(dict.fromkeys((*old, *value)))
            elif name in ("count", "total") and isinstance(old, int) and isinstance(value, int):
                known[name] = old + value
            elif isinstance(old, Quantity) and isinstance(value, Quantity):
                known[name] = max(old, value, key=lambda q: q.value)
            elif value is not None or name not in known:
                known[name] = value
    return [refuse(str(key[0]), **numbers) for key, numbers in out.items() if isinstance(key, tuple)]

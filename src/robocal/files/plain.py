"""Whatever a verb found, as strict JSON can hold it: the one way from dataclasses, arrays and mappings into a document."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

from numpy import isfinite

__all__ = ["json_text", "plain"]

_NESTED = frozenset({dict, list})
_PLAIN = frozenset({str, int, bool, type(None)})  # what JSON holds as it is
_NAMES: dict[type[Any], tuple[str, ...]] = {}  # the fields of every dataclass that was written


def plain(value: Any) -> Any:
    """Plain data that strict JSON can hold: dataclasses as mappings (without fields that are mere layout), arrays, tuples and sets as
    lists, null for what is not finite, texts for whatever else."""
    kind = type(value)
    if kind is float:
        return value if math.isfinite(value) else None
    if value is None or kind in (str, int, bool):
        return value
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | set):
        kinds = set(map(type, value))
        if kinds <= _PLAIN:
            return list(value)
        if kinds == {float} and all(map(math.isfinite, value)):
            return list(value)
        if kinds <= _PLAIN | {float}:
            return [None if v.__class__ is float and not math.isfinite(v) else v for v in value]
        return [plain(v) for v in value]
    if hasattr(value, "tolist"):
        # A million numbers that are all finite need not be asked one by one.
        listed = value.tolist()
        return (
            listed
            if value.dtype.kind in "biu" or (value.dtype.kind == "f" and isfinite(value).all())
            else plain(listed)
        )
    if is_dataclass(kind):
        if kind not in _NAMES:
            _NAMES[kind] = tuple(f.name for f in fields(kind) if f.metadata.get("document", True))
        return {name: plain(getattr(value, name)) for name in _NAMES[kind]}
    return value if isinstance(value, int) else str(value)


def json_text(value: Any) -> str:
    """A document as the text of its file."""
    return _indented(plain(value), "\n") + "\n"


def _indented(value: Any, line: str) -> str:
    """As `json.dumps` with an indent of one, that encodes every number by itself: what holds no lists and mappings goes as a whole.
    `line` begins a line where the value stands."""
    inner = line + " "
    between = "," + inner
    if isinstance(value, dict) and not _NESTED.isdisjoint(map(type, value.values())):
        told = between.join(f"{_encoder(', ').encode(k)}: {_indented(v, inner)}" for k, v in value.items())
    elif isinstance(value, list) and not _NESTED.isdisjoint(map(type, value)):
        told = between.join(_indented(v, inner) for v in value)
    elif value and isinstance(value, dict | list):
        told = _encoder(between).encode(value)[1:-1]
    else:
        return _encoder(", ").encode(value)
    first, last = "{}" if isinstance(value, dict) else "[]"
    return first + inner + told + line + last


@cache
def _encoder(between: str) -> json.JSONEncoder:
    return json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(between, ": "))

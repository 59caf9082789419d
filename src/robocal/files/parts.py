"""What every part of result.json is made of: numbers that may be missing, and models that refuse unknown fields, and
what is said as data."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

__all__ = ["Number", "Part", "Remark", "RowsLeftOut", "finite"]


def _plain(value: Any) -> Any:
    """Arrays and their scalars as lists and numbers, tuples as lists."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return {k: _plain(v) for k, v in value.items()} if isinstance(value, dict) else value


def finite(value: Any) -> Any:
    """A value, or None where it is a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


Number = Annotated[float | None, BeforeValidator(finite)]


class Part(BaseModel):
    """A part of a result: unknown fields are refused, numpy values are taken as plain ones."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _as_plain(cls, data: Any) -> Any:
        return _plain(data)


class Remark(Part):
    """What is said, as data: its code, its sentence, what to do about it, and its numbers by name."""

    code: str
    sentence: str
    advice: str = ""
    numbers: dict[str, Any] = Field(default_factory=dict)


class RowsLeftOut(Part):
    """Rows of a file that were not read, as an editor numbers lines, and why."""

    file: str
    rows: list[int]
    why: Literal["excluded", "missing"]

"""Values and documents as strict JSON can hold them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

__all__ = ["json_text", "plain"]


def plain(value: Any) -> Any:
    """Plain data that strict JSON can hold: what is not finite becomes null, numpy's numbers become Python's."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | set):
        return [plain(v) for v in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, str | int | bool):
        return value
    return str(value)


def json_text(document: Mapping[str, Any]) -> str:
    """A document as the text of its file."""
    return json.dumps(plain(document), indent=1, ensure_ascii=False, allow_nan=False) + "\n"

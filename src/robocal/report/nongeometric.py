"""What lies beyond geometry in the report: groups that were tried, and the residual layer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robocal.report.numbers import entries, finite, section, significant
from robocal.report.tables import mappings

__all__ = ["beyond"]


def beyond(result: Mapping[str, object]) -> dict[str, Any]:
    """Rows of the table of groups, and one sentence on the layer."""
    rows = []
    for t in mappings(result.get("groups_tried")):
        gain = section(t, "gain")
        orders = "; ".join(
            f"{joint}: {', '.join(f'{k:g}' for k in entries(each))}" for joint, each in section(t, "orders").items()
        )
        rows.append(
            {
                "name": str(t.get("name", "")),
                "parameters": str(t.get("parameters", "")),
                "before": significant(t.get("before")),
                "gain": significant(gain.get("mean")),
                "span": f"{significant(gain.get('low'), 2)} to {significant(gain.get('high'), 2)}" if gain else "–",
                "entered": t.get("entered") is True,
                "reason": str(t.get("reason", "")),
                "orders": orders,
                "unit": str(t.get("unit", "")),
            }
        )
    layer = section(result, "layer")
    words = ""
    if layer:
        gain = section(layer, "gain")
        state = "is switched on" if layer.get("used") is True else "is left off"
        words = f"The residual layer {state}: {layer.get('reason', '')}."
        if finite(layer.get("before")) is not None:
            before, after = (significant(layer.get(k), 4) for k in ("before", "after"))
            low, high = (significant(gain.get(k), 2) for k in ("low", "high"))
            words += f" Unseen blocks of rows: {before} mm without it, {after} mm with it,"
            words += f" 95 % interval of the reduction {low} to {high} mm."
    return {"tried": rows, "layer_words": words}

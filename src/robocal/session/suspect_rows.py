"""From strange rows in SI to what is written and shown."""

from __future__ import annotations

from pathlib import Path

from robocal.diagnose.outliers import Outlier
from robocal.files.display import display_unit, to_display
from robocal.files.evidence_parts import OutlierRow as Told
from robocal.measure.base import KINDS

__all__ = ["outlier"]


def outlier(o: Outlier) -> Told:
    """A strange row, its value in the units in which people read it."""
    units = [display_unit(u) for a, b, u in KINDS[o.kind].parts for _ in range(a, b)]
    value = [v / u.factor for v, u in zip(o.value, units, strict=False)]
    return to_display(Told, o, source=Path(o.source).name, value=value, units=[u.name for u in units[: len(value)]])

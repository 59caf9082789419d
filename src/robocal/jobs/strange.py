"""From strange rows in SI to what is written and shown."""

from __future__ import annotations

from pathlib import Path

from robocal.calibrate.outliers import Outlier
from robocal.files.parts import Remark
from robocal.files.strange import Outlier as Told
from robocal.files.units import UNITS
from robocal.measure.base import KINDS

__all__ = ["outlier"]

SHOWN = {"m": UNITS["mm"], "rad": UNITS["deg"], "px": UNITS["px"]}


def outlier(o: Outlier) -> Told:
    """A strange row, its value in the units in which people read it."""
    units = [SHOWN[u] for a, b, u in KINDS[o.kind].parts for _ in range(a, b)]
    return Told(
        configuration=o.configuration,
        group=o.group,
        kind=o.kind,
        target=o.target,
        source=Path(o.source).name,
        row=o.row,
        distance=o.distance,
        p_value=o.p_value,
        leverage=o.leverage,
        value=[v / u.factor for v, u in zip(o.value, units, strict=False)],
        units=[u.name for u in units[: len(o.value)]],
        set_aside=o.set_aside,
        counted=o.counted,
        cause=None if o.cause is None else Remark.of(o.cause),
    )

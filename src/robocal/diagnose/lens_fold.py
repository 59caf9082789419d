"""Pixels that no direction explains: a distortion that bends inward folds back at some radius, and images nothing beyond it."""

from __future__ import annotations

from collections.abc import Iterator

from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.measure.machine import Model
from robocal.measure.pixels import fold_of_lens
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["lens_reach"]

FOLDS = declare(
    "pixels-beyond-fold",
    "{count} of {total} pixels of {group} are out of reach of the lens as stated, which folds back {radius:.4g} from its centre",
    "Check its numbers, and the size of the images that they are for. A polynomial holds only where the lens was calibrated: for a wide "
    "lens take `model: rational` or `fisheye`.",
)


@check("pixels-beyond-fold", When.DATA, order=35, needs=("data",))
def lens_reach(context: Context[Model]) -> Iterator[Finding]:
    """Pixels beyond those at which the stated lens of their camera folds back."""
    for obs in context.need_data.observations:
        if obs.kind != "pixels" or obs.value.ndim != 2:
            continue
        radius, lost = fold_of_lens(obs)
        lost = lost if obs.used is None else lost & obs.used
        if lost.any():
            yield doubt(FOLDS, count=int(lost.sum()), total=len(obs), group=obs.label, radius=Quantity(radius, "px"))

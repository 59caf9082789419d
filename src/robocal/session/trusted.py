"""Where an identification can be trusted, for result.json: the predicted error, the check of its bands, the working range,
the scale."""

from __future__ import annotations

from robocal.files import evidence_parts as files
from robocal.files.display import to_display
from robocal.fit.estimators import estimator
from robocal.measure.machine import Model
from robocal.prove.identification import Identification
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["prediction_part", "range_part", "scale_part"]

NOTHING = 1e-9  # tolerance: m; two models that differ by rounding are one, and neither is the better


def prediction_part(found: Identification[Model]) -> files.Prediction | None:
    """The predicted error in mm with the check of the bands; a method that fits what cannot be seen has no honest one."""
    if estimator(found.options.method).blind:
        return None
    shares = list(found.coverage)
    if found.band is None:
        return files.Prediction(unit="mm", n=0, region="", coverage=shares) if shares else None
    return to_display(files.Prediction, found.band, coverage=shares)


def range_part(found: Identification[Model]) -> files.WorkingRange | None:
    """The working range in mm, and in words; None where nothing was gained and nothing changed."""
    h = found.holds
    if h is None or (h.moved < NOTHING and found.verdict.status != "improved"):
        return None
    said = Remark.of(
        Code.OVER_THE_RANGE,
        region=h.name,
        band=Quantity(h.band),
        moved=Quantity(h.moved),
        chance=h.chance,
        scale=None if h.sized else "scale",
    )
    return to_display(files.WorkingRange, h, text=said.sentence)


def scale_part(found: Identification[Model]) -> files.ScaleSummary | None:
    """The common scale, and in words where a stated length is all that gives it."""
    s = found.scale
    if s is None:
        return None
    told = s.observable or s.implausible
    said = Remark.of(Code.SCALE_SEEN, factor=s.factor, sigma=s.sigma).sentence if s.stated and told else ""
    return to_display(files.ScaleSummary, s, factor=s.factor if told else None, text=said)

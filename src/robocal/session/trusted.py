"""Where an identification can be trusted, for result.json: the predicted error, the check of its bands, the working range,
the scale; and what is remarked on them."""

from __future__ import annotations

from scipy import special

from robocal.files import evidence as files
from robocal.files.shown import shown
from robocal.fit.estimators import estimator
from robocal.measure.machine import Model
from robocal.prove.identification import Identification
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["band_remarks", "prediction_part", "range_part", "scale_part"]

NOTHING = 1e-9  # m: two models that differ by rounding are one, and neither is the better
WHOLE = {"position": "positions", "orientation": "orientations"}


def prediction_part(found: Identification[Model]) -> files.Prediction | None:
    """The predicted error in mm with the check of the bands; a method that fits what cannot be seen has no honest one."""
    if estimator(found.options.method).blind:
        return None
    shares = list(found.coverage)
    if found.band is None:
        return files.Prediction(unit="mm", n=0, region="", coverage=shares) if shares else None
    return shown(files.Prediction, found.band, coverage=shares)


def band_remarks(found: Identification[Model]) -> tuple[Remark, ...]:
    """Bands that are too narrow, and the predicted error away from the data."""
    if estimator(found.options.method).blind:
        return ()
    narrow = [
        Remark.of(Code.BAND_TOO_NARROW, whole=c.whole, n=c.n, quantity=WHOLE[c.quantity])
        for c in found.coverage
        # Fewer than one honest band in a thousand would miss so many.
        if c.quantity in WHOLE and special.bdtr(round(c.whole * c.n), c.n, c.level) < 1e-3
    ]
    b = found.band
    if b is None:
        return tuple(narrow)
    left = Quantity(b.left) if b.left > 0 else None
    away = Remark.of(Code.ELSEWHERE, region=b.region, mean=Quantity(b.mean), p95=Quantity(b.p95), left=left)
    return (*narrow, away)


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
    return shown(files.WorkingRange, h, text=said.sentence)


def scale_part(found: Identification[Model]) -> files.Scale | None:
    """The common scale, and in words where a stated length is all that gives it."""
    s = found.scale
    if s is None:
        return None
    told = s.seen or s.beyond
    said = Remark.of(Code.SCALE_SEEN, factor=s.factor, sigma=s.sigma).sentence if s.stated and told else ""
    return shown(files.Scale, s, factor=s.factor if told else None, text=said)

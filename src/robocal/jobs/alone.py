"""The joint offsets fitted alone, as result.json holds them: angles and lengths in the robot file's units, errors in mm, deg
or px."""

from __future__ import annotations

from robocal.calibrate.evidence import Statistic
from robocal.calibrate.offsets import JointOffset, OffsetsAlone
from robocal.files import offsetparts as files
from robocal.files.nongeometric_parts import Gain
from robocal.files.opened import Opened
from robocal.files.parts import Remark, kept
from robocal.files.units import UNITS, Unit

__all__ = ["offset_result"]

SHOWN = {"m": UNITS["mm"], "rad": UNITS["deg"], "px": UNITS["px"]}


def offset_result(found: OffsetsAlone | None, robot: Opened) -> files.OffsetsAlone | None:
    """The section `offsets` of result.json."""
    if found is None:
        return None
    unit = SHOWN[found.unit]

    def mean(s: Statistic | None) -> float | None:
        return None if s is None else s.mean / unit.factor

    gain = None
    if found.gain is not None:
        gain = Gain(**{k: v / unit.factor for k, v in zip(("mean", "low", "high"), found.gain, strict=True)})
    return files.OffsetsAlone(
        status="improved" if found.proven else "not_improved",
        reason=Remark.of(found.reason),
        unit=unit.name,
        before=mean(found.before),
        after=mean(found.after),
        whole=mean(found.whole),
        n=found.before.n if found.before else 0,
        gain=gain,
        how=found.how,
        parameters=[_joint(o, robot.units.of(o.unit)) for o in found.offsets],
    )


def _joint(o: JointOffset, unit: Unit) -> files.JointOffset:
    return files.JointOffset(
        joint=o.joint,
        unit=unit.name,
        offset=o.offset / unit.factor,
        sigma=None if o.sigma is None else o.sigma / unit.factor,
        interval=None if o.interval is None else (o.interval[0] / unit.factor, o.interval[1] / unit.factor),
        status=o.status,  # type: ignore[arg-type]
        note="; ".join(map(str, o.notes)),
        remarks=kept(o.notes),
    )

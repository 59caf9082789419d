"""The kinds of measurement that files can hold, by name: one import and one line each."""

from __future__ import annotations

from robocal.files.kinds.angular import BEARING, SPHERICAL
from robocal.files.kinds.base import KindFile
from robocal.files.kinds.contact import PLANE, POINT, SPHERE
from robocal.files.kinds.distance import DISTANCE
from robocal.files.kinds.lengths import LENGTHS
from robocal.files.kinds.pixels import PIXELS
from robocal.files.kinds.pose import POSE
from robocal.files.kinds.position import POSITION
from robocal.files.kinds.range import RANGE
from robocal.files.kinds.relative import DISPLACEMENT, RELATIVE_POSE
from robocal.measure.machine import Machine

__all__ = ["READERS", "readers_of"]

READERS: dict[str, KindFile] = {
    kind.name: kind
    for kind in (
        POSITION,
        POSE,
        SPHERICAL,
        BEARING,
        RANGE,
        DISTANCE,
        DISPLACEMENT,
        RELATIVE_POSE,
        POINT,
        PLANE,
        SPHERE,
        PIXELS,
    )
}


def readers_of(machine: Machine) -> dict[str, KindFile]:
    """The kinds by which a machine can be measured: lengths of cables are those of a robot that has some."""
    return READERS | ({LENGTHS.name: LENGTHS} if getattr(machine, "cables", ()) else {})

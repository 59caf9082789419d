"""How logs of a motor are identified, unless it is said otherwise: what `drive identify` has as options, and `drive simulate` as it is."""

from __future__ import annotations

from robocal._record import record

__all__ = ["DriveSettings"]


@record
class DriveSettings:
    """At most so many `orders`; `phases`: auto, lag or directions; whether the encoder may be `eccentric`; `slots` and `poles`, where they
    are known; the `method`, harmonics or seed, with the `degree` and the `window` (deg) of the latter's polynomials."""

    orders: int = 20
    phases: str = "auto"
    eccentric: bool = False
    slots: int | None = None
    poles: int | None = None
    method: str = "harmonics"
    degree: int = 2
    window: float = 5.0

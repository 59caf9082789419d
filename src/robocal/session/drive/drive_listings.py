"""Tables of a motor: its logs, friction and load of each, logs that were held back, and harmonics beside the seed document's tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from robocal._types import Array
from robocal.quantities import Column, Listing
from robocal.session.drive.drive_data import WEIGHT, friction_free

__all__ = ["friction_listing", "log_listing", "other_listing", "seed_listing"]

LOADS = {None: "not said", "detached": "detached", "loaded": "loaded"}


def log_listing(found: Any) -> Listing:
    """A row for each log: speed, rows, noise and how large it is beside the cogging."""
    size = float(np.sqrt(np.sum(found.taken.motor.cogging.amplitudes**2) / 2)) or np.nan
    logs, shares = found.logs, found.log_shares
    unit = logs[0].speed_unit
    noise = np.array([p.noise for p in shares])
    return Listing(
        (
            Column("log", "", [log.path.name for log in logs]),
            Column("rows", "", [len(log.sweep) for log in logs]),
            Column("turns", "", np.array([np.ptp(log.sweep.angle) / (2 * np.pi) for log in logs]), figures=3),
            Column("speed", unit, logs[0].in_angle_unit([log.sweep.median_speed for log in logs]), figures=3),
            Column("noise", found.unit, noise, figures=2),
            Column("noise_share", "", noise / size, figures=2, label="noise / cogging"),
            Column("alone", "", np.array([p.alone for p in shares]), spec=".1%", label="table explains"),
            Column("use", "", ["fitted" if i in found.fitted else "held back" for i in range(len(logs))]),
        )
    )


def friction_listing(found: Any) -> Listing:
    """A row for each log that was fitted: its offset, Coulomb friction with sigma, and the weight of its load."""
    logs = [found.logs[i] for i in found.fitted]
    values = found.taken.decision.values
    numbers = [f"log{i + 1}" for i in range(len(logs))]

    def of(symbol: str) -> Array:
        return np.array([values.get(f"{n}.{symbol}", np.nan) for n in numbers])

    return Listing(
        (
            Column("log", "", [log.path.name for log in logs]),
            Column("load", "", [LOADS[log.load] for log in logs]),
            Column("offset", found.unit, of("offset"), figures=3),
            Column("friction", found.unit, of("coulomb"), figures=4),
            Column("sigma", found.unit, [found.taken.sigma(f"{n}.coulomb") for n in numbers], figures=2, label=f"its sigma [{found.unit}]"),
            Column("weight", found.unit, np.hypot(*(of(w) for w in WEIGHT)), figures=3, label=f"weight of the load [{found.unit}]"),
        )
    )  # fmt: skip


def other_listing(found: Any) -> Listing:
    """A row for each log that was held back."""
    rows = [(found.logs[i], e) for i, e in found.other_logs.items()]
    unit = found.logs[0].speed_unit
    speed = found.logs[0].in_angle_unit([e.speed for _, e in rows])
    return Listing(
        (
            Column("log", "", [log.path.name for log, _ in rows]),
            Column("speed", unit, speed, figures=3),
            Column("alone", "", [e.alone for _, e in rows], spec=".1%"),
            Column("fitted", "", [e.fitted for _, e in rows], spec=".1%", label="with lag, gain, inertia"),
            Column("best", "", [e.best for _, e in rows], spec=".1%", label="own fit of the same orders"),
        )
    )


def seed_listing(found: Any) -> Listing | None:
    """The seed document's tables beside harmonics: what each explains of the rows that it was made of, and what one direction's
    explains of the other, as it is; None of another method."""
    if found.seed is None:
        return None
    sweep, used = found.sweeps[0], found.used[0]
    effort, some = friction_free(sweep, used), sweep.take(used)
    total = float(effort @ effort)
    cogging = found.taken.motor.cogging

    def share(curve: Array) -> float:
        left = effort - curve
        return 1 - float(left @ left) / total

    each = (cogging.at, found.seed.at)
    return Listing(
        (
            Column("method", "", ["harmonics", "tables of the seed"]),
            Column("same", "", [share(c(some.angle, some.direction)) for c in each], spec=".2%", label="of its own rows"),
            Column("other", "", [share(c(some.angle, -some.direction)) for c in each], spec=".2%", label="of the other direction"),
            Column("numbers", "", [2 * len(cogging.orders) * (2 if cogging.by_direction else 1), found.seed.values.size]),
        )
    )  # fmt: skip

"""Tables of a motor: its logs, friction and load of each, logs that were held back, and harmonics beside the seed document's tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robocal._types import Array, Bools
from robocal.drives.cogging import Cogging
from robocal.drives.drive_sweep import Sweep
from robocal.drives.seed_table import SeedTable
from robocal.files.drive_log import DriveLog
from robocal.quantities import Column, Listing
from robocal.session.drive.drive_data import WEIGHT, friction_free

__all__ = ["friction_listing", "log_listing", "log_names", "other_listing", "seed_listing", "seed_shares"]

LOADS = {None: "not said", "detached": "detached", "loaded": "loaded"}


def log_names(logs: Sequence[DriveLog]) -> list[str]:
    """What logs are called: their files, with their folders where files of different folders have one name."""
    names = [log.path.name for log in logs]
    return [n if names.count(n) == 1 else f"{log.path.parent.name}/{n}" for n, log in zip(names, logs, strict=True)]


def log_listing(found: Any) -> Listing:
    """A row for each log: speed, rows, noise and how large it is beside the cogging."""
    size = float(np.sqrt(np.sum(found.taken.motor.cogging.amplitudes**2) / 2)) or np.nan
    logs, shares = found.logs, found.log_shares
    unit = logs[0].speed_unit
    noise = np.array([p.noise for p in shares])
    return Listing(
        (
            Column("log", "", log_names(logs)),
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
            Column("log", "", [log_names(found.logs)[i] for i in found.fitted]),
            Column("load", "", [LOADS[log.load] for log in logs]),
            Column("offset", found.unit, of("offset"), figures=3),
            Column("friction", found.unit, of("coulomb"), figures=4),
            Column("sigma", found.unit, [found.taken.sigma(f"{n}.coulomb") for n in numbers], figures=2, label=f"its sigma [{found.unit}]"),
            Column("weight", found.unit, np.hypot(*(of(w) for w in WEIGHT)), figures=3, label=f"weight of the load [{found.unit}]"),
        )
    )  # fmt: skip


def other_listing(found: Any) -> Listing:
    """A row for each log that was held back."""
    names = log_names(found.logs)
    rows = [(names[i], e) for i, e in found.other_logs.items()]
    unit = found.logs[0].speed_unit
    speed = found.logs[0].in_angle_unit([e.speed for _, e in rows])
    return Listing(
        (
            Column("log", "", [name for name, _ in rows]),
            Column("speed", unit, speed, figures=3),
            Column("alone", "", [e.alone for _, e in rows], spec=".1%"),
            Column("fitted", "", [e.fitted for _, e in rows], spec=".1%", label="with lag, gain, inertia"),
            Column("best", "", [e.best for _, e in rows], spec=".1%", label="own fit of the same orders"),
        )
    )


def seed_shares(sweep: Sweep, used: Bools, cogging: Cogging, seed: SeedTable) -> Array:
    """What harmonics and the seed document's tables (2 rows) explain of the rows that they were made of, and of the other direction as
    it is (2 columns)."""
    effort, some = friction_free(sweep, used), sweep.take(used)
    total = float(effort @ effort)
    left = [[effort - c(some.angle, d * some.direction) for d in (1, -1)] for c in (cogging.at, seed.at)]
    return np.array([[1 - float(e @ e) / total for e in row] for row in left])


def seed_listing(found: Any) -> Listing | None:
    """The seed document's tables beside harmonics, by the shares that they explain; None of another method."""
    if found.seed is None:
        return None
    cogging = found.taken.motor.cogging
    shares = seed_shares(found.sweeps[0], found.used[0], cogging, found.seed)
    return Listing(
        (
            Column("method", "", ["harmonics", "tables of the seed"]),
            Column("same", "", shares[:, 0], spec=".2%", label="of its own rows"),
            Column("other", "", shares[:, 1], spec=".2%", label="of the other direction"),
            Column(
                "numbers", "", [2 * len(cogging.orders) * (2 if cogging.by_direction else 1), found.seed.values.size]
            ),
        )
    )

"""What `drive identify` finds: a motor with its orders and their intervals, the verdict, what logs that were held back say of it, and what
the logs cannot tell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.diagnose.drive_limits import LONE_ROWS, SAME_PACE, WINDOW_LOSES
from robocal.drives.drive_sweep import Sweep, escaped_rows, lone_rows
from robocal.drives.order_choice import ChosenOrders
from robocal.drives.order_names import STRONG, guess_motor, name_order
from robocal.drives.seed_table import SeedTable, seed_table
from robocal.errors import ModelError
from robocal.files.display import to_display
from robocal.files.drive_log import DriveLog
from robocal.files.motor_file import FILE, MotorFile, motor_text
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.result import Verdict as VerdictPart
from robocal.progress import Watch
from robocal.prove.verdict import Verdict
from robocal.quantities import Column, Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, sentences
from robocal.report.sections import Section
from robocal.session.drive.drive_checks import check_reading
from robocal.session.drive.drive_data import friction_of
from robocal.session.drive.drive_fit import (
    MotorFit,
    choose,
    fit_motor,
    highest_order,
    moments_of_sweeps,
    noise_of,
    other_direction,
    prefer_directions,
)
from robocal.session.drive.drive_judge import escape_width, judge_logs
from robocal.session.drive.drive_listings import friction_listing, log_listing, other_listing, seed_listing, seed_shares
from robocal.session.drive.log_agreement import contradictions
from robocal.session.drive.table_share import Explained, explain
from robocal.session.verb_base import VerdictResult
from robocal.session.watching import computable

__all__ = ["DriveDocument", "IdentifiedDrive", "find_drive", "identify_logs"]


@record(kw_only=True)
class DriveDocument(Document):
    """drive.json: the motor, the verdict, shares of the variance without friction on unseen arcs (as taken; with one lag, with phases per
    direction, of one direction from the other), the noise and the share that it leaves to any curve, friction, orders, logs, friction
    of each, harmonics beside tables of the seed's method, and logs that were held back."""

    motor: str
    method: str
    verdict: VerdictPart
    share: float
    share_lag: float | None
    share_directions: float | None
    share_other_direction: float | None
    ceiling: float
    noise: UnitValue
    lag: UnitValue
    friction: UnitValue
    orders: Listing
    logs: Listing
    frictions: Listing
    methods: Listing | None
    other_logs: Listing
    escapes: UnitValue
    provenance: Origin


@record(kw_only=True, eq=False)
class IdentifiedDrive(VerdictResult):
    """A motor in its logs, with everything that its page shows."""

    logs: tuple[DriveLog, ...]
    fitted: tuple[int, ...]  # which of the logs
    used: tuple[Bools, ...]  # of the fitted ones
    escaped: tuple[Bools, ...]
    verdict: Verdict
    chosen: ChosenOrders
    taken: MotorFit
    tried: Mapping[str, MotorFit]
    other: float
    noise: float
    other_logs: Mapping[int, Explained]
    log_shares: tuple[Explained, ...]
    seed: SeedTable | None
    motor_file: MotorFile
    left_amplitudes: Array  # of every order, what the fit leaves

    @property
    def trusted(self) -> bool:
        """Whether the table may be used."""
        return self.verdict.status == "improved"

    @property
    def unit(self) -> str:
        """The unit of the effort."""
        return self.logs[0].sweep.unit

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        """The sweeps that were fitted."""
        return tuple(self.logs[i].sweep for i in self.fitted)

    @cached_property
    def signal(self) -> float:
        """The variance of the effort without friction."""
        from robocal.session.drive.drive_data import friction_free

        every = np.concatenate([friction_free(s, u) for s, u in zip(self.sweeps, self.used, strict=True)])
        return float(np.mean(every**2))

    @property
    def ceiling(self) -> float:
        """The share that the noise leaves to any curve."""
        return 1 - self.noise**2 / self.signal

    @cached_property
    def slots_and_poles(self) -> tuple[int | None, int | None]:
        """As they were said, else as they were guessed."""
        motor = self.taken.motor
        said = motor.slots, motor.poles
        return said if all(said) else guess_motor(motor.orders, motor.cogging.amplitudes, said) or said

    @cached_property
    def orders(self) -> Listing:
        """A row for each order: amplitude and phase, both parts with what they may be off by, and its name."""
        motor, c = self.taken.motor, self.taken.motor.cogging
        sigma = np.array([[self.taken.sigma(n) for n in _parts(o)] for o in c.orders]).reshape(-1, 2)
        slots, poles = self.slots_and_poles
        amplitude = c.amplitudes
        strong = [[m for m, b in zip(c.orders, amplitude, strict=True) if b > STRONG * a] for a in amplitude]
        names = [name_order(n, slots, poles, s) for n, s in zip(c.orders, strong, strict=True)]
        cos, sin = np.array(c.cosine), np.array(c.sine)
        shares = np.diff([0.0, *self.chosen.shares])
        return Listing(
            (
                Column("order", "", list(motor.orders)),
                Column("amplitude", self.unit, amplitude, figures=4),
                Column("phase", "deg", np.degrees(c.phases), figures=4),
                Column("cos", self.unit, cos, figures=4),
                Column("sin", self.unit, sin, figures=4),
                Column("sigma_cos", self.unit, sigma[:, 0], figures=2, label=f"sigma cos [{self.unit}]"),
                Column("sigma_sin", self.unit, sigma[:, 1], figures=2, label=f"sigma sin [{self.unit}]"),
                Column("share", "", shares if len(shares) == len(cos) else np.full(len(cos), np.nan), spec=".2%"),
                Column("name", "", names),
            )
        )

    @cached_property
    def log_listing(self) -> Listing:
        """A row for each log: speed, rows, noise and how large it is beside the cogging."""
        return log_listing(self)

    @cached_property
    def friction_listing(self) -> Listing:
        """Friction of each log that was fitted, detached or loaded."""
        return friction_listing(self)

    @cached_property
    def other_listing(self) -> Listing:
        """A row for each log that was held back."""
        return other_listing(self)

    @property
    def escapes(self) -> float:
        """How wide the arcs are where the rotor escaped, deg."""
        return float(sum(escape_width(s, e) for s, e in zip(self.sweeps, self.escaped, strict=True)))

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (
            ("Logs", ", ".join(log.path.name for log in self.logs)),
            ("Effort", "current" if self.unit == "A" else "torque"),
            ("Method", "tables per direction" if self.seed is not None else "harmonics of the turn"),
        )
        return {"title": f"Cogging of {self.motor_file.name}", "kind": "Drive", "facts": facts}

    @property
    def document(self) -> DriveDocument:
        """What --json says."""
        said = to_display(VerdictPart, self.verdict, reasons=sentences(self.verdict.remarks))
        motor = self.taken.motor
        of = {k: t.share for k, t in self.tried.items()}
        return self.document_of(
            DriveDocument, motor=self.motor_file.name, method="seed" if self.seed is not None else "harmonics", verdict=said,
            share=self.taken.share, share_lag=of.get("lag"), share_directions=of.get("directions"), share_other_direction=self.other,
            ceiling=self.ceiling, noise=UnitValue(self.noise, self.unit), lag=UnitValue(float(np.degrees(motor.cogging.lag)), "deg"),
            friction=UnitValue(self.motor_file.coulomb, self.unit), orders=self.orders, logs=self.log_listing,
            frictions=self.friction_listing, methods=seed_listing(self),
            other_logs=self.other_listing, escapes=UnitValue(self.escapes, "deg"),
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The motor and the document."""
        return {FILE: motor_text(self.motor_file), "drive.json": json_text(self.document)}

    def details(self) -> Iterator[Section]:
        """Figures of the sweep, of its directions, its orders and what is left."""
        from robocal.report.drive_page import drive_pictures

        yield from drive_pictures(self)


def _parts(order: int) -> tuple[str, str]:
    return f"order{order}.cos", f"order{order}.sin"


def find_drive(o: Any, logs: tuple[DriveLog, ...], watch: Watch | None, command: str) -> IdentifiedDrive:
    """Identifies the motor of some logs. Raises InputError."""
    with computable(*(log.path for log in logs)):
        return identify_logs(o, logs, watch, command)


def identify_logs(o: Any, logs: tuple[DriveLog, ...], watch: Watch | None, command: str) -> IdentifiedDrive:
    """The same of logs that were read."""
    slowest = min(log.sweep.median_speed for log in logs)
    fitted = tuple(i for i, log in enumerate(logs) if log.sweep.median_speed <= SAME_PACE * slowest)
    sweeps = [logs[i].sweep for i in fitted]
    escaped = tuple(escaped_rows(s) for s in sweeps)
    lone = tuple(lone_rows(s, LONE_ROWS) for s in sweeps)
    used = tuple(s.used & ~e & ~a for s, e, a in zip(sweeps, escaped, lone, strict=True))
    told = next((log.motor for log in logs if log.motor.slots or log.motor.poles), logs[0].motor)
    slots, poles = o.slots or told.slots, o.poles or told.poles
    if poles is not None and poles % 2:
        raise ModelError("poles come in pairs", key="--poles", found=poles, expected="an even number")
    highest, _ = highest_order(sweeps, used)
    moments = moments_of_sweeps(sweeps, used, highest)
    if len(np.unique(moments.arc)) < 2:
        reading = check_reading(sweeps[0], 0.0)
        hint = "" if reading is None else f", or other columns or units: {dict(reading.numbers)['change']}"
        message, found = "the log stays within one arc of 30 degrees", str(logs[fitted[0]].path)
        raise ModelError(message, found=found, expected=f"a sweep over a turn{hint}")
    chosen = choose(moments, o.orders, o.eccentric, all(s.loaded for s in sweeps))
    name = logs[fitted[0]].sweep.name
    tried: dict[str, MotorFit] = {}
    # Where a rotor escaped, one direction has to say what the other lost: phases of its own would hear nothing of it.
    both = len(np.unique(moments.direction)) > 1 and not any(e.any() for e in escaped)
    for word in ("lag", "directions"):
        if word in (o.phases, "lag" if o.phases == "auto" else "") or (o.phases == "auto" and both):
            tried[word] = fit_motor(
                sweeps, used, moments, chosen.orders, by_direction=word == "directions", eccentric=o.eccentric, name=name,
                slots=slots, poles=poles, watch=watch,
            )  # fmt: skip
    taken = prefer_directions(tried)
    other = other_direction(moments, chosen.orders, chosen.lag)
    other_logs = {
        i: explain(taken.motor, log.sweep, log.sweep.used & ~escaped_rows(log.sweep))
        for i, log in enumerate(logs)
        if i not in fitted
    }
    log_shares = tuple(
        other_logs[i] if i in other_logs else explain(taken.motor, log.sweep, used[fitted.index(i)])
        for i, log in enumerate(logs)
    )
    table = seed_table(sweeps[0], escaped[0] | lone[0], o.degree, np.radians(o.window)) if o.method == "seed" else None
    noise = noise_of(taken.decision)
    one_lag = tried["lag"].motor.cogging.lag if "lag" in tried else chosen.lag
    noise_share = noise**2 * float(moments.n.sum() / moments.q.sum())
    apart = tuple(contradictions([logs[i] for i in fitted], used, o.orders))
    verdict, warnings = judge_logs(
        logs, sweeps, used, escaped, taken, other_logs, apart, (slots, poles), noise_share, one_lag, other
    )
    alone = [
        Remark.of(Code.DRIVE_LONE_ROWS, count=int(a.sum()), log=s.name)
        for s, a in zip(sweeps, lone, strict=True)
        if a.any()
    ]
    warnings = (*warnings, *alone)
    if table is not None and len(np.unique(sweeps[0].direction[used[0]])) < 2 and verdict.status == "improved":
        verdict = verdict.instead("not_improved", Remark.of(Code.DRIVE_ONE_DIRECTION, log=sweeps[0].name))
    if table is not None and table.lost.any() and verdict.status == "improved":
        lost = float(table.lost.any(axis=0).mean()) * 360
        verdict = verdict.instead("not_improved", Remark.of(Code.DRIVE_TABLE_LOST, lost=lost))
    if table is not None:
        (harmonics, _), (own, _) = seed_shares(sweeps[0], used[0], taken.motor.cogging, table).tolist()
        if own < harmonics - WINDOW_LOSES:
            remark = Remark.of(Code.DRIVE_WINDOW_FLATTENS, window=float(o.window), table=own, harmonics=harmonics)
            warnings = (*warnings, remark)
    motor_file = _motor_file(name, taken, logs, sweeps, table, told.torque_constant, verdict.status)
    left = _left(taken, moments.highest)
    return IdentifiedDrive(
        warnings=warnings, inputs=tuple(dict.fromkeys(f for log in logs for f in log.files)), command=command, logs=logs, fitted=fitted,
        used=used, escaped=escaped, verdict=verdict, chosen=chosen, taken=taken, tried=tried, other=other,
        noise=noise, other_logs=other_logs, log_shares=log_shares, seed=table,
        motor_file=motor_file, left_amplitudes=left,
    )  # fmt: skip


def _left(taken: MotorFit, highest: int) -> Array:
    from robocal.drives.moments import moments_of

    data = taken.decision.need_data
    angle, direction = (
        np.concatenate([np.asarray(b.extra[n]) for b in data.observations]) for n in ("angle", "direction")
    )
    effort = np.concatenate([r.value[:, 0] for r in taken.decision.residuals])
    found = moments_of(angle, effort, direction, np.zeros(len(angle), dtype=np.int64), highest)
    return np.asarray(2 * np.abs(found.y.sum(axis=0)) / len(effort))


def _motor_file(
    name: str, taken: MotorFit, logs: Sequence[DriveLog], sweeps: Sequence[Sweep], table: SeedTable | None, constant: float | None,
    verdict: str,
) -> MotorFile:  # fmt: skip
    values = taken.decision.values
    sigma = tuple(max(taken.sigma(p) for p in _parts(n)) for n in taken.motor.orders)
    source = "robocal drive identify " + ", ".join(log.path.name for log in logs)
    coulomb = friction_of(values, sweeps)
    return MotorFile(
        name, logs[0].sweep.unit, taken.motor.cogging, values.get("log1.offset", 0.0), table.coulomb if table is not None else coulomb,
        None if table is None else table.values, constant, sigma, source, verdict=verdict,
    )  # fmt: skip

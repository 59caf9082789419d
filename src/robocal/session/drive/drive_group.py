"""Several motors in one call: each identified by itself, in a table beside the others, and the strange ones by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.drive_limits import STRANGE_CHANCE, STRANGE_RATIO
from robocal.drives.motor_group import unlike_others
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.progress import Watch, tell
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.report.sections import Section
from robocal.session.drive.drive_logs import MotorLogs
from robocal.session.drive.drive_result import IdentifiedDrive, identify_logs
from robocal.session.verb_base import VerbResult
from robocal.session.watching import computable

__all__ = ["IdentifiedDrives", "MotorsDocument", "identify_each"]

COMMON = 3  # grid: of the strongest orders that most motors have
CELLS = 3600  # grid: of a turn, among which the peak is looked for
WORDS = {"improved": "improved", "located": "improved", "not_improved": "not improved", "refused": "refused"}


@record(kw_only=True)
class MotorsDocument(Document):
    """motors.json: a row for each motor, and the names of those that are unlike the others."""

    motors: Listing
    strange: list[str]
    provenance: Origin


@record(kw_only=True, eq=False)
class IdentifiedDrives(VerbResult):
    """Motors by name, each as it was identified."""

    members: Mapping[str, IdentifiedDrive]
    strange: tuple[str, ...]

    @property
    def trusted(self) -> bool:
        """Whether every table may be used."""
        return all(m.trusted for m in self.members.values())

    @cached_property
    def listing(self) -> Listing:
        """A row for each motor."""
        of = list(self.members.values())
        unit = of[0].unit
        strongest = [
            int(np.argmax(m.motor_file.cogging.amplitudes)) if m.motor_file.cogging.orders else None for m in of
        ]
        orders = [0 if i is None else m.motor_file.cogging.orders[i] for m, i in zip(of, strongest, strict=True)]
        return Listing(
            (
                Column("motor", "", list(self.members)),
                Column("verdict", "", [WORDS[m.verdict.status] for m in of]),
                Column("share", "", [m.taken.share for m in of], spec=".1%"),
                Column("order", "", orders, label="strongest order"),
                Column("amplitude", unit, [_amplitude(m, n) for m, n in zip(of, orders, strict=True)], figures=3),
                Column("peak", unit, [_peak(m) for m in of], figures=3),
                Column("friction", unit, [m.motor_file.coulomb for m in of], figures=3),
                Column("lag", "deg", np.degrees([m.motor_file.cogging.lag for m in of]), figures=3),
                Column("noise", unit, [m.noise for m in of], figures=2),
                Column("strange", "", ["strange" if name in self.strange else "" for name in self.members], label=""),
            )
        )

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (("Motors", f"{len(self.members)}"), ("Strange", ", ".join(self.strange) or "none"))
        return {"title": f"Cogging of {len(self.members)} motors", "kind": "Drive", "facts": facts}

    @property
    def document(self) -> MotorsDocument:
        """What --json says."""
        return self.document_of(MotorsDocument, motors=self.listing, strange=list(self.strange))

    def texts(self) -> Mapping[str, str | bytes]:
        """The document."""
        return {"motors.json": json_text(self.document)}

    def details(self) -> Iterator[Section]:
        """The curves of all motors."""
        from robocal.report.drive_group import group_pictures

        yield from group_pictures(self)


def identify_each(o: Any, motors: MotorLogs, watch: Watch | None, command: str) -> IdentifiedDrives:
    """Identifies every motor by itself, and compares them. Raises InputError."""
    members: dict[str, IdentifiedDrive] = {}
    for name, logs in motors.items():
        tell(watch, name)
        with computable(*(log.path for log in logs)):
            members[name] = identify_logs(o, logs, watch, command)
    remarks = tuple(_strange(members))
    inputs = tuple(dict.fromkeys(f for m in members.values() for f in m.inputs))
    names = tuple(dict.fromkeys(str(r.numbers["motor"]) for r in remarks))
    return IdentifiedDrives(members=members, strange=names, warnings=remarks, inputs=inputs, command=command)


def _amplitude(found: IdentifiedDrive, order: int) -> float:
    """The amplitude of an order; of one that was not found what the fit leaves there."""
    c, left = found.motor_file.cogging, found.left_amplitudes
    if order in c.orders:
        return float(c.amplitudes[c.orders.index(order)])
    return float(left[order]) if order < len(left) else float("nan")


def _peak(found: IdentifiedDrive) -> float:
    return float(np.abs(found.motor_file.curves(CELLS)).max())


def _features(of: Sequence[IdentifiedDrive]) -> Iterator[tuple[str, str, Array]]:
    """What motors of one type have alike: a word, the unit and an amount of each (n,)."""
    unit = of[0].unit
    yield "Coulomb friction", unit, np.abs([m.motor_file.coulomb for m in of])
    yield "noise", unit, np.array([m.noise for m in of])
    every = {n for m in of for n in m.motor_file.cogging.orders}
    common = [n for n in every if 2 * sum(n in m.motor_file.cogging.orders for m in of) > len(of)]
    size = {n: np.array([_amplitude(m, n) for m in of]) for n in common}
    for n in sorted(common, key=lambda n: -float(np.median(size[n])))[:COMMON]:
        yield f"amplitude of order {n}", unit, size[n]


def _strange(members: Mapping[str, IdentifiedDrive]) -> Iterator[Remark]:
    """The motors that are unlike the others, each by what differs most."""
    names, of = list(members), list(members.values())
    if len({m.unit for m in of}) > 1:
        return
    features = list(_features(of))
    worst: dict[int, tuple[float, Remark]] = {}
    for what, unit, value in features:
        with np.errstate(divide="ignore"):
            odd = unlike_others(value, STRANGE_CHANCE / len(features), STRANGE_RATIO)
        others = np.delete(value, odd)
        for i in odd:
            times = float(np.exp(np.abs(np.log(value[i] / np.median(others)))))
            low, high = float(others.min()), float(others.max())
            remark = Remark.of(
                Code.DRIVE_STRANGE, motor=names[i], what=what, value=float(value[i]), unit=unit, low=low, high=high
            )
            if i not in worst or times > worst[i][0]:
                worst[i] = (times, remark)
    yield from (worst[i][1] for i in sorted(worst))

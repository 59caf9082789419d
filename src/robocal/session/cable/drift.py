"""What `cable drift` finds: calibrations of one cable robot side by side; what moved, how they scatter, and what they could not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal.apply.anchors import AnchorDrift, CableChange, compare_anchors
from robocal.cables.calibration.comparison import Scattered, calibration_scatter
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.files.parts import provenance_of
from robocal.files.plain import json_text
from robocal.files.runfolder import Run
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, remark_fields
from robocal.session.cable.calibrated import Calibrated, open_calibrated
from robocal.session.cable.statics_options import robot_inputs
from robocal.session.runs import shared_files, tables_by_hash
from robocal.session.verb_base import VerdictResult

__all__ = ["Drifts", "drifts"]

STEEL = 12.0  # ppm / K


@record(kw_only=True, eq=False)
class Drifts(VerdictResult):
    """Calibrations of one robot; every later one against the first, where both are runs; `labels` are short names for the places."""

    all: tuple[Calibrated, ...]
    compared: tuple[tuple[str, AnchorDrift], ...]
    scattered: Scattered
    labels: Mapping[str, str]

    @property
    def robot(self) -> CableRobot:
        """The first of them."""
        return self.all[0].robot

    @property
    def trusted(self) -> bool:
        """Whether anything follows: at least one comparison, and only of runs that improved the robot."""
        return bool(self.compared) and not any(c.cautions for c in self.all)

    @property
    def runs(self) -> list[Run]:
        """The run folders among them."""
        return [c.run for c in self.all if c.run is not None]

    @property
    def head(self) -> dict[str, str]:
        """What stands at the head of a page."""
        return {"title": f"{self.robot.name}: calibrations compared", "kind": "Cable robot"}

    def texts(self) -> dict[str, str | bytes]:
        """The files that a folder gets beside a page."""
        return {"drift.json": json_text(self.document)}

    @property
    def document(self) -> dict[str, Any]:
        """What --json says, schema 1: mm, mrad, ppm."""
        s = self.scattered
        scatter = {k: 1e3 * getattr(s, k) for k in ("component", "point", "zero", "moved", "scaled", "along", "across")}
        return {
            "robocal": 1, "robot": self.robot.name, "cables": self.robot.cables,
            "runs": [c.place for c in self.all],
            "scatter_mm": {**scatter, "size_ppm": 1e6 * s.size},
            "compared": [
                {
                    "run": place, "moved": c.cables_moved, "grown": c.grown, "chance": c.chance,
                    "doubtful": [x.cable for x in c.cables if x.doubtful],
                    "size_ppm": [1e6 * c.scale, 1e6 * c.scale_sigma] if np.isfinite(c.scale_sigma) else None,
                    "base": None if c.base is None else 1e3 * c.base,
                    "cables": {x.cable: _cable(x) for x in c.cables},
                }
                for place, c in self.compared
            ],
            "reasons": [r.document for r in self.reasons],
            "assumed": self.robot.assumed, **remark_fields(self.remarks), "provenance": provenance_of(self.command, self.inputs),
        }  # fmt: skip


def _labels(places: Sequence[str]) -> dict[str, str]:
    """Short names for the places: as many of their last parts as it takes to tell them apart."""
    parts = [Path(place).absolute().parts for place in places]
    for n in range(1, max(map(len, parts)) + 1):
        if len({p[-n:] for p in parts}) == len({*parts}):
            break
    return {place: str(Path(*p[-n:])) for place, p in zip(places, parts, strict=True)}


def _cable(x: CableChange) -> dict[str, Any]:
    return {
        "shift_mm": 1e3 * x.shift, "sigma_mm": 1e3 * x.sigma, "along_mm": 1e3 * x.along, "across_mm": 1e3 * x.across,
        "zero_mm": 1e3 * x.zero, "zero_sigma_mm": 1e3 * x.zero_sigma, "chance": x.chance, "of_all": x.of_all,
        "smallest_mm": {"along": 1e3 * x.smallest[0], "across": 1e3 * x.smallest[1]},
    }  # fmt: skip


def _reasons(place: str, found: AnchorDrift, zeros_unchanged: bool) -> list[Remark]:
    out = [
        Remark.of(
            Code.ANCHOR_MOVED, run=place, cable=c.cable, across=Quantity(c.across), along=Quantity(c.along),
            off=Quantity(1.96 * c.along_sigma), x=Quantity(float(c.shift[0])), y=Quantity(float(c.shift[1])), z=Quantity(float(c.shift[2])),
        )
        for c in sorted(found.cables, key=lambda c: c.of_all)
        if c.moved
    ]  # fmt: skip
    if found.grown:
        size, off = 1e6 * found.scale, 1.96e6 * found.scale_sigma
        out.insert(0, Remark.of(Code.SIZE_CHANGED, run=place, size=size, off=off, kelvin=abs(size) / STEEL))
    if not out:
        out.append(Remark.of(Code.NOTHING_MOVED, run=place))
    doubtful = [c for c in found.cables if c.doubtful]
    if 2 * len(doubtful) > len(found.cables):
        out.append(Remark.of(Code.ZEROS_CHANGED, run=place, cables=tuple(c.cable for c in doubtful)))
    else:
        amounts = ((c, {"zero": Quantity(c.zero), "along": Quantity(c.along)}) for c in doubtful)
        out += [Remark.of(Code.ANCHOR_OR_ZERO, run=place, cable=c.cable, **both) for c, both in amounts]
    seen = [c for c in found.cables if np.isfinite(c.smallest[0])]
    if seen:
        along, across = (max(c.smallest[i] for c in seen) for i in (0, 1))
        code = Code.SMALLEST_DRIFT if zeros_unchanged else Code.SMALLEST_DRIFT_FREE
        out.append(Remark.of(code, along=Quantity(along), across=Quantity(across)))
    return out


def drifts(places: Sequence[str], zeros_unchanged: bool, base_moves: bool, command: str = "") -> Drifts:
    """Compares calibrations of one robot. Raises InputError where they cannot be compared."""
    if len(places) < 2:
        alone = "one calibration alone cannot be compared"
        raise ModelError(alone, key="RUNS", found=len(places), expected="2 or more")
    every = tuple(open_calibrated(p) for p in places)
    first = every[0]
    for other in every[1:]:
        if other.robot.cables != first.robot.cables or other.robot.degrees != first.robot.degrees:
            raise ModelError(
                "these are different robots", key=other.place, found=f"{other.robot.name}: {', '.join(other.robot.cables)}",
                expected=f"{first.robot.name}: {', '.join(first.robot.cables)}",
            )  # fmt: skip
        own = any(n.split(".")[1].startswith("b") for n in first.robot.table.free)
        if not own and np.abs(other.robot.b - first.robot.b).max() > 1e-9:
            raise ModelError(
                "the platform anchors differ: identify both from the same robot file", key=other.place,
                expected=f"those of {first.place}",
            )  # fmt: skip
    remarks: list[Remark] = []
    found = []
    for other in every[1:]:
        if first.estimates is None or other.estimates is None:
            unknown = other if other.estimates is None else first
            remarks.append(Remark.of(Code.NOTHING_KNOWN_OF_ERRORS, run=unknown.place))
            continue
        assert first.run is not None and other.run is not None
        one, two = first.run.result, other.run.result
        shared = shared_files(one, two)
        if shared and tables_by_hash(one).keys() == tables_by_hash(two).keys():
            raise ModelError("this is the same run twice", key=other.place, expected="runs of other measurements")
        if shared:
            remarks.append(Remark.of(Code.MEASUREMENTS_SHARED, run=other.place, files=shared))
        # Without an instrument on the base a run knows shape alone, and where its base is follows from where it began.
        loose = tuple(c.place for c in (first, other) if not c.base_is_known)
        if loose and not base_moves:
            remarks.append(Remark.of(Code.BASE_NOT_MEASURED, runs=loose))
        how = {"zeros_unchanged": zeros_unchanged, "base_moves": base_moves or bool(loose)}
        found.append((other.place, compare_anchors(first.robot, first.estimates, other.estimates, **how)))
    remarks += [doubt for c in every for doubt in c.cautions]
    anchors, zeros = (np.array([getattr(c.robot, k) for c in every]) for k in ("a", "zeros"))
    scattered = calibration_scatter(first.robot, anchors, zeros)
    inputs = tuple(i for c in every for i in robot_inputs(c.file, c.place))
    labels = _labels([c.place for c in every])
    reasons = tuple(r for place, one in found for r in _reasons(labels[place], one, zeros_unchanged))
    return Drifts(
        all=every, compared=tuple(found), scattered=scattered, labels=labels, reasons=reasons, warnings=tuple(remarks), inputs=inputs,
        command=command,
    )  # fmt: skip

"""What a study says: its trials as a file, and every point in a few numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robocal.errors import FormatError
from robocal.files.csvtable import csv_text
from robocal.files.parts import Document, Origin, provenance_of
from robocal.files.text import InputFile
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, remark_fields
from robocal.studies.run import StudyOutputs
from robocal.studies.work import pack

__all__ = ["document", "missing_trials", "table_of", "written"]


def missing_trials(found: StudyOutputs) -> tuple[tuple[Remark, ...], bool]:
    """What is to be said of trials without a number, and whether every output has one at every point."""
    remarks, whole = [], True
    for name in found.outputs:
        every = found.summary(name)
        gone = [s.lost for s in every]
        none = sum(n == found.study.trials for n in gone)
        if none:
            remarks.append(Remark.of(Code.NO_TRIAL_ENDED, output=name, points=none, total=len(every)))
        if some := [n for n in gone if 0 < n < found.study.trials]:
            most, trials = max(some), found.study.trials
            counts = {"points": len(some), "total": len(every), "most": most, "trials": trials}
            remarks.append(Remark.of(Code.TRIALS_LOST, output=name, **counts))
        whole &= not none
    return tuple(remarks), whole


@dataclass(frozen=True, kw_only=True)
class StudyDocument(Document):
    """What --json says, SI: of every output one row for each point."""

    of: str
    trials: int
    seed: int
    outputs: dict[str, Listing]
    provenance: Origin


def table_of(found: StudyOutputs, name: str) -> Listing:
    """One output at every point, with what was varied."""
    unit, every, points = found.units[name], found.summary(name), found.study.points
    unit = "" if unit == "1" else unit
    parts = {"rms": "rms", "mean": "mean", "scatter": "scatter", "foretold": "theory"}  # columns and fields
    numbers = (Column(k, unit, [getattr(s, f) for s in every], label="" if k == "rms" else k) for k, f in parts.items())
    varied = (Column(n, "", [dict(p.varied)[n] for p in points]) for n, _ in points[0].varied)
    return Listing((*varied, *numbers, Column("lost", "", [s.lost for s in every])))


def document(found: StudyOutputs, command: str) -> StudyDocument:
    """What --json says."""
    study = found.study
    inputs = (InputFile(study.path, study.sha256), *(InputFile(Path(name), digest) for name, digest in study.read))
    return StudyDocument(
        of=study.of, trials=study.trials, seed=study.seed, outputs={name: table_of(found, name) for name in found.outputs},
        **remark_fields(missing_trials(found)[0]), provenance=provenance_of(command, inputs),
    )  # fmt: skip


def written(result: Path) -> Callable[[StudyOutputs], bytes]:
    """How every trial is written into a file of this name. Raises FormatError for another than .npz and .csv."""
    known = {".npz": _npz, ".csv": _csv}
    if result.suffix.lower() not in known:
        raise FormatError(
            "trials are written as .npz or .csv", file=result, key="--output", found=result.suffix or "no suffix", expected=".npz or .csv"
        )  # fmt: skip
    return known[result.suffix.lower()]


def _npz(found: StudyOutputs) -> bytes:
    """`point` (P, T), every output (P, T) in SI, and what was varied (P,) as text."""
    points = found.study.points
    names = [name for name, _ in points[0].varied]
    return pack({f"varied.{n}": np.array([dict(p.varied)[n] for p in points]) for n in names} | found.outputs)


def _csv(found: StudyOutputs) -> bytes:
    names = [name for name, _ in found.study.points[0].varied]
    head = [*names, "trial", *(f"{n} [{u}]" for n, u in found.units.items())]
    rows = (
        [*(v for _, v in p.varied), i, *("" if np.isnan(x) else f"{x:.9g}" for x in row)]
        for k, p in enumerate(found.study.points)
        for i, row in enumerate(np.stack([found.outputs[n][k] for n in found.units], axis=1))
    )
    return csv_text(head, rows).encode("utf-8")

"""Measurements that a run was fitted to: they prove nothing about it, whichever file they stand in by now."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal.errors import FormatError
from robocal.files.residuals import read_residuals
from robocal.files.runfolder import RESIDUALS, Run, find_run
from robocal.measure.fingerprint import fingerprints
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.inputs import Inputs

__all__ = ["FEWEST", "unseen"]

FEWEST = 5  # unseen configurations that can judge a robot


def unseen(inputs: Inputs, places: Iterable[Path | None]) -> tuple[Inputs, tuple[Remark, ...], tuple[Remark, ...]]:
    """The same inputs without what the runs beside these files were fitted to, reasons why nothing is proven all the same, and
    remarks. Where nothing is left, everything is kept, to be told and not to be trusted."""
    runs = {run.folder: run for place in places if place is not None and (run := find_run(place)) is not None}
    if not runs:
        return inputs, (), ()
    data = inputs.data
    rows = _rows(inputs, list(runs.values()))
    count = sum(int(r.sum()) for r in rows)
    if not count:
        return inputs, (), ()
    files = tuple(dict.fromkeys(o.source for o, r in zip(data.observations, rows, strict=True) if r.any()))
    seen = np.zeros(len(data.configurations), dtype=bool)
    for obs, r in zip(data.observations, rows, strict=True):
        seen[obs.configuration[r]] = True
    left = np.flatnonzero(~seen)
    if not len(left):
        return inputs, (Remark.of(Code.FITTED_TO_THESE, files=files),), ()
    total = sum(len(o) for o in data.observations)
    told = Remark.of(Code.SEEN_LEFT_OUT, count=count, total=total, files=files, left=len(left))
    few = (Remark.of(Code.FEW_UNSEEN_HERE, left=len(left), fewest=FEWEST),) if len(left) < FEWEST else ()
    return inputs.with_data(data.take(left)), few, (told,)


def _rows(inputs: Inputs, runs: Sequence[Run]) -> list[NDArray[np.bool_]]:
    """Which rows of each of the observations a run was fitted to."""
    known: set[int] = set()
    files: set[str] = set()  # of runs that do not say which rows they were fitted to
    for run in runs:
        place = run.part(RESIDUALS)
        marks = read_residuals(place).get("fingerprint") if place is not None else None
        known |= {_mark(m, place) for m in marks or ()}
        if marks is None:
            files |= {i.sha256 for i in run.result.provenance.inputs}
    again = {str(f.file) for f in inputs.reading.files if f.sha256 in files}
    marks_here = fingerprints(inputs.data)
    wanted = np.array(sorted(known), dtype=np.uint64)
    return [np.isin(m, wanted) | (o.source in again) for m, o in zip(marks_here, inputs.data.observations, strict=True)]


def _mark(cell: str, place: Path | None) -> int:
    """A fingerprint as residuals.csv holds it. Raises FormatError where it is none."""
    if not cell or len(cell) > 16 or set(cell.lower()) - set("0123456789abcdef"):
        raise FormatError(
            "not the fingerprint of a row",
            file=place,
            column="fingerprint",
            found=cell,
            expected="16 digits from 0 to f",
        )
    return int(cell, 16)

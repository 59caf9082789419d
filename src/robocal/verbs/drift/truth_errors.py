"""`drift RUN truth.yaml`: how far the parameters that a run identified are from the truth of a simulation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal.apply.difference import step_between
from robocal.apply.truth import CHANCE, GroupErrors, ParameterError, TruthErrors, compare_truth
from robocal.errors import FileError, ModelError
from robocal.files.display import to_display
from robocal.files.parts import provenance_of
from robocal.files.plain import json_text, plain
from robocal.files.runfolder import RESULT, find_run
from robocal.files.text import InputFile, read_text
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, remark_fields, sentences
from robocal.report.sections import Cell, Section, Style, Text, ends, figure, quiet, table
from robocal.session.inputs import open_calibration, open_machine
from robocal.session.opened import Opened
from robocal.session.runs import verdict_remarks
from robocal.session.verb_base import VerdictResult

__all__ = ["TruthComparison", "compare_with_truth", "truth_sections"]

TEN = 10
SAME = 1e-9  # of two values, m or rad


@record(kw_only=True, eq=False)
class TruthComparison(VerdictResult):
    """A run of a machine beside the truth (SI)."""

    name: str
    errors: TruthErrors
    places: tuple[str, str]

    @property
    def trusted(self) -> bool:
        """Whatever follows, they could be compared."""
        return True

    @property
    def head(self) -> dict[str, Any]:
        """The machine."""
        return {"title": f"{self.name}: identified and true", "kind": "Simulated truth"}

    def texts(self) -> Mapping[str, str | bytes]:
        """The document."""
        return {"drift.json": json_text(self.document)}

    @cached_property
    def groups(self) -> tuple[GroupErrors, ...]:
        """Groups, in mm and deg."""
        return tuple(to_display(GroupErrors, g) for g in self.errors.groups)

    @cached_property
    def parameters(self) -> tuple[ParameterError, ...]:
        """Parameters, in mm and deg."""
        return tuple(to_display(ParameterError, p) for p in self.errors.parameters)

    @property
    def consistent(self) -> bool:
        """Whether errors are what their standard deviations say, together and each."""
        return self.errors.total.p_value >= CHANCE and not self.errors.named

    @property
    def document(self) -> dict[str, Any]:
        """drift.json: errors in mm and deg, and in their standard deviations."""
        return {
            "robocal": 1,
            "robot": self.name,
            "run": self.places[0],
            "truth": self.places[1],
            "verdict": {"consistent": self.consistent, **remark_fields(self.reasons, "reasons")},
            "groups": [plain(g) for g in self.groups],
            "parameters": [plain(p) for p in self.parameters],
            "far": list(self.errors.named),
            **remark_fields(self.remarks),
            "provenance": plain(provenance_of(self.command, self.inputs)),
        }


def compare_with_truth(run: Path, truth: Path, command: str = "") -> TruthComparison:
    """Compares a run folder with a robot file that holds the truth. Raises InputError where they are of different machines, or have
    nothing in common."""
    found = open_calibration(run)
    true = _open_truth(truth, found.opened)
    table, identified = true.machine.table, found.identified
    names = tuple(n for n in identified if n in table and n in found.known.total.names)
    if true.file.convention != found.opened.file.convention or not names:
        raise ModelError(
            "the truth is of another robot", key=str(truth), found=f"{true.machine.name} ({true.file.convention})",
            expected=f"{found.opened.machine.name} ({found.opened.file.convention}), as in {run}",
        )  # fmt: skip
    own = found.opened.machine.table
    errors = compare_truth(own, table, found.known.total, names)
    remarks = [*found.opened.warnings, *verdict_remarks(found.run.result, str(run))]
    held = [n for n in own.names if n in table and n not in found.known.total.names]
    off = np.abs(step_between(table, own, held)) > SAME
    if fixed := tuple(n for n, differs in zip(held, off, strict=True) if differs):
        remarks.append(Remark.of(Code.TRUTH_HELD, names=fixed))
    if missing := tuple(n for n in identified if n not in names):
        remarks.append(Remark.of(Code.NOT_COMPARED, names=missing))
    return TruthComparison(
        name=str(found.opened.machine.name), errors=errors, places=(str(run), str(truth)), reasons=_reasons(errors),
        warnings=tuple(dict.fromkeys(remarks)), inputs=(*found.files, InputFile(truth, read_text(truth).sha256)), command=command,
    )  # fmt: skip


def _reasons(errors: TruthErrors) -> tuple[Remark, ...]:
    """Whether errors are what their standard deviations say."""
    whole, named = errors.total, errors.named
    code = Code.TRUTH_MISSED if whole.p_value < CHANCE else Code.TRUTH_MET
    size = {"within": whole.within, "n": whole.n, "chi2": whole.chi2, "rank": whole.rank}
    first = Remark.of(code, **size, chance=whole.p_value)
    return (first, Remark.of(Code.TRUTH_MISSED_BY, names=named)) if named else (first,)


def _open_truth(place: Path, like: Opened[Any]) -> Opened[Any]:
    """The machine of a file that holds the truth; the links of a URDF are those of the run."""
    if find_run(place) is not None:
        raise FileError(
            "this is the calibrated robot of a run, and no truth", file=place,
            expected=f"truth.yaml, as robocal simulate writes it; two runs are compared by their folders ({RESULT})",
        )  # fmt: skip
    links = ("", "") if like.arm is None else (like.arm.root, like.arm.tip)
    base, tip = (link or None for link in links)
    return open_machine(place, base=base, tip=tip)


def truth_sections(found: TruthComparison, written: Sequence[Path] = ()) -> Iterator[Section]:
    """The errors by group, and the parameters that are farthest from the truth."""
    yield Section.of(
        "",
        Text.of((found.name, "strong"), f"   {found.places[0]} beside {found.places[1]}"),
        *(Text.of(reason, indent=2) for reason in sentences(found.reasons)),
    )
    units = [size.unit for size in found.groups[0].sizes]
    sizes = [f"{what} [{unit}]" for unit in units for what in ("rms", "σ")]
    columns = ("group", "n", *sizes, "chi2", "of", "chance", "within 2σ")
    yield Section.of(
        "",
        table(
            *columns, right=range(1, len(columns)), rows=[_row(g, units) for g in found.groups],
            styles=[_style(g.p_value) for g in found.groups],
        ),
        *quiet(
            "σ: rms of the standard deviations; chi2: squares of the errors in their σ, with what they have in common",
            "chance: of as large a chi2 where the standard deviations are right",
        ),
        title="Errors by group", key="groups",
    )  # fmt: skip
    worst = sorted(found.parameters, key=lambda p: -abs(p.sigmas))
    rows: list[tuple[Cell, ...]] = []
    for p in worst:
        values = figure(p.truth, 6), figure(p.identified, 6), f"{p.error:+.3g}", figure(p.sigma, 2), p.unit
        rows.append((p.name, *values, f"{p.sigmas:+.3g}", f"{p.p_of_all:.1g}"))
    styles = [_style(p.p_of_all) for p in worst]
    heads = ("parameter", "truth", "identified", "error", "σ", "unit", "in σ", "chance of all")
    lines = [f"... and {len(rows) - TEN} more in --json"] if len(rows) > TEN else []
    lines.append("chance of all: of so many σ in any parameter, after looking at every one")
    yield Section.of(
        "", table(*heads, right=(1, 2, 3, 4, 6, 7), rows=rows[:TEN], styles=styles[:TEN]), *quiet(*lines),
        title="Parameters farthest from the truth", key="parameters",
    )  # fmt: skip
    yield from ends(found.remarks, written)


def _style(chance: float) -> Style:
    return "bad" if chance < CHANCE else ""


def _row(group: GroupErrors, units: list[str]) -> tuple[Cell, ...]:
    sizes = {size.unit: (figure(size.rms, 3), figure(size.sigma, 3)) for size in group.sizes}
    cells = [cell for unit in units for cell in sizes.get(unit, ("", ""))]
    within = f"{group.within} of {group.n}"
    return (group.group, str(group.n), *cells, figure(group.chi2, 3), str(group.rank), f"{group.p_value:.2g}", within)

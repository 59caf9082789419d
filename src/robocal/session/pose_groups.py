"""Groups of errors by their means and standard deviations: the analysis of variance that `verify --summary` tells."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robocal._record import record
from robocal.apply.verification import Anova, anova
from robocal.files.csvtable import read_csv
from robocal.files.parts import provenance_of
from robocal.files.text import InputFile
from robocal.files.units import parse_unit
from robocal.files.verification import SummaryDocument
from robocal.quantities import Column, Listing
from robocal.session.verified_poses import PoseComparison

__all__ = ["AnovaResult", "summarise_groups"]


@record(kw_only=True, eq=False)
class AnovaResult(PoseComparison):
    """Groups by their means and standard deviations, and the analysis of variance of every quantity."""

    groups: tuple[str, ...]
    means: Listing
    anova: dict[str, Anova]

    @property
    def document(self) -> SummaryDocument:
        """What --json says."""
        origin = provenance_of(self.command, self.inputs)
        return SummaryDocument(groups=self.groups, means=self.means, anova=self.anova, provenance=origin)


def summarise_groups(place: str, command: str = "") -> AnovaResult:
    """An analysis of variance from a CSV of groups: `group`, `n`, and for every quantity `NAME_mean` and `NAME_sd`. Raises
    InputError."""
    table = read_csv(place)
    names = [str(n) for n in table.names]
    quantities = [n[: -len("_mean")] for n in names if n.endswith("_mean")]
    for need in ("group", "n", *(f"{q}_sd" for q in quantities), *(() if quantities else ("NAME_mean",))):
        if need not in names:
            raise table.fail("a column is missing", None, need, expected="group, n, NAME_mean, NAME_sd")
    counts = table.numbers(["n"])[:, 0]
    whole = (counts >= 2) & (counts == np.round(counts))
    table.insist(whole, ["n"], "not a count", counts, expected="a whole number, 2 or more")
    groups = tuple(str(g) for g in table.texts("group"))
    for i, name in enumerate(groups):
        if name in groups[:i]:
            raise table.fail("a group is named twice", i, "group", found=name, expected="one row for each group")
    if len(groups) < 2:
        raise table.fail("one group alone cannot be compared", None, "group", found=len(groups), expected="2 or more")
    found, columns = {}, [Column("group", "", groups), Column("n", "", counts.astype(int))]
    for q in quantities:
        both = [f"{q}_mean", f"{q}_sd"]
        factor = [1.0 if (u := table.unit(c)) is None else parse_unit(u, file=place, column=c).factor for c in both]
        if len({table.unit(c) is None for c in both}) > 1:
            message, unit = "one of two columns has a unit", str(table.unit(both[1]))
            raise table.fail(message, None, both[1], found=unit, expected="both, or neither")
        mean, spread = (table.numbers(both) * np.array(factor)).T
        unit = table.unit(both[0]) or ""
        columns += [Column(c, unit, v / factor[0]) for c, v in zip(both, (mean, spread), strict=True)]
        table.insist(spread >= 0, [f"{q}_sd"], "a standard deviation is not negative", spread, expected="0 or above")
        found[q] = anova(mean.tolist(), spread.tolist(), counts.astype(int).tolist())
    read = (InputFile(Path(place), table.sha256),)
    return AnovaResult(groups=groups, means=Listing(tuple(columns)), anova=found, inputs=read, command=command)

"""The verdict: a fold over what checks found and the gain on unseen measurements.

Findings speak against a gain in the order in which they were found, and the last one is reported first:

    refuse     refused, whatever the gain
    qualify    not improved; or improved where it was measured, for a finding that names a region
    note       reported after the gain
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

from robocal._record import record, replace
from robocal.diagnose.check_registry import DIAGNOSE, PROVE, Finding, Level, When, run
from robocal.measure.machine import Model
from robocal.prove.decision import REGION, Decision
from robocal.prove.evidence import Gain
from robocal.prove.region import range_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Verdict", "fold", "verdict_of"]


@record
class Verdict:
    """improved, located (frames alone), not_improved or refused, with the reasons; `region` says where an improvement holds: working
    or measured."""

    status: str
    reasons: tuple[Remark, ...]
    region: str | None = None

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """The reasons, each once."""
        return tuple(dict.fromkeys(self.reasons))

    def instead(self, status: str, *why: Remark) -> Verdict:
        """Another status: these reasons first, and a gain that was proven is only mentioned, for nobody should act on it."""
        gains = (Code.GAIN_PROVEN, Code.GAIN_NOT_PROVEN, Code.EXACT, Code.FRAMES_LOCATED)
        rest = (replace(r, code=Code.GAIN_ANYWAY) if r.code in gains[:2] else r for r in self.reasons)
        return Verdict(status, (*why, *(r for r in rest if r.code not in gains)))


def fold(findings: Iterable[Finding], gain: Gain | None) -> Verdict:
    """The verdict of findings in the order in which they were found; `gain` is None where none could be computed."""
    verdict = Verdict("not_improved", ())
    if gain is not None:
        verdict = Verdict(gain.status if gain.proven else "not_improved", (gain.remark,), gain.region)
    for _, some in groupby(findings, key=lambda f: (f.check, f.level)):
        group = list(some)
        remarks = tuple(f.remark for f in group)
        if group[0].level is Level.REFUSE:
            verdict = verdict.instead("refused", *remarks)
        elif group[0].level is Level.QUALIFY and "region" not in group[0].numbers:
            verdict = verdict.instead("not_improved", *remarks)
        else:
            region = "measured" if group[0].level is Level.QUALIFY else verdict.region
            verdict = replace(verdict, reasons=(*verdict.reasons, *remarks), region=region)
    return verdict


def verdict_of(context: Decision[Model], *, over_range: bool = True) -> Verdict:
    """Whether the model improved, with the reasons: all checks of unseen measurements and of a gain. `over_range` asks where the
    correction holds as well, which changes no status; frames alone correct nothing."""
    over_range = over_range and REGION not in context.silent
    unseen = run(When.UNSEEN, context, DIAGNOSE, PROVE)
    skipped = (*context.silent, *(() if over_range else (REGION,)))
    findings = [*unseen, *run(When.PROOF, context, DIAGNOSE, PROVE, found=unseen, skip=skipped)]
    gain = None if unseen else context.gain
    if gain is not None and gain.proven and over_range and range_of(context) is not None:
        gain = replace(gain, region="working")
    return fold(findings, gain)

"""One change of the data, or another chain of the robot's file, that explains what the nominal machine does not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from robocal.diagnose.check_registry import Finding, Given, Machines, When, check, doubt, once, refuse
from robocal.diagnose.hypotheses.explain import Explanation, assess_misfit, explain
from robocal.diagnose.hypotheses.reading import OtherChain, ReadContext
from robocal.diagnose.hypotheses.remounted import find_remount
from robocal.measure.machine import Mechanism
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["CHANGED", "Mistake", "mistake", "one_change", "remounted_targets"]

CHANGED = declare(
    "one-change-explains",
    "one change of the data explains what the nominal model leaves: with that, it falls from {stated:.3g} to {left:.3g}",
    "Make that change.",
)


@dataclass(frozen=True)
class Mistake:
    """What explains the data: changes, or other chains; what is left as stated and with the best of them (m)."""

    explanation: Explanation | None
    others: Sequence[OtherChain]
    stated: float
    best: float


@once
def mistake(context: ReadContext[Mechanism]) -> Mistake | None:
    """What explains a misfit that asks for it; None where nothing does."""
    assert context.changes is not None
    asked = assess_misfit(context.model, context.need_data)
    if asked is None:
        return None
    found = explain(context.model, context.need_data, context.changes(), asked)
    others = () if context.others is None else context.others(asked)
    best = min([o.left for o in others] + ([found.left] if found else []), default=None)
    return None if best is None else Mistake(found, others, asked.stated, best)


@check("one-change", When.READ, order=30, machines=Machines.JOINTED, given=Given.ACCEPTED, needs=("data", "changes"))
def one_change(context: ReadContext[Mechanism]) -> Iterator[Finding]:
    """A mistake that explains the data; what it is, the context remembers."""
    found = mistake(context)
    if found is not None:
        yield refuse(CHANGED, stated=Quantity(found.stated), left=Quantity(found.best))


@check("remounted", When.READ, order=40, machines=Machines.JOINTED, given=Given.ACCEPTED, needs=("data", "changes"))
def remounted_targets(context: ReadContext[Mechanism]) -> Iterator[Finding]:
    """A target that was put on anew between files; refused where that alone explains what no making leaves."""
    found = find_remount(context.model, context.need_data)
    if found is None:
        return
    files = tuple(s.replace("\\", "/").rpartition("/")[2] for s in found.sources)
    amounts = {"together": Quantity(found.together), "apart": Quantity(found.separate)}
    yield (refuse if found.alone else doubt)(Code.REMOUNTED, target=found.target, files=files, **amounts)

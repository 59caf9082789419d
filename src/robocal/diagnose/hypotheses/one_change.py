"""One change of the data, or another chain of the robot's file, that explains what the nominal machine does not.

A target that was put on anew between files may be worth a place of its own for each. The nominal model, softly held, is fitted
twice: with one place of the target on the tool for all files, and with one for each. What the second leaves less is what it is
worth. By chance F - 1 more places explain next to nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._record import record, replace
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Finding, Given, Machines, When, check, doubt, once, refuse
from robocal.diagnose.hypotheses.explain import Explanation, assess_misfit, explain, finite_sights, left_softly
from robocal.diagnose.hypotheses.lockstep import reach_of
from robocal.diagnose.hypotheses.reading import OtherChain, ReadContext
from robocal.diagnose.hypotheses.sights import rows_of, taken, usable
from robocal.measure.data import DataSet
from robocal.measure.machine import Mechanism
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["CHANGED", "Mistake", "find_remount", "mistake", "one_change", "remounted_targets"]

CHANGED = declare(
    "one-change-explains",
    "one change of the data explains what the nominal model leaves: with that, it falls from {stated:.3g} to {left:.3g}",
    "Make that change.",
)


@record
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
    others = () if context.others is None else context.others(asked, False)
    found = explain(context.model, context.need_data, context.changes(), asked, alone=bool(others))
    if found is None and not others and context.others is not None:
        others = context.others(asked, True)
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
    yield from () if found is None else (found,)


def find_remount(chain: Mechanism, data: DataSet) -> Finding | None:
    """Whether the one target that several files share was put on anew between them, by the median errors with one place and with several.
    None where it was not, or nobody can tell."""
    shared = [o for o in data.observations if usable(o)]
    sources = tuple(dict.fromkeys(o.source for o in shared))
    names = {t.name for o in shared for t in o.targets} or {"tool"}
    alike = len({bool(o.targets) for o in shared}) == 1 and all(o.frame and o.frame.mount == "base" for o in shared)
    if not 2 <= len(sources) <= limits.REMOUNT_FILES or len(names) != 1 or not alike:
        return None
    chosen = rows_of(data)
    if chosen is None:
        return None
    small = taken(data, chosen)
    one = finite_sights(chain, small)
    if one is None or one.places < limits.HYPOTHESIS_PLACES or not one.things_free[0, :3].any():
        return None
    each = np.concatenate([np.full(len(o), sources.index(o.source)) for o in small.observations if usable(o)])
    things, free = np.repeat(one.things, len(sources), axis=0), np.repeat(one.things_free, len(sources), axis=0)
    several = replace(one, thing=each[None], things=things, things_free=free)
    with np.errstate(all="ignore"):
        together, apart = (left_softly(chain, s) for s in (one, several))
    if together <= limits.REMOUNT_WORTH * apart or together - apart <= limits.REMOUNT_LEAST:
        return None
    making = limits.MAKING_LEAVES * reach_of(chain, one)
    alone = apart <= making < together and limits.EXPLAINED_CLEARLY * apart <= together
    files = tuple(s.replace("\\", "/").rpartition("/")[2] for s in sources)
    amounts = {"together": Quantity(together), "apart": Quantity(apart)}
    return (refuse if alone else doubt)(Code.REMOUNTED, target=names.pop(), files=files, **amounts)

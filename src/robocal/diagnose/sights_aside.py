"""Sights of one target that were set aside whole, where its other sights and other targets of the same views were not: it stood elsewhere
there, or it was another one. Too few sights for a step (`frame_steps`), and each is told by itself.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.diagnose.frame_step_checks import frame_steps
from robocal.diagnose.limits import VIEW_FAR
from robocal.measure.base import kind_of
from robocal.measure.data import Observations
from robocal.measure.machine import Model
from robocal.remarks.english import declare

__all__ = ["SIGHTS_ASIDE"]

SIGHTS_ASIDE = declare(
    "sights-aside",
    "{target} of {instrument} does not fit its place in {count} of {total} views ({views}), in which other targets do",
    "Look whether it moved, was covered, or was taken for another one. Leave these views out (--exclude {views}), or give it another "
    "name there.",
)


@check("sights-aside", When.FIT, order=236, needs=("data", "fit"))
def sights_aside(context: Context[Model]) -> Iterator[Finding]:
    """Every target of which some sights were set aside whole, if no step of it is told."""
    told = {str(f.remark.numbers.get("what", "")).rpartition(" ")[2] for f in frame_steps(context)}
    ids = context.need_data.configurations.ids
    for obs in context.need_data.observations:
        if not kind_of(obs).views or obs.used is None or obs.target is None:
            continue
        for name, aside, total in _whole(obs):
            if name not in told:
                views = tuple(ids[c] for c in aside)
                yield doubt(SIGHTS_ASIDE, target=name, instrument=obs.label, count=len(aside), total=total, views=views)


def _whole(obs: Observations) -> Iterator[tuple[str, list[int], int]]:
    """Targets, the configurations in which all their corners were set aside beside others that were not, and how many show them."""
    assert obs.used is not None and obs.target is not None
    many = int(obs.configuration.max()) + 1
    out, every = (np.zeros((len(obs.targets), many), dtype=np.int64) for _ in range(2))
    np.add.at(every, (obs.target, obs.configuration), 1)
    np.add.at(out, (obs.target, obs.configuration), (~obs.used).astype(np.int64))
    good = out.sum(axis=0) <= VIEW_FAR * every.sum(axis=0)
    whole = (every > 0) & (out == every) & good
    for i, target in enumerate(obs.targets):
        if whole[i].any() and not whole[i][every[i] > 0].all():
            yield target.name, np.flatnonzero(whole[i]).tolist(), int((every[i] > 0).sum())

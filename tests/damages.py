"""Every way to spoil a data set that robocal names, and what undoes each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.diagnose.hypotheses.changes import Change, What, changes

RIGHT = np.pi / 180


def units(chain, data, small):
    """What undoes deg and mm that were read as rad and m, or the other way round."""
    angle, length = (RIGHT, 1e-3) if small else (1 / RIGHT, 1e3)
    sources = {o.source for o in data.observations}
    return dict.fromkeys(sources, (angle,) * len(chain.joints)), dict.fromkeys(sources, (length,) * 3)


def every(chain, data):
    """All changes, whichever of the units is stated."""
    return [
        *changes(chain, data, *units(chain, data, True)),
        *(c for c in changes(chain, data, *units(chain, data, False)) if c.what in (What.JOINT_UNIT, What.LENGTH_UNIT)),
    ]


def tried(chain, data, damage):
    """What would be tried with a file that states its units as the damaged one does."""
    return changes(chain, data, *units(chain, data, not damage.factors or damage.factors[0] > 1))


def undone(change: Change) -> Change:
    """The change that undoes another one."""
    if change.what in (What.ZERO, What.SHIFT, What.WITH):
        turn = -change.amount if not np.isclose(abs(change.amount), np.pi) else change.amount
        return replace(change, amount=turn)
    if change.what in (What.JOINT_UNIT, What.LENGTH_UNIT):
        return replace(change, factors=tuple(1 / f for f in change.factors))
    if change.what == What.AXES:
        order = np.argsort(change.at)
        return replace(change, at=tuple(int(i) for i in order), signs=tuple(change.signs[i] for i in order))
    return change


def same(a, b):
    return (a.what, a.at, a.signs) == (b.what, b.at, b.signs) and np.allclose(
        (a.amount, *a.factors), (b.amount, *b.factors)
    )


def words(change):
    return f"{change.what.value} {change.at} {change.amount:.4g} {change.signs or change.factors}"

"""What one camera sees of several targets: where it stands to what carries them is computed once for all.

T_camera_target = T_camera_carrier(configuration) T_carrier_target: what moves the first moves all targets alike, so that what their
points say of it is added before it meets the many columns of a machine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Ints
from robocal.measure.builder import Builder
from robocal.measure.carriers import Carrier
from robocal.measure.data import Observations

__all__ = ["SharedView", "SightEdges", "sights_of", "views_of"]


@record(eq=False)
class SharedView:
    """T_camera_carrier at some configurations, (V,) ascending."""

    carrier: Carrier
    configuration: Ints
    memo: dict[object, SharedView] = field(default_factory=dict, repr=False)

    def bind(self, column_of: Ints) -> SharedView:
        """The same with Jacobian columns for the free table rows: one object for all that ask."""
        key = column_of.tobytes()
        if key not in self.memo:
            self.memo[key] = replace(self, carrier=self.carrier.bind(column_of), memo={})
        return self.memo[key]

    def hold(self, family: int) -> SharedView:
        """The same, where the blocks of a family stay where x has them."""
        if family not in self.memo:
            self.memo[family] = replace(self, carrier=self.carrier.hold(family), memo={})
        return self.memo[family]


@record
class SightEdges:
    """Rows (m,) in the order of views: rows edges[s] to edges[s + 1] show one target in one view, sights views[v] to views[v + 1]
    are those of one view, and seat (S,) says which target a sight shows."""

    edges: Ints
    views: Ints
    seat: Ints


def sights_of(view: Ints, seat: Ints) -> SightEdges:
    """Of rows whose view and target, (m,) each, ascend."""
    new = np.append(True, (np.diff(view) != 0) | (np.diff(seat) != 0))
    edges = np.flatnonzero(np.append(new, True))
    views = np.searchsorted(view[edges[:-1]], np.arange(view[-1] + 2))
    return SightEdges(edges, views, np.ascontiguousarray(seat[edges[:-1]]))


def views_of(builder: Builder, obs: Observations, parts: Sequence[tuple[int, Ints]]) -> list[SharedView | None]:
    """The view that each part of the rows, a target and its rows, has in common with other ones; None where it has none."""
    out: list[SharedView | None] = [None] * len(parts)
    mounts = [
        "" if builder.blocks(obs, t, index) is not None or not obs.targets else obs.targets[t].mount
        for t, index in parts
    ]
    for mount in set(mounts) - {""}:
        mine = [i for i, other in enumerate(mounts) if other == mount]
        if len(mine) > 1:
            where = np.unique(np.concatenate([obs.configuration[parts[i][1]] for i in mine]))
            view = SharedView(builder.sight(obs, obs.targets[parts[mine[0]][0]], where, []), where)
            for i in mine:
                out[i] = view
    return out

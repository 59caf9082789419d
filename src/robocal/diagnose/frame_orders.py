"""Whether errors of the machine look like a step: where views scatter by more than their noise, their order has to prove it.

Views of a machine that errs are off by as much as the machine is, each in its own way. Some order of them then gains much by a step, and so
does the order of a joint, along which errors change slowly. A frame that moved gains in the order of time, and hardly in any other.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.measure.data import Configurations

__all__ = ["order_proves"]

ORDERS = 100  # grid: random orders of views
OFTEN = 95.0  # grid: %, of these orders


def order_proves(gains: Callable[[Ints], Array], seen: Ints, configurations: Configurations, slow: bool) -> bool:
    """Whether the order of time tells a step; `gains` tells those of an order (m,) of configurations `seen` (m,). `slow` asks the orders of
    joints too: whether errors that change slowly along one of them would explain it."""
    rng, m = np.random.default_rng(0), len(seen)
    most = np.nanmax(gains(np.arange(m)))
    if np.percentile([np.nanmax(gains(rng.permutation(m))) for _ in range(ORDERS)], OFTEN) > most:
        return False
    axes = (configurations.starts if configurations.joints is None else configurations.joints)[seen]
    along = [np.nanmax(gains(np.argsort(axis, kind="stable"))) for axis in axes.T if slow and np.ptp(axis) > 0]
    return bool(max(along, default=0.0) < limits.SEGMENT_RIVAL * most)

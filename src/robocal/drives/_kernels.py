"""The cogging of one motor at one angle, compiled, for kernels that step a motor; `drives.cogging` says the formula."""

from __future__ import annotations

import math

from robocal._jit import kernel


@kernel(inline=True)
def cogging_at(angle, direction, orders, cosine, sine, lag):
    """Torque at an angle (rad) moved to in a direction (1, -1, or 0 where no lag is wanted); orders, cosine, sine (n,)."""
    at = angle - direction * lag
    out = 0.0
    for i in range(len(orders)):
        out += cosine[i] * math.cos(orders[i] * at) + sine[i] * math.sin(orders[i] * at)
    return out

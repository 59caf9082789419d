"""Poses of a platform whose cables count from nobody knows where: they start where the anchors are that the lengths ask for.

Asked only where poses, as an instrument saw them, and lengths contradict each other from any zero.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._types import Array, Bools
from robocal.fit.limits import START_ASKS, START_CLEARLY, START_POSES
from robocal.geometry import fits, se3
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, freedom_of

__all__ = ["begin_zeros", "replace_by_anchors"]

KINDS = ("pose", "position")


Seen = Callable[[Observations], tuple[Array, Array | None]]


def replace_by_anchors(model: Model, data: DataSet, start: Array, lacking: Bools, seen_by: Seen) -> Array:
    """The start (U, 6) with those that were `lacking` (U,) placed anew where lengths and what an instrument saw contradict each other.

    `seen_by` gives T_base_tool (U, 4, 4) as an observation of poses has it, with its frame as stated; of one of positions a frame at the
    target, and where on the tool that is (3,).
    """
    watched = [o for o in data.observations if o.kind in KINDS and o.frame is not None and o.frame.mount == "base"]
    drawn = [o for o in data.observations if o.kind == "lengths"]
    if not watched or not drawn or not lacking.any():
        return start
    from robocal.measure.anchor_start import machine_size, place_by_anchors, without_turns, zero_spread

    out, least = np.array(start), START_ASKS * machine_size(model)
    for obs in watched:
        seen, point = seen_by(obs)
        known = np.isfinite(seen[:, 0, 0])
        if known.sum() < START_POSES:
            continue
        free = obs.frame is not None and all(obs.frame.free)
        here = se3.from_vector(out)
        as_stated = seen if point is None else without_turns(seen, point)
        begun = as_stated
        if free:
            begun = here if point is not None else fits.rigid(seen[known, :3, 3], here[known, :3, 3]) @ seen
        for lengths in drawn:
            left = zero_spread(model, lengths, begun)
            if left <= least and free:
                continue
            placed = place_by_anchors(model, lengths, seen, point) if free else as_stated
            if placed is not None and zero_spread(model, lengths, placed) < START_CLEARLY * left:
                vector = se3.to_vector(placed[known & lacking])
                vector[:, [i for i in range(6) if i not in (freedom_of(model) or ())]] = 0.0
                out[known & lacking] = vector
                break
    return out


def begin_zeros(model: Model, data: DataSet) -> dict[str, float]:
    """Where a robot's own zeros begin that are free and that nobody has said, where its platform stood at the starts of `data`; nothing
    where they are as the file has them, as near as any making leaves lengths."""
    drawn = [o for o in data.observations if o.kind == "lengths" and not o.options.get("zeros")]
    start, table = data.configurations.start, model.table
    if start is None or not drawn:
        return {}
    from robocal.measure.anchor_start import machine_size
    from robocal.measure.lengths import zeros_at

    unsaid = {n for n in table.free if n in model.anywhere and table[n].prior is None}
    found: dict[str, float] = {}
    for obs in drawn:
        known = np.asarray(np.isfinite(start).all(axis=1))
        index = np.flatnonzero(known[obs.configuration])
        zeros = zeros_at(model, obs, index, se3.from_vector(start[obs.configuration[index]]), own=True)
        found |= {n: v for n, v in zeros.items() if n in unsaid}
    off = [abs(v - table[n].value) for n, v in found.items()]
    return found if off and np.median(off) > START_ASKS * machine_size(model) else {}

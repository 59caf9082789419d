"""What a person would know of a rig beforehand: where a tracker stands is unknown, where a socket stands is measured with
a ruler."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.measure.data import DataSet, Frame

__all__ = ["hidden"]

ROUGH = (0.03, 0.03)  # how well a person with a ruler knows where something stands (m, rad)
# Instruments whose place is found from the data alone.
UNKNOWN = ("position", "pose")
FRAMED = ("position", "pose", "spherical", "bearing", "displacement", "pixels")


def hidden(data: DataSet, kind: str, scene: int = 7) -> DataSet:
    """The data as a person would hand them in: instruments stand anywhere, places are known to some centimetres."""
    rng = np.random.default_rng(scene)
    known: dict[str, Frame] = {}

    def shy(frame: Frame) -> Frame:
        if frame.name not in known:
            if frame.mount != "base" or not any(frame.free):
                known[frame.name] = frame
            elif kind in UNKNOWN:
                known[frame.name] = replace(frame, value=(0.0,) * 6)
            else:
                step = rng.normal(size=6) * np.repeat(ROUGH, 3) * np.array(frame.free)
                moved = np.array(frame.value) + step
                known[frame.name] = replace(
                    frame, value=tuple(float(v) for v in np.where(frame.free, np.round(moved, 2), frame.value))
                )
        return known[frame.name]

    out = []
    for obs in data.observations:
        options = dict(obs.options)
        if isinstance(place := options.get("place"), Frame):
            options["place"] = shy(place)
        if isinstance(ends := options.get("ends"), tuple):
            options["ends"] = tuple(shy(e) for e in ends)
        # Base coordinates are a frame that is known; a free one starts from nowhere, as for a real tracker.
        frame = shy(obs.frame) if obs.frame is not None else None
        if frame is None and kind in FRAMED:
            frame = Frame("world", free=(False,) * 6)
        out.append(replace(obs, frame=frame, options=options))
    return DataSet(data.configurations, tuple(out))

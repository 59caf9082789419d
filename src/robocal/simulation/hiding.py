"""A simulated data set as a user would hand it in: objects beside the robot have unknown places."""

from __future__ import annotations

from dataclasses import replace

from robocal.measure.data import DataSet, Frame

__all__ = ["hidden"]

NOWHERE = (0.0,) * 6
# Kinds whose instrument has a frame; without one it stands in base coordinates, which is a frame that is known.
FRAMED = ("position", "pose", "spherical", "bearing", "displacement", "pixels")


def hidden(data: DataSet) -> DataSet:
    """The data with the place of every frame that is to be found at zero."""
    out = []
    for obs in data.observations:
        options = dict(obs.options)
        if isinstance(place := options.get("place"), Frame):
            options["place"] = _unknown(place)
        if isinstance(ends := options.get("ends"), tuple):
            options["ends"] = tuple(map(_unknown, ends))
        frame = None if obs.frame is None else _unknown(obs.frame)
        if frame is None and obs.kind in FRAMED:
            frame = Frame("world", free=(False,) * 6)
        out.append(replace(obs, frame=frame, options=options))
    return DataSet(data.configurations, tuple(out))


def _unknown(frame: Frame) -> Frame:
    return replace(frame, value=NOWHERE) if frame.mount == "base" and any(frame.free) else frame

"""The cables that some observations are of, by their names."""

from __future__ import annotations

from robocal.errors import ModelError
from robocal.measure.data import Observations

__all__ = ["cable_names"]


def cable_names(obs: Observations, what: str) -> tuple[str, ...]:
    """The names of the cables that some observations state. Raises ModelError where they state none; `what` needs them."""
    names = obs.options.get("cables")
    if not isinstance(names, tuple) or not names:
        raise ModelError(f"{what} need the names of the cables", key=obs.label, expected="options['cables']")
    return names

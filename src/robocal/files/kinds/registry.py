"""The kinds of measurement that files can hold, by name: one line each. The module of a kind is loaded when the kind is met."""

from __future__ import annotations

from collections import UserDict
from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from typing import Any

from robocal.files.kinds.kind import KindFile
from robocal.measure.kinds import NAMES
from robocal.measure.machine import Model

__all__ = ["READERS", "reader_of", "readers_of"]

# The modules in this package that read and write several kinds; the name of a kind in capitals is its KindFile.
SEVERAL = {
    "pose": ("position", "pose", "displacement", "relative_pose"),
    "ranges": ("spherical", "bearing", "range", "distance"),
    "places": ("point", "plane", "sphere"),
}
# Kinds that the file of another one makes, and those of logs of drives, which `files/drive_log.py` reads.
TOGETHER = ("plane_targets", "current", "torque")
MODULES = {kind: module for module, kinds in SEVERAL.items() for kind in kinds} | {"pixels": "pixels"}
# Those of machines that have such parts alone.
OF_PARTS: dict[str, dict[str, str]] = {
    "cable": {
        "lengths": "lengths",
        "swivel": "lengths",
        "load": "lengths",
        "winches": "winch_currents",
        "inclination": "ranges",
    },
    "rope": {"sag": "loads", "elongation": "loads"},
}
# Those that no arm is simulated with yet.
NOT_SIMULATED = {"plane_points": "plane_points", "joint_torque": "torques_of_joints"}
# Whatever else is a kind has a module of its own name.
MODULES |= {
    name: name
    for name in NAMES
    if not any(name in own for own in (MODULES, NOT_SIMULATED, TOGETHER, *OF_PARTS.values()))
}


class Readers(UserDict[str, Any]):
    """Kinds by name, from the names of their modules."""

    def __getitem__(self, name: str) -> KindFile:
        found: KindFile = getattr(import_module(f"robocal.files.kinds.{self.data[name]}"), name.upper())
        return replace(found, name=name)


READERS = Readers(MODULES)


def reader_of(name: str) -> KindFile:
    """Any kind by its name, those of parts too."""
    return _readers(OF_PARTS)[name]


def readers_of(machine: Model) -> Readers:
    """The kinds by which a machine can be measured: some are of machines that have certain parts alone."""
    return _readers(machine.parts)


def _readers(parts: Iterable[str]) -> Readers:
    return Readers(
        {**MODULES, **NOT_SIMULATED, **{name: module for p in parts for name, module in OF_PARTS.get(p, {}).items()}}
    )

"""The kinds of measurement that files can hold, by name: one line each. The module of a kind is loaded when the kind is met."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module

from robocal.files.kinds.kind import KindFile
from robocal.measure.kinds import NAMES
from robocal.measure.machine import Model

__all__ = ["READERS", "reader_of", "readers_of"]

# The module in this package that reads and writes each kind; the name of the kind in capitals is its KindFile.
MODULES = {
    "position": "pose",
    "pose": "pose",
    "spherical": "angular",
    "bearing": "angular",
    "range": "range",
    "distance": "distance",
    "displacement": "pose",
    "relative_pose": "pose",
    "point": "contact",
    "plane": "contact",
    "sphere": "contact",
    "pixels": "pixels",
}
# Those of machines that have such parts alone.
OF_PARTS: dict[str, dict[str, str]] = {
    "cable": {"lengths": "lengths", "swivel": "lengths", "load": "lengths", "inclination": "angular"}
}
# Whatever else is a kind has a module of its own name.
MODULES |= {name: name for name in NAMES if not any(name in own for own in (MODULES, *OF_PARTS.values()))}


class Readers(Mapping[str, KindFile]):
    """Kinds by name, from the names of their modules."""

    def __init__(self, modules: Mapping[str, str]) -> None:
        self._modules = modules

    def __getitem__(self, name: str) -> KindFile:
        found: KindFile = getattr(import_module(f"robocal.files.kinds.{self._modules[name]}"), name.upper())
        return found

    def __contains__(self, name: object) -> bool:
        return name in self._modules

    def __iter__(self) -> Iterator[str]:
        return iter(self._modules)

    def __len__(self) -> int:
        return len(self._modules)


READERS = Readers(MODULES)


def reader_of(name: str) -> KindFile:
    """Any kind by its name, those of parts too."""
    return _readers(OF_PARTS)[name]


def readers_of(machine: Model) -> Readers:
    """The kinds by which a machine can be measured: some are of machines that have certain parts alone."""
    return _readers(machine.parts)


def _readers(parts: Iterable[str]) -> Readers:
    return Readers({**MODULES, **{name: module for p in parts for name, module in OF_PARTS.get(p, {}).items()}})

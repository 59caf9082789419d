"""Verbs called from tests, as the command line calls them: what each found."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from robocal.verbs.option import entries
from robocal.verbs.outcome import Outcome


def called(verb: str, **options: Any) -> Outcome:
    """What a verb hands back; words and paths may be either."""
    module = import_module(f"robocal.verbs.{verb}")
    told = {e.name: e for e in entries(module.Options)}
    given = {k: _as(told[k].kind, v) for k, v in options.items()}
    return module.run(module.Options(**given))


def _as(kind: type, value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(_as(kind, v) for v in value)
    if value is None:
        return None
    return Path(value) if kind is Path else os.fspath(value) if isinstance(value, Path) else value


def identify(robot: Any, data: Sequence[Any], options: Mapping[str, Any] | None = None, **more: Any) -> Any:
    """The outcome of an identification."""
    return called("identify", robot=robot, data=data, **(options or {}), **more).result


def validate(robot: Any, data: Sequence[Any], **more: Any) -> Any:
    """A validation."""
    return called("validate", robot=robot, data=data, **more).result


def simulate(robot: Any, output: Path, **more: Any) -> Any:
    """A simulation, in a folder."""
    return called("simulate", robot=robot, output=output, **more).result


def drift(first: Path, second: Path, **more: Any) -> Any:
    """Two runs compared."""
    return called("drift", first=first, second=second, **more).result


def predict(folder: Path, poses: Path, **more: Any) -> Any:
    """Predictions with their bands."""
    return called("predict", folder=folder, poses=poses, **more).result


def compensate(robot: Any, targets: Any, **more: Any) -> Any:
    """Corrected targets."""
    return called("compensate", robot=robot, targets=targets, **more).result


def export(robot: Any, **more: Any) -> Outcome:
    """A model in another form: `result` has text, notes and worth."""
    return called("export", robot=robot, **more)

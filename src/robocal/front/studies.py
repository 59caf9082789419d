"""A study from a mapping: what study.yaml says, with robots that a program opened and paths from where it runs."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robocal.errors import FormatError
from robocal.files.scratch import keep_file
from robocal.files.yamlio import mapping_text

__all__ = ["study_file"]

FILES = ("file", "tests")  # keys under `poses` that name files


def study_file(study: Mapping[str, Any]) -> str:
    """The path of a study.yaml with what a mapping says, in a folder of this call that stays until the program ends.

    Raises FormatError for what no file can hold."""
    made = {"robocal": 1, "kind": "study"} | dict(study)
    if "robot" in made:
        made["robot"] = _robot(made["robot"])
    poses = made.get("poses")
    if isinstance(poses, Mapping):
        made["poses"] = {k: _place(v) if k in FILES else v for k, v in poses.items()}
    sweep = made.get("sweep")
    if isinstance(sweep, Mapping):
        made["sweep"] = {k: _swept(k, v) for k, v in sweep.items()}
    try:
        return str(keep_file("study.yaml", mapping_text(made), alone=True))
    except TypeError as error:
        expected = "numbers, texts, lists, arrays and mappings, and a robot under robot"
        raise FormatError(
            "a value that no file can hold", argument="study", found=str(error), expected=expected
        ) from None


def _robot(given: Any) -> Any:
    """A robot that was opened by its file; a path from where the program runs; a name of the catalogue as it is."""
    opened = getattr(given, "opened", given)
    return _place(opened) if isinstance(opened, str | os.PathLike) else opened


def _place(given: Any) -> Any:
    if isinstance(given, str | os.PathLike) and Path(given).exists():
        return str(Path(given).resolve())
    return given


def _swept(key: str, values: Any) -> Any:
    """The values of one key of a sweep: of robots and files by their paths."""
    if key == "robot" and isinstance(values, list | tuple):
        return [_robot(v) for v in values]
    if key in {f"poses.{name}" for name in FILES} and isinstance(values, list | tuple):
        return [_place(v) for v in values]
    return values

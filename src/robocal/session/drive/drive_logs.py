"""The logs of one motor, or of several: by file, or by the names that motors have within files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from robocal.errors import ModelError
from robocal.files.drive_log import DriveLog, read_drive_logs

__all__ = ["MotorLogs", "folder_name", "logs_by_motor"]

MotorLogs = dict[str, tuple[DriveLog, ...]]


def logs_by_motor(o: Any) -> MotorLogs:
    """The logs of each motor by its name: with `o.each` every file is a motor of its own, and a file of several motors has theirs;
    otherwise all logs are of one. Raises InputError."""
    files = [read_drive_logs(p, o.columns) for p in o.logs]
    several = o.each or any(len(logs) > 1 for logs in files)
    found: dict[str, list[DriveLog]] = {}
    for logs in files:
        for log in logs:
            name = (log.motor.name or log.path.stem) if several else ""
            if o.each and name in found:
                expected = "a name for each, as motor: {name: ...} in its data file"
                raise ModelError("two motors have one name", key=str(log.path), found=name, expected=expected)
            found.setdefault(name, []).append(log.with_load(o.loaded))
    out = {name: tuple(logs) for name, logs in found.items()}
    for logs in out.values():
        _insist_one_motor(logs)
    folders = [folder_name(name) for name in out]
    if len(set(folders)) < len(folders):
        raise ModelError("two motors would have one folder", found=", ".join(out), expected="names that differ")
    return out


def folder_name(motor: str) -> str:
    """The name of a motor as that of its folder."""
    return re.sub(r"[^\w.-]+", "-", motor).strip("-.") or "motor"


def _insist_one_motor(logs: Sequence[DriveLog]) -> None:
    """Raises ModelError for logs that cannot be of one motor."""
    units = {log.sweep.unit for log in logs}
    if len(units) > 1:
        raise ModelError(
            "one motor has logs of torque and of current", found=" and ".join(sorted(units)), expected="one of them"
        )
    for i, log in enumerate(logs):
        again = next((o for o in logs[:i] if np.array_equal(o.sweep.effort, log.sweep.effort)), None)
        if again is not None:
            found = f"{again.path} and {log.path}"
            raise ModelError("two logs are the same", found=found, expected="every log once: twice it counts twice")
    known: dict[tuple[int | None, int | None], DriveLog] = {}
    for log in logs:
        known.setdefault((log.motor.slots, log.motor.poles), log)
    said = [k for k in known if any(k)]
    if len(said) > 1:
        found = ", ".join(str(known[k].path) for k in said)
        raise ModelError("the logs are of different motors", found=found, expected="one motor, or --each")

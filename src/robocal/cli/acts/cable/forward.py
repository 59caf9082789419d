"""The verb `cable forward`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE, UNTRUSTED
from robocal.cli.terminal import Terminal

__all__ = ["forward"]


def forward(*, robot: str, lengths: str, output: str | None, json: bool, **options: Any) -> int:
    """cable forward: the CSV on stdout, or a file; doubts on stderr."""
    terminal = Terminal(json=json)
    with terminal.watching():
        from robocal.jobs.cable.forward import cable_forward as job

        made = job(robot, lengths, output=None if output is None else Path(output), **options)
    for warning in (*made.warnings, *made.doubts):
        terminal.warn(warning)
    terminal.document(
        {
            "robot": made.robot.name,
            "poses": [
                {
                    "name": name,
                    "T_base_platform": made.found.pose[i],
                    "residual_m": made.rms[i],
                    "sigma_position_m": made.sigma[i, 0],
                    "sigma_orientation_rad": made.sigma[i, 1],
                    "covariance": made.found.covariance[i],
                    "converged": bool(made.found.converged[i]),
                    "solutions": int(made.found.solutions[i]),
                }
                for i, name in enumerate(made.names)
            ],
            "written": None if made.written is None else str(made.written),
            "warnings": [*made.warnings, *made.doubts],
        }
    )
    if not json:
        sys.stdout.write(made.text if made.written is None else f"{made.written}\n")
    return UNTRUSTED if made.doubts else DONE

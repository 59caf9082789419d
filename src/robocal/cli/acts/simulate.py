"""The verb `simulate`: measurements of an imperfect robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal.cli.guard import DONE
from robocal.cli.terminal import Terminal

__all__ = ["simulate"]


def simulate(*, robot: str, output: str, json: bool, **options: Any) -> int:
    """simulate: robot, data and truth in a folder."""
    terminal = Terminal(json=json)
    with terminal.watching() as watch:
        from robocal.jobs.simulate import simulate as job

        made = job(robot, Path(output), watch=watch, **options)
    terminal.document(
        {
            "robot": made.robot.name, "simulated": True, "kind": made.instrument.kind, "configurations": len(made.data.configurations),
            "seed": made.seed, "largest_error_mm": made.largest_error * 1e3, "written": [str(p) for p in made.written],
        }
    )  # fmt: skip
    if not json:
        count = len(made.data.configurations)
        terminal.say(
            f"Simulated {made.robot.name}: {count} configurations, the model is wrong by up to {made.largest_error * 1e3:.3g} mm."
        )
        for path in made.written:
            terminal.say(f"  {path}")
        names = {p.stem: p for p in made.written if p.suffix != ".csv"}
        terminal.say(f"Next: robocal identify {names['robot']} {names['data']}")
    return DONE

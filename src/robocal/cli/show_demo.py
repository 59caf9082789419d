"""The demo on the terminal: a story that is told while it happens."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from robocal.cli.show import errors_table, indented, verdict_line
from robocal.cli.terminal import Terminal

__all__ = ["show_demo"]


def show_demo(terminal: Terminal, name: str | None, output: Path, seed: int) -> bool:
    """Runs the demo and tells it; true when every case came out as it should."""
    from rich.rule import Rule
    from rich.text import Text

    begun = time.monotonic()
    told: list[dict[str, Any]] = []
    good = True
    with terminal.watching() as watch:
        from robocal.jobs.demo import demo

        last = None
        for case, finding in demo(name, output, seed=seed, watch=watch):
            watch.rest()
            if case is not last:
                label = "simulated" if case.simulated else "real measurements"
                terminal.show(
                    Rule(Text.assemble((case.title, "bold"), f"  ({label})"), align="left", characters="─"),
                    Text(case.story),
                    Text(""),
                )
                last = case
            result = finding.outcome.result
            good &= finding.ok
            folder = finding.outcome.written[0].parent
            told.append(
                {
                    "case": case.name, "simulated": case.simulated, "title": finding.title, "expected": finding.expected, "ok": finding.ok,
                    "verdict": result.verdict.model_dump(), "residuals": result.residuals.model_dump(), "facts": list(finding.facts),
                    "folder": str(folder), "command": finding.repeat,
                }
            )  # fmt: skip
            if terminal.json:
                continue
            terminal.show(Text(finding.title, style="bold italic"))
            if finding.expected in ("improved", "refused"):
                terminal.show(verdict_line(result.verdict.status, result.verdict.reasons))
            made = errors_table(result.residuals, "error")
            if made is not None:
                terminal.show(made)
            terminal.show(*indented(*finding.facts))
            mark = (
                Text("  as it should be", style="green")
                if finding.ok
                else Text(f"  NOT as it should be: {finding.expected}", style="bold red")
            )
            terminal.show(
                mark,
                Text(
                    f"  report: {folder / 'report.html'}"
                    if (folder / "report.html").exists()
                    else f"  files: {folder}",
                    style="dim",
                ),
            )
            terminal.show(Text(f"  again:  {finding.repeat}", style="dim"), Text(""))
    seconds = time.monotonic() - begun
    terminal.document({"ok": good, "seconds": round(seconds, 2), "folder": str(output), "cases": told})
    if not terminal.json:
        terminal.show(Rule(characters="─"))
        words = "Every case came out as it should" if good else "NOT every case came out as it should"
        terminal.show(
            Text(
                f"{words}, in {seconds:.1f} s. Robots, data and reports are in {output}/",
                style="bold green" if good else "bold red",
            )
        )
        terminal.show(
            Text("Your own robot: robocal new ROBOT -o FOLDER; robocal check ...; robocal identify ... -o run")
        )
    return good

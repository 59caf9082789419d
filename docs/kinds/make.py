"""Draws the rigs of these pages and measures their numbers, both in simulation with fixed seeds.

    python docs/kinds/make.py figures            SVG files beside this one
    python docs/kinds/make.py numbers [KIND...]  the block between the two marks of every page (some minutes)

A number is the median over seeds of the mean error of the tool's place on fresh poses, after the best rigid fit, against
the true robot: what the calibration is worth, whatever the instrument could read.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.arms import catalog
from robocal.arms.chain import Chain
from robocal.errors import InputError
from robocal.files.kinds.registry import READERS
from robocal.fit.options import Options
from robocal.geometry import fits
from robocal.prove.identify import identify
from robocal.session.simulated_robot import Errors, sample_joints
from robocal.session.simulator import true_model
from robocal.simulation.rigs import FINE, Instrument, hidden, measure

HERE = Path(__file__).parent
ARMS = {"irb-120": "six axes (IRB 120)", "fr3": "seven axes (FR3)"}
COUNTS, SEEDS = (10, 20, 40, 80), range(5)
START, END = "<!-- measured by make.py -->", "<!-- end -->"
BARE = Options(hold_out=0.0, leave_one_out=False)


def tool_error(model: Chain, truth: Chain) -> float:
    """Mean distance (mm) of two arms' tools on 300 poses after the best rigid fit."""
    q = sample_joints(truth, 300, np.random.default_rng(99))
    a, b = model.pose(q)[:, :3, 3], truth.pose(q)[:, :3, 3]
    t = fits.rigid(a, b)
    return float(np.linalg.norm(a @ t[:3, :3].T + t[:3, 3] - b, axis=1).mean() * 1e3)


def trial(kind: str, arm: str, poses: int, seed: int):
    """Nominal arm, true arm, and what was identified from so many poses; None where it could not be."""
    nominal = catalog.get(arm)
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3)]
    truth = true_model(nominal, nominal.geometric, Errors(), streams[0])
    q = sample_joints(nominal, poses, streams[1])
    data = hidden(measure(truth, q, Instrument(kind, angle_noise=FINE.get(kind, 1e-4)), streams[2]))
    try:
        # As a robot file has it: base held, tool free.
        return nominal, truth, identify(free(nominal), data, BARE)
    except InputError:
        return nominal, truth, None


def free(arm: Chain) -> Chain:
    """All geometry free, and the tool."""
    names = [*arm.geometric, *(f"tool.{s}" for s in ("x", "y", "z", "rx", "ry", "rz"))]
    return replace(arm, table=arm.table.with_free(set(names)))


def block(kind: str) -> str:
    """The measured part of a page."""
    lines = []
    for arm, words in ARMS.items():
        _, _, found = trial(kind, arm, 80, 0)
        if found is None:
            lines.append(f"- **{words}**: not identifiable from 80 poses.")
            continue
        seen = found.identifiability
        chain = {n for n in seen.dropped if n in found.nominal.table}
        dropped = [n for n in seen.dropped if n in chain]
        text = ", ".join(f"`{n}`" for n in dropped) or "none"
        lines.append(
            f"- **{words}**, 80 poses: {seen.rank} of {len(seen.names)} free parameters are observable. Dropped of the robot: {text}."
        )
    lines += ["", "| poses | " + " | ".join(str(n) for n in COUNTS) + " |", "|---|" + "---|" * len(COUNTS)]
    for arm, words in ARMS.items():
        before = np.median([tool_error(*trial_arms(arm, s)) for s in SEEDS])
        cells = []
        for poses in COUNTS:
            errors = []
            for seed in SEEDS:
                _, truth, found = trial(kind, arm, poses, seed)
                errors.append(np.inf if found is None else tool_error(found.corrected, truth))
            cells.append(f"{np.median(errors):.2g}" if np.isfinite(np.median(errors)) else "none")
        lines.append(f"| {words}, before {before:.2g} mm | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def trial_arms(arm: str, seed: int) -> tuple[Chain, Chain]:
    """Nominal and true arm of a seed."""
    nominal = catalog.get(arm)
    return nominal, true_model(
        nominal, nominal.geometric, Errors(), np.random.default_rng(np.random.SeedSequence(seed).spawn(3)[0])
    )


def put(kind: str) -> None:
    """Writes the measured block into a page."""
    page = HERE / f"{kind}.md"
    text = page.read_text(encoding="utf-8")
    head, _, rest = text.partition(START)
    _, _, tail = rest.partition(END)
    page.write_text(f"{head}{START}\n{block(kind)}\n{END}{tail}", encoding="utf-8")
    print(page)


if __name__ == "__main__":
    what, *kinds = sys.argv[1:] or ["figures"]
    if what == "numbers":
        for name in kinds or READERS:
            put(name)
    else:
        sys.path.insert(0, str(HERE))
        from drawings import drawings

        for name, svg in drawings().items():
            (HERE / f"{name}.svg").write_text(svg, encoding="utf-8")

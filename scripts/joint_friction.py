"""Friction and gravity of an arm's joints from torques, by simulation: prints what was asked for and what is measured.

python scripts/joint_friction.py [--draws 40]    the Mitsubishi RV-2AJ of the catalogue with masses and friction drawn at random
"""

from __future__ import annotations

import sys

import numpy as np

from robocal.arms.joint_loads import EXPECTED, LOAD_SYMBOLS, load_names, with_loads
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.identify import identify
from robocal.session.inputs import open_machine

POSES, NOISE = 60, 0.1  # N m
ARM = "rv-2aj"


def draw(seed: int):  # type: ignore[no-untyped-def]
    """The nominal arm, the true numbers, and what its drives reported."""
    rng = np.random.default_rng(seed)
    nominal = with_loads(open_machine(ARM).machine)
    nominal = nominal.with_table(nominal.table.with_free(load_names(nominal)))
    true = {n: EXPECTED[n.rpartition(".")[2]] * rng.normal() for n in load_names(nominal)}
    true |= {n: abs(v) for n, v in true.items() if n.endswith(("mass", "coulomb", "viscous"))}
    n = len(nominal.joints)
    q, speed = rng.uniform(-2, 2, (POSES, n)), rng.choice([-1.0, 1.0], (POSES, n)) * rng.uniform(0.05, 0.5, (POSES, n))
    extra = {"joint": np.tile(np.arange(n, dtype=float), POSES), "speed": speed.ravel()}
    where, none = np.repeat(np.arange(POSES), n), np.zeros((POSES * n, 1))
    obs = Observations("joint_torque", where, none, none + NOISE, extra=extra, group="drives")
    where = Configurations(tuple(f"p{i}" for i in range(POSES)), q)
    return nominal, true, synthesise(nominal.with_values(true), DataSet(where, (obs,)), rng)


def main(words: list[str]) -> int:
    """All draws; 0 where everything is met."""
    draws = int(words[words.index("--draws") + 1]) if "--draws" in words else 40
    inside: dict[str, list[bool]] = {"friction": [], "gravity": []}
    status, share, ranks = [], [], set()
    for seed in range(draws):
        nominal, true, data = draw(seed)
        found = identify(nominal, data)
        status.append(found.verdict.status)
        stage = found.stages[0]
        share.append(stage.held_out.rms / NOISE if stage.held_out is not None else np.nan)
        seen = [p for p in found.parameters if p.status == "identified" and p.name in true]
        ranks.add(len(seen))
        for p in seen:
            kind = "friction" if p.name.endswith(LOAD_SYMBOLS[-2:]) else "gravity"
            inside[kind].append(p.interval[0] <= true[p.name] <= p.interval[1])
    told = ", ".join(f"{k} {100 * np.mean(v):.1f} % of {len(v)}" for k, v in inside.items())
    held = 100 * float(np.mean(inside["friction"]))
    lines = (
        ("friction: 95 % intervals hold the truth, 93 to 97 %", 93 <= held <= 97, told),
        (
            "unseen torques met as their noise allows",
            np.nanmean(share) < 1.3,
            f"held-out rms {np.nanmean(share):.2f} times the noise",
        ),
        (
            "improved over an arm of which nothing is known",
            all(s == "improved" for s in status),
            f"{status.count('improved')} of {draws}",
        ),
        (
            "gravity numbers that the data tell (base parameters)",
            len(ranks) == 1,
            f"{sorted(ranks)} numbers of {len(true)}, with friction",
        ),
    )
    for asked, met, said in lines:
        print(f"{'met ' if met else 'OPEN'}  {asked:<58} {said}")
    return 0 if all(met for _, met, _ in lines) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

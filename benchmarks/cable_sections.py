"""The cable section: tensions, reachable poses and grids, robocal beside quadprog, daqp, osqp and HiGHS.

    python -m benchmarks --section cables

Robot and tasks are those of `cable_job.py`; every worker stays up, and within a task the contestants take turns (A B C A B C), one at
a time, one thread each; medians. `off` is how far a contestant's numbers are from those of the task's yardstick, another contestant than
robocal, in the same run. Those who would take minutes for the whole grid do a sample of its cells; their time is scaled up, and `cells`
says from how many.
"""

import statistics
import sys
from collections.abc import Callable
from dataclasses import dataclass, field

import cable_job as cables
import numpy as np
from contestants import Contestant, Worker
from environments import Unavailable

ROUNDS = 7
VISIT = 0.05  # seconds that a visit to a quick contestant lasts
SLOW = 2.0  # seconds per solve beyond which two rounds must do


def own(name: str, way: str) -> Contestant:
    return Contestant(name, None, "cable_worker.py", (way,))


def peer(name: str, task: str, solver: str) -> Contestant:
    return Contestant(name, "cables", "peers/worker_cables.py", (task, solver))


TENSION = (
    own("robocal", "tension"),
    own("robocal, from the poses", "tension of poses"),
    own("robocal, pose by pose", "tension singly"),
    peer("quadprog", "tension", "quadprog"),
    peer("daqp, solve", "tension", "daqp"),
    peer("daqp, Model", "tension", "daqp.Model"),
    peer("osqp, to 1e-10", "tension", "osqp"),
)
PLACE = (
    own("robocal, pose by pose", "placed"),
    own("robocal, one batch", "placed at once"),
    peer("scipy, least_squares", "place", "-"),
)
POSES = (
    own("robocal, one list", "list"),
    own("robocal, one by one", "one"),
    peer("LP ray search, highspy", "poses", "highspy"),
    peer("LP ray search, linprog", "poses", "linprog"),
)
GRID = (
    own("robocal", "grid"),
    own("robocal, with margins", "margins"),
    peer("quadprog", "grid", "quadprog"),
    peer("HiGHS, highspy", "grid", "highspy"),
    peer("HiGHS, linprog", "grid", "linprog"),
    peer("Qhull, margins", "margins", "hull"),
)


@dataclass
class Runner:
    """A contestant in the race and what it has answered so far, by the name of the job."""

    worker: Worker
    wall: dict[str, list[float]] = field(default_factory=dict)
    cpu: dict[str, list[float]] = field(default_factory=dict)
    answer: dict[str, dict] = field(default_factory=dict)

    def visit(self, job: str, path) -> None:
        seen = self.wall.setdefault(job, [])
        repeat = int(np.clip(VISIT / statistics.median(seen), 1, 50)) if seen else 1
        answer = self.worker.ask(path, repeat)
        seen += answer["seconds"]
        self.cpu.setdefault(job, []).extend(answer["cpu_seconds"])
        self.answer[job] = answer

    def seconds(self, job: str) -> tuple[float, float]:
        """Median wall and CPU time."""
        return statistics.median(self.wall[job]), statistics.median(self.cpu[job])


def race(contestants: tuple[Contestant, ...], jobs: dict[str, dict], rounds: int = ROUNDS) -> dict[str, Runner]:
    """Everybody who can be had and did every job, by name."""
    paths = {name: cables.save(f"cables-{name}", job) for name, job in jobs.items()}
    runners: dict[str, Runner] = {}
    for contestant in contestants:
        try:
            runners[contestant.name] = Runner(Worker(contestant))
        except Unavailable as why:
            print(f"skipped {contestant.name}: {why}", file=sys.stderr)
    started = list(runners.values())
    try:
        for turn in range(rounds):
            for job, path in paths.items():
                for name, runner in list(runners.items()):
                    if turn > 1 and runner.seconds(job)[0] > SLOW:
                        continue
                    try:
                        runner.visit(job, path)
                    except Unavailable as why:
                        print(f"dropped {name}: {why}", file=sys.stderr)
                        del runners[name]
    finally:
        for runner in started:
            runner.worker.close()
    return runners


def rows_of(
    runners: dict[str, Runner], job: str, scale: Callable[[str], float], unit: str, reference: str
) -> dict[str, dict]:
    """Times in `unit` (us, ms or s), each solve's divided by scale(name), and CPU time over that of `reference`."""
    factor = {"us": 1e6, "ms": 1e3, "s": 1.0}[unit]
    out = {}
    for name, runner in runners.items():
        wall, cpu = (factor * t / scale(name) for t in runner.seconds(job))
        out[name] = {"what": name, f"wall_{unit}": wall, f"cpu_{unit}": cpu, "solves": len(runner.wall[job])}
    base = out.get(reference, {}).get(f"cpu_{unit}")
    return {name: row | {"cpu_over_robocal": row[f"cpu_{unit}"] / base if base else None} for name, row in out.items()}


def apart(one, other) -> float | None:
    """Greatest difference where both have numbers; None where there is nothing to compare."""
    gap = np.abs(np.array(one, float) - np.array(other, float))
    return float(np.nanmax(gap)) if np.isfinite(gap).any() else None


def yardstick(runners: dict[str, Runner], first: str, job: str) -> dict:
    """The answer that the others are compared with: `first`'s, or of another who is not robocal, or robocal's."""
    name = first if first in runners else min(runners, key=lambda n: n.startswith("robocal"))
    return runners[name].answer[job]


def tension(count: int = 2000) -> list[dict]:
    """Per pose, in a batch of feasible and one of infeasible ones; `wrong`: answers that the linear program denies."""
    jobs = cables.tension_jobs(count)
    runners = race(TENSION, jobs)
    rows = []
    for job in jobs:
        made = rows_of(runners, job, lambda name: count, "us", "robocal")
        judge = yardstick(runners, "quadprog", job)["tension"]
        for name, row in made.items():
            found = np.array(runners[name].answer[job]["tension"], float)
            wrong = int((np.isfinite(found).all(axis=1) != (job == "feasible")).sum())
            off = apart(found, judge) if job == "feasible" else None
            rows.append({"poses": job} | row | {"wrong": wrong, "off_N": off})
    return rows


def place(count: int = 500) -> list[dict]:
    """Forward kinematics per pose, from about 17 mm and 3 deg away; `off_m` from scipy's."""
    runners = race(PLACE, {"place": cables.place_job(count)})
    rows = rows_of(runners, "place", lambda name: count, "us", "robocal, pose by pose")
    judge = yardstick(runners, "scipy, least_squares", "place")["place"]
    return [row | {"off_m": apart(runners[name].answer["place"]["place"], judge)} for name, row in rows.items()]


def poses(count: int = 20, many: int = 1000) -> list[dict]:
    """Per pose, statics, interference, tensions and lengths; and robocal alone with a list of `many`. `off` is early, not late:
    robocal stops before the last micrometre."""
    runners = race(POSES, {"poses": cables.pose_job(count)}, 3)
    long = race(POSES[:1], {"long list": cables.pose_job(many)}, 3)
    rows = rows_of(runners, "poses", lambda name: count, "ms", "robocal, one by one")
    judge = yardstick(runners, "LP ray search, linprog", "poses")
    for name, row in rows.items():
        answer = runners[name].answer["poses"]
        lengths = apart(answer["length"], judge["length"])
        row |= {"poses": count, "off_lambda": apart(answer["furthest"], judge["furthest"]), "off_m": lengths}
    base = rows.get("robocal, one by one", {}).get("cpu_ms")
    for row in rows_of(long, "long list", lambda name: many, "ms", "").values():
        ratio = row["cpu_ms"] / base if base else None
        rows["long list"] = row | {"poses": many, "cpu_over_robocal": ratio, "off_lambda": None, "off_m": None}
    order = {"what": None, "poses": None}
    return [order | row for row in rows.values()]


def grid(cells: int = 41) -> list[dict]:
    """The whole grid; `wrong`: cells of the sample that are not as HiGHS says."""
    job = cables.grid_job(cells)
    total, done = cells**3, {c.name: len(job["sample"]) for c in GRID[2:]} | {"Qhull, margins": len(job["hulls"])}
    runners = race(GRID, {"grid": job}, 3)
    rows = rows_of(runners, "grid", lambda name: done.get(name, total) / total, "s", "robocal")
    judge = yardstick(runners, "HiGHS, linprog", "grid")["feasible"]
    hulls = runners["Qhull, margins"].answer["grid"]["margin"] if "Qhull, margins" in runners else None
    out = []
    for name, row in rows.items():
        answer = runners[name].answer["grid"]
        wrong = int((np.array(answer["feasible"]) != judge).sum()) if "feasible" in answer else None
        off = apart(answer["margin"], hulls) if "margin" in answer and hulls is not None else None
        out.append(row | {"cells": done.get(name, total), "wrong": wrong, "off_N": off})
    return out


def sections() -> dict[str, list[dict]]:
    """All of them, by name."""
    return {"cable_tension": tension(), "cable_place": place(), "cable_poses": poses(), "cable_grid": grid()}


if __name__ == "__main__":
    import table

    for name, rows in sections().items():
        print(f"\n{name}\n{table.section_table(rows)}")

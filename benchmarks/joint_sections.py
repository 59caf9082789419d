"""The joint section: poses, markers, cables and a camera in one estimate, robocal beside Ceres in C++.

    python -m benchmarks --section joint

Jobs are those of `joint_job.py`; contestants take turns as in the cable section. `off_cost` is how far, relative to it, the cost at
the end is from the lowest that anybody reached: who ends higher has not finished.
"""

import json
import os
import subprocess
import sys

import joint_job as joint
from cable_sections import race
from contestants import THREADS, Contestant

OWN = Contestant("robocal", None, "joint_worker.py", ("families",))
COLUMNS = Contestant("robocal, markers as columns", None, "joint_worker.py", ("columns",))


def ceres(first: str, solver: str) -> Contestant:
    return Contestant(f"Ceres C++, {first} first, {solver}", None, "peers/worker_ceres.py", (first, solver))


PEERS = (
    *(
        Contestant(f"pyceres, compiled, {s}", "pyceres", "peers/worker_joint_pyceres.py", (s,))
        for s in ("dense", "sparse")
    ),
    Contestant("scipy trf, compiled", "scipy", "peers/worker_joint_scipy.py"),
)
SMALL = (OWN, COLUMNS, *(ceres(f, s) for f in ("markers", "poses") for s in ("dense", "sparse")), *PEERS)
LARGE = (OWN, ceres("markers", "sparse"), ceres("poses", "sparse"), ceres("poses", "dense"), ceres("markers", "dense"))
# views, grid of markers, sides of the floor over the small one's
SCENES = {"100 x 85": (100, (17, 5), 1.0), "1000 x 108": (1000, (12, 9), 1.0), "300 x 754": (300, (29, 26), 2.2)}
GROWTH = {
    "100 x 100": (100, (10, 10), 1.0), "300 x 100": (300, (10, 10), 1.0), "1000 x 100": (1000, (10, 10), 1.0),
    "300 x 300": (300, (20, 15), 1.4), "300 x 1000": (300, (40, 25), 2.5), "1000 x 1000": (1000, (40, 25), 2.5),
}  # fmt: skip


def jobs_of(scenes: dict) -> dict[str, dict]:
    return {name: joint.make(views, grid, room=room) for name, (views, grid, room) in scenes.items()}


def rows_of(contestants, jobs: dict[str, dict], rounds: int) -> list[dict]:
    runners = race(contestants, {f"joint-{name}": job for name, job in jobs.items()}, rounds)
    out = []
    for name, job in jobs.items():
        key = f"joint-{name}"
        lowest = min(r.answer[key]["cost"] for r in runners.values())
        base = runners["robocal"].seconds(key)[1]
        for who, runner in runners.items():
            wall, cpu = runner.seconds(key)
            answer = runner.answer[key]
            out.append(
                {"scene": name, "what": who, "corners": 4 * len(job["view"]), "wall_s": wall, "cpu_s": cpu, "cpu_over_robocal": cpu / base}
                | {"iterations": answer["iterations"], "off_cost": answer["cost"] / lowest - 1}
            )  # fmt: skip
    return out


def robust() -> list[dict]:
    """The small scene with three gross corners in a hundred: what a robust loss costs over none."""
    jobs = {loss: joint.make(100, (17, 5), gross=0.03, loss=loss) for loss in ("none", "huber", "tukey")}
    rows = rows_of((OWN, ceres("markers", "dense"), ceres("poses", "dense")), jobs, 5)
    plain = {row["what"]: row["cpu_s"] for row in rows if row["scene"] == "none"}
    return [row | {"cpu_over_plain": row["cpu_s"] / plain[row["what"]]} for row in rows]


EVIDENCE = (("statistics", "100 x 85"), ("leave-one-out", "100 x 85"), ("solve", "300 x 754"))
LIKELIHOOD = tuple((what, "100 x 85") for what in ("likelihood", "generalised", "one-pass"))


def evidence(asked=EVIDENCE) -> list[dict]:
    """What robocal's statistics cost on the small scene, and the memory of the wide one, each in a process of its own."""
    out = []
    for what, scene in asked:
        views, grid, room = SCENES[scene]
        path = joint.save(f"joint-{scene}", joint.make(views, grid, room=room))
        env = os.environ | THREADS | {"PYTHONPATH": str(joint.HERE)}
        words = [sys.executable, str(joint.HERE / "joint_evidence.py"), str(path), what]
        done = subprocess.run(words, capture_output=True, text=True, env=env, check=True)
        out.append({"scene": scene, "what": what} | json.loads(done.stdout))
    return out


def sections() -> dict[str, list[dict]]:
    """All rows of the section."""
    scenes = jobs_of(SCENES)
    small = {"100 x 85": scenes.pop("100 x 85")}
    return {
        "joint": rows_of(SMALL, small, 7) + rows_of(LARGE, scenes, 3),
        "joint_robust": robust(),
        "joint_evidence": evidence(),
        "joint_likelihood": evidence(LIKELIHOOD),
        "joint_growth": rows_of((OWN,), jobs_of(GROWTH), 2),
    }

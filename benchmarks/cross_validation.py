"""Five-fold cross-validation of the 56-pose job: robocal beside FIGAROH, interleaved, in the same folds.

    robocal, five folds            the job's 19 parameters, all folds as one batch (`calibrate.folds.unseen`)
    robocal, identify --folds 5    everything: start, noise, selection among all parameters, folds, verdict, covariance
    FIGAROH, five folds            the job's 19 parameters, fold by fold (`estimation._cv_error`)
    FIGAROH, map_cv                its cross-validated route: `estimation.method: map_cv` with its defaults, then `solve()`

The first and the third must find the same error: the folds are FIGAROH's, drawn with its seed, and the error is its own,
the mean over folds of the rms of all coordinates. The second and the fourth are what a user calls. Ratios are of CPU time
(one thread each): a second-long solve meets every neighbour on the machine, a millisecond meets none.
"""

import statistics
import sys
from pathlib import Path

import job as jobs
from contestants import Contestant, Worker
from environments import Unavailable

HERE = Path(__file__).resolve().parent
CONTESTANTS = (
    Contestant("robocal, five folds", None, "robocal_worker.py", ("folds",)),
    Contestant("robocal, identify --folds 5", None, "robocal_worker.py", ("identify",)),
    Contestant("FIGAROH, five folds", "figaroh", "peers/worker_figaroh.py", ("folds",)),
    Contestant("FIGAROH, map_cv", "figaroh", "peers/worker_figaroh.py", ("map_cv",)),
)
# what is compared with what
PARTNERS = {"FIGAROH, five folds": "robocal, five folds", "FIGAROH, map_cv": "robocal, identify --folds 5"}
INSTANCES, ROUNDS = 3, 3


def section() -> list[dict]:
    """Median times of one cross-validation, its error, and how much more CPU time than robocal's partner it took."""
    seconds: dict[str, list[float]] = {}
    busy: dict[str, list[float]] = {}
    errors: dict[str, list[float]] = {}
    workers = {}
    for contestant in CONTESTANTS:
        try:
            workers[contestant.name] = Worker(contestant)
        except Unavailable as why:
            print(f"skipped {contestant.name}: {why}", file=sys.stderr)
    try:
        for seed in list(range(INSTANCES)) * ROUNDS:
            path = jobs.make(seed).save(HERE / ".cache" / "jobs" / f"{seed}.npz")
            for name, worker in list(workers.items()):
                try:
                    answer = worker.ask(path, 5 if name.startswith("robocal") else 1)
                except Unavailable as why:
                    print(f"dropped {name}: {why}", file=sys.stderr)
                    workers.pop(name).close()
                    continue
                seconds.setdefault(name, []).extend(answer["seconds"])
                busy.setdefault(name, []).extend(answer["cpu_seconds"])
                errors.setdefault(name, []).append(answer["k_fold_rms_mm"])
    finally:
        for worker in workers.values():
            worker.close()
    middle = {name: statistics.median(s) for name, s in busy.items()}
    return [
        {
            "what": name,
            "wall_ms": 1e3 * statistics.median(seconds[name]),
            "cpu_ms": 1e3 * middle[name],
            "k_fold_rms_mm": statistics.fmean(errors[name]),
            "solves": len(seconds[name]),
            "cpu_over_robocal": middle[name] / middle[PARTNERS[name]] if PARTNERS.get(name) in middle else None,
        }
        for name in workers
    ]


if __name__ == "__main__":
    import table

    print(table.section_table(section()))

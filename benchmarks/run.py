"""`make bench`: the 56-pose job with every contestant, interleaved in one run, then the sections.

    python -m benchmarks [--rounds 7] [--instances 20] [--only NAME ...] [--no-sections] [-o FILE]
    python -m benchmarks --section NAME ... [-o FILE]
    python -m benchmarks --section waits --against OTHER/src [--waits-rounds 5] [--waits-out FOLDER] [-o FILE]

All workers are started first and stay up. Then every round visits every instance, and at each instance all
contestants in turn (A B C ... A B C ...), so that a noisy neighbour or a throttled clock strikes all alike; one
process works at a time. A visit repeats a quick solve for about 20 ms; contestants slower than 3 s per solve take
part in the first round only. Medians over all solves. The held-out error is the mean distance on 500 noise-free
poses, computed here for everybody, averaged over the instances. Everybody has one BLAS and one numba thread. Writes
`benchmarks/results.json` (not with --only, unless -o is given) and the tables of the documentation that are made from it.
With --section only those sections are run; they take the place of what the results had of them.
"""

import argparse
import json
import statistics
import sys
from dataclasses import dataclass, field
from pathlib import Path

import job as jobs
import numpy as np
import publish
import table
from contestants import CONTESTANTS, THREADS, Contestant, Worker
from environments import Unavailable

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results.json"
VISIT = 0.02  # seconds that a visit to a quick contestant lasts
MOST_REPEATS = 50
SLOW = 3.0  # seconds per solve beyond which one round must do


@dataclass
class Record:
    """What a contestant has answered so far."""

    worker: Worker
    name: str
    how: str
    versions: dict
    seconds: list[float] = field(default_factory=list)
    prepare: list[float] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    errors: dict[int, float] = field(default_factory=dict)

    @property
    def repeat(self) -> int:
        """How many solves the next visit asks for."""
        if not self.seconds:
            return 1
        return int(np.clip(VISIT / statistics.median(self.seconds), 1, MOST_REPEATS))

    @property
    def slow(self) -> bool:
        return bool(self.seconds) and statistics.median(self.seconds) > SLOW


def visit(record: Record, instance: jobs.Job, path: Path) -> None:
    """One contestant, one instance."""
    answer = record.worker.ask(path, record.repeat)
    record.seconds += answer["seconds"]
    record.prepare.append(answer["prepare_seconds"])
    record.iterations.append(answer["iterations"])
    if "parameters" in answer:
        predicted = jobs.position(np.array(answer["parameters"]), instance.held_out_q)
    else:
        predicted = np.array(answer["held_out"])
    record.errors[instance.seed] = instance.error_mm(predicted)


def start(contestants: tuple[Contestant, ...], skipped: list[dict]) -> list[Record]:
    """Start the workers; those that cannot be had go to `skipped` with the reason."""
    records = []
    for contestant in contestants:
        try:
            worker = Worker(contestant)
        except Unavailable as why:
            skipped.append({"name": contestant.name, "reason": str(why)})
            print(f"skipped {contestant.name}: {why}", file=sys.stderr)
        else:
            records.append(Record(worker, contestant.name, worker.how, worker.versions))
    return records


def race(records: list[Record], instances: list[jobs.Job], rounds: int, skipped: list[dict]) -> None:
    """All rounds. A contestant that fails leaves the race and the table: half a result is no result."""
    paths = [instance.save(HERE / ".cache" / "jobs" / f"{instance.seed}.npz") for instance in instances]
    for turn in range(rounds):
        for instance, path in zip(instances, paths, strict=True):
            for record in list(records):
                if turn and record.slow:
                    continue
                try:
                    visit(record, instance, path)
                except Unavailable as why:
                    skipped.append({"name": record.name, "reason": str(why)})
                    print(f"dropped {record.name}: {why}", file=sys.stderr)
                    records.remove(record)
        print(f"round {turn + 1} of {rounds} done", file=sys.stderr, flush=True)


def yardstick(instances: list[jobs.Job]) -> dict:
    """Held-out errors before calibration and of the exact least-squares solution."""
    before = [instance.error_mm(jobs.position(jobs.nominal(), instance.held_out_q)) for instance in instances]
    exact = [instance.error_mm(jobs.position(jobs.reference(instance), instance.held_out_q)) for instance in instances]
    return {"held_out_before_mm": statistics.fmean(before), "held_out_exact_least_squares_mm": statistics.fmean(exact)}


def cross_validation() -> dict[str, list[dict]]:
    """Cross-validation beside FIGAROH."""
    import cross_validation as section

    return {"cross_validation": section.section()}


def robocal() -> dict[str, list[dict]]:
    """robocal alone: batch, leave-one-out, forward kinematics, scaling, compilation, start-up."""
    import robocal_sections as section

    return section.sections()


def cables() -> dict[str, list[dict]]:
    """Cable robots beside quadprog, daqp, osqp and HiGHS."""
    import cable_sections as section

    return section.sections()


def joint() -> dict[str, list[dict]]:
    """Poses, markers, cables and a camera in one estimate, beside Ceres in C++."""
    import joint_sections as section

    return section.sections()


def waits(**options) -> dict[str, list[dict]]:
    """What a user waits for: whole commands, those of another state of the project in turn with them."""
    import waits as section

    return {"waits": section.section(**{key: value for key, value in options.items() if value})}


SECTIONS = {"cross_validation": cross_validation, "robocal": robocal, "cables": cables, "joint": joint, "waits": waits}


def sections(names, **waits_for) -> dict:
    """Rows of these sections, and on what machine they were measured; `waits_for` are the options of what a user waits for."""
    made = {}
    for name in names:
        made |= SECTIONS[name](**(waits_for if name == "waits" else {}))
    for name, rows in made.items():
        print(f"\n{name}\n{table.section_table(rows)}")
    return {"measured": dict.fromkeys(names, table.machine()), "sections": made}


def write(document: dict, output: Path) -> None:
    """The results as JSON, and in the documentation if they are the project's own."""
    output.write_text(json.dumps(document, indent=2) + "\n")
    if output.resolve() == RESULTS:
        publish.publish(document)


def main() -> int:
    parser = argparse.ArgumentParser(description="The 56-pose job: robocal and its peers in one run.")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--instances", type=int, default=20)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="contestants whose name contains one of these")
    parser.add_argument("--no-sections", action="store_true")
    parser.add_argument("--section", nargs="+", choices=SECTIONS, metavar="NAME", help=f"only {', '.join(SECTIONS)}")
    parser.add_argument(
        "--against", metavar="SRC", help="waits: the sources of another state; SRC:FOLDER with packages that it needs"
    )
    parser.add_argument("--waits-rounds", type=int, metavar="N", help="waits: how often every command is run")
    parser.add_argument(
        "--waits-only", nargs="+", default=(), metavar="WORD", help="waits: rows whose names hold one of these"
    )
    parser.add_argument("--waits-out", type=Path, metavar="FOLDER", help="waits: keeps data and rounds, to go on there")
    parser.add_argument("--waits-minutes", type=float, metavar="M", help="waits: ends after so long")
    parser.add_argument("--waits-jobs", type=int, metavar="N", help="waits: rows that are measured at a time")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    waits_for = {
        "against": options.against, "rounds": options.waits_rounds, "words": options.waits_only,
        "out": options.waits_out and options.waits_out.resolve(), "minutes": options.waits_minutes, "jobs": options.waits_jobs,
    }  # fmt: skip
    if options.section:
        kept = options.waits_out and options.waits_out / "results.json"
        output = options.output or kept or RESULTS
        document = json.loads(output.read_text()) if output.exists() else {}
        for key, part in sections(options.section, **waits_for).items():
            document[key] = document.get(key, {}) | part
        write(document, output)
        return 0

    chosen = tuple(c for c in CONTESTANTS if not options.only or any(part in c.name for part in options.only))
    instances = [jobs.make(seed) for seed in range(options.instances)]
    skipped: list[dict] = []
    records = start(chosen, skipped)
    workers = [record.worker for record in records]
    try:
        race(records, instances, options.rounds, skipped)
    finally:
        for worker in workers:
            worker.close()
    if not records:
        print("no contestant took part", file=sys.stderr)
        return 1
    rows = table.compare([table.summarise(record) for record in records])
    measure = yardstick(instances)

    print(table.job_table(rows))
    print(
        f"held-out mean error before {measure['held_out_before_mm']:.4f} mm, "
        f"exact least squares {measure['held_out_exact_least_squares_mm']:.5f} mm"
    )
    extra = sections([] if options.no_sections else SECTIONS, **waits_for)
    output = options.output or (None if options.only else RESULTS)
    if output:
        document = {
            "machine": table.machine(),
            "threads": THREADS,
            "job": {
                "poses": jobs.POSES,
                "noise_mm": 1e3 * jobs.SIGMA,
                "angle_error_mrad": 1e3 * jobs.ANGLE_ERROR,
                "length_error_mm": 1e3 * jobs.LENGTH_ERROR,
                "free": [jobs.NAMES[i] for i in jobs.FREE],
                "held_out_poses": jobs.HELD_OUT,
                "instances": len(instances),
                "rounds": options.rounds,
            }
            | measure,
            "contestants": rows,
            "skipped": skipped,
        } | extra
        write(document, output)
    return 0


if __name__ == "__main__":
    sys.exit(main())

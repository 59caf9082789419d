"""A study from its first to its last trial: chunks over processes, each written whole; what is there is not done again."""

from __future__ import annotations

import contextlib
import shutil
import threading
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from queue import SimpleQueue

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import FileError, InputError
from robocal.files.studyfile import Study
from robocal.files.writing import LOCK, write_text
from robocal.progress import Watch
from robocal.studies.cluster import Cluster, on_cluster
from robocal.studies.work import Work, chunks, do, drawn, trials_of, unpack
from robocal.studies.worker import Died, Worker

__all__ = ["PointSummary", "StudyOutputs", "clear", "conduct", "parts_of"]

DEATHS = 20  # of the workers of one thread
ABOUT = "study.json"


@record
class PointSummary:
    """Of one output at one point, SI: root mean square and mean over trials, standard deviation of one, trials that did not end, and
    what theory foretells of the root mean square."""

    rms: float
    mean: float
    scatter: float
    lost: int
    theory: float | None


@record
class StudyOutputs:
    """Every output of every trial, (points, trials), its SI unit, and its prediction by theory at every point where there is one."""

    study: Study
    outputs: dict[str, Array]
    units: dict[str, str]
    theory: tuple[dict[str, float], ...]

    def summary(self, name: str) -> list[PointSummary]:
        """One output at every point."""
        out = []
        for values, theory in zip(self.outputs[name], self.theory, strict=True):
            good = values[np.isfinite(values)]
            spread = float(good.std(ddof=1)) if len(good) > 1 else float("nan")
            rms, mean = (float(np.sqrt(np.mean(good**2))), float(good.mean())) if len(good) else (float("nan"),) * 2
            out.append(PointSummary(rms, mean, spread, len(values) - len(good), theory.get(name)))
        return out


def parts_of(result: Path) -> Path:
    """The folder in which a study's chunks wait for the others."""
    return result.with_name(f"{result.name}.parts")


def conduct(
    study: Study,
    result: Path,
    *,
    workers: int,
    resume: bool,
    cluster: Cluster | None = None,
    watch: Watch | None = None,
) -> StudyOutputs:
    """Runs what is missing of a study, in so many processes or on a cluster; chunks are kept beside `result` until all are there.

    Who calls has the folder of the chunks for itself (`files.writing.alone`). Raises FileError where chunks of another study, or without
    `resume` any, are in the way, and InputError for what cannot be opened and where workers die again and again.
    """
    parts = parts_of(result)
    _ready(study)
    _enter(study, parts, resume)
    every = chunks(study, parts)
    names = tuple(study.points[0]["outputs"])
    left = [w for w in every if not _whole(w, names)]
    total = sum(w.count for w in every)
    done = total - sum(w.count for w in left)
    try:
        for count in _work_through(left, workers) if cluster is None else on_cluster(left, cluster):
            done += count
            if watch:
                watch({"stage": "trials", "done": done, "total": total})
    finally:
        if not any(parts.glob("*.npz")):  # nothing to go on with
            clear(result)
    found = [unpack(work.place) for work in every]
    shape = (len(study.points), study.trials)
    trials = [trials_of(study, p) for p in range(len(study.points))]
    theory = tuple(t.theory(drawn(study.seed)) if hasattr(t, "theory") else {} for t in trials)
    whole = {name: np.concatenate([part[name] for part in found]).reshape(shape) for name in found[0]}
    return StudyOutputs(study, whole, dict(trials[0].outputs), theory)


def _ready(study: Study) -> None:
    """Opens every robot and list of a study, so that one that is not there is told before the first trial. Raises InputError."""
    seen = set()
    for i, p in enumerate(study.points):
        files = (p["robot"], p["poses.file"], p["poses.tests"])
        if files not in seen:
            trials_of(study, i)
            seen.add(files)


def _enter(study: Study, parts: Path, resume: bool) -> None:
    about = parts / ABOUT
    if about.is_file() and about.read_bytes() != study.text.encode("utf-8"):
        expected = "--force without --resume to begin anew, or another -o"
        raise FileError("chunks of another study, or of another version, are here", file=parts, expected=expected)
    if parts.is_dir() and any(parts.glob("*.npz")) and not resume:
        expected = "--resume to go on, or --force to begin anew"
        raise FileError("this study was interrupted", file=parts, expected=expected)
    if not about.is_file():
        write_text(about, study.text)


def clear(result: Path) -> None:
    """Does away with the chunks of a study; who holds the folder goes on holding it."""
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        for place in [p for p in parts_of(result).iterdir() if p.name != LOCK]:
            if place.is_dir():
                shutil.rmtree(place)
            else:
                place.unlink()


def _whole(work: Work, names: tuple[str, ...]) -> bool:
    """Whether a chunk is there. One that cannot be read is done again."""
    if not work.place.is_file():
        return False
    try:
        found = unpack(work.place)
    except FileError:
        return False
    return set(found) == set(names) and all(v.shape == (work.count,) for v in found.values())


def _work_through(left: list[Work], workers: int) -> Iterator[int]:
    """The numbers of trials of chunks as they get done, here or by processes; the chunk of one that dies is given to another."""
    if workers == 1 or len(left) < 2:
        for work in left:
            do(work)
            yield work.count
        return
    waiting, ended, stop = deque(left), SimpleQueue[int | BaseException](), threading.Event()
    many, arguments = min(workers, len(left)), (waiting, ended, stop)
    threads = [threading.Thread(target=_serve, args=arguments, daemon=True) for _ in range(many)]
    for thread in threads:
        thread.start()
    try:
        for _ in left:
            found = ended.get()
            if isinstance(found, BaseException):
                raise found
            yield found
    finally:
        stop.set()
        for thread in threads:
            thread.join()


def _serve(waiting: deque[Work], ended: SimpleQueue[int | BaseException], stop: threading.Event) -> None:
    """Has one process after the other work until nothing waits; what was asked of one that died is asked of the next."""
    worker, died = Worker(), 0

    def wait_and_end() -> None:
        stop.wait()
        worker.end()

    threading.Thread(target=wait_and_end, daemon=True).start()
    while not stop.is_set():
        try:
            work = waiting.popleft()
        except IndexError:
            break
        while not stop.is_set():
            try:
                worker.ask(work)
            except Died:
                died += 1
                worker.end()
                if stop.is_set():
                    return
                if died >= DEATHS:
                    ended.put(InputError(f"workers died {died} times: memory may be short; --workers 1 says why"))
                    return
                worker = Worker()
            except BaseException as error:
                ended.put(error)
                return
            else:
                ended.put(work.count)
                break
    worker.end()

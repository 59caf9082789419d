"""`study`: many simulated trials of one procedure, as a file says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record, replace
from robocal.errors import FileError, ModelError
from robocal.quantities import Listing
from robocal.report.sections import Section, Text, ends, listing_table, quiet
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.studies.cluster import Cluster
    from robocal.studies.run import StudyOutputs

__all__ = ["Options", "details", "run", "sections"]


@record
class Options(BaseOptions):
    """Simulate a study: many trials of a calibration at every point of a sweep, on all cores.

    The same seed gives the same numbers with any number of workers. A page with pictures of the sweep is written beside
    them. Finished parts are stored beside the result until all are there: after an interruption, --resume continues.

    \b
    robocal study examples/studies/figure-3.8.yaml
    robocal study study.yaml --workers 2 -o result.csv
    robocal study study.yaml --resume
    """

    study: str = arg(..., "STUDY", "study.yaml: robot, poses, noise, trials and the varied keys.")
    workers: int | None = option(
        None, "Processes on this machine", "N", least=1, most=1024, otherwise="as many as cores"
    )
    cluster: str | None = option(
        None,
        "A Dask scheduler, tcp://HOST:PORT or tls://HOST:PORT; workers read the robot file under the same path",
        "ADDRESS",
    )
    tls_ca: Path | None = option(None, "For --cluster: certificate of the authority", "FILE")
    tls_cert: Path | None = option(None, "For --cluster: certificate of this machine", "FILE")
    tls_key: Path | None = option(None, "For --cluster: key of that certificate", "FILE")
    resume: bool = option(False, "Continue a study that was interrupted")
    output: Path | None = option(
        None, "File for every trial, .npz or .csv", "FILE", short="-o", otherwise="beside the study, as .npz"
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[StudyOutputs]:
    """Runs a study; the file holds every output of every trial, the .json beside it what is said of them. Raises InputError."""
    import os

    from robocal.files.plain import json_text, plain
    from robocal.files.studyfile import read_study
    from robocal.files.writing import alone, refuse_existing, refuse_unwritable, write_files
    from robocal.report.page import page
    from robocal.studies.run import clear, conduct, parts_of
    from robocal.verbs.study.result import document, missing_trials, written

    far = _far(o)
    study = read_study(o.study)
    result = study.path.with_suffix(".npz") if o.output is None else o.output
    written(result)  # which way, before anything is worked out
    summed, drawn = result.with_suffix(".json"), result.with_suffix(".html")
    with alone(parts_of(result)):
        for place in (result, summed, drawn):
            refuse_existing(place, (), o.force)
            refuse_unwritable(place)
        if o.force and not o.resume:  # with it, the result is replaced by what was begun
            clear(result)
        workers = o.workers or os.cpu_count() or 1
        found = conduct(study, result, workers=workers, resume=o.resume, cluster=far, watch=watch)
        files = {result.name: written(result)(found)}
        remarks, whole = missing_trials(found)
        outcome = Outcome(found, lambda: document(found, command), whole, remarks)
        files[summed.name] = json_text(outcome.document()).encode("utf-8")
        if len(study.points) > 1:
            head, *tables = sections(outcome)
            told, recipe = (head, *details(outcome), *tables), plain(outcome.document().provenance)
            files[drawn.name] = page(study.path.name, told, kind="Study", recipe=recipe).encode("utf-8")
        places = write_files(result.parent, files, remove=(drawn.name,))
        clear(result)
    return outcome.with_files(places)


def _far(o: Options) -> Cluster | None:
    """The cluster that is asked for. Raises ModelError for what is said of one where there is none, and of processes here where there is
    one."""
    from robocal.studies.cluster import Cluster

    tls = {"--tls-ca": o.tls_ca, "--tls-cert": o.tls_cert, "--tls-key": o.tls_key}
    if o.cluster is not None and o.workers is not None:
        alone = "--cluster alone"
        raise ModelError("a cluster has its own workers", key="--workers", found=o.workers, expected=alone)
    for name, file in tls.items():
        if file is not None and o.cluster is None:
            expected = "--cluster tls://HOST:PORT"
            raise ModelError("this option is for a cluster", key=name, found=str(file), expected=expected)
        if file is not None and not file.is_file():
            raise FileError("there is no such file", file=file, key=name)
    files = (None if file is None else str(file) for file in tls.values())
    return None if o.cluster is None else Cluster(o.cluster, *files)


def details(made: Outcome[StudyOutputs]) -> Iterator[Section]:
    """A picture of every output."""
    from robocal.verbs.study.result import pictures

    yield from pictures(made.result)


def sections(made: Outcome[StudyOutputs]) -> Iterator[Section]:
    """Root mean square, mean and scatter of every output at every point, and what theory foretells."""
    from robocal.files.display import in_units
    from robocal.files.units import Units
    from robocal.verbs.study.result import table_of

    found = made.result
    study = found.study
    yield Section.of(
        "",
        Text.of(
            (study.path.name, "strong"),
            f"   {study.trials} trials at each of {len(study.points)} points, seed {study.seed}",
        ),
    )
    varied = [name for name, _ in study.points[0].varied]
    for name in found.units:
        listing = in_units(table_of(found, name), Units())
        *numbers, lost = listing.columns[len(varied) :]
        head = replace(numbers[0], label=f"{name}: {numbers[0].header}")
        few = replace(lost, values=[v or None for v in lost.values])
        shown = Listing((*listing.columns[: len(varied)], head, *numbers[1:], few))
        yield Section.of(
            "", replace(listing_table(shown), right=tuple(range(len(varied), len(shown.columns)))),
            *quiet("rms and mean over trials, scatter: standard deviation of one trial; lost: trials without it, not among these"),
            title=f"{name} in numbers", key=name, folded=True,
        )  # fmt: skip
    yield from ends(made.remarks, made.written)

"""Whatever has a name is one thing in all files of an identification: a file that only names a place, a ball or a target takes
what another one says of it, and a distance that two files state is stated once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from robocal.diagnose.check_registry import Finding, Level
from robocal.errors import FormatError
from robocal.files.unread import SHOWN
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.pixels import LENS_FILE
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = [
    "UNSAID",
    "new_distances",
    "one_thing",
    "refuse_again",
    "refuse_copies",
    "refuse_names_of_lens",
    "target_remarks",
]

UNSAID = "unsaid"  # the option of a number of which its file says no more than the name
NUMBERS = ("values", "free")


def one_thing(data: DataSet) -> DataSet:
    """The data with what is said of a name in any file said of it in all; who contradicts whom is not decided here."""
    said = {f.name: f for obs in data.observations for f in _frames(obs) if f.described}

    def resolve(frame: Frame) -> Frame:
        """A frame as whoever describes it does."""
        return frame if frame.described else said.get(frame.name, frame)

    def resolve_option(value: object) -> object:
        if isinstance(value, tuple) and value and all(isinstance(v, Frame) for v in value):
            return tuple(map(resolve, value))
        return resolve(value) if isinstance(value, Frame) else value

    numbers = {
        key: {k: obs.options[k] for k in NUMBERS if k in obs.options}
        for obs in data.observations
        if UNSAID not in obs.options
        for key in _owners(obs)
    }
    renewed = []
    for obs in data.observations:
        options = {k: resolve_option(v) for k, v in obs.options.items() if k != UNSAID}
        for key in _owners(obs) if UNSAID in obs.options else ():
            options |= numbers.get(key, {})
        frame = None if obs.frame is None else resolve(obs.frame)
        renewed.append(replace(obs, frame=frame, targets=tuple(map(resolve, obs.targets)), options=options))
    return DataSet(data.configurations, tuple(renewed))


def _frames(obs: Observations) -> Iterator[Frame]:
    if obs.frame is not None:
        yield obs.frame
    yield from obs.targets
    for value in obs.options.values():
        yield from (v for v in (value if isinstance(value, tuple) else (value,)) if isinstance(v, Frame))


def _owners(obs: Observations) -> Iterator[tuple[str, str]]:
    """Numbers of an instrument, by what they are and whose."""
    return ((k, v) for k, v in obs.options.items() if k in ("radius", "length", "zero") and isinstance(v, str))


def target_remarks(data: DataSet, described: Mapping[str, Path]) -> tuple[Remark, ...]:
    """A remark on each file that describes places or targets which no row is about; `described` says which file does."""
    seen = {obs.targets[i].name for obs in data.observations if obs.target is not None for i in np.unique(obs.target)}
    seen |= {f.name for obs in data.observations if obs.rows is not None for f in _frames(obs) if f not in obs.targets}
    seen |= {f.name for obs in data.observations if obs.target is None for f in obs.targets}
    idle: dict[Path, list[str]] = {}
    for name, file in described.items():
        if name not in seen:
            idle.setdefault(file, []).append(name)
    return tuple(Remark.of(Code.PLACES_UNTOUCHED, file=str(f), names=tuple(names[:SHOWN])) for f, names in idle.items())


def new_distances(data: DataSet) -> DataSet:
    """The data without distances between places that tell nothing: those that were said before, since they are of a drawing
    and no second reading, and those to a place which is free and is touched nowhere."""
    joints = data.configurations.joints
    if joints is None:
        return data
    touched = {f.name for obs in data.observations if obs.rows is not None for f in _frames(obs)}
    seen: set[tuple[object, ...]] = set()
    kept, idle = [], []
    for obs in data.observations:
        ends = obs.options.get("ends")
        if isinstance(ends, tuple) and obs.rows is None and np.isnan(joints[obs.configuration]).all():
            sigma = None if obs.sigma is None else obs.sigma.tobytes()
            key = (frozenset(f.name for f in ends), obs.value.tobytes(), sigma)
            if key in seen or any(any(f.free) and f.name not in touched for f in ends):
                idle.append(obs.configuration)
                continue
            seen.add(key)
        kept.append(obs)
    if not idle:
        return data
    rest = np.setdiff1d(np.arange(len(data.configurations)), np.concatenate(idle))
    return DataSet(data.configurations, tuple(kept)).take(rest)


def refuse_again(made: DataSet, hashes: Mapping[str, str], known: dict[tuple[object, ...], Path]) -> None:
    """Raises FormatError for a table that was read before, under whatever name: counted twice, it would look twice as
    sure. Other columns of one table are other measurements. `hashes` are those of
    the files, `known` what was read before."""
    for obs in made.observations:
        joints = made.configurations.joints
        where = b"" if joints is None else joints[obs.configuration].tobytes()
        ends = obs.options.get("ends", ())
        place = obs.options.get("place")
        names = tuple(f.name for f in (*(ends if isinstance(ends, tuple) else ()), place) if isinstance(f, Frame))
        # Of the numbers a hash is kept: they may be many.
        values = (obs.value.tobytes(), where, b"" if obs.target is None else obs.target.tobytes())
        key = (hashes.get(obs.source), obs.kind, names, *(sha256(v).digest() for v in values))
        if key in known:
            found, expected = f"as in {known[key].parent.name}/{known[key].name}", "every data file once"
            raise FormatError("the same measurements are given twice", file=obs.source, found=found, expected=expected)
        known[key] = Path(obs.source)


def refuse_copies(findings: list[Finding], rows: int) -> list[Finding]:
    """What was found in the rows of a file. Raises FormatError for copies that are no slip."""
    for n in (f.numbers for f in findings if f.level is Level.REFUSE):
        message = "measurements equal others to the last digit: what is given twice counts twice"
        found, row = f"{n['count']} of {rows} rows, the first one equal to row {n['first']}", int(str(n["second"]))
        raise FormatError(message, file=str(n["file"]), row=row, found=found, expected="every measurement once")
    return findings


def refuse_names_of_lens(data: DataSet) -> None:
    """Raises FormatError where one file's lens is identified under two names: the error of its prior is one, and would be taken for two
    that have nothing in common."""
    known: dict[object, Observations] = {}
    for obs in data.observations:
        free, prior = obs.options.get("free", ()), obs.options.get("known", ())
        if LENS_FILE not in obs.options or not set(free) & set(prior):  # type: ignore[call-overload]
            continue
        other = known.setdefault(obs.options[LENS_FILE], obs)
        if other.options["camera"] != obs.options["camera"]:
            found = f"{obs.options['camera']}, and {other.options['camera']} in {Path(other.source).name}"
            expected = "one name for one camera; a file of its own for another camera"
            message = "one lens has two names, and its prior would count twice"
            raise FormatError(message, file=obs.source, key="camera.name", found=found, expected=expected)

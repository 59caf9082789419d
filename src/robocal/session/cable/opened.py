"""A cable robot that was opened: its data are lengths beside poses, put together by the ids of their rows."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.diagnose.cables.column_order import exchanged
from robocal.diagnose.cables.pose_axes import turned
from robocal.errors import FormatError, ToWrite
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.robot import read_cable
from robocal.files.cable.show import describe_cable
from robocal.files.cable.write import render_cable
from robocal.files.dataset import read_datasets
from robocal.files.plain import plain
from robocal.files.runfolder import ROBOTS, find_run
from robocal.files.text import InputFile
from robocal.fit.starts.own import placed
from robocal.geometry import se3
from robocal.measure.data import DataSet, Observations
from robocal.measure.lengths import located
from robocal.prove.identification import Identification
from robocal.remarks.code import Code
from robocal.report.sections import Section
from robocal.session.cable.atrest import at_rest
from robocal.session.cable.beyond import of_file
from robocal.session.cable.load import robot_inputs
from robocal.session.cable.stretch import stretched
from robocal.session.cable.summed import facts, summary
from robocal.session.cable.weighed import weighed
from robocal.session.opened import Data, Inputs, Opened, Rendered
from robocal.session.prediction import Prediction
from robocal.session.simulator import Request, Simulator
from robocal.session.watching import Watch, computable

__all__ = ["OpenedCable", "open_cable"]


COPIES = 0.1  # of the configurations
FEWEST = 5  # configurations that tell a size
SIMPLER = 1.5  # times as much may be left by axes that are wrong, which is one mistake, as by cables that are exchanged, which are several
SIZES = 4.0  # an inch is 25 mm, and no robot is four times as large as it was built


@dataclass(frozen=True)
class OpenedCable(Opened[CableRobot]):
    """A cable robot."""

    file: CableFile
    noun: ClassVar[str] = "cable robot"
    lacks: ClassVar[tuple[str, ...]] = (*Opened.lacks, "group")

    @property
    def inputs(self) -> tuple[InputFile, ...]:
        """The robot's files."""
        return robot_inputs(self.file, self.given)

    @property
    def facts(self) -> Mapping[str, Any]:
        """Its cables, and what is known of them."""
        return {"cables": list(self.file.robot.cables), "cable_robot": plain(facts(self.file.robot))}

    def sections(self) -> Iterator[Section]:
        """Every cable, and the platform in a few lines."""
        yield from summary(self.file)

    def read(
        self, data: Data, *, group: str | None = None, exclude: Sequence[str] = (), watch: Watch | None = None
    ) -> Inputs:
        """Data files as one data set, lengths beside poses put together by the ids of their rows. Raises InputError for whatever is
        wrong with them: columns that are no cables, files that no id ties together."""
        file = self.file
        reading = read_datasets(data, file.robot, exclude=exclude)
        seen = tuple(_named(obs, file) for obs in reading.dataset.observations)
        joined = replace(reading.dataset, observations=seen).by_id()
        if len(seen) > 1 and len(joined.configurations) == len(reading.dataset.configurations):
            raise FormatError(
                "the files have no configuration in common",
                file=str(data[-1]),
                key="configuration",
                expected="an id in every row of every file (configuration: {id: ...}), the same where the platform stood still",
            )
        kinds = {o.kind for o in joined.observations}
        if "load" in kinds and not kinds & {"lengths", "swivel"}:
            source = next(o.source for o in joined.observations if o.kind == "load")
            raise FormatError(
                "load cells without lengths tell nothing of anchors", file=source, key="kind", found=", ".join(sorted(kinds)),
                expected="the lengths of the cables beside them",
            )  # fmt: skip
        _copied(joined)
        with computable(self.given, *data):
            _one_size(joined, file)
            _own_columns(joined, file)
            told = at_rest(file, joined)
            joined, said = stretched(file, joined)
            joined = placed(file.robot, joined)
        return self.inputs_of(replace(reading, dataset=joined), *told, *said)

    def simulator(self, request: Request) -> Simulator[CableRobot]:
        """Its sensors, and an instrument that sees the platform."""
        from robocal.session.cable.simulate import CableSimulator

        return CableSimulator(self.file, request)

    def predict(self, rows: Path, absolute: bool) -> Prediction:
        """Lengths at poses, or poses at lengths."""
        from robocal.session.cable.predict import predict

        return predict(self.given, rows, absolute)

    @property
    def yaml(self) -> str:
        """The robot as a robot.yaml."""
        return self.file.text if self.file.format == "yaml" else describe_cable(self.file.robot, self.file.units)

    def render(self, found: Identification[CableRobot]) -> Rendered:
        """Its file with what was identified, the platform's weight too."""
        values = {p.name: p.value for p in found.corrected.table.rows}
        values, beyond = of_file(found, values)
        text, left_out = render_cable(self.file, values)
        return Rendered(text, (*left_out, *beyond), Code.CABLE_FILE_LACKS)


def open_cable(name: str | os.PathLike[str]) -> OpenedCable:
    """A cable robot from its file, or from a run folder. Raises InputError."""
    place = Path(name)
    run = find_run(place) if place.exists() else None
    file = read_cable(place / ROBOTS[0] if place.is_dir() else place)
    file = file if run is None else replace(file, warnings=(*file.warnings, *run.doubts))
    return OpenedCable(file, os.fspath(name))


def _copied(data: DataSet) -> None:
    """Raises FormatError where configurations repeat others in every number that was read: they are rows that were copied."""
    seen: dict[bytes, int] = {}
    again: list[tuple[int, int]] = []
    parts: dict[int, list[bytes]] = {}
    for obs in data.observations:
        for c, value in zip(obs.configuration.tolist(), obs.value, strict=True):
            parts.setdefault(c, []).append(value.tobytes())
    for c, part in parts.items():
        if (first := seen.setdefault(b"".join(part), c)) != c:
            again.append((c, first))
    # Of one length a coarse encoder may show the same twice, of eight and a pose it does not.
    if COPIES * len(parts) < len(again) and len(set(seen.values())) > 1:
        c, first = again[0]
        ids = data.configurations.ids
        raise FormatError(
            "configurations repeat others to the last digit", file=data.observations[0].source, key="configuration",
            found=f"{len(again)} of {len(parts)}, such as {ids[c]} and {ids[first]}", expected="every measurement once",
        )  # fmt: skip


def _one_size(data: DataSet, file: CableFile) -> None:
    """Raises FormatError where measured positions span far more or less than the lengths say: one of them is in another
    unit."""
    every = np.ones(len(data.configurations), dtype=bool)
    read = [o for o in data.observations if o.kind == "lengths"]
    told = [located(file.robot, o, every)[:, :3, 3] for o in read]
    for obs in data.observations:
        if not told or obs.kind not in ("position", "pose"):
            continue
        lengths, by_lengths = read[0], told[0][obs.configuration]
        known = np.isfinite(by_lengths).all(axis=1)
        if known.sum() >= FEWEST:
            seen, said = (float(np.linalg.norm(v[known].std(axis=0))) for v in (obs.value[:, :3], by_lengths))
        else:  # lengths that no pose meets: of a step in any direction a length takes a third, in the mean of squares
            of = lengths.extra["cable"]
            each = [float(lengths.value[of == c, 0].std()) for c in np.unique(of)]
            seen, said = float(np.linalg.norm(obs.value[:, :3].std(axis=0))), float(np.sqrt(3.0) * np.median(each))
        if len(obs) >= FEWEST and said > 0 and not 1 / SIZES < seen / said < SIZES:
            # The one that is farther from the size of the robot is likelier to be wrong.
            frame = float(np.linalg.norm(file.robot.a.std(axis=0)))
            wrong = obs if abs(np.log(seen / frame)) > abs(np.log(said / frame)) else lengths
            raise FormatError(
                "positions and lengths speak of two sizes", file=wrong.source,
                key="position.unit" if wrong is obs else "lengths.unit",
                found=f"positions that scatter by {seen:.3g} m, by the lengths {said:.3g} m",
                expected=f"the same; the robot's frame anchors scatter by {frame:.3g} m",
            )  # fmt: skip


def _own_columns(data: DataSet, file: CableFile) -> None:
    """Raises FormatError where lengths stand in each other's columns, by poses that were measured."""
    robot, m = file.robot, len(file.robot.cables)
    lengths = [o for o in data.observations if o.kind == "lengths"]
    seen = [o for o in data.observations if o.kind == "pose" and not (o.frame is not None and o.frame.mount == "tool")]
    if len(lengths) != 1 or len(seen) != 1:
        return
    (said,), (pose,) = lengths, seen
    held = np.eye(4)[None] if not pose.targets else np.stack([se3.from_vector(np.array(t.value)) for t in pose.targets])
    which = np.zeros(len(pose), dtype=np.int64) if pose.target is None else pose.target
    t = np.full((len(data.configurations), 4, 4), np.nan)
    t[pose.configuration] = se3.from_vector(pose.value) @ se3.inverse(held[which])
    y = np.full((len(data.configurations), m), np.nan)
    y[said.configuration, said.extra["cable"].astype(np.int64)] = said.value[:, 0]
    known = np.isfinite(t).all(axis=(1, 2))
    found, axes = exchanged(robot, t[known], y[known]), turned(robot, t[known], y[known])
    if axes is not None and (found is None or axes.left <= SIMPLER * found.left):
        gain = f"with that, what they leave falls from {1e3 * axes.stated:.3g} mm to {1e3 * axes.left:.3g} mm"
        message = {
            "position": f"in the positions {axes.what}", "orientation": "the orientations are inverted",
            "pose": f"the poses are of a left-handed frame ({axes.what})",
        }[axes.kind]  # fmt: skip
        raise FormatError(
            f"{message}: {gain}", file=pose.source, key="orientation" if axes.kind == "orientation" else "position.columns",
            expected="poses in right-handed axes, T_base_platform",
        )  # fmt: skip
    if found is None:
        return
    names = [robot.cables[j] for j in found.moved]
    right = ", ".join(robot.cables[i] for i in found.of)
    gain = f"with that, what they leave falls from {1e3 * found.stated:.3g} mm to {1e3 * found.left:.3g} mm"
    if found.anchors:
        raise FormatError(
            f"the platform anchors of {' and '.join(names)} are exchanged: {gain}", file=file.path, key="cables",
            expected=ToWrite(f"the platform anchors in the order of {right}"),
        )  # fmt: skip
    raise FormatError(
        f"the lengths of {' and '.join(names)} are exchanged: {gain}", file=said.source, key="lengths.columns",
        expected=ToWrite(f"columns that hold {right} in this order"),
    )  # fmt: skip


def _named(obs: Observations, file: CableFile) -> Observations:
    """What is read of every cable by the names of its columns where these are names of cables, else in the robot's order."""
    if "cable" not in obs.extra:
        return obs
    cables, columns = file.robot.cables, obs.options.get("columns", ())
    assert isinstance(columns, tuple)
    known = [c for c in columns if c in cables]
    if len(columns) != len(cables) or (known and (len(known) < len(columns) or len(set(known)) < len(known))):
        raise FormatError(
            "these are not the cables of the robot", file=obs.source, key=f"{obs.kind}.columns", found=", ".join(columns),
            expected=f"{len(cables)}: {', '.join(cables)}",
        )  # fmt: skip
    obs = replace(obs, options={**obs.options, "cables": cables})
    number = np.array([cables.index(c) for c in columns] if known else range(len(cables)), dtype=float)
    named = replace(obs, extra={**obs.extra, "cable": number[obs.extra["cable"].astype(np.int64)]})
    return weighed(file, named) if obs.kind == "load" else named

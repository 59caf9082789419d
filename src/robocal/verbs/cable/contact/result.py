"""What `cable contact` finds and its page: every motion of a path of one's own, and where it ends before its time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from robocal._record import record, replace
from robocal.cables.boundary import Legs, legs
from robocal.cables.tension import hold
from robocal.cables.workspace import Demand
from robocal.errors import FormatError, ModelError
from robocal.files.cable.pose_lists import pose_columns, read_platform_poses
from robocal.files.display import listing_text
from robocal.files.parts import CableDocument
from robocal.files.plain import json_text
from robocal.files.text import InputFile
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.report.cable.part import part
from robocal.report.cable.scene import scene
from robocal.report.numbers import significant
from robocal.report.sections import Detail, Section
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.calibrated import open_robot
from robocal.session.cable.start import clearance_of
from robocal.session.cable.statics_options import mass_of, robot_inputs, robot_with_limits

__all__ = ["Motions", "path_of"]

DRAWN = 6  # motions
MOST = 500  # rows of the table


@record(kw_only=True)
class PathDocument(CableDocument):
    """contact.json."""

    whole: bool
    motions: Listing


@record(kw_only=True, eq=False)
class Motions(CableResult):
    """Names of the poses, and what the motions between them meet."""

    names: tuple[str, ...]
    legs: Legs
    demand: Demand | None
    from_first: bool

    title: ClassVar[str] = "a path"

    @property
    def listing(self) -> Listing:
        """Of every motion: from, to, the share that can be gone, what ends it, and the pose where it ends."""
        met = self.legs.contacts.names(self.robot.cables)
        statics = self.legs.feasible_share < self.legs.contacts.fraction
        first = [self.names[0 if self.from_first else i] for i in range(len(met))]
        return Listing((
            Column("from", "", first),
            Column("to", "", self.names[1:]),
            Column("free", "", self.legs.free, digits=9, label="free share"),
            Column("ends by", "", ["the tension limits" if s else m or None for s, m in zip(statics, met, strict=True)]),
            *pose_columns(first, self.legs.end_poses)[1:],
        ))  # fmt: skip

    @property
    def table_listing(self) -> Listing:
        """What a table has of it."""
        return self.listing.only("from", "to", "free", "ends by")

    @property
    def trusted(self) -> bool:
        """Whether all of it can be gone."""
        return bool(self.legs.whole.all())

    @property
    def document(self) -> PathDocument:
        """What --json says."""
        return self.document_of(PathDocument, whole=self.trusted, motions=self.listing)

    def texts(self) -> Mapping[str, str | bytes]:
        """The motions, and the document."""
        return {"legs.csv": listing_text(self.table_listing), "contact.json": json_text(self.document)}

    @property
    def first_answer(self) -> Detail:
        """What a page says first."""
        whole, count = int(self.legs.whole.sum()), len(self.legs.whole)
        kind = f"{count} straight motion{'' if count == 1 else 's'} from {'the first pose' if self.from_first else 'pose to pose'}"
        tensions = " and within the tension limits" if self.demand is not None else ""
        stopped = np.flatnonzero(~self.legs.whole)
        ends, after = "", f"robocal cable inverse {self.place} POSES (the lengths of this path)"
        if len(stopped):
            first, last, free, why = next(self.table_listing.take(stopped[:1].tolist()).rows).values()
            ends = f"{first} to {last}, after {significant(100 * free)} % of its way: {why}"
            after = "another path, or other poses between; then this once more"
        return self.answer(
            ("Asked", f"whether {kind} can be gone without a contact{tensions}"), ("Found", f"{whole} of {count} can be gone to their end"),
            ("First stop", ends), ("Next", after),
        )  # fmt: skip

    def details(self) -> Iterator[Section]:
        """Pictures of the motions that cannot be gone to their end, or of the last one; every motion; how it was worked out."""
        stopped, count = np.flatnonzero(~self.legs.whole), len(self.legs.whole)
        shown = stopped[:DRAWN] if len(stopped) else np.array([count - 1])
        more = f" The first {DRAWN} of {len(stopped)} are drawn." if len(stopped) > DRAWN else ""
        for number, i in enumerate(shown.tolist()):
            yield _drawn(self, i, more if number == 0 else "", folded=number > 1)
        said = "The share of every motion that can be gone, 0 to 1, and what ends it."
        said += f" The first {MOST} motions; {count - MOST} more are in legs.csv." if count > MOST else ""
        every = list(self.table_listing.rows)[:MOST]
        rows = [[r["from"], r["to"], significant(r["free"]), r["ends by"] or "–"] for r in every]
        yield part("Motion by motion", said, table=[["from", "to", "free share", "ends by"], *rows], folded=True)
        words = "The platform's origin goes straight and it turns about one axis; contacts are certain between the poses too."
        if self.demand is not None:
            words += f" {significant(float(self.demand.masses.max()))} kg is held, without acceleration."
        yield self.method_part(words)


def path_of(o: Any, command: str = "") -> Motions:
    """A path by the options of the verb. Raises InputError."""
    file = open_robot(o.robot)
    si = o.si(file.units)
    rows = read_platform_poses(o.poses, file.robot)
    if len(rows.names) < 2:
        raise FormatError("a path needs two poses or more", file=o.poses, found=f"{len(rows.names)} rows")
    clearance, said = clearance_of(file, file.robot, si.diameter, o.body, si.relief)
    robot, demand = file.robot, None
    if (robot.limits is None and si.limits is None) or (robot.mass is None and si.mass is None):
        said = (*said, Remark.of(Code.TENSIONS_NOT_ASKED, robot=robot.name))
    else:
        robot = robot_with_limits(file, si.limits)
        demand = Demand(np.array([mass_of(file, si.payload, si.mass)]))
    try:
        found = legs(robot, rows.values, demand=demand, **vars(clearance), from_first=o.from_first)
    except ModelError as error:
        raise error.of_file(o.poses, row=None) from None
    if open_ := int((~found.contacts.complete & ~(found.feasible_share < found.contacts.fraction)).sum()):
        said = (*said, Remark.of(Code.MOTIONS_OPEN, count=open_))
    return Motions(
        file=file.with_machine(robot), names=rows.names, legs=found, demand=demand, from_first=o.from_first,
        warnings=(*file.warnings, *rows.warnings, *said),
        inputs=(*robot_inputs(file, o.robot), InputFile(Path(o.poses), rows.sha256)), command=command,
    )  # fmt: skip


def _drawn(made: Motions, i: int, more: str, folded: bool) -> Section:
    """Where a motion ends, between where it starts and where it was to go."""
    first, last, free, why = next(made.table_listing.take([i]).rows).values()
    at, shown = made.legs.end_poses[i], np.stack([made.legs.starts[i], made.legs.ends[i]])
    ends = f"ends at {significant(free)} of its way: {why}" if why else "can be gone to its end"
    caption, pull = f"{first} to {last}: {ends}", _tension(made, at)
    picture = scene(made.robot, at, tension=pull, ghosts=shown, caption=caption, ruler=made.length_unit)
    text = f"The motion {ends}. In outline: where it starts, and where it was to end.{more}"
    return part(f"From {first} to {last}", text, picture, folded=folded)


def _tension(made: Motions, at: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Tensions that hold the platform there; none where nothing is known of them, or none do."""
    robot = made.robot
    if made.demand is None or robot.limits is None:
        return None
    return np.asarray(hold(replace(robot, mass=float(made.demand.masses.max())), at[None]).tension[0])

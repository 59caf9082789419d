"""`vision hand-eye`: where the camera is, on the flange or beside the robot, and where the target is, from views and the robot's poses."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal.diagnose.check_registry import DIAGNOSE, PROVE, Finding, When
from robocal.diagnose.check_registry import run as run_checks
from robocal.diagnose.vision_limits import HAND_EYE_ASK, HAND_EYE_LEFT, ROBOT_PLACE, ROBOT_TURN
from robocal.files.display import listing_text, to_display
from robocal.files.hand_eye_forms import easy_handeye_text, static_transform_text, urdf_joint_text
from robocal.files.lens import lens_text
from robocal.files.orientation import to_form
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.result import Verdict as VerdictPart
from robocal.fit.options import Options as Solver
from robocal.geometry import se3
from robocal.measure.machine import Rig
from robocal.planning.hand_eye_poses import next_poses
from robocal.progress import Watch
from robocal.prove.decision import Decision
from robocal.prove.frame_checks import LITTLE_TURN, ONE_AXIS
from robocal.prove.statistics import Statistic
from robocal.prove.verdict import Verdict, verdict_of
from robocal.quantities import Column, Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, sentences
from robocal.session.verb_base import VerdictResult
from robocal.session.vision.corner_table import CAMERA
from robocal.session.vision.hand_eye_checks import (
    OF_VIEWS,
    contradict_lens,
    find_mirrored,
    find_moves,
    find_turned,
    stands_still,
)
from robocal.session.vision.hand_eye_data import EYE, HandEyeData, open_hand_eye
from robocal.session.vision.hand_eye_errors import HandEyeErrors, chain_of, find_errors, frame_of, middle_of
from robocal.session.vision.hand_eye_exchanged import find_exchanged
from robocal.session.vision.hand_eye_frames import PlacedFrame, frames_listing, place_frames
from robocal.session.vision.hand_eye_readings import PoseReading, doubt_poses, read_otherwise
from robocal.session.vision.hand_eye_remarks import restate, tell_lens
from robocal.session.vision.hand_eye_rig import contradict_rig
from robocal.session.vision.hand_eye_size import contradict_size
from robocal.session.vision.hand_eye_unknowns import find_lateness, locate_unknowns
from robocal.session.watching import computable
from robocal.vision.lenses import Lens

__all__ = ["CORNERS", "FILES", "HandEyeCalibration", "HandEyeDocument", "find_hand_eye"]

FILES = ("hand_eye.json", "hand_eye.yaml", "hand_eye.urdf", "static_transform.sh", "lens.yaml", "hand_eye.html")
CORNERS = ("corners.csv", "corners.json")  # of images
TO_ADD, READINGS = 3, 4  # grid: poses, and readings of the robot's poses, that are told
LEAST = 0.1  # grid: of the usual errors of a robot
# Checks that ask for what this verb tells by itself, or that mean nothing of frames alone.
SILENT = ("coverage", "place", "few-numbers")
HARDLY_TURNS = {LITTLE_TURN, ONE_AXIS}  # with them nothing tells a size, and closed forms are poor
# The robot's own errors are said in mm, and the views alone say what the lens is.
HIDDEN = (Code.ABOVE_STATED_NOISE, Code.NUMBER_DOUBTED, "lens-factor-doubted", Code.NOT_LINEAR, Code.ONE_STEP_MISLEADS)


@record(kw_only=True)
class FramePart:
    """T_parent_child: place (mm), quaternion (x, y, z, w), matrix (4, 4) with mm, and the covariance (6, 6) of place and small turns about
    the axes of the parent, in mm and rad."""

    parent: str
    child: str
    unit: str
    xyz: list[float]
    quaternion_xyzw: list[float]
    matrix: list[list[float]]
    covariance: list[list[float]]


@record(kw_only=True)
class HandEyeDocument(Document):
    """hand_eye.json: verdict; errors at the target of views that were left out, and what is normal for an arm that nobody calibrated;
    their corners; how sure the target's place is and the three poses to add; the camera and the targets; what the robot's poses were
    read as, and how other readings fare; pairs; numbers of the lens that were found; delay and size, where they were."""

    camera: str
    verdict: VerdictPart
    unit: str
    error: Statistic | None
    how: str
    normal: float
    corners: Statistic | None
    robot: list[UnitValue] | None
    sure: float
    further: Listing
    frames: list[FramePart]
    poses: str
    readings: Listing
    pairs: Listing
    lens: Listing | None
    unknowns: Listing | None
    provenance: Origin


@record(kw_only=True, eq=False)
class HandEyeCalibration(VerdictResult):
    """A hand-eye calibration with everything that its page shows; lengths in m."""

    opened: HandEyeData
    decision: Decision[Rig]
    verdict: Verdict
    errors: HandEyeErrors
    frames: tuple[PlacedFrame, ...]
    alternatives: tuple[PoseReading, ...]
    files: tuple[str, ...] = ()

    @property
    def trusted(self) -> bool:
        """Whether the frames are located."""
        return self.verdict.status == "located"

    @property
    def lens(self) -> Lens | None:
        """The lens as it was found, where numbers of it were free."""
        given, free = self.opened.lens, [n for n in self.decision.need_fit.problem.free if n.startswith(f"{CAMERA}.")]
        if given is None or not free:
            return None
        numbers = [
            self.decision.values.get(f"{CAMERA}.{s}", v) for s, v in zip(given.kind.symbols, given.numbers, strict=True)
        ]
        names, covariance = self.decision.spread
        at = [names.index(n) for n in free]
        known = tuple(n.rpartition(".")[2] for n in free)
        return Lens.of(given.model, numbers, given.size, known, covariance[np.ix_(at, at)], "robocal vision hand-eye")

    @cached_property
    def lens_numbers(self) -> Listing | None:
        """What the file has and what was found, with one standard deviation."""
        found, given = self.lens, self.opened.lens
        if found is None or given is None:
            return None
        was = dict(zip(given.kind.symbols, given.numbers, strict=True))
        now = dict(zip(found.kind.symbols, found.numbers, strict=True))
        return Listing((
            Column("name", "", list(found.known)),
            Column("given", "", np.array([was[s] for s in found.known]), figures=6),
            Column("found", "", np.array([now[s] for s in found.known]), figures=6),
            Column("sigma", "", np.array([found.sigma[s] for s in found.known]), figures=2),
        ))  # fmt: skip

    @cached_property
    def unknowns(self) -> Listing | None:
        """The delay of the camera's clock and the size of the target, where these were free."""
        return self.opened.unknowns.listing(self.decision)

    @cached_property
    def further(self) -> tuple[float, Listing]:
        """How sure the place of the target is, m, and the poses that would help most: in mm, as a quaternion, the turn, and how sure it is
        then."""
        target, middle = middle_of(self.decision)
        inhand = self.opened.inhand
        a, b = chain_of(frame_of(self.decision, EYE), frame_of(self.decision, target), inhand)
        machine = se3.inverse(self.opened.flange) if inhand else self.opened.flange
        shift, turn = self.decision.share.errors or (0.0, 0.0)
        # A robot without errors would need no more poses.
        error = np.array([max(shift, LEAST * ROBOT_PLACE)] * 3 + [max(turn, LEAST * ROBOT_TURN)] * 3)
        now, poses = next_poses(a, b, machine, middle, error, TO_ADD, inhand=inhand)
        flange = np.stack([se3.inverse(p.machine) if inhand else p.machine for p in poses])
        if self.opened.inverse:
            flange = se3.inverse(flange)
        place, q = 1e3 * flange[:, :3, 3], to_form(flange[:, :3, :3], "quaternion_xyzw")
        listing = Listing((
            Column("pose", "", [f"+ {i + 1}" for i in range(len(poses))]),
            *(Column(n, "mm", place[:, i], figures=5) for i, n in enumerate("xyz")),
            *(Column(f"q{n}", "", q[:, i], figures=4, spec=".4f") for i, n in enumerate("xyzw")),
            Column("turn", "deg", np.degrees([p.angle for p in poses]), figures=3),
            Column("sure", "mm", 1e3 * np.array([p.sure for p in poses]), figures=2, label="then sure to [mm]"),
        ))  # fmt: skip
        return now, listing

    @property
    def places(self) -> tuple[Listing, Listing]:
        """Where the frames are, and how they are turned: a row for each."""
        return frames_listing(self.frames)

    @cached_property
    def pairs(self) -> Listing:
        """A row for each view: its pose of the robot, and what is off when it was left out."""
        pairs, robot = self.opened.pairs, self.opened.robot
        named = robot.names or tuple(f"row {i + 1}" for i in range(len(robot)))
        columns = [
            Column("view", "", list(self.opened.views)),
            Column("pose", "", [named[i] for i in pairs.pose]),
            Column("error", "mm", 1e3 * self.errors.each, figures=3, label="left out [mm]"),
        ]
        if self.opened.lens is not None:
            columns.append(Column("corners", "px", self.errors.corners, figures=3, label="corners [px]"))
        return Listing(tuple(columns))

    @property
    def readings(self) -> Listing:
        """How the robot's poses fare as stated and in other ways: what most views miss."""
        some = self.alternatives[:READINGS]
        return Listing((
            Column("read", "", [r.name for r in some]),
            Column("place", "mm", 1e3 * np.array([r.place for r in some]), figures=3, label="most views off by [mm]"),
            Column("turn", "deg", np.degrees([r.turn for r in some]), figures=2, label="and by [deg]"),
        ))  # fmt: skip

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (
            ("Camera", "in the hand" if self.opened.inhand else "beside the robot"),
            ("Views", f"{len(self.opened.views)}, paired {self.opened.pairs.description}"),
            ("Poses of the robot", self.opened.robot.notation),
            ("Lens", self.opened.source.description),
        )
        return {"title": "Hand-eye calibration", "kind": "Hand-eye", "facts": facts}

    @property
    def document(self) -> HandEyeDocument:
        """What --json says."""
        said = to_display(VerdictPart, self.verdict, reasons=sentences(self.verdict.remarks))
        now = self.further
        return self.document_of(
            HandEyeDocument, camera="hand" if self.opened.inhand else "fixed", verdict=said, unit="mm", error=_in_mm(self.errors.left_out),
            how=self.errors.how, normal=1e3 * self.errors.normal, corners=self.errors.pixels,
            robot=_robot_part(self.decision.share.errors), sure=1e3 * now[0], further=now[1],
            frames=[_frame_part(f) for f in self.frames], poses=self.opened.robot.notation, readings=self.readings, pairs=self.pairs,
            lens=self.lens_numbers, unknowns=self.unknowns,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The document and the forms of other programs."""
        camera, lens = self.frames[0].exported, self.lens or self.opened.lens
        made = {
            "hand_eye.json": json_text(self.document), "hand_eye.yaml": easy_handeye_text(camera, self.opened.inhand),
            "hand_eye.urdf": urdf_joint_text(camera), "static_transform.sh": static_transform_text(camera),
        }  # fmt: skip
        if (found := self.opened.source.detected) is not None and CORNERS[0] in self.files:
            made |= {CORNERS[0]: listing_text(found.listing), CORNERS[1]: json_text(found.document)}
        return made | ({"lens.yaml": lens_text(lens)} if "lens.yaml" in self.files and lens is not None else {})


def _robot_part(errors: tuple[float, float] | None) -> list[UnitValue] | None:
    return (
        None if errors is None else [UnitValue(1e3 * errors[0], "mm"), UnitValue(float(np.degrees(errors[1])), "deg")]
    )


def _in_mm(s: Statistic | None) -> Statistic | None:
    return None if s is None else replace(s, mean=1e3 * s.mean, rms=1e3 * s.rms, p95=1e3 * s.p95, max=1e3 * s.max)


def _frame_part(f: PlacedFrame) -> FramePart:
    scale = np.array([1e3] * 3 + [1.0] * 3)
    matrix = np.array(f.pose)
    matrix[:3, 3] *= 1e3
    covariance = (f.covariance * np.outer(scale, scale)).tolist()
    xyz, q = matrix[:3, 3].tolist(), list(f.quaternion)
    return FramePart(
        parent=f.parent, child=f.child, unit="mm", xyz=xyz, quaternion_xyzw=q, matrix=matrix.tolist(), covariance=covariance
    )  # fmt: skip


def find_hand_eye(
    o: Any, watch: Watch | None = None, command: str = "", files: tuple[str, ...] = ()
) -> HandEyeCalibration:
    """Reads views and poses, finds the frames, and judges them. Raises InputError."""
    if watch:
        watch({"stage": "read"})
    opened = open_hand_eye(o, watch)
    with computable(o.corners, o.robot):
        readings = read_otherwise(opened)
        solver = Solver(folds=o.folds, hold_out=None if o.folds is None else 0.0)
        opened, made = locate_unknowns(opened, solver, watch)
        errors = find_errors(made, opened.flange, opened.inhand, readings[0].distance if readings else np.inf)
        verdict, said = _judge(opened, made, errors, readings)
        frames = place_frames(made, opened.inhand, opened.hand)
    readings = () if HARDLY_TURNS & {r.code for r in verdict.reasons} else readings
    return HandEyeCalibration(
        opened=opened, decision=made, verdict=verdict, errors=errors, frames=frames, alternatives=readings, files=files,
        warnings=tuple(dict.fromkeys((*opened.remarks, *said))), reasons=verdict.reasons, inputs=opened.files, command=command,
    )  # fmt: skip


def _judge(
    opened: HandEyeData, made: Decision[Rig], errors: HandEyeErrors, readings: tuple[PoseReading, ...]
) -> tuple[Verdict, list[Remark]]:
    """The verdict of every identification, and what is said of poses, pairs and lens besides. What explains everything is said alone."""
    said: list[Remark] = []
    pairs, views = opened.pairs, opened.views
    if pairs.method == "order":
        said.append(Remark.of(Code.PAIRED_IN_ORDER, first=views[0], last=views[-1]))
    if pairs.views_alone:
        said.append(Remark.of(Code.VIEWS_WITHOUT_POSE, count=len(pairs.views_alone), views=pairs.views_alone))
    if pairs.poses_alone and pairs.views_alone:
        said.append(Remark.of(Code.POSES_WITHOUT_VIEW, count=len(pairs.poses_alone), poses=pairs.poses_alone))
    given, left = verdict_of(made), errors.left_out
    # A closed form of turns about one axis may miss what a fit meets: then the poses are read rightly. It meets the turns all the same.
    met = left is not None and left.rms <= HAND_EYE_LEFT * errors.normal
    doubts = [] if met and not (readings and readings[0].turn > HAND_EYE_ASK) else doubt_poses(readings)
    still = stands_still(opened)
    explained = [
        *doubts,
        *([] if still is None else [still]),
        *([] if opened.rig is None else contradict_rig(opened.data, middle_of(made)[1], errors.normal)),
        *find_mirrored(opened, made),
        *(restate(r, opened, errors) for r in given.reasons if r.code in OF_VIEWS),
    ]
    if explained:
        return Verdict("refused", tuple(explained)), said
    verdict = replace(given, reasons=tuple(dict.fromkeys(restate(r, opened, errors) for r in given.reasons)))
    exchanged = list(find_exchanged(opened))
    if exchanged and verdict.status != "located":
        return Verdict("refused", tuple(exchanged)), said
    if moves := find_moves(opened, made):
        verdict = verdict.instead("refused", *moves)
    far = left is not None and not met
    late = find_lateness(opened.unknowns, *opened.target_views()[::-1]) if far or verdict.status != "located" else None
    if late is not None:
        verdict = verdict.instead("refused", late)
    if left is not None and far:
        said.append(Remark.of(Code.HAND_EYE_FAR, left=Quantity(left.rms), times=left.rms / errors.normal))
    turned = find_turned(opened, made)
    if turned is not None and verdict.status != "located":  # what they leave behind is no cause, and its advice no help
        verdict = Verdict("refused", (turned,))
    elif turned is not None:
        said.append(turned)
    verdict, more, material = tell_lens(verdict, *contradict_lens(opened, made, errors.normal))
    said += more
    unsized = material or bool(HARDLY_TURNS & {r.code for r in given.reasons})
    size, large = (None, False) if unsized else contradict_size(opened, made, errors)
    if size is not None and large:
        verdict = verdict.instead("refused" if verdict.status == "refused" else "not_improved", size)
    elif size is not None:
        said.append(size)
    findings: list[Finding] = [
        f
        for when in (When.DATA, When.FIT)
        for f in run_checks(when, made, DIAGNOSE, PROVE, skip=(*made.silent, *SILENT))
    ]
    told = [f.remark for f in findings if f.code not in HIDDEN]
    if {r.code for r in exchanged} - {r.code for r in told}:  # of corners a fit tells the same, with pixels
        told += exchanged
    return verdict, [*said, *told]

"""What `cable rig` finds: a rig moved through lists of poses with a rough geometry, calibrated from what it recorded, and verified."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.apply.verification import errors, relative
from robocal.cables.calibration.beacons import gauge_of
from robocal.errors import FormatError, ModelError
from robocal.files.cable.rig_spec import CableRigSpec, read_cable_rig
from robocal.files.cable.write import describe_cable
from robocal.files.images import encode_png
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.verification import Views
from robocal.files.writing import write_files
from robocal.progress import Watch, tell
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.commissioning.rig_calibration import CalibratedList, Verification, calibrate, verify_list
from robocal.session.commissioning.rig_checks import check_rig, remark_of_stop
from robocal.session.commissioning.rig_files import LABEL
from robocal.session.commissioning.rig_folder import list_files, verification_files, whole_poses
from robocal.session.commissioning.rig_images import check_family
from robocal.session.commissioning.rig_motion import RigMotion, Stop, power_up
from robocal.session.commissioning.rig_world import RigWorld, draw_poses, draw_world
from robocal.session.verb_base import VerbResult
from robocal.session.verified_poses import VIEWS, PoseSource, Verified, spreads_of, views_of

__all__ = ["Commissioned", "RigDocument", "RigList", "commission"]

NAMES = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
SOURCES = ("robot", "camera")


@record(kw_only=True)
class RigDocument(Document):
    """rig.json: what was simulated, of every list the errors of its verification, and tensions of the plant (N). `normalised` is the rms of
    errors against the truth by the covariance that the run states; `poses` are those of each verification pose."""

    robot: str
    simulated: bool = True
    seed: int
    anchors: str
    motions: int
    tensions: Listing | None
    lists: Listing | None
    poses: Listing | None
    provenance: Origin


@record(eq=False)
class RigList:
    """A list of poses: what `identify` made of it, its verification, and the least and greatest tension (N) that the plant saw."""

    calibration: CalibratedList
    verified: Verification
    tension: tuple[float, float]

    @property
    def name(self) -> str:
        """A, B, C, ..."""
        return self.calibration.name


@record(kw_only=True, eq=False)
class RigVerified(Verified):
    """Robot and camera beside the external instrument, list by list: each is relative to its own first pose."""

    each: Mapping[str, Mapping[str, Views]]

    @cached_property
    def lists(self) -> dict[str, dict[str, Views]]:
        """Errors by list."""
        return {name: dict(of) for name, of in self.each.items()} if len(self.each) > 1 else {}


@record(kw_only=True, eq=False)
class Commissioned(VerbResult):
    """A rig, what was done with it, and how many motions it made before it ended."""

    spec: CableRigSpec
    world: RigWorld
    seed: int
    done: tuple[RigList, ...]
    motions: int
    data: tuple[Path, ...]

    lists_files = "always"

    @property
    def limits(self) -> Array:
        """Of the controller, N."""
        return self.spec.limits

    @cached_property
    def verified(self) -> Verified | None:
        """The verification poses of all lists, as `verify` has them."""
        if not self.done:
            return None
        ids: list[str] = []
        labels: list[str] = []
        parts: dict[str, list[Array]]
        each: dict[str, dict[str, Views]] = {}
        # A camera that sees the floor at fewer than two poses of a list has nothing to be compared by.
        seen = all(whole_poses(d.verified.camera).sum() > 1 for d in self.done)
        names = SOURCES if seen else SOURCES[:1]
        parts = {s: [] for s in ("reference", *names)}
        for done in self.done:
            v = done.verified
            good = whole_poses(v.camera) if seen else np.ones(len(v.robot), dtype=bool)
            reference = v.recording.reference[good]
            mine = {n: p[good] for n, p in zip(SOURCES, (v.robot, v.camera), strict=True) if n in names}
            ids += [f"{done.name}-{n}" for n, g in zip(v.recording.ids, good.tolist(), strict=True) if g]
            labels += [done.name] * int(good.sum())
            parts["reference"].append(reference)
            each[done.name] = {}
            for source, poses in mine.items():
                parts[source].append(poses)
                each[done.name][source] = spreads_of(
                    {VIEWS[0]: errors(poses, reference), VIEWS[1]: relative(poses, reference)}
                )
        sources = {n: PoseSource(n, tuple(ids), np.concatenate(p), tuple(labels)) for n, p in parts.items()}
        views, motions = zip(*(views_of(sources[n].poses, sources["reference"].poses) for n in names), strict=True)
        return RigVerified(
            reference=sources["reference"], sources=tuple(sources[n] for n in names), errors=views, motions=motions, each=each,
            inputs=self.inputs, command=self.command,
        )  # fmt: skip

    @cached_property
    def listing(self) -> Listing:
        """A row for each list: tables 3.3 to 3.5 of the seed document."""
        rows = []
        for done in self.done:
            v = done.verified
            good, reference = whole_poses(v.camera), v.recording.reference
            whole = np.array([*errors(v.robot, reference).position])
            first = relative(v.robot, reference)
            turned = errors(v.robot, reference).orientation
            camera, between = errors(v.camera[good], reference[good]), errors(v.camera[good], v.robot[good])
            truth = v.against_truth()
            rows.append((
                done.name, 1e3 * v.residual, *_two(1e3 * whole), *_two(1e3 * first.position), *_two(np.degrees(turned)),
                *_two(np.degrees(first.orientation)), *_two(1e3 * camera.position), *_two(np.degrees(camera.orientation)),
                *_two(1e3 * between.position), *_two(np.degrees(between.orientation)), v.normalised,
                *(f for e in truth[1:] for f in (1e3 * float(e.position.mean()), float(np.degrees(e.orientation.mean())))),
                done.calibration.outcome.result.verdict.status,
            ))  # fmt: skip
        return Listing(tuple(
            Column(n, u, [r[i] for r in rows], digits=6, figures=3 if u else 0) for i, (n, u) in enumerate(COLUMNS)
        ))  # fmt: skip

    @property
    def tensions(self) -> Listing:
        """Of the plant, by list."""
        return Listing((
            Column("list", "", [d.name for d in self.done]),
            Column("least", "N", [d.tension[0] for d in self.done], figures=3),
            Column("greatest", "N", [d.tension[1] for d in self.done], figures=3),
        ))  # fmt: skip

    @cached_property
    def poses(self) -> Listing:
        """The verification poses against the truth."""
        rows = [(d.name, n, p, q) for d in self.done
                for n, p, q in zip(d.verified.recording.ids, *_pair(d.verified), strict=True)]  # fmt: skip
        return Listing((
            Column("list", "", [r[0] for r in rows]), Column("id", "", [r[1] for r in rows]),
            Column("position", "mm", [1e3 * r[2] for r in rows], figures=3),
            Column("orientation", "deg", [float(np.degrees(r[3])) for r in rows], figures=3),
        ))  # fmt: skip

    @property
    def document(self) -> RigDocument:
        """What --json says."""
        return self.document_of(
            RigDocument, robot=self.spec.name, seed=self.seed, anchors="beacons" if self.world.beacons else "tape", motions=self.motions,
            tensions=self.tensions if self.done else None, lists=self.listing if self.done else None,
            poses=self.poses if self.done else None,
        )  # fmt: skip

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        n = self.spec.model.poses.calibration
        return {
            "title": f"Commissioning of {self.spec.name}",
            "kind": "Simulation",
            "facts": (("Poses", f"{n} a list"),),
        }

    def texts(self) -> Mapping[str, str | bytes]:
        """The document, the truth, and the errors of the verification."""
        out = {"rig.json": json_text(self.document), "truth.yaml": LABEL + describe_cable(self.world.true)}
        if self.verified is not None:
            out["verify.json"] = json_text(self.verified.document)
        return out


COLUMNS = (
    ("list", ""), ("residual", "mm"),
    *((f"{what}_{view}{end}", unit) for what, view, unit in (
        ("position", "marker", "mm"), ("position", "first", "mm"), ("orientation", "marker", "deg"), ("orientation", "first", "deg"),
        ("camera", "position", "mm"), ("camera", "orientation", "deg"), ("between", "position", "mm"), ("between", "orientation", "deg"),
    ) for end in ("", "_sd")),
    ("normalised", ""), ("true_position_first", "mm"), ("true_orientation_first", "deg"), ("true_position_move", "mm"),
    ("true_orientation_move", "deg"), ("verdict", ""),
)  # fmt: skip


def _two(values: Array) -> tuple[float, float]:
    """Mean and standard deviation; not a number where there are too few."""
    mean = float(values.mean()) if len(values) else float("nan")
    return mean, float(values.std(ddof=1)) if len(values) > 1 else float("nan")


def _pair(v: Verification) -> tuple[Array, Array]:
    """Errors of the robot against the truth."""
    found = errors(v.robot, v.recording.true)
    return found.position, found.orientation


def commission(o: Any, watch: Watch | None = None, command: str = "") -> Commissioned:
    """Does it all by the options of the verb. Raises InputError."""
    spec = read_cable_rig(o.spec)
    spec = _with_options(spec, o)
    streams = np.random.SeedSequence(o.seed).spawn(2 + spec.model.lists)
    world = draw_world(spec, np.random.default_rng(streams[0]))
    done: list[RigList] = []
    written: list[Path] = []
    motions, reason = 0, None
    for name, stream in zip(NAMES, streams[2:], strict=False):
        tell(watch, "motion")
        rng = np.random.default_rng(stream)
        motion = _switch_on(world, rng)
        motion.draws, motion.watch = o.images, watch
        reason = check_rig(motion, rng)
        if reason is None:
            made = _one(o, world, motion, name, streams[1], rng, command, watch, written)
            reason = made if isinstance(made, Remark) else None
            if isinstance(made, RigList):
                done.append(made)
        motions += motion.moved
        if reason is not None:
            break
    warnings, reasons = _said(spec, done)
    if reason is not None:
        reasons = (reason, *reasons)
    return Commissioned(
        spec=spec, world=world, seed=o.seed, done=tuple(done), motions=motions, data=tuple(written), inputs=(spec.file,), command=command,
        warnings=warnings, reasons=reasons,
    )  # fmt: skip


def _switch_on(world: RigWorld, rng: np.random.Generator) -> RigMotion:
    """The rig at power-up. Raises FormatError in the words of its own file: nobody has seen the robot's yet."""
    try:
        return power_up(world, rng)[0]
    except FormatError as error:
        raise error.of_file(world.spec.file.file, row=None) from None


def _with_options(spec: CableRigSpec, o: Any) -> CableRigSpec:
    """The rig with what the command line says otherwise."""
    said = spec.model
    if o.poses is not None:
        said = said.model_copy(update={"poses": said.poses.model_copy(update={"calibration": o.poses})})
    if o.lists is not None:
        said = said.model_copy(update={"lists": o.lists})
    if o.anchors is not None:
        said = said.model_copy(update={"anchors": said.anchors.model_copy(update={"known_by": o.anchors})})
    if o.images:
        check_family(spec)
    if said.anchors.known_by == "beacons":
        try:
            gauge_of(spec.frame)
        except ModelError as error:
            raise error.of_file(spec.file.file, key="frame_anchors_nominal") from None
    return replace(spec, model=said)


def _one(
    o: Any, world: RigWorld, motion: RigMotion, name: str, verification: Any, rng: np.random.Generator, command: str,
    watch: Watch | None, written: list[Path],
) -> RigList | Remark:  # fmt: skip
    """A list from its first motion to its verification, or why it ended."""
    spec, said = world.spec, world.spec.model
    rough = motion.believed
    poses = draw_poses(spec, rough, said.poses.calibration, rng)
    if len(poses) < said.poses.calibration:
        return remark_of_stop(Stop("infeasible", f"most poses of list {name}"), motion)
    recording = motion.record_list(poses, "p", rng)
    if isinstance(recording, Stop):
        return remark_of_stop(recording, motion)
    if not recording.corners:
        expected = "a camera that looks at them, larger markers, or another marker_seen_if"
        raise FormatError(
            "the camera shows no marker at any pose", file=spec.file.file, key="markers", expected=expected
        )
    folder = Path(o.output) / name
    written += write_files(folder, list_files(world, rough.zeros, recording))
    if recording.images:
        files = {f"{n}.png": encode_png(image) for n, image in zip(recording.ids, recording.images, strict=True)}
        written += write_files(folder / "images", files)
    tell(watch, "identify")
    found = calibrate(folder, name, recording, command, o.seed, watch)
    motion.send(found.robot)
    own = np.random.default_rng(verification)
    made = motion.record_list(draw_poses(spec, found.robot, said.poses.verification, own), "v", rng)
    if isinstance(made, Stop):
        return remark_of_stop(made, motion)
    verified = verify_list(world, found, made)
    written += write_files(folder, verification_files(world, made, verified))
    return RigList(found, verified, (motion.least, motion.most))


def _said(spec: CableRigSpec, done: Sequence[RigList]) -> tuple[tuple[Remark, ...], tuple[Remark, ...]]:
    """What is to be said of the lists that were done: warnings and reasons."""
    if not done:
        return (), ()
    low, high = spec.model.tensions.allowed_N
    least, most = min(d.tension[0] for d in done), max(d.tension[1] for d in done)
    warnings = (
        [Remark.of(Code.RIG_LIMITS_LEFT, least=least, most=most, low=low, high=high)]
        if least < low or most > high
        else []
    )
    reasons = [
        Remark.of(Code.RIG_NOT_IMPROVED, name=d.name, verdict=_verdict(d))
        for d in done
        if not d.calibration.outcome.improved
    ]
    return tuple(warnings), tuple(reasons)


def _verdict(done: RigList) -> str:
    """The verdict of a calibration that is not trusted, in words."""
    status = done.calibration.outcome.result.verdict.status
    return "improved where it was measured, and nowhere else" if status == "improved" else status.replace("_", " ")

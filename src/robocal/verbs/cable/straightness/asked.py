"""What `cable straightness` makes of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import straight
from robocal.cables.rope import Rope, rope
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.straightness import excess_of, level_sag
from robocal.cables.tension import distribute
from robocal.diagnose.limits import LOADS_UNLIKE, SOUND_MOST, STRETCH_MOST, TENSION_MASS
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.pose_lists import CableList, read_platform_poses
from robocal.files.text import InputFile
from robocal.files.units import finite, parse_quantity
from robocal.geometry.gravity import GRAVITY
from robocal.progress import Watch
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.cable import statics_options as statics
from robocal.session.cable.calibrated import open_calibrated
from robocal.session.cable.load_fits import LoadFit, Loads, fit_loads
from robocal.session.cable.straightness_result import Straightness
from robocal.session.cable.winch_run import with_tensions

__all__ = ["compute_straightness"]

MOST = 5  # grid: poses that are named


def compute_straightness(o: Any, watch: Watch | None = None, command: str = "") -> Straightness:
    """What the options of the verb ask for. Raises InputError."""
    known = open_calibrated(o.robot)
    file = known.file
    si = o.si(file.units)
    wanted = parse_quantity(o.wanted, "m", key="--wanted")
    at = _tensions(o.at, file)
    robot = file.robot
    density, strain = robot.density, robot.elasticity
    loads = None
    if o.loads:
        loads = fit_loads(
            o.loads,
            0.0 if density is None else float(density.mean()),
            0.0 if strain is None else float(strain.mean()),
            watch,
        )
    m = len(robot.cables)
    weight = _weight(file, loads)
    ropes = _ropes(file, None if loads is None else loads.law, m)
    rows, poses, names = _poses(o, file)
    told: tuple[Remark, ...] = ()
    if rows is not None:
        rows, told = with_tensions(rows, file.robot, known.run, o.poses)
    warnings = [
        *file.warnings,
        *known.cautions,
        *told,
        *(() if rows is None else rows.warnings),
        *(() if loads is None else (*loads.reading.warnings, *loads.notes)),
    ]
    tension, lost = _pulls(o, si, file, rows, poses, names)
    _insist_hang(file, at, si.span, weight)
    if at is not None:
        lost = (*lost, *_contradictions(file, at))
    slack = (
        *_too_light(file, ropes, tension, weight),
        *_span(file, poses, si.span),
        *_slack(file, names, poses, tension, weight),
    )
    reasons = (*lost, *slack, *_overstretched(file, ropes, tension), *(() if loads is None else loads.refused))
    inputs = [*statics.robot_inputs(file, o.robot)]
    if rows is not None:
        inputs.append(InputFile(Path(o.poses), rows.sha256))
    if loads is not None:
        inputs += loads.reading.files
    return Straightness(
        file=file, names=names, poses=poses, tension=tension, weight=weight, ropes=ropes, wanted=wanted, span=si.span, at=at, loads=loads,
        warnings=tuple(warnings), reasons=reasons, inputs=tuple(inputs), command=command,
    )  # fmt: skip


def _tensions(given: tuple[str, ...], file: CableFile) -> Array | None:
    found = [finite(word) for word in given]
    if any(v is None or not v > 0 for v in found):
        raise ModelError(
            "not tensions",
            key="--at",
            found=",".join(given),
            expected="numbers above 0 between commas, such as 5,20,100",
        )
    return file.units.force.to_si(np.array(found, dtype=float)) if found else None


def _weight(file: CableFile, loads: Loads | None) -> Array:
    """The weight of the cables (m,) in N/m: what loads say, else the robot's file. Raises FormatError where neither does."""
    m = len(file.robot.cables)
    if loads is not None and loads.weight is not None:
        return np.full(m, max(loads.weight.parameters[0].identified, 0.0))
    density = file.robot.density
    if density is None or not np.all(np.asarray(density) > 0):
        message = "the weight of the cables is not known" if density is None else "every cable weighs something"
        expected = "every_cable: {density: ...}, above 0, or --loads with sags"
        found = None if density is None else float(np.min(density))
        raise FormatError(message, file=file.path, key="every_cable.density", found=found, expected=expected)
    return np.asarray(density, float)


def _ropes(file: CableFile, law: LoadFit | None, m: int) -> tuple[Rope, ...]:
    """The cables by how they stretch: what loads say, else the robot's file. Raises FormatError where neither does."""
    if law is not None:
        return (law.rope,) * m
    if file.robot.elasticity is None:
        message, expected = (
            "the elasticity of the cables is not known",
            "every_cable: {elasticity: ...}, or --loads with elongations",
        )
        raise FormatError(message, file=file.path, key="every_cable.elasticity", expected=expected)
    return tuple(rope(elasticity=float(e)) for e in file.robot.elasticity)


def _poses(o: Any, file: CableFile) -> tuple[CableList | None, Array, tuple[str, ...]]:
    """The poses that are asked for, else the middle of the frame."""
    if o.poses is None:
        return None, file.robot.home[None], ("middle of the frame",)
    rows = read_platform_poses(o.poses, file.robot)
    return rows, rows.values, rows.names


def _insist_hang(file: CableFile, at: Array | None, span: float | None, weight: Array) -> None:
    """Raises ModelError for tensions at which the level cable hangs by more than its span."""
    if at is None or not len(at):
        return
    least = float(at.min())
    length = float(straight(file.robot, file.robot.home[None])[0].max()) if span is None else span
    if float(level_sag(length, least, float(weight.max()))) > length:
        expected = f"tensions that hold a level cable of {float(file.units.length.from_si(length)):.4g} {file.units.length.name}"
        raise ModelError("no cable hangs by more than its span", key="--at", found=f"{least:.4g} N", expected=expected)


def _span(file: CableFile, poses: Array, span: float | None) -> tuple[Remark, ...]:
    """Why a span is in another unit than the robot's file; none where it may be of a cable like these."""
    longest = float(np.nanmax(straight(file.robot, poses)[0]))
    if span is None or 1 / LOADS_UNLIKE < span / longest < LOADS_UNLIKE:
        return ()
    numbers = {"span": Quantity(span), "longest": Quantity(longest)}
    return (Remark.of(Code.SPAN_UNLIKE, unit=file.units.length.name, **numbers),)


def _too_light(file: CableFile, ropes: tuple[Rope, ...], tension: Array, weight: Array) -> tuple[Remark, ...]:
    """The cable in which sound would run faster than in any material, sqrt(E A / (w / g)): weight or elasticity are of another unit."""
    pull = np.nanmean(np.nan_to_num(tension), axis=0)
    stiff = np.array([float(t / r.strain(t)) if r.strain(t) > 0 else 0.0 for r, t in zip(ropes, pull, strict=True)])
    speed = np.sqrt(stiff * float(np.linalg.norm(GRAVITY)) / weight)
    worst = int(speed.argmax())
    if not speed[worst] > SOUND_MOST:
        return ()
    return (
        Remark.of(Code.CABLE_TOO_LIGHT, cable=file.robot.cables[worst], speed=Quantity(float(speed[worst]), "m/s")),
    )


def _slack(file: CableFile, names: tuple[str, ...], poses: Array, tension: Array, weight: Array) -> tuple[Remark, ...]:
    """The first pose at which a tension does not carry its cable."""
    held = np.asarray(np.isfinite(tension).all(axis=1))
    longer = excess_of(file.robot, poses, tension, weight)
    slack = (held[:, None] & ~np.isfinite(longer)) | (tension <= 0)
    if not slack.any():
        return ()
    pose, cable = (int(v[0]) for v in np.nonzero(slack))
    more = int(slack.any(axis=1).sum()) - 1
    numbers = {"tension": Quantity(float(tension[pose, cable]), "N"), "more": more or None}
    return (Remark.of(Code.CABLE_HANGS_SLACK, pose=names[pose], cable=file.robot.cables[cable], **numbers),)


def _overstretched(file: CableFile, ropes: tuple[Rope, ...], tension: Array) -> tuple[Remark, ...]:
    """The cable that stretches most, where no rope stretches so much."""
    strain = np.nan_to_num(np.stack([r.strain(tension[:, i]) for i, r in enumerate(ropes)], axis=1))
    pose, cable = (int(v) for v in np.unravel_index(int(strain.argmax()), strain.shape))
    if strain[pose, cable] <= STRETCH_MOST:
        return ()
    share, pull = float(strain[pose, cable]), Quantity(float(tension[pose, cable]), "N")
    return (Remark.of(Code.STRETCH_BEYOND, cable=file.robot.cables[cable], share=share, tension=pull),)


def _contradictions(file: CableFile, given: Array) -> tuple[Remark, ...]:
    """Why tensions (k, m) in N are in another unit than those of the robot's file."""
    limits = file.robot.limits
    if limits is None:
        return ()
    least, most = float(limits[:, 0].min()), float(limits[:, 1].max())
    low, high = float(given.min()), float(given.max())
    if high <= TENSION_MASS * most and high >= least / TENSION_MASS:
        return ()
    numbers = {k: Quantity(v, "N") for k, v in (("low", low), ("high", high), ("least", least), ("most", most))}
    return (Remark.of(Code.TENSIONS_BEYOND, **numbers),)


def _pulls(
    o: Any, si: Any, file: CableFile, rows: CableList | None, poses: Array, names: tuple[str, ...]
) -> tuple[Array, tuple[Remark, ...]]:
    """Tensions (k, m) in N, and which poses none hold: as asked for, else as the list says, else the least ones. Raises InputError."""
    shape = (len(poses), len(file.robot.cables))
    given = None if rows is None else rows.tension
    if si.tension is not None:
        if given is not None:
            raise ModelError("tensions are given twice", key="--tension", found="columns of the list as well")
        if not si.tension > 0:
            raise ModelError("a slack cable is not straight", key="--tension", found=o.tension, expected="above 0")
        every = np.full(shape, float(si.tension))
        return every, _contradictions(file, every)
    if given is not None:
        return given, _contradictions(file, given)
    robot = statics.robot_with_limits(file, si.limits)
    load = gravity_wrench(poses, statics.mass_of(file, si.payload, si.mass), robot.com)[:, robot.axes]
    spread = distribute(structure_of(robot, poses), load, robot.need("limits"))
    missing = spread.missing(1.0)
    lost = np.flatnonzero(~spread.feasible)
    said = [
        Remark.of(Code.NOT_HELD, pose=names[i], missing=statics.missing_text(robot, missing[i])) for i in lost[:MOST]
    ]
    if len(lost) > len(said):
        said.append(Remark.of(Code.AND_MORE, count=len(lost) - len(said)))
    if len(lost) == len(poses):
        raise ModelError(
            "no tensions hold the platform at any of these poses",
            key="--poses",
            expected="--tension, other poses, or limits",
        )
    return spread.tension, tuple(said)

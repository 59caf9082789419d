"""Where the tool of an identified robot is at given joint values, and how far that may be off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.errors import FormatError
from robocal.estimate.uncertainty import radius
from robocal.files.covariance import COVARIANCE, Knowledge
from robocal.files.robot import Robot
from robocal.files.runfolder import LAYER
from robocal.files.targets import read_targets
from robocal.files.text import InputFile, read_text
from robocal.geometry import so3
from robocal.prove.place_bands import Predicted, base_motion, parameters_of, predict, sample_joints
from robocal.prove.shape import shapes_of_rows
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.report.sections import figure
from robocal.session.prediction import Prediction
from robocal.session.runs import knowledge_of, run_cautions

__all__ = ["predict_poses", "shape_motion"]

ANCHORS = 2000  # configurations over which the base is aligned
BLIND = 30.0  # tolerance: deg; only a word in place of a number that means nothing
COLUMNS = ("configuration", *"xyz", "rx", "ry", "rz", "band", "band_new", "turn_band")  # that readers see


def shape_motion(robot: Robot, known: Knowledge) -> tuple[Array, str]:
    """The motion of the base that undoes most of each parameter over the workspace, (6, k), and the workspace's name."""
    sample, region = sample_joints(robot.chain, known.joints, ANCHORS)
    names = parameters_of(robot.chain, known.total)
    jac = robot.chain.parameter_jacobian(sample, names, known.conditions)
    return base_motion(jac, robot.chain.pose(sample, known.conditions)[:, :3, 3]), region


def predict_poses(folder: Path, robot: Robot, poses: Path, absolute: bool) -> Prediction:
    """Predicts the tool's pose at the joint values of a CSV. Raises InputError.

    The band is that of the arm's shape, unless `absolute` or the run measured the base itself: then it is that of the
    pose in base coordinates.
    """
    known = knowledge_of(folder, robot.chain.table)
    targets = read_targets(poses, robot.chain)
    q = targets.targets.joints
    if q is None:
        expected = f"columns {robot.chain.joint_names[0]} to {robot.chain.joint_names[-1]} with units"
        raise FormatError("there are no joint values", file=poses, expected=expected)
    whole = absolute or known.placed
    motion, region = (None, "") if whole else shape_motion(robot, known)
    conditions: dict[str, ArrayLike] = {**known.conditions, **targets.targets.extra}
    found = predict(robot.chain, q, known.total, conditions, motion)
    warnings = [
        *run_cautions(str(folder)),
        *robot.warnings,
        *(remark for file in targets.files for remark in file.remarks),
        *_outside(robot, known, q),
        *_condition_remarks(robot, known, q, targets.targets.extra),
    ]
    if (folder / LAYER).is_file():
        warnings.append(Remark.of(Code.LAYER_LEFT_OUT, what="predictions"))
    rows = _listing(targets.ids, found, known)
    files = (InputFile(folder / COVARIANCE, read_text(folder / COVARIANCE).sha256), *targets.files)
    shape = f"of the arm's shape: the base placed best over the {region}"
    notes = "± are 95 % radii: of the model [mm], of a new measurement [mm], of the model's turn [deg]; "
    return Prediction(
        robot.name, rows, "base" if whole else "the best place of the base over the workspace",
        f"{len(rows)} poses of the tool, in base coordinates", _table(rows), notes + ("where the base stands included" if whole else shape),
        files, tuple(warnings), partial(shapes_of_rows, robot.chain, targets.ids, found.pose, q, conditions),
    )  # fmt: skip


def _table(rows: Listing) -> Listing:
    """What readers see of the poses; of a turn that nothing determines no number."""
    *others, turn = rows.only(*COLUMNS).columns
    shown = ["not seen" if v > BLIND else figure(v, turn.figures) for v in turn.plain]
    return Listing((*others, replace(turn, values=shown)))


def _outside(robot: Robot, known: Knowledge, q: Array) -> list[Remark]:
    """Joint values where the robot was never measured: the model is trusted there, not tested."""
    if known.joints is None:
        return []
    out = np.atleast_2d((q < known.joints[:, 0] - 1e-9) | (q > known.joints[:, 1] + 1e-9))
    names = tuple(robot.chain.joint_names[i] for i in np.flatnonzero(out.any(axis=0)))
    if not names:
        return []
    many = int(out.any(axis=1).sum())
    return [Remark.of(Code.OUTSIDE_MEASURED, poses=many, total=len(q), joints=names)]


def _condition_remarks(robot: Robot, known: Knowledge, q: Array, given: Mapping[str, Array]) -> list[Remark]:
    """Recorded columns that the model depends on and the poses do not have: the mean of the measurements is no answer for
    a pose that is reached from the other side, or on a hot day."""
    here: dict[str, ArrayLike] = {**known.conditions, **given}
    plain = robot.chain.pose(q, here)
    absent = [n for n in known.conditions if n not in given]
    names = [n for n in absent if (robot.chain.pose(q, {**here, n: known.conditions[n] + 1.0}) != plain).any()]
    return [Remark.of(Code.CONDITIONS_ASSUMED, columns=tuple(names))] if names else []


def _listing(ids: Sequence[str], found: Predicted, known: Knowledge) -> Listing:
    """One row per pose: place and turn, 95 % radii of the model and of a new measurement, one sigma of the place."""
    dof = known.total.dof
    shift, spin = known.noise.get("m", 0.0), known.noise.get("rad")
    turned = np.full(len(ids), np.nan) if spin is None else radius(found.turn + spin**2 * np.eye(3), dof)
    sigma = np.sqrt(np.einsum("kii->ki", found.position))
    lengths = zip("xyz", found.pose[:, :3, 3].T, strict=True)
    angles = zip(("rx", "ry", "rz"), so3.log(found.pose[:, :3, :3]).T, strict=True)
    band, new = radius(found.position, dof), radius(found.position + shift**2 * np.eye(3), dof)
    turn = np.degrees(radius(found.turn, dof))
    return Listing((
        Column("configuration", "", tuple(ids)),
        *(Column(name, "mm", 1e3 * v, spec=".3f") for name, v in lengths),
        *(Column(name, "deg", np.degrees(v), spec=".3f") for name, v in angles),
        *(Column(f"sigma_{a}", "mm", 1e3 * v) for a, v in zip("xyz", sigma.T, strict=True)),
        Column("band", "mm", 1e3 * band, label="± model", figures=2),
        Column("band_new", "mm", 1e3 * new, label="± new", figures=2),
        Column("turn_band", "deg", turn, label="± turn", figures=2),
        Column("turn_band_new", "deg", np.degrees(turned)),
    ))  # fmt: skip

"""Where images see the target, against where the machine has it: an error in lengths of data that are pixels alone.

    T_i = argmin of the reprojection errors of all images of pose i, frames and lenses as fitted
    e_i = | T_machine T_i^-1 p - p |,    p the middle of the points that were seen, in base coordinates as the images have them

All cameras that saw one pose (configurations with one id, at one place) see it together, as bodies that are fixed to one another. The
noise of the images is part of the error.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.camera_views import carriers
from robocal.diagnose.check_registry import Finding, When, check, note
from robocal.fit.free_poses import own_poses
from robocal.fit.repeats import places
from robocal.geometry import se3
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Model, Rig, freedom_of
from robocal.prove.decision import Decision
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["ImagePlaces", "image_places", "note_image_places"]

SEVERAL = 2  # grid: cameras that see a place together


@record
class ImagePlaces:
    """Errors (N,) in m, each with the first configuration (N,) of its pose."""

    error: Array
    at: Ints


def image_places(model: Model, data: DataSet, values: dict[str, float]) -> ImagePlaces | None:
    """Of a machine whose poses are known, by its joints or as given, and whose parameters, and frames and lenses of the data, have these
    `values`; None of any other, and where no camera saw anything."""
    where = data.configurations
    seen = [
        o for o in data.observations if o.kind == "pixels" and o.value.ndim == 2 and o.frame is not None and o.targets
    ]
    if not seen or freedom_of(model):
        return None
    machine = carriers(model.with_values({n: v for n, v in values.items() if n in model.table}), data)
    if machine is None:
        return None
    names = np.unique(np.array(where.ids, dtype=str), return_inverse=True)[1]
    _, first, pose = np.unique(np.column_stack([names, places(where)]), axis=0, return_index=True, return_inverse=True)
    pose = pose.ravel()
    still = [_fixed(o if o.used is None else o.take(np.flatnonzero(o.used)), values, pose) for o in seen]
    stood = Configurations(tuple(where.ids[i] for i in first), start=se3.to_vector(machine[first]))
    made = build(Rig(), DataSet(stood, tuple(still)))
    made = made.with_table(made.table.with_values({n: values[n] for n in made.table.names if n in values}))
    x, factor, _ = own_poses(made, made.start, np.ones((1, len(first)), dtype=np.bool_))
    found = se3.from_vector(x[0, made.places[0]].reshape(-1, 6))
    total, count = np.zeros((len(first), 3)), np.zeros(len(first))
    for obs in still:
        np.add.at(total, obs.configuration, _points(obs, found))
        np.add.at(count, obs.configuration, 1)
    told = np.flatnonzero((count > 0) & np.isfinite(factor[0]))
    middle = total[told] / count[told, None]
    moved = machine[first[told]] @ se3.inverse(found[told])
    error = np.linalg.norm(np.einsum("nij,nj->ni", moved[:, :3, :3], middle) + moved[:, :3, 3] - middle, axis=1)
    order = np.argsort(first[told], kind="stable")
    return ImagePlaces(error[order], first[told][order])


@check("image-places", When.FIT, order=25, needs=("proven",))
def note_image_places(context: Decision[Model]) -> Iterator[Finding]:
    """How far from the robot's several cameras together see their target, of frames that were fitted alone, on unseen poses."""
    cameras = {o.label for o in context.need_data.observations if o.kind == "pixels"}
    if len(cameras) < SEVERAL or not context.frames_alone or context.proof is None or context.proof.after.x is None:
        return
    fit = context.proven.part
    names, found = fit.problem.table.names, []
    for x, held in zip(context.proof.after.x, context.proof.split.held_out, strict=True):
        values = dict(zip(names, map(float, x), strict=False))
        if (seen := image_places(context.model, fit.data.take(np.flatnonzero(held)), values)) is not None:
            found.append(seen.error)
    error = np.concatenate(found) if found else np.zeros(0)
    if len(error):
        amounts = {"mean": error.mean(), "median": np.median(error), "largest": error.max()}
        lengths = {k: Quantity(float(v)) for k, v in amounts.items()}
        yield note(Code.IMAGE_PLACES, instruments=tuple(sorted(cameras)), poses=len(error), **lengths)


def _fixed(obs: Observations, values: dict[str, float], pose: Ints) -> Observations:
    """The same rows of poses, where frames stand as fitted."""

    def stand(frame: Frame) -> Frame:
        return replace(frame, value=tuple(values[p.name] for p in frame.parameters), free=(False,) * 6)

    assert obs.frame is not None
    targets = tuple(stand(t) for t in obs.targets)
    return replace(obs, configuration=pose[obs.configuration], frame=stand(obs.frame), targets=targets)


def _points(obs: Observations, found: Array) -> Array:
    """The points (k, 3) of all rows in base coordinates, where what moves is as `found` (U, 4, 4)."""
    which = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    held = se3.from_vector(np.array([t.value for t in obs.targets]))[which]
    on_tool = np.array([t.mount == "tool" for t in obs.targets])[which]
    stand = np.where(on_tool[:, None, None], found[obs.configuration] @ held, held)
    return np.asarray(np.einsum("nij,nj->ni", stand[:, :3, :3], obs.extra["point"]) + stand[:, :3, 3])

"""Views beside the pose of another view: two that changed places, one with the pose of another moment, or all from one on.

    e_ij = |log(A M_j B, Y_i)|,    place over the distance of the target, and turn

A and B are what most views agree on (`fit/starts/consensus`); Y_i is the pose of the target in the camera, M_j that of the robot. What
fits is decided as for the views of a camera anywhere (`diagnose/exchanged_views`). Images and poses that changed places look the same.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._types import Array
from robocal.diagnose.exchanged_views import VIEWS_EXCHANGED, places_of_views, readings_of_views
from robocal.diagnose.limits import GROSS_SHARE
from robocal.diagnose.view_readings import READINGS_OF_ANOTHER, VIEW_OF_ANOTHER
from robocal.diagnose.vision_limits import HAND_EYE_ASK
from robocal.fit.starts.consensus import agree, views_near
from robocal.geometry import se3, so3
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.hand_eye_data import HandEyeData
from robocal.session.vision.hand_eye_step import tell_step
from robocal.session.vision.hand_eye_twins import tell_renamed, tell_twins

__all__ = ["find_exchanged"]

MOST = 200  # grid: views that are tried at each other's poses


def find_exchanged(opened: HandEyeData) -> Iterator[Remark]:
    """Every two views that are exchanged, and every view with the pose of another; the view from which on all are out of step; and the
    views that show another target of the same number. None where views hardly agree."""
    where, seen = opened.target_views()
    machine = opened.flange[where]
    if len(where) > MOST or opened.unknowns.path is not None:  # between poses of a log there is no other one
        return
    machine = se3.inverse(machine) if opened.inhand else machine
    found = agree(seen, machine)
    if found is None:
        return
    names = [opened.views[i] for i in where.tolist()]
    near = views_near(found, seen, machine)
    if not near.all():
        whole = list(tell_renamed(opened)) if len(opened.observations.targets) > 1 else []
        if not whole and near.mean() < 1 - GROSS_SHARE:
            whole = [*tell_step(names, seen, machine), *tell_twins(opened)]
        if whole:
            yield from whole
            return
    place, turn = _missed(found[0] @ machine @ found[1], seen)
    error = np.hypot(place / np.median(np.linalg.norm(seen[:, :3, 3], axis=1)), turn)
    if np.median(np.diag(error)) > HAND_EYE_ASK:
        return
    said = {"instruments": (opened.observations.label,), "files": tuple(f.file.name for f in opened.files)}
    for i, j, mutual in places_of_views(error):
        amounts = {"stated": Quantity(float(place[i, i])), "left": Quantity(float(place[i, j]))}
        code, more = (VIEWS_EXCHANGED, {"every": None}) if mutual else (VIEW_OF_ANOTHER, {})
        yield Remark.of(code, view=names[i], partner=names[j], **said, **more, **amounts)
    for i, j in readings_of_views(error):
        amounts = {"stated": Quantity(float(place[i, i])), "left": Quantity(float(place[j, i]))}
        yield Remark.of(READINGS_OF_ANOTHER, view=names[i], partner=names[j], **said, **amounts)


def _missed(there: Array, seen: Array) -> tuple[Array, Array]:
    """From poses `there` (n, 4, 4) of every column to `seen` of every row: m and rad, (n, n)."""
    place = np.linalg.norm(seen[:, None, :3, 3] - there[None, :, :3, 3], axis=2)
    turn = np.einsum("jlk,ilm->ijkm", there[:, :3, :3], seen[:, :3, :3])
    return place, np.linalg.norm(so3.log(turn), axis=2)

"""Moments of gravity at the joints of an arm, as columns that compliance multiplies.

They depend on the geometry that is being identified, and are taken at the nominal model while it is sought. The
relative error is that of nominal lengths and angles (1e-3), of a deflection (1e-3 rad): second order, 1e-6 rad. The
identified chain takes them at its own values, so a second identification from there would not change them any more.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.arms.chain import Chain, drive_term
from robocal.arms.columns import ChainColumn
from robocal.arms.screws import chart
from robocal.errors import ModelError, nearest
from robocal.geometry.gravity import GRAVITY
from robocal.geometry.path.program import Element
from robocal.parameters import ParameterTable

__all__ = ["Gravity", "Load", "Triple", "axis_of", "drive", "link_end"]

Known = Mapping[str, Array]
Triple = tuple[float, float, float]


# --- where things are in a chain ------------------------------------------------------------------------------------


def drive(chain: Chain, joint: str) -> int:
    """The number of the element that a joint moves. Raises ModelError for an unknown joint."""
    for i, element in enumerate(chain.elements):
        if drive_term(element, joint) is not None:
            return i
    raise ModelError("no joint has this name", key=joint, suggestion=nearest(joint, chain.joint_names))


def link_end(chain: Chain, joint: str) -> int:
    """The number of elements up to where the row of a joint ends: behind the last one that it owns a parameter of."""
    _ = drive(chain, joint)
    owned = [i for i, e in enumerate(chain.elements) if any(t.parameter.rpartition(".")[0] == joint for t in e.terms)]
    return owned[-1] + 1


def axis_of(element: Element) -> tuple[Array, Array]:
    """Axis, u and v as rows (3, 3) with u x v = axis, and a point (3,) of the axis, in the coordinates behind the
    element."""
    if element.axis == "screw":
        v, w = np.array(element.screw[:3]), np.array(element.screw[3:])
        turning = bool(w.any())
        axis = (w if turning else v) / np.linalg.norm(w if turning else v)
        point = np.cross(w, v) if turning else np.zeros(3)
    else:
        axis, point = np.eye(3)["xyz".index(element.axis[1])], np.zeros(3)
    u, v = chart(axis)
    return np.stack([axis, u, v]), point


# --- moments --------------------------------------------------------------------------------------------------------


@record
class Load:
    """A mass (kg) that link `link` carries, its centre `at` in the frame in which the link's row ends (m); link "" is
    the tool.

    `column` names a recorded column that multiplies the mass (the payload); where it was not recorded, it is zero.
    """

    link: str
    mass: float
    at: Triple = (0.0, 0.0, 0.0)
    column: str = ""


@record
class Gravity:
    """Moments of gravity at chosen joints, of the loads behind each, at the nominal model.

        M_j = R_j^T sum_l (p_l - o_j) x m_l g,     columns `gravity.j`, `gravity.j.u`, `gravity.j.v`  (N m)

    along the joint's axis and along two directions u, v perpendicular to it, which turn with the link. `acceleration`
    is g in base coordinates (m/s^2).
    """

    model: Chain
    joints: tuple[str, ...]
    loads: tuple[Load, ...]
    acceleration: Triple = GRAVITY
    label: str = "gravity"

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{self.label}.{j}{end}" for j in self.joints for end in ("", ".u", ".v"))

    @cached_property
    def _ends(self) -> dict[str, int]:
        """Behind how many elements each link ends; the whole arm is the tool's."""
        wanted = {load.link for load in self.loads}
        return {name: link_end(self.model, name) if name else len(self.model.elements) for name in wanted}

    @cached_property
    def _joints(self) -> dict[str, tuple[int, Array, Array]]:
        """How many elements there are up to each joint, its own included, with its directions and a point of its axis there."""
        at = {joint: drive(self.model, joint) for joint in self.joints}
        return {j: (i + 1, *axis_of(self.model.elements[i])) for j, i in at.items()}

    @cached_property
    def _pieces(self) -> dict[int, Chain]:
        """The arm from each of these places to the next, by where it ends: every element is passed once."""
        counts = sorted({*self._ends.values(), *(count for count, _, _ in self._joints.values())})
        starts = [0, *counts[:-1]]
        return {b: replace(self.model, elements=self.model.elements[a:b]) for a, b in zip(starts, counts, strict=True)}

    def _frames(self, q: Array, known: Known) -> dict[int, Array]:
        """T_base (m, 4, 4) behind so many elements."""
        # Of all that is known it reads little: what it multiplies, and what its own derived columns come from.
        read = known if self.model.derived else {c: known[c] for c in self.model.program.columns if c in known}
        out, pose = {}, np.eye(4)
        for count, piece in self._pieces.items():
            pose = pose @ piece.pose(q, read)
            out[count] = pose
        return out

    def at(self, table: ParameterTable) -> ChainColumn:
        names = self.model.table.names
        return replace(self, model=self.model.with_values({n: table[n].value for n in names if n in table}))

    def columns(self, q: Array, known: Known) -> dict[str, Array]:
        order = [*self.model.joint_names, ""]
        frames = self._frames(q, known)
        # Behind every link, the tool's first: the mass (m,) and its first moment about the base (m, 3).
        mass, moment = np.zeros(len(q)), np.zeros((len(q), 3))
        behind = {}
        for link in reversed(order):
            for load in (load for load in self.loads if load.link == link):
                own = np.full(len(q), load.mass) * (known.get(load.column, 0.0) if load.column else 1.0)
                pose = frames[self._ends[link]]
                mass = mass + own
                moment = moment + own[:, None] * (pose[:, :3, :3] @ np.asarray(load.at) + pose[:, :3, 3])
            behind[link] = mass, moment
        out = {}
        weight = np.asarray(self.acceleration, float)
        for joint, (count, frame, origin) in self._joints.items():
            pose, (mass, moment) = frames[count], behind[joint]
            centre = pose[:, :3, :3] @ origin + pose[:, :3, 3]
            turned = np.einsum("mba,mb->ma", pose[:, :3, :3], np.cross(moment - mass[:, None] * centre, weight))
            for end, direction in zip(("", ".u", ".v"), frame, strict=True):
                out[f"{self.label}.{joint}{end}"] = turned @ direction
        return out

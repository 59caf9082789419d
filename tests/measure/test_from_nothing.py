"""Rigs of which less is known: one instrument, one place, sizes that nobody measured, a camera in hand that sees raw
pixels. Nobody says where anything stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms.arm_samples import arm
from measure.rigs import (
    PLATES,
    SIX,
    Frame,
    anywhere,
    at_the_place,
    configurations,
    cube_faces,
    on_a_cube,
    on_a_plate,
    on_a_sphere,
    recorded_by,
    rows,
    stated,
    touching,
    watched,
)

from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.data import DataSet
from robocal.prove.identify import identify

POSES = 120


def tip(value, free=()):
    return lambda i: {"radius": "tip", "values": {"radius": value}, "free": free}


def pixels_in_hand(truth, rng, m, contact=0):
    """Four points of a board that stands somewhere in front of a camera in hand, of known intrinsics."""
    eye = Frame("eye", (0.03, -0.02, 0.05, 0.2, 0.1, 0.4), SIX, "tool")
    q = 0.25 * anywhere(truth, rng, 4000)
    t = truth.pose(q) @ se3.from_vector(eye.value)
    board = t[0] @ se3.compose(np.eye(3), [0.0, 0.0, 1.2])
    seen = np.linalg.inv(t) @ board[:, 3]
    good = (seen[:, 2] > 0.5) & (np.abs(seen[:, :2]).max(axis=1) < 0.5 * seen[:, 2])
    q = q[good][:m]
    points = 0.1 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    obs = rows(
        "pixels", 4 * m, 0.05, eye, (Frame("board", tuple(se3.to_vector(board)), SIX),), configuration=np.repeat(np.arange(m), 4),
        options={"camera": "lens", "intrinsics": (2000.0, 2000.0, 1000.0, 800.0, -0.05, 0.01, 0.0, 0.0, 0.0), "free": ()},
        extra={"point": np.tile(points, (m, 1))},
    )  # fmt: skip
    return DataSet(configurations(q), (obs,))


LESS = {
    "one theodolite": watched("bearing", 2e-5),
    "one socket": touching("point", 1, at_the_place),
    "one plate": touching("plane", 1, on_a_plate(0.005), tip(0.005)),
    "one wall": touching("plane", 1, on_a_plate(0.005), tip(0.005), axes=PLATES[1:]),
    "spheres of unknown size": touching("sphere", 3, on_a_sphere(0.03), tip(0.03, ("radius",))),
    "a datum cube, a ball of unknown size": touching(
        "plane", 1, on_a_cube, tip(0.005, ("radius",)), axes=PLATES, extra=cube_faces
    ),
    "pixels of a camera in hand": pixels_in_hand,
}


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", LESS)
def test_from_nothing(name):
    """Converged, improved, and no more left than the stated noise."""
    rng = np.random.default_rng(1)
    made = arm("dh", "RRRRRR", rng)
    table = made.table.with_free([n for n in made.usual if not n.startswith("tool.")])
    nominal = replace(made, table=table)
    errors = {"m": 1e-3, "rad": 2e-3}
    truth = nominal.with_values({n: table[n].value + errors[table[n].unit] * rng.standard_normal() for n in table.free})
    data = stated(recorded_by(LESS[name], truth, rng, POSES, POSES), rng)
    found = identify(nominal, data, Options(leave_one_out=False))
    assert found.verdict.status == "improved", found.verdict.reasons
    for g in found.groups:
        assert g.sigma_source == "stated" and g.chi2 / g.dof < 1 + 5 * np.sqrt(2 / g.dof), g.name
    # What was free of the tip is found: 5 mm, or 30 mm, within what it is said to be off by.
    unknown = [p for p in found.parameters if p.name == "tip.radius" and p.status != "fixed"]
    assert len(unknown) == ("unknown" in name)
    for p in unknown:
        size = 0.03 if "spheres" in name else 0.005
        assert p.sigma is not None and abs(p.identified - size) < 4 * p.sigma < 1e-3

"""Machines before cameras that see a board: an arm, a cable robot, and a rig that nothing but the cameras sees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from prove.machines import hung, lengths

from robocal.files.robot import open_robot
from robocal.geometry import se3
from robocal.measure.base import Rig, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.reach import reach

LENS = (900.0, 905.0, 640.0, 412.0, -0.1, 0.02, 0.0, 0.0, 0.0)
GRID = np.array([(c % 9 * 0.02, c // 9 * 0.02, 0.0) for c in range(63)])
MIDDLE = se3.from_vector((0.08, 0.06, 0.0, 0.0, 0.0, 0.0))
SIX = (True,) * 6
Q = np.radians([20.0, -70.0, 90.0, -60.0, -80.0, 30.0])


def eyes(board, count):
    """Cameras `count` in front of a board, 0.9 m away, each from another side: T_base_camera."""
    out = []
    for k in range(count):
        turn = se3.from_vector((0, 0, 0, 0.35 * np.cos(2.1 * k), 0.35 * np.sin(2.1 * k), 0.4 * k))
        out.append(board @ MIDDLE @ turn @ se3.from_vector((0, 0, 0.9, np.pi, 0, 0)))
    return out


def camera(k, where, ids, *, free=SIX, sigma=0.2, board=(0.02, 0.01, 0.03, 0.0, 0.0, 0.1), board_free=SIX):
    """What a camera sees of a board on what moves, without values."""
    m, n = len(ids), len(GRID)
    frames = (
        Frame(f"cam{k}", tuple(se3.to_vector(se3.inverse(where))), free),
        Frame("board", board, board_free, "tool", (0.1, 0.3)),
    )
    return Observations(
        "pixels", np.repeat(ids, n), np.zeros((m * n, 2)), np.full((m * n, 2), sigma), frames[0], (frames[1],),
        np.zeros(m * n, dtype=np.int64), {"point": np.tile(GRID, (m, 1))}, {"camera": f"lens{k}", "intrinsics": LENS, "free": ()},
        source=f"somewhere/cam{k}.csv", rows=np.arange(m * n) + 2,
    )  # fmt: skip


def recorded(truth, where, seen, rng):
    """The data that the true machine gives; frames in the data are stated a little off."""
    data = synthesise(truth, DataSet(where, tuple(seen)), rng)
    moved = []
    for o in data.observations:
        frame = o.frame
        if frame is not None and any(frame.free):
            frame = replace(frame, value=tuple(np.array(frame.value) + rng.normal(0, 0.003, 6)))
        moved.append(replace(o, frame=frame))
    return replace(data, observations=tuple(moved))


def names(m):
    return tuple(f"p{i}" for i in range(m))


def arm(rng, m=40, cameras=2):
    """An arm that carries the board: model, truth, data. Configurations are those of one list, as several columns of files have them."""
    model = open_robot("ur10").chain
    model = replace(model, table=model.table.with_free([n for n in model.usual if not n.startswith("tool.")]))
    truth = model.with_values(
        {
            n: model.table[n].value + rng.normal(0, 5e-4 if model.table[n].unit == "m" else 1e-3)
            for n in model.table.free
        }
    )
    q = Q + rng.uniform(-0.1, 0.1, (m, 6)) * [1, 1, 1, 3, 3, 3]
    there = reach(truth, Q[None], (), {})[0][0] @ se3.from_vector((0.02, 0.01, 0.03, 0.0, 0.0, 0.1))
    seen = [camera(k, e, np.arange(m)) for k, e in enumerate(eyes(there, cameras))]
    return model, truth, recorded(truth, Configurations(names(m), q), seen, rng)


def poses(rng, m):
    """Poses about the middle of a frame of 4 x 4 x 3 m, frame vectors (m, 6)."""
    return np.column_stack([rng.uniform(-0.25, 0.25, (m, 3)) + [0, 0, 1.5], rng.normal(0, 0.12, (m, 3))])


def cable(rng, m=40, cameras=3):
    """A cable robot whose platform carries the board."""
    model = hung()
    truth = model.with_values({n: model.table[n].value + rng.normal(0, 0.005) for n in model.table.free})
    start = poses(rng, m)
    there = se3.from_vector(np.array([0, 0, 1.5, 0, 0, 0])) @ se3.from_vector((0.02, 0.01, 0.03, 0.0, 0.0, 0.1))
    seen = [camera(k, e, np.arange(m)) for k, e in enumerate(eyes(there, cameras))]
    data = recorded(truth, Configurations(names(m), start=start), [lengths(model, m), *seen], rng)
    return model, truth, data


def rig(rng, m=40, cameras=3):
    """A board that somebody moves before cameras: the first says where it is."""
    model = Rig()
    start = poses(rng, m)
    there = se3.from_vector(np.array([0, 0, 1.5, 0, 0, 0]))
    still = {"board": (0.0,) * 6, "board_free": (False,) * 6}
    seen = [
        camera(k, e, np.arange(m), free=SIX if k else (False,) * 6, **still) for k, e in enumerate(eyes(there, cameras))
    ]
    return model, model, recorded(model, Configurations(names(m), start=start), seen, rng)


MACHINES = {"arm": arm, "cable": cable, "rig": rig}


def pixels(data):
    """The numbers of the observations that are of cameras."""
    return [i for i, o in enumerate(data.observations) if o.kind == "pixels"]


def with_seen(data, own, **changes):
    """The data with other fields of one of its observations."""
    seen = list(data.observations)
    seen[own] = replace(seen[own], **changes)
    return replace(data, observations=tuple(seen))


def exchange(data, own, a, b):
    """The data where the views a and b of one instrument are beside each other's configuration."""
    c = data.observations[own].configuration
    return with_seen(data, own, configuration=np.where(c == a, b, np.where(c == b, a, c)))

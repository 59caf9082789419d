"""Mistakes in the list of a phantom are named with the factor, the axis or the two names; without the mistake nothing is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from probe_world import NAMES, PIXEL, RIG, WIRES, draw

from robocal.fit.options import Options
from robocal.measure.data import DataSet
from robocal.measure.plane_points import across
from robocal.prove.identify import identify


def change(data, **extra):
    (obs,) = data.observations
    return DataSet(data.configurations, (replace(obs, extra={**obs.extra, **extra}),))


def exchange(data, one=1, other=7):
    (obs,) = data.observations
    named = obs.extra["named"].astype(int)
    to = np.arange(len(NAMES))
    to[[one, other]] = other, one
    first = np.array([np.flatnonzero(named == i)[0] for i in range(len(NAMES))])[to[named]]
    return change(data, named=to[named].astype(float), at=obs.extra["at"][first], across=obs.extra["across"][first])


def scale(data, factor):
    (obs,) = data.observations
    return change(data, at=obs.extra["at"] * factor)


def mirror(data):
    (obs,) = data.observations
    signs = np.array([-1.0, 1, 1])
    return change(data, at=obs.extra["at"] * signs, across=obs.extra["across"] * signs)


def move_wire(data, by, name="H3"):
    """The data with the list of the phantom wrong at the back end of one wire."""
    (obs,) = data.observations
    ends = WIRES.copy()
    ends[NAMES.index(name), 1, 0] += by
    named = obs.extra["named"].astype(int)
    return change(data, at=ends[named, 0], across=across(ends[:, 1] - ends[:, 0])[named])


def other_depth(data, factor):
    (obs,) = data.observations
    values = {"su": PIXEL[0] * factor, "sv": PIXEL[1] * factor}
    return DataSet(data.configurations, (replace(obs, options={**obs.options, "values": values}),))


def said(data):
    found = identify(RIG, data, Options())
    codes = {str(r.code): dict(r.items) for r in (*found.verdict.reasons, *found.findings)}
    return found.verdict.status, codes


# obeys: phantom-exchanged
# obeys: phantom-unit
# obeys: phantom-mirrored
# obeys: phantom-displaced
# obeys: pixel-size
@pytest.mark.parametrize(
    ("wrong", "mend", "code", "fact"),
    [
        (exchange, exchange, "phantom-exchanged", ("one", "L1")),
        (lambda d: scale(d, 1 / 25.4), lambda d: scale(d, 25.4), "phantom-unit", ("factor", pytest.approx(1 / 25.4))),
        (mirror, mirror, "phantom-mirrored", ("axis", "x")),
        (lambda d: move_wire(d, -5e-3), lambda d: move_wire(d, 0.0), "phantom-displaced", ("name", "H3")),
        (
            lambda d: other_depth(d, 2.0),
            lambda d: other_depth(d, 1.0),
            "pixel-size",
            ("factor", pytest.approx(0.5, rel=0.01)),
        ),
    ],
    ids=["names", "inches", "mirrored", "wire", "depth"],
)
def test_the_mistake_is_named_and_gone_when_corrected(wrong, mend, code, fact):
    data, _ = draw(3)
    bad = wrong(data)
    status, codes = said(bad)
    assert code in codes and codes[code][fact[0]] == fact[1]
    assert status == ("located" if code == "pixel-size" else "refused")
    status, codes = said(mend(bad))
    assert status == "located" and not {c for c in codes if c.startswith(("phantom-", "pixel-"))}


def test_what_one_wire_or_parallel_frames_cannot_tell_is_said():
    """One wire leaves turns about it; frames that are all parallel, with a free phantom, leave both."""
    data, _ = draw(5, turn=0.02)
    (obs,) = data.observations
    one = DataSet(data.configurations, (obs.take(np.flatnonzero(obs.extra["named"] == 1)),))
    status, codes = said(one)
    assert status != "located" or {"frames-open", "frames-loose"} & set(codes)
    data, _ = draw(5, turn=0.0)
    (obs,) = data.observations
    (phantom,) = obs.targets
    loose = DataSet(data.configurations, (replace(obs, targets=(replace(phantom, prior=None),)),))
    status, codes = said(loose)
    assert status == "refused" and "little-turn" in codes


def test_a_probe_at_rest_says_nothing_of_the_size_of_a_phantom():
    """Without motion a list of any size leaves as much in proportion: no factor is better than another."""
    data, _ = draw(5)
    (obs,) = data.observations
    still = replace(
        data.configurations, start=np.repeat(data.configurations.starts[:1], len(data.configurations), axis=0)
    )
    _, codes = said(DataSet(still, (obs,)))
    assert "phantom-unit" not in codes

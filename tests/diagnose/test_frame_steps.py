"""Frames with two places, or another than stated: named with how far, and nothing is said where nothing moved or once it is mended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from probe_world import NAMES, RIG, SIGMA, WIRES, draw

from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.data import DataSet
from robocal.prove.identify import identify
from robocal.simulation.wire_images import look_at_wires, probe_data

MOVED, ELSEWHERE, MIXED = "frame-moved", "frame-elsewhere", "phantom-mixed"
IMAGES, HALF = 60, 30


def said(data):
    """Status, and the remarks on frames and names."""
    found = identify(RIG, data, Options(leave_one_out=False))
    every = (*found.verdict.reasons, *found.warnings)
    return found.verdict.status, [r for r in every if r.code in (MOVED, ELSEWHERE, MIXED)]


def slipped(seed, size):
    """The image plane slips along its rows by `size` (m) before the sixteenth image."""
    data, probe = draw(seed, IMAGES)
    poses = se3.from_vector(data.configurations.starts)
    noise = np.random.default_rng(seed + 7).normal(0, SIGMA, (len(poses), len(WIRES), 2))
    later = replace(probe, image=probe.image @ se3.from_vector(np.array([size, 0, 0, 0, 0, 0])))
    before, after = (look_at_wires(p, poses, noise) for p in (probe, later))
    seen = np.concatenate([before[:HALF], after[HALF:]])
    return probe_data(probe, poses, seen, NAMES, phantom=data.observations[0].targets[0])


def stated(seed, off, **known):
    """A phantom whose list is exact, `off` (m) away from where its place is stated."""
    data, _ = draw(seed, off=False)
    (obs,) = data.observations
    place = np.array(obs.targets[0].value) + [off, 0, 0, 0, 0, 0]
    changes = {"value": tuple(place), "free": (False,) * 6, "prior": None} | known
    return DataSet(data.configurations, (replace(obs, targets=(replace(obs.targets[0], **changes),)),))


# obeys: frame-moved
@pytest.mark.parametrize("size", [1e-3, 2e-3])
def test_an_image_plane_that_slips_half_way_is_refused_by_name(size):
    data = slipped(3, size)
    status, (told,) = said(data)
    assert status == "refused" and told.code == MOVED
    numbers = told.numbers
    assert numbers["first"] == f"f{HALF}" and "image" in numbers["what"]
    assert numbers["shift"].value == pytest.approx(size, rel=0.1)
    assert said(data.take(np.arange(HALF))) == ("located", [])


# obeys: frame-elsewhere
def test_a_fixed_phantom_that_stands_elsewhere_is_refused_by_name():
    status, (told,) = said(stated(3, 0.01))
    assert status == "refused" and told.code == ELSEWHERE and "phantom" in told.numbers["what"]
    assert told.numbers["shift"].value == pytest.approx(0.01, rel=0.05)
    assert said(stated(3, 0.01, free=(True,) * 6, prior=(0.02,) * 6)) == ("located", [])


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_said_where_nothing_moved(seed):
    assert said(draw(seed)[0]) == ("located", [])
    assert said(stated(seed, 0.0)) == ("located", [])


def renamed(data, pairs):
    """The names of wires exchanged."""
    (obs,) = data.observations
    named, to = obs.extra["named"].astype(int), np.arange(len(NAMES))
    for a, b in pairs:
        to[[a, b]] = to[[b, a]]
    first = np.array([np.flatnonzero(named == i)[0] for i in range(len(NAMES))])
    moved = {k: obs.extra[k][first[to[named]]] for k in ("at", "across")}
    extra = {**obs.extra, **moved, "named": to[named].astype(obs.extra["named"].dtype)}
    return DataSet(data.configurations, (replace(obs, extra=extra),))


# obeys: phantom-mixed
@pytest.mark.parametrize("pairs", [[(0, 1), (3, 5)], [(0, 1), (1, 2)], [(1, 2), (4, 5)]])
def test_names_of_wires_that_are_exchanged_twice_are_told(pairs):
    data, _ = draw(3)
    status, (told,) = said(renamed(data, pairs))
    assert status == "refused" and told.code == MIXED
    count = told.numbers["names"].count(" is ")
    assert count == len({i for p in pairs for i in p})
    assert said(renamed(renamed(data, pairs), pairs[::-1])) == ("located", [])

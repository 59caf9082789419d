"""What the builder of a virtual rig writes of anchors: a tape measure tells each alone, ranges between beacons all together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robocal._record import replace
from robocal.cables.calibration.beacons import anchors_of_ranges, gauge_of
from robocal.errors import FormatError
from robocal.files.cable.rig_spec import CableRigSpec, read_cable_rig
from robocal.session.commissioning.rig_commission import commission
from robocal.session.commissioning.rig_world import draw_world, read_robot
from robocal.verbs.cable.rig import Options

RIG = Path(__file__).parents[2] / "examples" / "commissioning" / "rig.yaml"


def spec_of(known_by: str) -> CableRigSpec:
    spec = read_cable_rig(RIG)
    anchors = spec.model.anchors.model_copy(update={"known_by": known_by})
    return replace(spec, model=spec.model.model_copy(update={"anchors": anchors}))


def test_beacons_are_told_with_their_covariance():
    spec = spec_of("beacons")
    world = draw_world(spec, np.random.default_rng(0))
    _, covariance = anchors_of_ranges(world.belief.ranges, spec.frame, spec.model.anchors.range_sigma)
    (shared,) = read_robot(world, np.zeros(8)).robot.table.together
    free = ~gauge_of(spec.frame).ravel()
    np.testing.assert_allclose(shared.covariance, covariance[np.ix_(free, free)], rtol=1e-6, atol=1e-10)
    assert shared.names == tuple(f"c{i // 3 + 1}.a{'xyz'[i % 3]}" for i in np.flatnonzero(free))


def test_a_tape_measure_tells_each_alone():
    table = read_robot(draw_world(spec_of("tape"), np.random.default_rng(0)), np.zeros(8)).robot.table
    assert not table.together and table["c3.ay"].prior == 0.03


def test_beacons_that_fix_no_frame_are_named_with_their_file(tmp_path):
    text = RIG.read_text(encoding="utf-8").replace("- [-2.45, 1.95, 2.95]", "- [-2.4, 1.9, 2.9]", 1)
    place = tmp_path / "rig.yaml"
    place.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError) as caught:
        commission(Options(spec=place, output=tmp_path / "out", anchors="beacons"))
    assert str(place) in str(caught.value) and caught.value.key == "frame_anchors_nominal"
    assert not (tmp_path / "out").exists()

"""Trials of identifications: what a study says of each is what identify says of the same data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocal.files.studyfile import read_study
from robocal.prove.identify import identify
from robocal.studies.arms import ArmTrials

STUDIES = Path(__file__).parents[2] / "examples" / "studies"


@pytest.mark.parametrize("name", ["poses-of-an-arm", "outliers-against-losses"])
def test_a_trial_says_what_identify_says(name):
    for point in read_study(STUDIES / f"{name}.yaml").points:
        trials = ArmTrials(point)
        told = trials.run(2, np.random.default_rng(7))
        for i, own in enumerate(np.random.default_rng(7).spawn(2)):
            found = identify(trials.arm.chain, trials._measure(own)[2], trials.options)
            (stage,) = (s for s in found.stages if s.unit == "m")
            assert told["improved"][i] == (found.verdict.status == "improved")
            assert stage.held_out is not None and stage.held_out_before is not None
            assert told["before"][i] == stage.held_out_before.mean and told["after"][i] == stage.held_out.mean


def test_without_a_hold_out_a_trial_tells_what_was_left_out_one_by_one():
    point = next(p for p in read_study(STUDIES / "poses-of-an-arm.yaml").points if p["poses.count"] == 30)
    trials = ArmTrials(replace(point, settings=(*point.settings, ("options.hold_out", 0.0))))
    told = trials.run(1, np.random.default_rng(7))
    found = identify(trials.arm.chain, trials._measure(np.random.default_rng(7).spawn(1)[0])[2], trials.options)
    (stage,) = (s for s in found.stages if s.unit == "m")
    assert stage.held_out is None and stage.leave_one_out is not None and stage.leave_one_out_before is not None
    assert told["improved"][0] == (found.verdict.status == "improved")
    assert told["before"][0] == stage.leave_one_out_before.mean and told["after"][0] == stage.leave_one_out.mean

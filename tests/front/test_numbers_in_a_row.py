"""What the command line takes between commas, Python takes as a row of numbers; and a number may name its unit in both."""

from __future__ import annotations

import numpy as np
import pytest

import robocal as rc
from robocal.errors import InputError

LISTED = {"poses": 20, "choose": 15, "sigma": "0.5mm"}


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    folder = tmp_path_factory.mktemp("row")
    rc.new("cable", output=folder)
    return folder


@pytest.fixture(scope="module")
def plain(home):
    return rc.cable.poses(home / "robot.yaml", pose_noise="0.2,0.02", limits="20,600", **LISTED).text


@pytest.mark.parametrize(
    ("noise", "limits"),
    [((0.2, 0.02), [20, 600]), (np.array([0.2, 0.02]), np.array([20, 600])), (("0.2mm", "0.02deg"), ("20N", "0.6kN"))],
)
def test_rows_are_words_between_commas(noise, limits, home, plain):
    assert rc.cable.poses(home / "robot.yaml", pose_noise=noise, limits=limits, **LISTED).text == plain


@pytest.mark.parametrize(
    ("at", "said"),
    [
        ([0, 1.5], "expected X,Y,Z"),
        ([0, 0, np.nan], "expected X,Y,Z"),
        ((True, False, True), "argument at: not a value"),
        (np.zeros((2, 3)), "argument at: not a value"),
        (["0mm", "0mm", "1kg"], "a length is needed"),
    ],
)
def test_other_rows_are_answered_by_the_argument(at, said, home):
    lengths = rc.table({f"c{i} [mm]": [2800.0, 2850.0] for i in range(1, 9)})
    with pytest.raises(InputError, match=said) as failure:
        rc.cable.rezero(home / "robot.yaml", lengths, at=at)
    assert "argument at" in str(failure.value)

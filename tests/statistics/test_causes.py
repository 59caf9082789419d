"""Each cause on four arms, positions and poses: 95 % are named, two at once too, and nothing on undamaged files.

ROBOCAL_FULL=1: 20 draws for each cell of one cause, 10 of two, 640 undamaged files. Noise of 0.02 to 1 mm, errors of the arm from a third
to twice the usual, 30 to 150 rows, frame and tool known or not.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from causes import ARMS, CAUSES, EXTRA, GOOD, PAIRS, Setting, undamaged
from sizes import size

from robocal.errors import InputError
from robocal.session.inputs import read_inputs

EVERY = {**CAUSES, **PAIRS}


def message_of(robot, data) -> str:
    try:
        read_inputs(robot, data)
    except InputError as error:
        return str(error)
    return ""


def count(name, folder, draws, arms=ARMS):
    """How many are named, and what was said of the others."""
    hits, missed = 0, []
    for arm in arms:
        for pose in (False, True):
            for k in range(draws):
                rng = np.random.default_rng([list(EVERY).index(name), ARMS.index(arm), int(pose), k])
                case = EVERY[name](folder, arm, rng, Setting.draw(rng, pose))
                message = message_of(case.robot, [case.data])
                right = bool(re.search(case.words, message))
                hits += right
                missed += [] if right else [f"{arm}, {'pose' if pose else 'position'}, {k}: {message[-200:]}"]
    return hits, missed


@pytest.mark.slow
@pytest.mark.parametrize("name", CAUSES)
def test_a_cause_is_named(name, tmp_path, capsys):
    draws = size(20, 1)
    hits, missed = count(name, tmp_path, draws, ARMS if draws > 1 else ARMS[list(CAUSES).index(name) % 4 :][:1])
    with capsys.disabled():
        print(f"\n{name}: {hits} of {hits + len(missed)} named; missed: {missed[:5]}")
    assert len(missed) <= 0.05 * (hits + len(missed)), missed


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_two_causes_are_named(name, tmp_path, capsys):
    draws = size(10, 1)
    hits, missed = count(name, tmp_path, draws, ARMS if draws > 1 else ARMS[list(PAIRS).index(name) % 4 :][:1])
    with capsys.disabled():
        print(f"\n{name}: {hits} of {hits + len(missed)} named; missed: {missed[:5]}")
    assert len(missed) <= 0.05 * (hits + len(missed)), missed


@pytest.mark.slow
def test_nothing_is_named_on_undamaged_files(tmp_path, capsys):
    named, arms = [], (*ARMS, *EXTRA)
    files = size(640, 18)
    for i in range(files):
        arm, pose = arms[i // len(GOOD) % len(arms)], bool(i // (len(GOOD) * len(arms)) % 2)
        kind = GOOD[i % len(GOOD)]
        message = message_of(*undamaged(tmp_path, arm, np.random.default_rng([i, 77]), pose, kind))
        named += [f"{i}, {kind}, {arm}: {message[-200:]}"] if message else []
    with capsys.disabled():
        print(f"\nnamed on {len(named)} of {files} undamaged files: {named}")
    assert not named

"""Each cause on four arms, positions and poses: 95 % are named, and nothing on undamaged files.

ROBOCAL_TRIALS draws for each cell (20 for the figures of the documentation); errors of 0.3 to 1 mm and 1 to 5 mrad, a tracker of
0.05 mm, 30 to 150 poses, frame and target unknown.
"""

from __future__ import annotations

import os
import re

import numpy as np
import pytest
from causes import ARMS, CAUSES, Setting, World, either

from robocal.errors import InputError
from robocal.session.inputs import read_inputs

TRIALS = int(os.environ.get("ROBOCAL_TRIALS", "1"))


def message_of(robot, data) -> str:
    try:
        read_inputs(robot, [data])
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("name", CAUSES)
def test_a_cause_is_named(name, tmp_path, capsys):
    hits, missed = 0, []
    for arm in ARMS:
        for pose in (False, True):
            rng = np.random.default_rng([list(CAUSES).index(name), ARMS.index(arm), int(pose)])
            for _ in range(TRIALS):
                case = CAUSES[name](tmp_path, arm, rng, Setting.draw(rng, pose))
                message = message_of(case.robot, case.data)
                right = bool(re.search(case.words, message))
                hits += right
                missed += [] if right else [f"{arm}, {'pose' if pose else 'position'}: {message[:200]}"]
    with capsys.disabled():
        print(f"\n{name}: {hits} of {hits + len(missed)} named; missed: {missed[:5]}")
    assert hits >= 0.95 * (hits + len(missed)) - (1 if TRIALS < 5 else 0)


@pytest.mark.slow
def test_nothing_is_named_on_undamaged_files(tmp_path, capsys):
    named, draws = [], 0
    for arm in ARMS:
        for pose in (False, True):
            rng = np.random.default_rng([9, ARMS.index(arm), int(pose)])
            for k in range(4 * TRIALS):
                world = World(tmp_path, arm, rng, Setting.draw(rng, pose), either(rng))
                n = len(world.names)
                # In three draws of four the mastering of some joints is lost.
                lost = np.radians(rng.uniform(5, 40, n)) * rng.choice([-1, 1], n) * (rng.random(n) < (k % 4) / 3)
                message = message_of(world.robot, world.table(world.q, world.measure(world.q + lost)))
                named += [message[:200]] if message else []
                draws += 1
    with capsys.disabled():
        print(f"\nnamed on {len(named)} of {draws} undamaged files: {named}")
    assert not named

"""What is wrong is named on measured data too: every change that shows, in UR10 and FR3 files; undamaged, nothing is."""

from __future__ import annotations

import os

import numpy as np
import pytest
from damages import every, same, tried, undone, units, words
from real.test_franka import load as franka  # noqa: F401
from real.test_ur10 import load as ur10  # noqa: F401

from robocal.diagnose.hypotheses.changes import changes
from robocal.diagnose.hypotheses.explain import explain
from robocal.diagnose.hypotheses.lockstep import fit_trials, reach_of
from robocal.diagnose.hypotheses.sights import sights
from robocal.diagnose.limits import MAKING_LEAVES

FILES = {
    "UR10 C, position": ("ur10", "C", "position"),
    "UR10 C, pose": ("ur10", "C", "pose"),
    "UR10 D, position": ("ur10", "D", "position"),
    "FR3, position": ("franka", "position"),
    "FR3, pose": ("franka", "pose"),
}


def told(chain, data):
    """Whether the damage shows: frames alone leave more than an arm's making leaves."""
    seen = sights(chain, [data])
    return fit_trials(chain, seen).left[0] > MAKING_LEAVES * reach_of(chain, seen)


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_every_wrong_that_shows_is_named(name, request, capsys):
    fixture, *which = FILES[name]
    chain, data = request.getfixturevalue(fixture)(*which)
    for small in (True, False):
        assert explain(chain, data, changes(chain, data, *units(chain, data, small))) is None
    some = data.take(np.sort(np.random.default_rng(1).permutation(len(data.configurations))[:100]))
    hits, missed, silent = 0, [], []
    # Every third one, of poses, which have all turns of the axes besides, every eighth: others in each file; all with ROBOCAL_TRIALS.
    step = 1 if "ROBOCAL_TRIALS" in os.environ else 8 if "pose" in which else 3
    for damage in every(chain, some)[[*FILES].index(name) % step :: step]:
        spoilt = damage.apply(some)
        if not told(chain, spoilt):
            silent.append(words(damage))
            continue
        found = explain(chain, spoilt, tried(chain, spoilt, damage))
        right = found is not None and any(same(undone(damage), c) for f in found.changes for c in f)
        hits += right
        if not right:
            missed.append(f"{words(damage)}: {found and [words(c) for f in found.changes for c in f]}")
    with capsys.disabled():
        print(f"\n{name}: {hits} of {hits + len(missed)} named; missed: {missed}; not to be told: {silent}")
    assert hits >= 0.95 * (hits + len(missed))

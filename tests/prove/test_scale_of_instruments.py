"""An instrument and the cables of one robot say how long a length is, and must agree; where they do not, the advice helps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from prove.machines import cables, recorded

from robocal.diagnose.instrument_scale import UNLIKE, UNLIKE_KNOWN
from robocal.fit.options import Options
from robocal.prove.identify import identify
from robocal.remarks.code import Code

OPTIONS = Options(leave_one_out=False)
SCALES = {UNLIKE, UNLIKE_KNOWN}


def run(degrees, seed=0, *, instrument=1.0, drums=1.0, scale=0.0, gain=None, m=50):
    """A cable robot whose instrument and drums read lengths so many times too long; a free gain has a name."""
    rng = np.random.default_rng(seed)
    robot, truth, data = cables(degrees, rng, m)
    seen = []
    for o in recorded(truth, data, rng).observations:
        value = np.array(o.value)
        value[:, :3] *= drums if o.kind == "lengths" else instrument
        own = {"gain": gain, "free": ("gain",)} if gain and o.kind == "lengths" else o.options
        seen.append(replace(o, value=value, options=own, scale=None if o.kind == "lengths" else scale))
    data = replace(data, configurations=replace(data.configurations, start=None), observations=tuple(seen))
    found = identify(robot, data, OPTIONS)
    return found, {r.code: r for r in (*found.verdict.reasons, *found.warnings)}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("degrees", ["3R3T", "1R2T", "3T"])
@pytest.mark.parametrize("wrong", [{"instrument": 1.008}, {"instrument": 0.993}, {"drums": 1.012}])
def test_a_scale_that_cables_contradict_is_refused(degrees, wrong):
    found, said = run(degrees, **wrong)
    assert found.verdict.status == "refused" and UNLIKE_KNOWN in said
    factor = wrong.get("instrument", 1.0) / wrong.get("drums", 1.0) - 1
    assert said[UNLIKE_KNOWN].numbers["factor"] == pytest.approx(factor, rel=0.3)


@pytest.mark.parametrize("degrees", ["3R3T", "1R2T"])
@pytest.mark.parametrize("seed", range(3))
def test_one_that_they_do_not_is_not(degrees, seed):
    found, said = run(degrees, seed)
    assert found.verdict.status == "improved"
    assert not any(said[c].numbers["z"] > 3 for c in SCALES & set(said))


@pytest.mark.parametrize("degrees", ["3R3T", "1R2T"])
def test_the_gain_of_the_drums_explains_it(degrees):
    found, said = run(degrees, drums=1.012, gain="drums")
    assert found.verdict.status == "improved" and not SCALES & set(said)
    assert found.table["drums.gain"].value == pytest.approx(1 / 1.012, abs=2e-3)


def test_where_the_scale_is_not_known_three_sigma_are_enough():
    """Readings that leave 4 sigma are a remark where the instrument is known, and refused where it is not."""
    for scale, status in ((0.0, "improved"), (0.002, "refused")):
        found, said = run("3R3T", instrument=1.0006, scale=scale, m=25)
        assert 3 < said[UNLIKE if scale else UNLIKE_KNOWN].numbers["z"] < 5
        assert found.verdict.status == status


@pytest.mark.parametrize("degrees", ["3R3T", "1R2T"])
def test_what_is_said_of_a_scale_of_cables_is_in_the_claim(degrees):
    """A scale that is a remark makes the band wider by about what it moves: the half diagonal of the range, times the factor."""
    factor = 1.0006 if degrees == "3R3T" else 1.0012
    (plain, _), (found, said) = (run(degrees, instrument=f, m=25) for f in (1.0, factor))
    wide = np.sqrt(found.holds.band**2 - plain.holds.band**2)
    robot = found.nominal
    half = 0.35 * (robot.a.max(axis=0) - robot.a.min(axis=0))
    assert said[UNLIKE_KNOWN].numbers["z"] < 5 or found.verdict.status == "refused"
    assert wide > 0.5 * (factor - 1) * np.sqrt(np.sum(half**2) / 3)


@pytest.mark.parametrize("degrees", ["3R3T", "1R2T"])
def test_what_is_left_by_wrong_platform_anchors_names_them(degrees):
    rng = np.random.default_rng(3)
    robot, truth, data = cables(degrees, rng, 50)
    held = [
        n
        for n in robot.geometric
        if n.rpartition(".")[2] in ("bx", "by", "bz") and not (degrees == "1R2T" and n.endswith("y"))
    ]
    truth = truth.with_values({n: truth.table[n].value + rng.normal(0, 0.05) for n in held})
    data = recorded(truth, data, rng)
    found = identify(robot, data, OPTIONS)
    said = [r for r in found.warnings if r.code == Code.ABOVE_STATED_NOISE]
    line = said[0].numbers["free"]
    names = set(line.split(","))
    assert {"bx", "bz"} <= names and {"l0", "ax"} <= names
    freed = robot.with_table(robot.table.with_free([n for n in robot.table.names if n.rpartition(".")[2] in names]))
    again = identify(freed, data, OPTIONS)
    assert again.groups[0].rms < 0.3 * found.groups[0].rms

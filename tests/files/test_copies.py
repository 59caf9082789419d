"""Copies are told from repeats that agree because an instrument shows few digits."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.diagnose.check_registry import Level
from robocal.diagnose.rows.table import repeat_findings
from robocal.measure.data import Configurations, Observations
from robocal.remarks.code import Code


def repeated(rng, digits, sigma, stated=True):
    """Forty places, each measured three times."""
    q = np.repeat(rng.uniform(-1, 1, (40, 3)), 3, axis=0)
    value = np.repeat(rng.uniform(-1, 1, (40, 3)), 3, axis=0) + sigma * rng.normal(size=(120, 3))
    spread = np.full((120, 3), sigma) if stated else None
    return Configurations(tuple(map(str, range(120))), q), Observations(
        "position", np.arange(120), np.round(value, digits), spread, rows=np.arange(120) + 2
    )


@pytest.mark.parametrize("stated", [True, False])
def test_few_digits_are_no_copies(rng, stated):
    places, obs = repeated(rng, 4, 3e-5, stated)
    assert not any(r.code is Code.COPIED for r in repeat_findings(obs, places, "table.csv"))


@pytest.mark.parametrize("stated", [True, False])
def test_copied_rows_are_told(rng, stated):
    places, obs = repeated(rng, 6, 3e-5, stated)
    obs.value[31] = obs.value[30]
    obs.value[35] = obs.value[34]
    (said,) = [r for r in repeat_findings(obs, places, "table.csv") if r.code is Code.COPIED]
    assert (
        said.level is Level.DOUBT
        and said.numbers["count"] == 2
        and (said.numbers["first"], said.numbers["second"]) == (32, 33)
    )


@pytest.mark.parametrize("stated", [True, False])
def test_many_copies_are_refused(rng, stated):
    """Every second reading a copy makes sigma of the whole 0.82 of what it is."""
    places, obs = repeated(rng, 6, 3e-5, stated)
    obs.value[1::3] = obs.value[::3]
    (said,) = [r for r in repeat_findings(obs, places, "table.csv") if r.code is Code.COPIED]
    assert said.level is Level.REFUSE and said.numbers["count"] == 40


def test_an_instrument_quieter_than_stated_is_not_accused(rng):
    """Readings that scatter by half their last digit agree often, which a stated sigma of ten digits does not foretell."""
    places, obs = repeated(rng, 5, 4e-6)
    obs.sigma[:] = 1e-4
    (said,) = repeat_findings(obs, places, "table.csv")
    assert said.level is Level.DOUBT and said.numbers["count"] > 12

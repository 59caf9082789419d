"""A cable that hangs at some poses is named, with its rows; a drum that slipped and gross rows of several cables are no slack."""

from __future__ import annotations

import numpy as np
import pytest
from cables.logs import Log

from robocal.fit.options import Options
from robocal.prove.identify import identify


def said(log):
    result = identify(log.nominal(), log.data(), Options(leave_one_out=False))
    return result, [f for f in (*result.verdict.reasons, *result.findings) if f.code == "slack-cable"]


def hang(log, cable, rows):
    log.y[rows, cable] += log.rng.uniform(0.012, 0.04, len(rows))


@pytest.mark.parametrize(("kind", "share", "status"), [("eight", 0.1, "improved"), ("planar", 0.3, "refused")])
def test_the_cable_that_hangs_is_named_with_its_rows(kind, share, status):
    log = Log(kind, seed=31, path=False)
    rows = np.sort(log.rng.choice(90, int(share * 90), replace=False))
    hang(log, 2, rows)
    found, (told,) = said(log)
    assert found.verdict.status == status and told.numbers["cable"] == "c3"
    named = [int(v) for v in str(told.numbers["rows"]).split(", ")]
    assert set(named) >= set((rows + 2).tolist()) and told.numbers["longer"] == len(named)


@pytest.mark.parametrize("what", ["slip", "several", "short"])
def test_what_lies_together_is_of_several_cables_or_too_short_is_no_slack(what):
    log = Log("eight", seed=32, path=False)
    rows = log.rng.choice(90, 9, replace=False)
    if what == "slip":
        log.y[77:, 2] += 0.02
    elif what == "several":
        log.y[rows, log.rng.integers(0, 8, 9)] += 0.03
    else:
        log.y[rows, 2] -= 0.03
    assert not said(log)[1]

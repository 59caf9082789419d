"""The nominal robot beside which a gain is counted: unknown zeros or not, its unseen errors are those of the truth, and of two baselines
the one that ended higher starts again from the other."""

from __future__ import annotations

import numpy as np
import pytest
from cables.unknown import Unknown
from sizes import size

from robocal.fit.options import Options
from robocal.prove import prove
from robocal.prove.identify import identify

KINDS = [("eight", "position"), ("planar", "pose")]
EVERY = [*KINDS, ("eight", "pose"), ("planar", "position")]


def told(found):
    """The unseen errors of the nominal robot, in m, and which configurations were held out together; all, where each was."""
    stage = next(s for s in found.stages if s.unit == "m")
    ids = np.array([*found.fit_ids, *found.held_out_ids])
    whole = stage.held_out_before is None
    first = (stage.k_fold_before or stage.leave_one_out_before) if whole else stage.held_out_before
    return first.mean, stage.leave_one_out_before, None if whole else np.isin(np.sort(ids), found.held_out_ids)


def one_by_one(world):
    """The mean over rounds of a tenth each, which is near enough to one by one."""
    turn = np.arange(len(world.y)) % 10
    return float(np.mean([world.unseen(turn != k, turn == k) for k in range(10)]))


def check(world, seeds):
    """How many baselines of these split seeds are off by more than a fifth."""
    off, single, data = 0, one_by_one(world), world.data()
    ids = list(data.configurations.ids)
    for seed in seeds:
        found = identify(world.robot, data, Options(seed=seed))
        first, alone, _ = told(found)
        held = np.isin(ids, found.held_out_ids)
        folded = next(s for s in found.stages if s.unit == "m").held_out_before is None
        truth = single if folded else world.unseen(np.isin(ids, found.fit_ids), held)
        pairs = [(first, truth)] + ([(alone.mean, single)] if alone else [])
        off += sum(abs(a / b - 1) > 0.2 for a, b in pairs)
        assert found.verdict.status in ("improved", "not_improved")
    return off


@pytest.mark.parametrize(("kind", "instrument"), KINDS)
def test_the_nominal_robot_with_unknown_zeros_leaves_what_it_leaves_in_truth(kind, instrument):
    assert check(Unknown(kind, instrument, seed=71, count=40), range(1)) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "instrument"), EVERY)
def test_whatever_the_draw_and_the_log(kind, instrument):
    for log, count in enumerate((48, 40, 60)):
        assert check(Unknown(kind, instrument, seed=80 + log, count=count), range(size(20, 4))) == 0


@pytest.mark.parametrize("stuck", [0, 1], ids=["of everything", "of a part"])
def test_a_baseline_that_ended_higher_starts_again_from_the_other(stuck, monkeypatch):
    """The first baseline is fitted to everything, the second to what was not held out."""
    world, calls, renew = Unknown("eight", "pose", seed=73), [], prove.renew_baseline
    right = identify(world.robot, world.data())

    def stay(*arguments):
        found = renew(*arguments)
        calls.append(found)
        if len(calls) - 1 == stuck:
            at = [found.problem.table.index[f"tracker.{s}"] for s in ("x", "rz")]
            found.x[:, at] += [0.3, 0.4]
        return found

    monkeypatch.setattr(prove, "renew_baseline", stay)
    found = identify(world.robot, world.data())
    assert len(calls) > 1
    for stage, want in zip(found.stages, right.stages, strict=True):
        for name in ("held_out_before", "leave_one_out_before"):
            assert getattr(stage, name).mean == pytest.approx(getattr(want, name).mean, rel=1e-3)


# obeys: baselines-apart
def test_where_few_rows_are_left_to_fit_the_difference_is_told_and_the_advice_helps():
    world = Unknown("planar", "position", seed=76, count=12)

    def codes(**chosen):
        return [r.code for r in identify(world.robot, world.data(), Options(seed=2, **chosen)).warnings]

    assert "baselines-apart" in codes(hold_out=0.5, leave_one_out=True)
    assert "baselines-apart" not in codes(hold_out=0.0, folds=5)


@pytest.mark.parametrize(
    ("kind", "instrument"), [pytest.param(*k, marks=[pytest.mark.slow] * (k not in KINDS)) for k in EVERY]
)
def test_zeros_that_nobody_named_are_told_and_the_advice_helps(kind, instrument):
    world = Unknown(kind, instrument, seed=75, count=40)
    found, named = (identify(world.robot, world.data(named)) for named in (False, True))
    remarks = [r for r in found.warnings if r.code == "cable-zeros-unknown"]
    assert len(remarks) == 1 and "zeros: NAME" in remarks[0].advice
    shift = np.abs(world.zeros - world.log.zeros)
    assert remarks[0].numbers["count"] == (shift > 0.1).sum()
    assert remarks[0].numbers["most"].value == pytest.approx(shift.max(), rel=0.05)
    assert not [r for r in named.warnings if r.code == "cable-zeros-unknown"]
    assert told(named)[0] < 0.01 < told(found)[0]

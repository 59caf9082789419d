"""One finding: checks register themselves, run in their order, and the verdict is a fold over what they found and the gain."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import pytest
from judging import judge
from unit.arm_data import arm, measured

from robocal.diagnose.check_registry import (
    ALL,
    CABLES,
    DIAGNOSE,
    Check,
    Context,
    Finding,
    Given,
    Level,
    Machines,
    When,
    checks,
    doubt,
    note,
    once,
    qualify,
    refuse,
    run,
)
from robocal.errors import Cancelled
from robocal.measure.machine import Rig
from robocal.prove.evidence import Gain
from robocal.prove.identify import identify
from robocal.prove.verdict import fold
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

PROVEN = Gain(Remark.of(Code.GAIN_PROVEN, gain=Quantity(1e-3), low=Quantity(5e-4), high=Quantity(2e-3)), True)
OPEN = Gain(Remark.of(Code.GAIN_NOT_PROVEN, gain=Quantity(1e-3), low=Quantity(-5e-4), high=Quantity(2e-3)), False)


def of(check: str, *findings: Finding) -> list[Finding]:
    return [Finding(f.code, f.items, f.level, check) for f in findings]


def codes(verdict):
    return [r.code for r in verdict.reasons]


def test_a_gain_alone():
    assert fold([], PROVEN).status == "improved" and fold([], OPEN).status == "not_improved"
    assert fold([], None).reasons == ()


def test_the_last_finding_against_a_gain_is_reported_first():
    found = [*of("angles", qualify(Code.NOT_CONVERGED)), *of("moved", refuse(Code.RANK_ZERO), refuse(Code.NOT_FINITE))]
    verdict = fold(found, PROVEN)
    assert verdict.status == "refused" and verdict.region is None
    assert codes(verdict) == [Code.RANK_ZERO, Code.NOT_FINITE, Code.NOT_CONVERGED, Code.GAIN_ANYWAY]


def test_what_is_refused_stays_refused_in_any_order():
    found = [of("a", refuse(Code.RANK_ZERO)), of("b", refuse(Code.NOT_FINITE)), of("c", refuse(Code.ONE_PLACE))]
    for one, other in combinations(found, 2):
        assert fold([*one, *other], PROVEN).status == fold([*other, *one], None).status == "refused"


def test_a_finding_that_names_a_region_limits_an_improvement():
    holds = qualify(Code.HOLDS_WHERE_MEASURED, region="box", band=Quantity(1.0), moved=Quantity(0.5), chance=0.1)
    verdict = fold(of("region", holds), Gain(PROVEN.remark, True, "working"))
    assert (verdict.status, verdict.region) == ("improved", "measured")
    assert codes(verdict) == [Code.GAIN_PROVEN, Code.HOLDS_WHERE_MEASURED]


def test_a_note_follows_the_gain_and_falls_with_it():
    exact = of("exact", note(Code.EXACT, left=Quantity(0.0), digits=Quantity(1e-9)))
    assert codes(fold(exact, PROVEN)) == [Code.GAIN_PROVEN, Code.EXACT]
    assert codes(fold([*exact, *of("x", refuse(Code.RANK_ZERO))], PROVEN)) == [Code.RANK_ZERO, Code.GAIN_ANYWAY]


# --- the registry -------------------------------------------------------------------------------------------------------


def test_every_check_has_a_name_and_a_place_of_its_own():
    every = [c for package in ALL for c in checks(package)]
    assert len(every) > 35
    assert max(Counter(c.name for c in every).values()) == 1
    # Checks of lists of cable robots run by themselves.
    together = [c for c in every if c not in checks(CABLES)]
    assert max(Counter((c.when, c.order) for c in together).values()) == 1
    for c in every:
        assert c.run.__doc__ and c.run.__doc__.endswith("."), c.name


def test_a_check_runs_where_it_means_something():
    jointed, posed = (Check("x", When.FIT, 1, list, machines=m) for m in (Machines.JOINTED, Machines.POSED))
    assert jointed.applies(Context(arm()), []) and not jointed.applies(Context(Rig()), [])
    assert posed.applies(Context(Rig()), []) and not posed.applies(Context(arm()), [])
    assert not Check("x", When.FIT, 1, list, needs=("fit",)).applies(Context(arm()), [])
    first = Check("x", When.READ, 1, list, given=Given.NOTHING)
    assert first.applies(Context(arm()), []) and not first.applies(Context(arm()), [doubt(Code.ONE_PLACE)])
    gain = Check("x", When.PROOF, 1, list, given=Given.GAIN)
    assert not gain.applies(Context(arm()), [])


def test_a_watcher_hears_of_findings_and_stops_between_checks():
    events = []
    data = measured(4)
    still = Context(arm(), data.take([0, 0, 0]), watch=events.append)
    found = run(When.DATA, still, DIAGNOSE)
    assert found[0].code == Code.ONE_PLACE and found[0].level is Level.DOUBT
    spoken = [e for e in events if e["stage"] == "finding"]
    assert spoken[0]["check"] == "still-joints" and spoken[0]["sentence"] == found[0].remark.sentence
    count = sum(e["stage"] == "check" for e in events)

    def stop(event):
        heard.append(event)
        if len(heard) == 2:
            raise Cancelled("stopped")

    heard = []
    with pytest.raises(Cancelled):
        run(When.DATA, Context(arm(), data, watch=stop), DIAGNOSE)
    assert len(heard) == 2 < count


def test_what_checks_share_is_computed_once():
    calls = []

    @once
    def thing(context):
        calls.append(context)
        return None

    one, other = Context(arm()), Context(arm())
    assert thing(one) is thing(one) is thing(other) is None and len(calls) == 2


def test_findings_of_an_identification_have_levels_and_checks():
    found = identify(arm(), measured(40))
    assert [f.remark for f in found.findings] == list(found.warnings)
    assert all(f.level in (Level.DOUBT, Level.NOTE) and f.check for f in found.findings)
    assert (
        judge([1e-3] * 9, [1e-4] * 9, None, range(9), blind=True, converged=True, seed=0, kind="x").status == "refused"
    )

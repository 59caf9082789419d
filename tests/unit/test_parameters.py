"""The table of named parameters: unique names, selection by words, and errors that name what is wrong."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocal.errors import ModelError, nearest
from robocal.parameters import FRAME_SYMBOLS, TYPICAL, Parameter, ParameterTable, frame_parameters

TABLE = ParameterTable(
    (
        Parameter("j1.r", 0.3, "m", True),
        Parameter("j1.alpha", 0.1, "rad"),
        Parameter("j2.alpha", 0.2, "rad", True, prior=0.01),
        *frame_parameters("tool", range(6), free=(True,) * 3 + (False,) * 3, expected=(0.5, 0.25), source="drawing"),
        Parameter("gain", 1.0, "1"),
    )
)


def test_a_table_is_read_by_name_and_in_order():
    assert len(TABLE) == 10 and TABLE.names[:3] == ("j1.r", "j1.alpha", "j2.alpha")
    assert TABLE.free == ("j1.r", "j2.alpha", "tool.x", "tool.y", "tool.z")
    np.testing.assert_array_equal(TABLE.values, [0.3, 0.1, 0.2, 0, 1, 2, 3, 4, 5, 1])
    assert TABLE["tool.ry"].value == 4 and "tool.ry" in TABLE and "tool" not in TABLE
    np.testing.assert_array_equal(TABLE.turns, [6])


def test_a_name_used_twice_is_named():
    with pytest.raises(ModelError, match="used twice") as e:
        ParameterTable((Parameter("a.x"), Parameter("b.x"), Parameter("c.x"), Parameter("b.x")))
    assert e.value.key == "b.x"
    with pytest.raises(ModelError, match="used twice"):
        TABLE + TABLE
    assert (TABLE + [Parameter("new.x")]).names[-1] == "new.x"
    assert len(TABLE + ParameterTable((Parameter("new.x"),))) == 11


def test_frame_parameters():
    rows = frame_parameters("eye", (1, 2, 3, 4, 5, 6), free=True)
    assert [r.name for r in rows] == [f"eye.{s}" for s in FRAME_SYMBOLS]
    assert [r.unit for r in rows] == ["m"] * 3 + ["rad"] * 3 and [r.turn for r in rows] == [False] * 3 + [True] * 3
    assert all(r.free for r in rows) and [r.scale for r in rows] == [TYPICAL["m"]] * 3 + [TYPICAL["rad"]] * 3
    assert [TABLE[f"tool.{s}"].scale for s in FRAME_SYMBOLS] == [0.5] * 3 + [0.25] * 3 and TABLE[
        "tool.x"
    ].source == "drawing"


def test_scale_is_the_prior_then_the_expected_then_the_typical_error():
    assert Parameter("a", prior=0.3, expected=0.2).scale == 0.3
    assert Parameter("a", expected=0.2).scale == 0.2
    assert Parameter("a", unit="rad").scale == TYPICAL["rad"]
    assert Parameter("a", unit="furlong").scale == 1.0


def test_turns_finds_every_rotation_vector():
    table = ParameterTable((*frame_parameters("a"), *frame_parameters("b"), Parameter("c", turn=False)))
    np.testing.assert_array_equal(table.turns, [3, 9])
    assert len(ParameterTable().turns) == 0 and ParameterTable().values.shape == (0,) and ParameterTable().free == ()


def test_with_values():
    by_name = TABLE.with_values({"j1.r": 0.5, "tool.z": -1})
    assert by_name["j1.r"].value == 0.5 and by_name["tool.z"].value == -1 and by_name["j1.alpha"] == TABLE["j1.alpha"]
    assert TABLE["j1.r"].value == 0.3, "a table is immutable"
    by_array = TABLE.with_values(np.arange(10.0))
    np.testing.assert_array_equal(by_array.values, np.arange(10))
    assert by_array["j2.alpha"].prior == 0.01 and by_array.free == TABLE.free
    with pytest.raises(ValueError, match="zip"):
        TABLE.with_values(np.arange(9.0))
    with pytest.raises(dataclasses.FrozenInstanceError):
        TABLE.rows = ()


def test_with_free_and_with_priors():
    assert TABLE.with_free(["gain", "j1.alpha"]).free == ("j1.alpha", "gain")
    assert TABLE.with_free([]).free == ()
    changed = TABLE.with_priors({"j1.r": 0.02, "j2.alpha": None})
    assert changed["j1.r"].prior == 0.02 and changed["j2.alpha"].prior is None and changed["j1.r"].free
    assert changed["j1.r"].scale == 0.02 and math.isinf(changed["j1.r"].upper)


@pytest.mark.parametrize(
    "use",
    [
        lambda n: TABLE[n],
        lambda n: TABLE.with_values({n: 1.0}),
        lambda n: TABLE.with_free(["j1.r", n]),
        lambda n: TABLE.with_priors({n: 1.0}),
    ],
    ids=["getitem", "values", "free", "priors"],
)
def test_an_unknown_name_is_answered_with_the_nearest(use):
    with pytest.raises(ModelError, match="did you mean 'j2.alpha'") as e:
        use("j2.alhpa")
    assert e.value.key == "j2.alhpa" and e.value.suggestion == "j2.alpha"


@pytest.mark.parametrize(
    ("patterns", "names"),
    [
        (["alpha"], ("j1.alpha", "j2.alpha")),
        (["j1"], ("j1.r", "j1.alpha")),
        (["tool"], tuple(f"tool.{s}" for s in FRAME_SYMBOLS)),
        (["tool.x", "r"], ("j1.r", "tool.x")),
        (["gain"], ("gain",)),
        (["alpha", "j2.alpha"], ("j1.alpha", "j2.alpha")),
        ([], ()),
    ],
)
def test_match_takes_names_symbols_and_owners_in_table_order(patterns, names):
    assert TABLE.match(patterns) == names


def test_match_names_the_nearest_of_every_sort():
    for wrong, right in (("tol", "tool"), ("j2.alfa", "j2.alpha"), ("Alpha", "alpha")):
        with pytest.raises(ModelError, match=f"did you mean '{right}'"):
            TABLE.match(["gain", wrong])
    with pytest.raises(ModelError) as e:
        TABLE.match(["qqqqqqqq"])
    assert e.value.suggestion is None


@given(st.lists(st.sampled_from(TABLE.names), unique=True))
def test_match_of_full_names_is_those_names(names):
    assert set(TABLE.match(names)) == set(names)
    assert TABLE.with_free(names).free == TABLE.match(names)


def test_nearest_ignores_case_only_when_it_must():
    assert nearest("TOOL", ["tool", "base"]) == "tool"
    assert nearest("j2.alhpa", TABLE.names) == "j2.alpha"
    assert nearest("zzz", TABLE.names) is None

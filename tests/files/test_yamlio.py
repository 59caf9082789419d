"""YAML is data only, every fault has its line, and an edit leaves all other bytes alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocal.errors import FormatError
from robocal.files.text import Source
from robocal.files.units import number
from robocal.files.yamlio import edit, parse

TEXT = """\
# top
robocal: 1   # schema
joints:
  - {name: j1, theta: 0, limits: [-150, 150]}   # first
  - name: j2   # second
    theta: 1.5 # hi
    d:
    # a comment at the end of the row

base: {free: false}
tool: {}
calibrate:
  prior:
    length: 1
source: |
  text: 3
"""


def read(text):
    return parse(Source(Path("robot.yaml"), text, "")).data


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_edit_changes_values_only(newline):
    text = TEXT.replace("\n", newline)
    changes = {
        ("joints", 0, "theta"): 1e-7,
        ("joints", 0, "beta"): 0.25,
        ("joints", 0, "limits", 1): 9.0,
        ("joints", 1, "theta"): -2.0,
        ("joints", 1, "d"): 3.0,
        ("joints", 1, "beta"): 4.0,
        ("base", "xyz"): "[0, 0, 1]",
        ("tool", "x"): 5.0,
        ("calibrate", "prior", "angle"): 6.0,
        ("home",): "{xyz: [1, 2, 3]}",
    }
    made = edit(text, changes)
    expected = (
        text.replace("theta: 0,", "theta: 1.0e-07,")
        .replace("150]}", "9], beta: 0.25}")
        .replace("1.5 #", "-2 #")
        .replace("d:" + newline, "d: 3" + newline + "    beta: 4" + newline)
        .replace("{free: false}", "{free: false, xyz: [0, 0, 1]}")
        .replace("{}", "{x: 5}")
        .replace("length: 1", "length: 1" + newline + "    angle: 6")
    )
    insertion = newline + "home: {xyz: [1, 2, 3]}"
    assert made.replace(insertion, "", 1) == expected
    assert read(made)["home"] == {"xyz": [1, 2, 3]}
    assert edit(text, {}) == text


def test_edit_refuses_a_place_that_is_not_there():
    with pytest.raises(FormatError, match=r"joints\[7\]"):
        edit(TEXT, {("joints", 7, "theta"): 1.0})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: &x [1]\nb: *x", ["row 1", "anchors"]),
        ("a: &x [1, 1]\nb: &y [*x, *x]\nc: [*y, *y]", ["anchors"]),
        ("b: 1\na: !!python/object:os.system x", ["row 2", "tags", "os.system"]),
        ("a: !custom 1", ["tags"]),
        ("a: 1\nb: 2\na: 3", ["row 3", "key a", "twice"]),
        ("x:\n  a: 1\n  a: 3", ["row 3", "key x.a", "twice"]),
        ("[" * 5000 + "]" * 5000, ["too deeply"]),
        ("a: " + "{b: " * 40 + "1" + "}" * 40, ["too deeply"]),
        ("a: [1,\nb", ["row", "not valid YAML"]),
        ("- 1", ["not a mapping", "a list"]),
        ("text", ["not a mapping", "a text"]),
        ("%YAML 1.1\n---\na: yes", ["directives"]),
        ("a: 1\n---\nb: 2", ["row 2", "second document"]),
        ("<<: {a: 1}", ["plain word"]),
        ("? [1]\n: 2", ["plain word"]),
        ("a: 1\nb: \x01", ["row 2", "control character"]),
        ("a:\n\t- 1", ["row 2", "not valid YAML"]),
        ("a: '", ["not valid YAML"]),
        ("# only a comment", ["empty"]),
        ("a: 9" + "9" * 400, ["not a number"]),
    ],
)
def test_bad_yaml(text, words):
    with pytest.raises(FormatError) as info:
        read(text)
    for word in ["robot.yaml", *words]:
        assert word in str(info.value)


def test_scalars():
    text = "a: 1\nb: 1.5\nc: 1e-3\nd: .inf\ne: true\nf: no\ng: '1'\nh:\ni: ~\nj: 0x10\nk: 010\nl: 1_000\nm: 2020-01-01"
    expected = [1, 1.5, 1e-3, float("inf"), True, "no", "1", None, None, 16, 10, 1000, "2020-01-01"]
    assert list(read(text).values()) == expected


@given(st.floats(-1e300, 1e300))
def test_numbers_survive(value):
    assert read(f"a: {number(value)}")["a"] == pytest.approx(value, rel=1e-14)

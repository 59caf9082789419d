"""`groups:` of a robot.yaml: read, written back, faults named; what was identified is predicted again to 1e-9 m."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocal.arms.groups import GROUPS, add
from robocal.errors import FormatError
from robocal.files.group_block import add_groups, plain_options
from robocal.files.robot import describe, open_robot, parse_robot, read_robot, render_robot
from robocal.files.text import Source

TEXT = """robocal: 1
name: two axes
units: {length: mm, angle: deg}
convention: dh-hayati
joints:
  - {name: j1, d: 300, alpha: 90}
  - {name: j2, a: 250}
groups:    # beyond geometry
  eccentricity: {harmonics: [1, 2], joints: [j1], prior: 0.02, values: {j1.cos1: 0.01}}
  ripple:
    harmonics: {j2: [7, 20.5]}
    range: {j2: [-60, 90]}
    values:
      j2.cos7: 0.003
  compliance: {gravity: [0, 0, -9.81], links: [{joint: j2, mass: 2.5, com: [-120, 0, 30]}]}
  expansion: {reference: 20 degC}
  gain:
"""


def read(text):
    return parse_robot(Source(Path("robot.yaml"), text, ""))


def everywhere(rng, n, m=40):
    q = rng.uniform(-3, 3, (m, n))
    return q, {
        "temperature": rng.uniform(285, 310, m),
        "payload": rng.uniform(0, 5, m),
        "approach.j1": rng.choice([-1.0, 1.0], m),
    }


def moved(chain, rng):
    """Other values of everything beyond geometry, and of some lengths."""
    names = [p for g in chain.groups for p in g.parameters]
    out = {n: chain.table[n].value + rng.normal() * chain.table[n].scale for n in names}
    return out | {n: chain.table[n].value + 1e-3 for n in chain.geometric if n.endswith((".d", ".a"))}


def test_what_is_stated_is_read(rng):
    chain = read(TEXT).chain
    table = chain.table
    assert [g.name for g in chain.groups] == ["eccentricity", "ripple", "compliance", "expansion", "gain"]
    assert table["j1.cos1"].value == pytest.approx(np.radians(0.01)) and table["j1.cos1"].prior == pytest.approx(
        np.radians(0.02)
    )
    assert {"j1.cos1", "j2.sin20_5", "j2.compliance", "thermal.expansion", "j1.gain"} <= set(table.free)
    (link,) = chain.groups[2].options["links"]
    assert link.mass == 2.5 and link.at == pytest.approx((-0.12, 0.0, 0.03))
    q, columns = everywhere(rng, 2)
    hot = chain.with_values({"thermal.expansion": 1e-5}).pose(q, columns | {"temperature": np.full(len(q), 303.15)})
    grown = chain.with_values({"j1.d": 0.3 * (1 + 1e-4), "j2.a": 0.25 * (1 + 1e-4)}).pose(q)
    np.testing.assert_allclose(hot, grown, atol=1e-15)


def test_written_back_it_predicts_the_same_and_keeps_its_comments(rng):
    robot = read(TEXT)
    values = moved(robot.chain, rng)
    text, left_out = render_robot(robot, values)
    assert not left_out and "# beyond geometry" in text
    q, columns = everywhere(rng, 2)
    again = read(text).chain
    np.testing.assert_allclose(again.pose(q, columns), robot.chain.with_values(values).pose(q, columns), atol=1e-9)
    twice, _ = render_robot(read(text), moved(again, rng))
    assert read(twice).chain.groups == again.groups


@pytest.mark.parametrize("name", ["ur10", "panda", "irb-120", "rv-2aj"])
def test_groups_that_were_added_are_written_into_any_robot_file(name, rng):
    robot = open_robot(name)
    chain = robot.chain
    for group in GROUPS:
        if group in ("compliance", "bending") and name not in ("ur10", "panda"):
            continue
        chain = add(chain, group, {"harmonics": {chain.joint_names[0]: (7.0,)}} if group == "ripple" else None)
    robot = replace(robot, chain=chain)
    values = moved(chain, rng)
    text, _ = render_robot(robot, values)
    q, columns = everywhere(rng, len(chain.joints))
    told = chain.with_values(values).pose(q, columns)
    np.testing.assert_allclose(read(text).chain.pose(q, columns), told, atol=1e-9)
    np.testing.assert_allclose(read(describe(chain.with_values(values))).chain.pose(q, columns), told, atol=1e-9)


def test_a_result_can_make_the_groups_again():
    chain = read(TEXT).chain
    bare = open_robot("ur10").chain
    stated = [
        (g.name, plain_options(g.options))
        for g in add(add(bare, "compliance"), "ripple", {"harmonics": {"j1": (3.0,)}}).groups
    ]
    assert [g.name for g in add_groups(bare, stated).groups] == ["compliance", "ripple"]
    assert isinstance(plain_options(chain.groups[2].options)["links"][0], dict)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("  eccentricity:", "  eccentricty:", ("unknown group", "eccentricity")),
        ("prior: 0.02", "prior: -1", ("standard deviation",)),
        ("joints: [j1]", "joints: [j7]", ("no joint has this name",)),
        ("[1, 2]", "[0, 2]", ("order",)),
        ("{j1.cos1: 0.01}", "{j1.cos9: 0.01}", ("no parameter of this group", "j1.cos")),
        ("mass: 2.5", "mass: 0", ("mass",)),
        ("joint: j2,", "joint: j5,", ("no joint has this name",)),
        ("com: [-120, 0, 30]", "com: [1, 2]", ("2 numbers instead of 3",)),
        ("20 degC", "warm", ("not a temperature",)),
        ("20 degC}", "20 mm}", ("unit",)),
        ("  gain:\n", "  gain: {harmonics: [1]}\n", ("unknown option",)),
        ("[-60, 90]", "[90, -60]", ("not a range",)),
        ("range: {j2:", "range: {j9:", ("no joint has this name",)),
        ("  gain:\n", "  gain: 3\n", ("mapping",)),
        ("[0, 0, -9.81]", "[0, 0, 0]", ("direction",)),
    ],
)
def test_a_fault_is_one_clear_error(old, new, words):
    assert old in TEXT
    with pytest.raises(FormatError) as caught:
        read(TEXT.replace(old, new))
    said = str(caught.value)
    assert "robot.yaml" in said and all(w in said for w in words), said


def test_masses_that_nobody_knows_are_asked_for():
    bare = TEXT.partition("groups:")[0] + "groups: {compliance: {}}\n"
    with pytest.raises(FormatError, match="masses"):
        read(bare)


def test_a_calibrated_file_is_a_file(tmp_path):
    text, _ = render_robot(read(TEXT), {"j1.cos1": 1e-4})
    (tmp_path / "calibrated.yaml").write_text(text)
    assert read_robot(tmp_path / "calibrated.yaml").chain.table["j1.cos1"].value == pytest.approx(1e-4)

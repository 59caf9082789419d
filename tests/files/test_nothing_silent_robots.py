"""Robots of every format: no key that means something is passed over without a word; each is misspelt, doubled and left out, and
what follows is an error, a remark that was not there before, or the same result.

What a file may leave out, and what then holds, stands in docs/files.md, docs/conventions.md and docs/cable-robots.md; those
keys are named here, and nothing else may be gone without a word.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from arms.arm_samples import BASE, HOME, NAMES, TOOL, rows
from files.slips import Path_, Read, quicker, silent, source, xml_slips, yaml_slips, yaml_text
from files.test_cable import BODIES, CABLE
from files.test_cable import ROBOT as CABLES

from robocal.arms.conventions import CONVENTIONS, chain
from robocal.files.cable.cable_robot import read_cable
from robocal.files.robot import describe, parse_robot, read_robot
from robocal.files.yamlio import parse


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    quicker(monkeypatch)


# --- robots -----------------------------------------------------------------------------------------------------------------


def robot(text: str) -> tuple[Any, tuple[object, ...]]:
    made = parse_robot(source(text))
    return (made.chain.elements, made.chain.joints, made.chain.table, made.units), made.warnings


OPTIONAL_ROBOT = {
    "kind",
    "base",
    "home",
    "tool",
    "calibrate",
    "source",
    "free",
    "fixed",
    "prior",
    "bounds",
    "xyz",
    "rotation_vector",
}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("convention", NAMES)
def test_robots_of_every_convention(convention):
    rng = np.random.default_rng(5)
    rule = CONVENTIONS[convention]
    home = HOME if rule.home else None
    given = rows(convention, "RRPRR", rng)
    for i, row in enumerate(given):
        row |= {"name": f"axis{i + 1}", "limits": (-1.5, 1.5)}
    arm = chain("an arm", convention, given, base=BASE, tool=TOOL, home=home)
    data = parse(source(describe(arm))).data
    data["calibrate"] |= {
        "prior": {"length": 1.0},
        "fixed": [next(n for n in arm.table.names if n.startswith("axis2"))],
    }
    text = yaml_text(data)

    def chosen() -> Iterator[tuple[str, Path_, str]]:
        """One joint of each type is enough for what is said alike of all; and what no convention says, in one of them."""
        for what, path, slip in yaml_slips(data):
            inside = path[0] == "joints" and len(path) > 1
            if path[1] in ((1, 2) if what == "deleted" else (1,)) if inside else convention == NAMES[0]:
                yield what, path, slip

    def may(path: Path_) -> bool:
        # An element without a symbol is a constant.
        return path[-1] == "symbol" if path[0] == "joints" else path[-1] in OPTIONAL_ROBOT

    assert silent(robot, text, chosen(), may) == []


URDF = """<robot name="three"><link name="base_link"/><link name="a"/><link name="b"/><link name="c"/><link name="t"/>
<joint name="j1" type="revolute"><origin xyz="0 0 0.3" rpy="0 0 0.1"/><parent link="base_link"/><child link="a"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><origin xyz="0.1 0 0.2" rpy="0.2 0 0"/><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j3" type="prismatic"><origin xyz="0.4 0 0" rpy="0 0.3 0"/><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
<limit lower="-0.2" upper="0.2" effort="1" velocity="1"/></joint>
<joint name="flange" type="fixed"><origin xyz="0 0 0.1" rpy="0 0.1 0"/><parent link="c"/><child link="t"/></joint></robot>"""


def test_urdf(tmp_path):
    place = tmp_path / "arm.urdf"

    def read(text: str) -> tuple[Any, tuple[object, ...]]:
        place.write_text(text, encoding="utf-8")
        made = read_robot(place, base="base_link", tip="t")
        return (made.chain.elements, made.chain.joints, made.chain.table), made.warnings

    # The robot's name is that of the file where it states none.
    assert silent(read, URDF, xml_slips(URDF), lambda path: path == ("robot", "@name")) == []


OPTIONAL_CABLE = {
    *("angle", "force", "mass", "degrees", "plane", "source", "assumed", "unit", "name", "zero", "frame", "platform"),
    *(
        "pulley",
        "tension",
        "elasticity",
        "density",
        "diameter",
        "centre_of_mass",
        "inertia",
        "calibrate",
        "every_cable",
        "cables",
    ),
}


def test_cable_robots(tmp_path):
    data = parse(source(CABLES)).data
    place = tmp_path / "robot.yaml"

    def read(text: str) -> tuple[Any, tuple[object, ...]]:
        place.write_text(text, encoding="utf-8")
        made = read_cable(place)
        return (made.robot, made.units), made.warnings

    own = ("frame_anchors", "platform_anchors")  # names of one's own

    def slips() -> Iterator[tuple[str, Path_, str]]:
        return (s for s in yaml_slips(data) if not (s[1][0] in own and len(s[1]) == 2 and s[0] == "misspelt"))

    found = silent(read, yaml_text(data), slips(), lambda path: path[-1] in OPTIONAL_CABLE)
    assert found == []


def test_caspr(tmp_path):
    ends = (("-1 0 0", "-.1 0 0"), ("1 0 0", "0.1 0 0"), ("1 0 2", "0.1 0 0.1"), ("-1 0 2", "-0.1 0 0.1"))
    cables = "".join(CABLE.format(name=f"cable {i}", reference="joint", a=a, b=b) for i, (a, b) in enumerate(ends))
    cables = f'<cables default_cable_set="used"><cable_set id="used">{cables}</cable_set></cables>'
    bodies = BODIES.partition("?>")[2].replace("0 0 0</location>", "0.05 0 0</location>", 1)
    place = tmp_path / "flat_cables.xml"

    def reader(name: str, other: tuple[str, str]) -> Read:
        def read(text: str) -> tuple[Any, tuple[object, ...]]:
            (tmp_path / other[0]).write_text(other[1], encoding="utf-8")
            (tmp_path / name).write_text(text, encoding="utf-8")
            made = read_cable(place)
            return made.robot, made.warnings

        return read

    def first(slips: Iterator[tuple[str, Path_, str]]) -> Iterator[tuple[str, Path_, str]]:
        seen: dict[tuple[str, Path_], None] = {}
        for slip in slips:
            if slip[:2] not in seen:
                seen[slip[:2]] = None
                yield slip

    def never(path: Path_) -> bool:
        return False

    of_cables = reader("flat_cables.xml", ("flat_bodies.xml", bodies))
    assert silent(of_cables, cables, first(xml_slips(cables)), lambda path: path[-1] == "cable_ideal") == []
    of_bodies = reader("flat_bodies.xml", ("flat_cables.xml", cables))
    # Without <parent> the body stands where the base is, which the plane of the anchors says too.
    assert silent(of_bodies, bodies, first(xml_slips(bodies)), lambda path: path[-1] in ("parent", "@ref")) == []

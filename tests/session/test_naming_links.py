"""Another chain of a URDF than the one that was measured is named; a link that only a fixed joint parts is not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from cli.runs import robocal

JOINT = """<joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>"""
REACH = {"left": ("0.05 0.02 0.2", "0.3 0 0.04", "0.25 0.03 0"), "right": ("0.07 0 0.15", "0.24 0.05 0", "0.31 0 0.06")}


def two_arms() -> str:
    """A torso that turns, and two arms of unlike lengths on it, each with a plate at its end."""
    parts = [("torso", "revolute", "root", "chest", "0 0 0.4", "0 0 0", "0 0 1")]
    for side, (a, b, c) in REACH.items():
        y = 0.2 if side == "left" else -0.2
        parts += [
            (f"{side}_1", "revolute", "chest", f"{side}_a", f"0 {y} 0.1", "0.4 0 0", "0 0 1"),
            (f"{side}_2", "revolute", f"{side}_a", f"{side}_b", a, "0 0.1 0", "0 1 0"),
            (f"{side}_3", "revolute", f"{side}_b", f"{side}_c", b, "0.2 0 0", "0 1 0"),
            (f"{side}_4", "revolute", f"{side}_c", f"{side}_d", c, "0 0.3 0.1", "1 0 0"),
            (f"{side}_plate", "fixed", f"{side}_d", f"{side}_end", "0.05 0 0", "0 0 0", "0 0 1"),
        ]
    links = dict.fromkeys(link for p in parts for link in (p[2], p[3]))
    keys = ("name", "type", "parent", "child", "xyz", "rpy", "axis")
    made = "\n".join(JOINT.format(**dict(zip(keys, p, strict=True))) for p in parts)
    return '<robot name="two arms">' + "".join(f'<link name="{n}"/>' for n in links) + made + "</robot>\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What was measured of the left arm from the chest, and from the root."""
    folder = tmp_path_factory.mktemp("links")
    (folder / "u.urdf").write_text(two_arms(), encoding="utf-8")
    for name, base in (("chest", "chest"), ("root", "root")):
        ran = robocal(
            "simulate", folder / "u.urdf", "--base", base, "--tip", "left_end", "-n", 40,
            "-o", folder / name,
        )  # fmt: skip
        assert ran.status == 0, ran.err
    return folder


def by_position(folder: Path, names: str) -> Path:
    """The data with their joints' columns stated one by one."""
    text = (folder / "data.yaml").read_text(encoding="utf-8")
    text = re.sub(r"joints: \{columns: \[[^\]]*\]", f"joints: {{columns: [{names}]", text)
    (folder / "stated.yaml").write_text(text, encoding="utf-8")
    return folder / "stated.yaml"


LEFT = "left_1, left_2, left_3, left_4"


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("given", "line"),
    [
        (("--base", "chest", "--tip", "left_end"), None),
        (("--base", "chest", "--tip", "left_d"), None),  # the tool takes the plate up
        (("--base", "chest", "--tip", "right_end"), "--tip left_end"),
        (("--base", "chest", "--tip", "right_d"), "--tip left_end"),
        (("--base", "root", "--tip", "right_c"), "--base chest --tip left_end"),
    ],
)
def test_another_arm(given: tuple[str, ...], line: str | None, place: Path) -> None:
    data = by_position(place / "chest", LEFT)
    ran = robocal("check", place / "u.urdf", data, *given)
    if line is None:
        assert ran.status == 0, ran.err
    else:
        ran.assert_refused("the chain that was measured is chest to left_end", line)
        told = line.split()
        assert robocal("check", place / "u.urdf", data, "--base", "chest", *told).status == 0 or "--base" in told


def test_columns_of_every_joint(place: Path) -> None:
    """A recording of all joints: the columns are taken by name, those of the other arm stand still; or a joint below the
    base has moved."""
    head, *rows = (place / "root" / "data.csv").read_text(encoding="utf-8").splitlines()[1:]
    more = [f"right_{i} [{'rad' if '[rad]' in head else 'deg'}]" for i in range(1, 5)]
    text = [",".join([head, *more]), *(",".join([r, "0.1", "0.2", "0.3", "0.4"]) for r in rows)]
    table = place / "root" / "all.csv"
    table.write_text("\n".join(text) + "\n", encoding="utf-8")
    assert robocal("check", place / "u.urdf", table, "--tip", "left_end").status == 0
    robocal("check", place / "u.urdf", table, "--tip", "right_end").assert_refused("root to left_end", "--tip left_end")
    ran = robocal("check", place / "u.urdf", table, "--base", "chest", "--tip", "left_end")
    ran.assert_refused("root to left_end", "--base root --tip left_end")

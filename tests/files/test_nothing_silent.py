"""No key and no column that means something is passed over without a word: for every format, each is misspelt, doubled and
left out, and what follows is an error, a remark that was not there before, or the same result.

What a file may leave out, and what then holds, stands in docs/files.md, docs/conventions.md and docs/cable-robots.md; those
keys are named here, and nothing else may be gone without a word.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from files.kind_samples import ARM, KINDS, texts
from files.slips import Path_, Read, header_slips, quicker, silent, source, yaml_slips, yaml_text
from files.test_cable import ROBOT as CABLES

from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_cable_lengths, read_platform_poses
from robocal.files.dataset import Reading, read_datasets
from robocal.files.offset_file import read_offsets
from robocal.files.pose_table import read_poses, read_region
from robocal.files.targets import read_targets
from robocal.files.yamlio import parse


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    quicker(monkeypatch)


# --- data -------------------------------------------------------------------------------------------------------------------

OPTIONAL_DATA = {
    *(
        "units",
        "frame",
        "targets",
        "target",
        "configuration",
        "group",
        "place",
        "places",
        "between",
        "id",
        "second",
        "length",
    ),
    *(
        "name",
        "mount",
        "free",
        "xyz",
        "rotation_vector",
        "unit",
        "sigma",
        "contact",
        "radius",
        "value",
        "medium",
        "speed",
    ),
    *("delay", "k1", "k2", "p1", "p2", "k3"),
}


def reading(folder: Path, described: str | None, table: str) -> tuple[Any, tuple[object, ...]]:
    (folder / "table.csv").write_text(table, encoding="utf-8")
    name = "table.csv"
    if described is not None:
        (folder / "data.yaml").write_text(described, encoding="utf-8")
        name = "data.yaml"
    made: Reading = read_datasets([folder / name], ARM)
    observations = [dataclasses.replace(o, source="", digits=None) for o in made.dataset.observations]
    return (made.dataset.configurations, observations, made.units), made.warnings


@pytest.mark.sampled(3)
@pytest.mark.parametrize("kind", KINDS)
def test_data_files_of_every_kind(kind, tmp_path):
    described, table = texts(kind)
    data = parse(source(described)).data
    own = ("ends", "places", "targets", "configuration")

    def slips() -> Iterator[tuple[str, Path_, str]]:
        return (s for s in yaml_slips(data, 4) if not (s[1][0] in own[:3] and len(s[1]) == 2 and s[0] == "misspelt"))

    def may(path: Path_) -> bool:
        return path[-1] in OPTIONAL_DATA or path[0] in own

    assert silent(lambda text: reading(tmp_path, text, table), yaml_text(data), slips(), may) == []


MORE = {
    "temperature [degC]": "20.5",
    "time [s]": "3",
    "payload [kg]": "1.5",
    "approach.j2": "1",
    "torque.j1 [Nm]": "0.5",
    "group": "a",
}


@pytest.mark.parametrize("kind", ["position", "pose", "spherical", "bearing", "displacement", "relative_pose"])
def test_headers_that_describe_themselves(kind, tmp_path):
    head, *lines = texts(kind)[1].splitlines()
    head = head.replace(",second,", ",") if ",second," in head else head
    if head != texts(kind)[1].splitlines()[0]:
        at = texts(kind)[1].splitlines()[0].split(",").index("second")
        lines = [",".join(c for i, c in enumerate(line.split(",")) if i != at) for line in lines]
    table = "\n".join([",".join([head, *MORE]), *(",".join([line, *MORE.values()]) for line in lines)]) + "\n"
    alone = {*(name.partition(" [")[0] for name in MORE), "configuration"}
    # A column that stands for itself may be absent: nobody can know that it was there.
    assert (
        silent(lambda text: reading(tmp_path, None, text), table, header_slips(table), lambda p: p[-1] in alone) == []
    )


def test_names_under_which_columns_are_carried_along(tmp_path):
    described, table = texts("position")
    more = "\n".join(f"{line},{'T' if i == 0 else 20}" for i, line in enumerate(table.splitlines())) + "\n"
    for name, near in (
        ("tempreature", "temperature"),
        ("paylod", "payload"),
        ("humidity", None),
        ("aproach.j1", "approach.j1"),
    ):
        text = described.replace("{id: configuration}", f"{{id: configuration, {name}: {{column: T, unit: degC}}}}")
        said = [str(w) for w in reading(tmp_path, text, more)[1]]
        assert [s for s in said if "is only copied" in s] == ([] if near is None else said), said
        assert near is None or f"did you mean {near}?" in said[0]


# --- lists ------------------------------------------------------------------------------------------------------------------


def test_lists_of_cable_robots(tmp_path):
    (tmp_path / "robot.yaml").write_text(CABLES, encoding="utf-8")
    cables = read_cable(tmp_path / "robot.yaml").robot
    place = tmp_path / "list.csv"

    def reader(read: Callable[..., Any]) -> Read:
        def made(text: str) -> tuple[Any, tuple[object, ...]]:
            place.write_text(text, encoding="utf-8")
            found = read(place, cables)
            return (found.names, found.values, found.tension, found.wrench), found.warnings

        return made

    pulls = ",".join(f"{c}.tension [N]" for c in cables.cables)
    poses = f"id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg],fx [N],fy [N],fz [N],mx [Nm],my [Nm],mz [Nm],{pulls}\n"
    poses += "p1,0,0.1,1,0,2,0,1,2,3,4,5,6,7,8,9,10\np2,0.1,0,1.2,0,1,0,1,2,3,4,5,6,7,8,9,11\n"
    # Forces that are not stated are none.
    may = ("id", "fx", "fy", "fz", "mx", "my", "mz")
    assert silent(reader(read_platform_poses), poses, header_slips(poses), lambda p: p[-1] in may) == []
    lengths = "id," + ",".join(f"{c} [m]" for c in cables.cables) + f",{pulls}\np1,1,2,3,4,5,6,7,8\n"
    assert silent(reader(read_cable_lengths), lengths, header_slips(lengths), lambda p: p[-1] == "id") == []


def test_lists_of_arms(tmp_path):
    place = tmp_path / "list.csv"

    def reader(read: Callable[[Path], tuple[Any, Any]]) -> Read:
        def made(text: str) -> tuple[Any, tuple[object, ...]]:
            place.write_text(text, encoding="utf-8")
            return read(place)

        return made

    def poses(at: Path) -> tuple[Any, Any]:
        names, q, files = read_poses(at, ARM)
        return (names, q), [w for f in files for w in f.remarks]

    def targets(at: Path) -> tuple[Any, Any]:
        found = read_targets(at, ARM)
        return (found.targets, found.ids), [w for f in found.files for w in f.remarks]

    def offsets(at: Path) -> tuple[Any, Any]:
        found = read_offsets(at, ARM)
        return (found.values, found.missing), found.remarks

    listed = "id,j1 [deg],j2 [deg],j3 [deg]\np1,0,10,20\np2,5,10,30\n"
    assert silent(reader(poses), listed, header_slips(listed), lambda p: p[-1] == "id") == []
    wanted = "id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg],temperature [degC],j1 [deg],j2 [deg],j3 [deg]\n"
    wanted += "a,100,20,300,0,10,0,21,0,10,20\nb,110,20,300,0,10,5,22,5,10,30\n"
    alone = ("id", "temperature")
    assert silent(reader(targets), wanted, header_slips(wanted), lambda p: p[-1] in alone) == []
    zeros = "joint,offset,sigma,unit\nj1,0.5,0.1,deg\nj2,-0.2,0.1,deg\nj3,0.1,0.1,deg\n"
    assert silent(reader(offsets), zeros, header_slips(zeros), lambda p: False) == []


def test_regions(tmp_path):
    data = {
        "robocal": 1,
        "kind": "region",
        "units": {"length": "mm", "angle": "deg"},
        "joints": {"j1": [-9, 9], "j2": [0, 6]},
    }
    place = tmp_path / "region.yaml"

    def read(text: str) -> tuple[Any, tuple[object, ...]]:
        place.write_text(text, encoding="utf-8")
        return read_region(place, ARM).ranges, ()

    assert silent(read, yaml_text(data), yaml_slips(data), lambda path: path[0] == "joints") == []

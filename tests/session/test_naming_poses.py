"""Poses that are not what they are said to be are named, with or without a data.yaml; and with the line that is told they
are read."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.files.orientation import to_form
from robocal.geometry import so3
from robocal.remarks.code import Code

Rows = list[list[str]]
TURN = ("rx", "ry", "rz")
NUMBERS = {"quaternion_xyzw": "a b c d", "quaternion_wxyz": "a b c d", "euler": "a b c", "matrix": "a b c d e f g h i"}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("poses")
    ran = robocal("simulate", "rv-2aj", "--kind", "pose", "-n", 40, "--seed", 4, "-o", folder / "made")
    assert ran.status == 0, ran.err
    return folder / "made"


def table(folder: Path) -> tuple[list[str], Rows]:
    lines = (folder / "data.csv").read_text(encoding="utf-8").splitlines()[1:]
    head, *rows = list(csv.reader(lines))
    return head, rows


def numbers(head: list[str], rows: Rows, names: tuple[str, ...]) -> np.ndarray:
    plain = [h.partition(" [")[0] for h in head]
    return np.array([[float(r[plain.index(n)]) for n in names] for r in rows])


def turned(head: list[str], rows: Rows) -> np.ndarray:
    return so3.exp(np.radians(numbers(head, rows, TURN)))


def write(path: Path, head: list[str], rows: Rows | np.ndarray) -> None:
    text = [",".join(head), *(",".join(c if isinstance(c, str) else repr(float(c)) for c in r) for r in rows)]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")


def without(head: list[str], rows: Rows, names: tuple[str, ...]) -> tuple[list[str], Rows]:
    kept = [i for i, h in enumerate(head) if h.partition(" [")[0] not in names]
    return [head[i] for i in kept], [[r[i] for i in kept] for r in rows]


def written(folder: Path, place: Path, orientation: str, names: list[str], values: np.ndarray) -> None:
    """The poses with other columns for the orientation, and what a data.yaml says of these."""
    head, rows = without(*table(place), (*TURN, "srx", "sry", "srz"))
    write(
        folder / "data.csv",
        [*head, *names],
        [[*r, *map(repr, map(float, v))] for r, v in zip(rows, values, strict=True)],
    )
    text = (place / "data.yaml").read_text(encoding="utf-8")
    text = re.sub(r"orientation: .*", f"orientation: {{columns: [{', '.join(names)}], {orientation}}}", text)
    text = text.replace(", sigma: {columns: [sx, sy, sz]}", "")
    (folder / "data.yaml").write_text(text, encoding="utf-8")


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("truth", "stated", "line"),
    [
        ("form: quaternion_xyzw", "form: quaternion_wxyz", "orientation: {form: quaternion_xyzw}"),
        ("form: quaternion_wxyz", "form: quaternion_xyzw", "orientation: {form: quaternion_wxyz}"),
        (
            "form: euler, order: ZYX, frame: intrinsic, unit: rad",
            "form: euler, order: XYZ, frame: intrinsic, unit: rad",
            "form: euler, order: ZYX, frame: intrinsic",
        ),
        (
            "form: euler, order: XYZ, frame: intrinsic, unit: rad",
            "form: euler, order: XYZ, frame: extrinsic, unit: rad",
            "form: euler, order: XYZ, frame: intrinsic",
        ),
        (
            "form: euler, order: XYZ, frame: intrinsic, unit: rad",
            "form: euler, order: XYZ, frame: intrinsic, unit: deg",
            "form: euler, order: XYZ, frame: intrinsic, unit: rad",
        ),
    ],
)
def test_orientations_in_another_form(truth: str, stated: str, line: str, place: Path, tmp_path: Path) -> None:
    words = dict(part.split(": ") for part in truth.split(", "))
    names = NUMBERS[words["form"]].split()
    rotations = turned(*table(place))
    values = to_form(rotations, words["form"], words.get("order", "XYZ"), intrinsic=words.get("frame") != "extrinsic")
    written(tmp_path, place, truth, names, values)
    assert robocal("check", place / "robot.yaml", tmp_path / "data.yaml").status == 0
    written(tmp_path, place, stated, names, values)
    ran = robocal("check", place / "robot.yaml", tmp_path / "data.yaml")
    ran.assert_refused("read in the wrong form", line)


def test_matrices_column_by_column(place: Path, tmp_path: Path) -> None:
    names = NUMBERS["matrix"].split()
    across = np.swapaxes(turned(*table(place)), 1, 2).reshape(-1, 9)
    written(tmp_path, place, "form: matrix", names, across)
    ran = robocal("check", place / "robot.yaml", tmp_path / "data.yaml")
    ran.assert_refused("transposed", "orientation: {columns: [a, d, g, b, e, h, c, f, i]}")
    text = (tmp_path / "data.yaml").read_text(encoding="utf-8")
    (tmp_path / "data.yaml").write_text(text.replace("a, b, c, d, e, f, g, h, i", "a, d, g, b, e, h, c, f, i"))
    assert robocal("check", place / "robot.yaml", tmp_path / "data.yaml").status == 0


def test_inverse_poses_in_a_table_alone(place: Path, tmp_path: Path) -> None:
    """T^-1 = (R^T, -R^T p); the line that is told is a whole data.yaml, and with it the file is right."""
    head, rows = table(place)
    back = np.swapaxes(turned(head, rows), 1, 2)
    at = -np.einsum("kij,kj->ki", back, numbers(head, rows, ("x", "y", "z")))
    plain = [h.partition(" [")[0] for h in head]
    values = numbers(head, rows, tuple(plain[1:]))
    for names, new in ((("x", "y", "z"), at), (TURN, np.degrees(so3.log(back)))):
        values[:, [plain[1:].index(n) for n in names]] = new
    write(tmp_path / "data.csv", head[1:], values)
    told = robocal("check", place / "robot.yaml", tmp_path / "data.csv")
    told.assert_refused("in the frame of the measured object", "frame: {mount: tool}", "mount: base")
    mend(tmp_path, told.err)
    assert robocal("check", place / "robot.yaml", tmp_path / "data.yaml").status == 0


def mend(folder: Path, said: str) -> None:
    """Writes the data.yaml that a message told to write."""
    line = re.search(r"a data.yaml beside it, with the line (\{.*\})\s*$", " ".join(said.split()))
    assert line, said
    (folder / "data.yaml").write_text(line[1] + "\n", encoding="utf-8")


def test_other_wrongs_in_a_table_alone(place: Path, tmp_path: Path) -> None:
    """Of a table without a data.yaml, what can be written in its header is told, else a data.yaml."""
    head, rows = table(place)
    robot, data = place / "robot.yaml", tmp_path / "data.csv"

    def said(new: list[str], numbers: Rows) -> str:
        write(data, new, numbers)
        ran = robocal("check", robot, data)
        ran.assert_refused()
        return ran.err

    swapped = [{"j2": "j3", "j3": "j2"}.get(h.partition(" [")[0], h.partition(" [")[0]) for h in head]
    new = [f"{name}{h[len(h.partition(' [')[0]) :]}" for name, h in zip(swapped, head, strict=True)]
    assert "the names j3 and j2 exchanged in the header" in said(new, rows)
    y = head.index("y [mm]")
    mirrored = [[*r[:y], repr(-float(r[y])), *r[y + 1 :]] for r in rows]
    mend(tmp_path, said(head, mirrored))
    assert "sign: [1, -1, 1]" in (tmp_path / "data.yaml").read_text(encoding="utf-8")
    assert robocal("check", robot, tmp_path / "data.yaml").status == 0
    exchanged = ["x [mm]" if h == "y [mm]" else "y [mm]" if h == "x [mm]" else h for h in head]
    assert "the columns x, y named y, x in the header" in said(exchanged, rows)
    bare = [
        h.replace("rx [deg]", "rx [rad]").replace("ry [deg]", "ry [rad]").replace("rz [deg]", "rz [rad]") for h in head
    ]
    assert "rx [deg], ry [deg], rz [deg] in the header" in said(bare, rows)


@pytest.mark.parametrize("free", [False, True])
def test_two_targets_that_are_exchanged(free: bool, place: Path, tmp_path: Path) -> None:
    """Places on the flange that are stated; free ones are mere names."""
    head, rows = table(place)
    shifts = {"ball": np.array([40.0, 0, 10]), "cone": np.array([0, -60.0, 30])}
    names = [("ball", "cone")[i % 2] for i in range(len(rows))]
    p = numbers(head, rows, ("x", "y", "z"))
    p += np.einsum("kij,kj->ki", turned(head, rows), np.array([shifts[n] for n in names]))
    bare, kept = without(head, rows, ("x", "y", "z", *TURN, "srx", "sry", "srz", "sx", "sy", "sz"))
    made = [[*r, *map(repr, map(float, v)), n] for r, v, n in zip(kept, p, names, strict=True)]
    write(tmp_path / "data.csv", [*bare, "x [mm]", "y [mm]", "z [mm]", "seen"], made)
    for swap in (False, True):
        text = "robocal: 1\nkind: position\nfile: data.csv\nposition: {columns: [x, y, z]}\ntarget: seen\ntargets:\n"
        for name, other in zip(shifts, reversed(shifts) if swap else shifts, strict=True):
            at = [float(v) for v in shifts[other]]
            text += f"  {name}: {{xyz: {at}, free: {str(free).lower()}}}\n"
        (tmp_path / "data.yaml").write_text(text, encoding="utf-8")
        ran = robocal("check", place / "robot.yaml", tmp_path / "data.yaml")
        if swap and not free:
            ran.assert_refused("the targets ball and cone are exchanged", "under targets")
        else:
            assert ran.status == 0, ran.err


@pytest.mark.slow
def test_one_of_two_files(place: Path, tmp_path: Path) -> None:
    """What is wrong in one of two files is said of that file."""
    head, rows = table(place)
    plain = [h.partition(" [")[0] for h in head]
    text = (place / "data.yaml").read_text(encoding="utf-8")
    for k, part in enumerate((rows[:20], rows[20:])):
        write(tmp_path / f"part{k}.csv", plain, part)
        words = text.replace("data.csv", f"part{k}.csv").replace("configuration: {id: configuration}", "")
        words = words.replace("{columns: [j1", "{unit: deg, columns: [j1").replace("z], sigma", "z], unit: mm, sigma")
        words = words.replace("form: rotation_vector", "form: rotation_vector, unit: deg")
        (tmp_path / f"part{k}.yaml").write_text(words, encoding="utf-8")
    both = (place / "robot.yaml", tmp_path / "part0.yaml", tmp_path / "part1.yaml")
    right = robocal("check", *both, "--json")
    assert right.status == 0, right.err
    assert str(Code.REMOUNTED) not in right.out
    second = tmp_path / "part1.yaml"
    good = second.read_text(encoding="utf-8")
    for old, new, words, line in (
        ("j2, j3", "j3, j2", "columns of j2 and j3 are exchanged", "joints: {columns: [j1, j2, j3, j4, j5]}"),
        ("unit: mm", "unit: [mm, m, mm]", "values of y are in mm", "position: {unit: mm}"),
        ("columns: [x, y, z]", "columns: [y, x, z]", "axes are mirrored", "position: {columns: [x, y, z]}"),
    ):
        assert old in good
        second.write_text(good.replace(old, new, 1), encoding="utf-8")
        ran = robocal("check", *both)
        ran.assert_refused("part1", words, line)
        assert "part0" not in ran.err.partition("error:")[2].partition(":")[0]

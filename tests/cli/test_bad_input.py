"""Every bad input that the project promises to answer: exit status 2, one message that says where, nothing written."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from cli.runs import files, robocal, small

Edit = Callable[[Path], object]


def replace(name: str, old: str, new: str, count: int = 1) -> Edit:
    def edit(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8")
        assert old in text, old
        (folder / name).write_text(text.replace(old, new, count), encoding="utf-8")

    return edit


def write(name: str, data: bytes) -> Edit:
    return lambda folder: (folder / name).write_bytes(data)


def cell(row: int, column: int, text: str) -> Edit:
    """Sets a cell of data.csv; row 0 is the first row of data."""

    def edit(folder: Path) -> None:
        lines = (folder / "data.csv").read_text(encoding="utf-8").splitlines()
        cells = lines[row + 2].split(",")
        cells[column] = text
        lines[row + 2] = ",".join(cells)
        (folder / "data.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

    return edit


def drop_column(folder: Path) -> None:
    lines = (folder / "data.csv").read_text(encoding="utf-8").splitlines()
    (folder / "data.csv").write_text(
        "\n".join([lines[0], *(",".join(li.split(",")[:-1]) for li in lines[1:])]), encoding="utf-8"
    )


def scale(columns: range, factor: float, header: tuple[str, str] | None = None) -> Edit:
    """Multiplies columns of data.csv, and may rename their unit."""

    def edit(folder: Path) -> None:
        lines = (folder / "data.csv").read_text(encoding="utf-8").splitlines()
        out = [lines[0], lines[1] if header is None else lines[1].replace(*header)]
        for line in lines[2:]:
            cells = line.split(",")
            out.append(",".join(repr(float(c) * factor) if i in columns else c for i, c in enumerate(cells)))
        (folder / "data.csv").write_text("\n".join(out) + "\n", encoding="utf-8")

    return edit


BOMB = b"robocal: 1\na: &a [x, x, x, x]\nb: &b [*a, *a, *a, *a]\nc: [*b, *b, *b, *b]\n"
FREE = "[j2.alpha, j2.d, j2.theta, j3.alpha, j3.d, j3.theta]"
JOINTS = range(1, 4)
CASES: dict[str, tuple[Edit, tuple[str, ...]]] = {
    "missing file": (lambda f: (f / "data.csv").unlink(), ("data.csv", "no such file")),
    "empty file": (write("data.csv", b""), ("data.csv", "empty")),
    "empty robot": (write("robot.yaml", b"\n\n"), ("robot.yaml", "empty")),
    "wrong encoding": (write("data.yaml", "robocal: 1\nsource: étalonnage\n".encode("latin-1")), ("data.yaml", "row 2", "UTF-8")),
    "utf-16": (write("robot.yaml", "robocal: 1".encode("utf-16")), ("robot.yaml", "UTF-16")),
    "unknown key": (replace("robot.yaml", "tool:", "tooll:"), ("robot.yaml", "row 10", "tooll", "did you mean 'tool'")),
    "unknown key of a joint": (replace("robot.yaml", "theta: -90", "thetta: -90"), ("joints[1].thetta", "did you mean 'theta'")),
    "unknown convention": (replace("robot.yaml", "khalil-hayati", "kahlil-hayati"), ("convention", "did you mean 'khalil-hayati'")),
    "unknown unit": (replace("robot.yaml", "length: mm", "length: mmm"), ("units.length", "mmm", "did you mean 'mm'")),
    "missing unit": (replace("data.csv", "j1 [deg]", "j1"), ("j1", "unit", "deg")),
    "wrong number of joints": (replace("data.yaml", "[j1, j2, j3]", "[j1, j2]"), ("joints.columns", "3 for three axes")),
    "wrong number of columns": (replace("data.csv", "\np01,", "\np01,7,"), ("data.csv", "row 3", "found 11")),
    "text in a number column": (cell(4, 2, "about 30"), ("data.csv", "row 7", "j2", "about 30")),
    "NaN": (cell(4, 4, "nan"), ("row 7", "column x", "nan", "finite")),
    "infinity": (cell(4, 4, "-inf"), ("row 7", "column x", "finite")),
    "empty cell": (cell(4, 4, ""), ("row 7", "column x", "empty")),
    "decimal commas and points": (
        lambda f: write("data.csv", (f / "data.csv").read_text().replace(",", ";").replace(".", ",", 9).encode())(f),
        ("data.csv", "decimal comma"),
    ),
    "degrees where radians are said": (replace("data.csv", "[deg]", "[rad]", 3), ("data.csv", "joints", "deg", "rad")),
    "radians where degrees are said": (scale(JOINTS, np.pi / 180), ("data.csv", "joints", "rad", "deg")),
    "metres where millimetres are said": (scale(range(4, 10), 1e-3), ("data.csv", "position", "found 'mm'", "expected m")),
    "millimetres where metres are said": (replace("data.csv", "[mm]", "[m]", 6), ("data.csv", "position", "expected mm")),
    "zero sigma": (cell(3, 7, "0"), ("row 6", "sx", "above 0")),
    "negative sigma": (cell(3, 7, "-0.05"), ("row 6", "sx", "above 0")),
    "a YAML bomb": (write("robot.yaml", BOMB), ("robot.yaml", "row 2", "aliases")),
    "a YAML tag": (replace("robot.yaml", "name: three axes", "name: !!python/object/apply:os.system [ls]"), ("row 2", "tags")),
    "a 100 MB line": (write("data.csv", b"configuration," + b"1" * 100_000_000), ("data.csv",)),
    "a line that is too long": (write("data.csv", b"x\n" + b"1" * 2_000_000), ("data.csv", "row 2", "too long")),
    "a folder": (lambda f: ((f / "data.csv").unlink(), (f / "data.csv").mkdir()), ("data.csv", "folder")),
    "no rows": (write("data.csv", b"configuration,j1 [deg],j2 [deg],j3 [deg],x [mm],y [mm],z [mm],sx [mm],sy [mm],sz [mm]\n"), ("rows",)),
    "nothing free": (
        lambda f: (replace("robot.yaml", FREE, "[]")(f), replace("data.yaml", "free: true", "free: false")(f)),
        ("free",),
    ),
    "another schema": (replace("robot.yaml", "robocal: 1", "robocal: 2"), ("robocal", "schema")),
    "a dead prior": (replace("robot.yaml", "calibrate: {", "calibrate: {prior: {length: 0}, "), ("prior", "above 0")),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_bad_files_are_answered(case: Path, name: str) -> None:
    edit, words = CASES[name]
    edit(case)
    before = files(case)
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run").assert_refused(*words)
    assert files(case) == before and not (case / "run").exists()
    if "nothing free" not in name:
        robocal("check", "robot.yaml", "data.yaml").assert_refused(*words)


URDF = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/> <joint name="j1" type="revolute"><parent
link="a"/><child link="b"/><axis xyz="0 0 1"/> <limit lower="-1" upper="1" effort="1" velocity="1"/></joint> <joint
name="j2" type="revolute"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>{extra} <limit
lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
URDFS = {
    "a missing link": (URDF.replace('<link name="c"/>', "").format(extra=""), ("c", "link")),
    "a loop": (URDF.replace('<child link="c"/>', '<child link="a"/>').format(extra=""), ("arm.urdf",)),
    "xacro": (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="m"/></robot>',
        ("xacro",),
    ),
    "a mimic joint on the chain": (URDF.format(extra='<mimic joint="j1"/>'), ("mimic", "j2")),
    "not XML": ("<robot name='r'><link", ("arm.urdf",)),
}


@pytest.mark.parametrize("name", URDFS)
def test_bad_urdfs_are_answered(case: Path, name: str) -> None:
    text, words = URDFS[name]
    (case / "arm.urdf").write_text(text, encoding="utf-8")
    robocal(
        "identify", "arm.urdf", "data.yaml", "-o", "run", *(("--tip", "c") if "mimic" in name else ())
    ).assert_refused(*words)
    assert not (case / "run").exists()


OPTIONS = {
    "--method lmm": ("--method", "did you mean 'lm'"),
    "--loss hubr": ("--loss", "huber"),
    "--hold-out 0.9": ("hold-out", "0.5"),
    "--hold-out x": ("--hold-out",),
    "--hold-out blocs": ("--hold-out", "blocks"),
    "--hold-out group": ("hold_out", "group"),
    "--hold-out group --group dya": ("dya",),
    "--folds 1": ("folds", "2 to"),
    "--folds 99": ("folds", "2 to"),
    "--folds 3 --hold-out 0.3": ("--hold-out", "blocks, group, or nothing"),
    "--reselect": ("--reselect", "--folds K as well"),
    "--hold-out blocks --blocks 99": ("blocks", "2 to"),
    "--free j2.alhpa": ("--free", "j2.alpha"),
    "--fix trackr": ("--fix", "tracker"),
    "--free tracker.x": ("--free", "tracker"),
    "--prior length": ("--prior", "NAME=SIGMA"),
    "--prior length=-1": ("--prior", "NAME=SIGMA"),
    "--prior lenght=1": ("--prior",),
    "--seed -1": ("--seed",),
    "--metod lm": ("--metod", "--method"),
    "--method pinv --loss huber": ("--loss",),
}


@pytest.mark.parametrize("words", OPTIONS)
def test_bad_options_are_answered(case: Path, words: str) -> None:
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run", *words.split()).assert_refused(*OPTIONS[words])
    assert not (case / "run").exists()


def test_bad_words_are_answered(case: Path) -> None:
    robocal("identfy").assert_refused("identify")
    robocal("identify", "rv-2a", "data.yaml").assert_refused("rv-2aj")
    robocal("identify", "robot.yml", "data.yaml").assert_refused("robot.yml", "robot.yaml")
    robocal("identify", "data.yaml", "robot.yaml").assert_refused("data.yaml", "not a robot", "the robot first")
    robocal("identify", "robot.yaml", "robot.yaml").assert_refused("robot.yaml", "not a data file")
    robocal("demo", "trakcer").assert_refused("tracker")
    robocal("identify", "robot.yaml").assert_refused("DATA")
    robocal("export", "robot.yaml", "--format", "ymal").assert_refused("yaml")


# --- not errors -------------------------------------------------------------------------------------------------------------


def test_all_rows_equal_is_a_verdict(case: Path) -> None:
    lines = (case / "data.csv").read_text(encoding="utf-8").splitlines()
    row = lines[2].split(",", 1)[1]
    rows = [f"p{i},{row}" for i in range(30)]
    (case / "data.csv").write_text("\n".join([*lines[:2], *rows]) + "\n", encoding="utf-8")
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run").assert_refused("data.csv", "29 of 30 rows")
    rows = [",".join([*(c := r.split(","))[:4], str(float(c[4]) + 1e-3 * i), *c[5:]]) for i, r in enumerate(rows)]
    (case / "data.csv").write_text("\n".join([*lines[:2], *rows]) + "\n", encoding="utf-8")
    ran = robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    assert ran.status == 3, ran.err
    assert "all configurations are equal" in ran.out and "result.json" in files(case / "run")


@pytest.mark.sampled(2)
@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 6])
def test_fewer_rows_than_parameters_is_a_verdict(case: Path, rows: int) -> None:
    lines = (case / "data.csv").read_text(encoding="utf-8").splitlines()
    (case / "data.csv").write_text("\n".join(lines[: 2 + rows]) + "\n", encoding="utf-8")
    ran = robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    # Twelve numbers or fewer for twelve parameters prove nothing; a few more may, when each is predicted from the
    # others.
    assert ran.status == 3 if rows <= 4 else ran.status in (0, 3), (rows, ran.out, ran.err)
    assert "few measurements" in ran.out and "result.json" in files(case / "run")


def test_a_joint_outside_its_limits_is_a_warning(case: Path) -> None:
    replace("robot.yaml", "limits: [-150, 150]", "limits: [-40, 40]")(case)
    ran = robocal("identify", "robot.yaml", "data.yaml")
    assert ran.status == 0 and "outside its limits (j1)" in " ".join(ran.out.split())


def test_repeated_joints_with_different_results_are_repeatability(case: Path) -> None:
    lines = (case / "data.csv").read_text(encoding="utf-8").splitlines()
    again = [re.sub(r"^p(\d+)", r"r\1", line) for line in lines[2:8]]
    (case / "data.csv").write_text("\n".join([*lines, *again]) + "\n", encoding="utf-8")
    robocal("identify", "robot.yaml", "data.yaml").assert_refused("data.csv", "6 of 36 rows")
    again = [",".join([*(x := r.split(","))[:4], str(float(x[4]) + 0.1), *x[5:]]) for r in again]
    (case / "data.csv").write_text("\n".join([*lines, *again]) + "\n", encoding="utf-8")
    assert robocal("identify", "robot.yaml", "data.yaml").status == 0


def test_units_that_only_look_odd_are_a_warning(tmp_path: Path) -> None:
    small(tmp_path)
    # A cell of a few degrees: nothing is gained by calling them radians.
    lines = (tmp_path / "data.csv").read_text(encoding="utf-8").splitlines()
    rng = np.random.default_rng(0)
    rows = []
    for line in lines[2:]:
        cells = line.split(",")
        cells[1:4] = [f"{v:.3f}" for v in rng.uniform(-3, 3, 3)]
        rows.append(",".join(cells))
    (tmp_path / "data.csv").write_text("\n".join([*lines[:2], *rows]) + "\n", encoding="utf-8")
    ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "data.yaml")
    assert ran.status == 3 and "look like rad" in " ".join(ran.out.split())


# --- where to write ---------------------------------------------------------------------------------------------------------


def test_a_file_in_place_of_the_run_folder(case: Path) -> None:
    (case / "run").write_text("mine", encoding="utf-8")
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run").assert_refused("run")
    assert (case / "run").read_text(encoding="utf-8") == "mine"
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run/deeper").assert_refused("run")
    robocal("simulate", "robot.yaml", "-o", "run").assert_refused("run")
    robocal("new", "ur10", "-o", "run/x").assert_refused("run")


def test_a_read_only_folder(case: Path) -> None:
    target = Path("/proc/robocal") if os.geteuid() == 0 else case / "closed" / "run"
    (case / "closed").mkdir(mode=0o555)
    robocal("identify", "robot.yaml", "data.yaml", "-o", target).assert_refused(str(target))


def test_a_full_disk(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import errno

    def full(fd: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run").assert_refused("run", "no space left")
    assert files(case / "run") == set()


# --- options and files that contradict themselves ------------------------------------------------------------------------------

SIMULATIONS = (
    "--length-error inf",
    "--length-error nan",
    "--angle-error nan",
    "--noise inf",
    "--noise -1",
    "--angle-noise nan",
)


@pytest.mark.parametrize("words", [*SIMULATIONS, "--set j2.d=nan", "--angle-error -0.1"])
def test_simulated_errors_are_finite(case: Path, words: str) -> None:
    robocal("simulate", "robot.yaml", "-o", "sim", *words.split()).assert_refused(words.split()[0])
    assert not (case / "sim").exists()


def test_empty_and_far_names_are_answered(case: Path) -> None:
    for option in ("--free", "--fix"):
        for word in ("", " ", "j2.d,"):
            robocal("identify", "robot.yaml", "data.yaml", option, word).assert_refused(option, "a name is missing")
    robocal("identify", "robot.yaml", "data.yaml", "--free", "nosuch").assert_refused("--free", "j2.alpha", "tracker")


def test_the_same_data_twice(case: Path) -> None:
    (case / "copy.csv").write_bytes((case / "data.csv").read_bytes())
    (case / "copy.yaml").write_text((case / "data.yaml").read_text().replace("data.csv", "copy.csv"), encoding="utf-8")
    for second in ("data.yaml", "copy.yaml", "copy.csv"):
        robocal("identify", "robot.yaml", "data.yaml", second).assert_refused("given twice", "data.csv")


def test_bounds_that_exclude_the_nominal_value(case: Path) -> None:
    replace("robot.yaml", "calibrate: {", "calibrate: {bounds: {j2.d: [41, 45]}, ")(case)
    words = ("robot.yaml", "calibrate.bounds.j2.d", "found [41", "bounds around 40")
    robocal("identify", "robot.yaml", "data.yaml").assert_refused(*words)


def test_one_joint_column_too_many(case: Path) -> None:
    lines = (case / "data.csv").read_text(encoding="utf-8").splitlines()
    rows = [lines[1] + ",j4 [deg]", *(line + ",1" for line in lines[2:])]
    (case / "wide.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    robocal("check", "robot.yaml", "wide.csv").assert_refused("wrong number of joint columns", "j4 as well", "3 for")


@pytest.mark.parametrize("unit", ["cm", "inch", "m"])
def test_lengths_in_any_other_unit_are_found(case: Path, unit: str) -> None:
    replace("data.csv", "[mm]", f"[{unit}]", 6)(case)
    robocal("check", "robot.yaml", "data.yaml").assert_refused("data.csv", "position", f"found '{unit}'", "expected mm")


def test_radians_of_a_joint_that_turns_twice_are_found(case: Path) -> None:
    replace("robot.yaml", "limits: [-150, 150]", "limits: [-360, 360]")(case)
    scale([1], 2.0)(case)  # j1 is now another angle: what was measured is simulated anew
    ran = robocal("simulate", "robot.yaml", "-o", "sim", "--at", "data.yaml", "--force")
    assert ran.status == 0, ran.err
    for name in ("data.csv", "data.yaml"):
        (case / name).write_bytes((case / "sim" / name).read_bytes())
    scale(JOINTS, np.pi / 180)(case)
    robocal("check", "robot.yaml", "data.yaml").assert_refused("joints", "found 'deg'", "expected rad")


def test_an_error_is_a_document_too(case: Path) -> None:
    ran = robocal("identify", "robot.yaml", "data.yaml", "--free", "j2.alhpa", "--json")
    assert ran.status == 2 and "error:" in ran.err
    error = ran.document["error"]
    assert set(error) == {"message", "file", "row", "column", "key", "found", "expected", "suggestion"}
    assert (error["key"], error["found"], error["suggestion"]) == ("--free", "j2.alhpa", "j2.alpha")
    assert "no-such" in robocal("check", "no-such.yaml", "--json").document["error"]["file"]
    assert robocal("check", "--json").document["error"]["message"]

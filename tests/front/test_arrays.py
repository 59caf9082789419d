"""`import robocal`: arrays give what the same table gives as a file, names load when asked for, and what is wrong is said."""

from __future__ import annotations

import ast
import json
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from called import identify as from_files
from cli.runs import small

import robocal as rc
from robocal.errors import Cancelled, FileError, FormatError, InputError, ModelError
from robocal.report.sections import figure


@pytest.fixture(scope="module")
def rig():
    """An arm with errors of making: its measured joints (rad), and positions (mm) from an instrument that stands elsewhere."""
    arm, rng = rc.robot("irb-120"), np.random.default_rng(1)
    chain = arm.model.chain
    off = {
        n: chain.table[n].value + rng.normal(0, 3e-4 if chain.table[n].unit == "m" else 1e-3) for n in chain.table.free
    }
    q = rng.uniform(-1.5, 1.5, (50, 6))
    p = chain.with_values(off).pose(q)[:, :3, 3] * 1e3 + [100, 20, -30] + rng.normal(0, 0.05, (50, 3))
    return arm, q, p


@pytest.fixture(scope="module")
def found(rig):
    arm, q, p = rig
    return rc.identify(arm, rc.measurements(q, position=p, units=("rad", "mm"), sigma=0.05))


def test_arrays_give_what_the_file_gives(rig, found, tmp_path):
    arm, q, p = rig
    rc.measurements(q, position=p, units=("rad", "mm"), sigma=0.05).save(tmp_path / "measurements.csv")
    other = from_files("irb-120", [tmp_path / "measurements.csv"]).result
    assert found.verdict == other.verdict.status == "improved"
    for a, b in zip(found.result.parameters, other.parameters, strict=True):
        assert (a.name, a.status) == (b.name, b.status)
        assert a.identified == pytest.approx(b.identified, rel=1e-12, abs=1e-12)


def test_the_corrected_arm_is_nearer_to_what_was_measured(rig, found):
    arm, q, p = rig

    def left(pose):
        gap = pose(q)[:, :3, 3] * 1e3 - p
        return np.linalg.norm(gap - gap.mean(axis=0), axis=1).mean()

    assert left(found.pose) < 0.3 * left(arm.pose)
    assert found.values["j2.a"] == pytest.approx(0.27, abs=2e-3)
    row = next(r for r in found.table() if r["name"] == "j2.a")
    assert row["identified"] == pytest.approx(found.values["j2.a"] * 1e3) and row["unit"] == "mm"


def test_what_is_shown_is_short_and_true(rig, found):
    arm, q, p = rig
    data = rc.measurements(q, position=p, units=("rad", "mm"))
    for thing in (arm, data, found):
        assert 0 < len(repr(thing).splitlines()) <= 20
        assert len(repr(thing)) < 2000
    assert found.verdict.upper() in repr(found) and figure(found.result.residuals.held_out.mean, 3) in repr(found)


def test_a_run_folder_is_that_of_the_command_line(found, tmp_path):
    written = found.save(tmp_path / "run")
    assert {p.name for p in written} >= {"result.json", "calibrated.yaml", "residuals.csv", "report.html"}
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["provenance"]["inputs"][1]["file"] == "measurements"
    again = rc.robot(tmp_path / "run")
    assert again.model.chain.table["j2.a"].value == pytest.approx(found.values["j2.a"], abs=1e-9)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    with pytest.raises(FileError, match="mine"):
        found.save(tmp_path / "mine")
    assert [f.name for f in (tmp_path / "mine").iterdir()] == ["notes.txt"]


def test_poses_sigmas_and_further_columns_are_read(rig):
    arm, q, p = rig
    turns = np.zeros((50, 3))
    made = rc.measurements(
        q, position=p / 10, rotation_vector=turns, units=("rad", "cm", "deg"), sigma=[1, 2, 3], turn_sigma=0.1,
        columns={"temperature [degC]": np.full(50, 21.5), "group": np.array(["a", "b"] * 25)},
    )  # fmt: skip
    head = made.text.splitlines()[0].split(",")
    assert head[6:] == [
        "x [cm]", "y [cm]", "z [cm]", "sx [cm]", "sy [cm]", "sz [cm]", "rx [deg]", "ry [deg]", "rz [deg]",
        "srx [deg]", "sry [deg]", "srz [deg]", "temperature [degC]", "group",
    ]  # fmt: skip
    assert made.text.splitlines()[1].endswith(",1.0,2.0,3.0,0.0,0.0,0.0,0.1,0.1,0.1,21.5,a")
    first = [float(v) for v in made.text.splitlines()[1].split(",")[:9]]
    assert first == [*q[0], *(p[0] / 10)]


def test_wrong_arrays_are_refused_by_name(rig):
    arm, q, p = rig
    bad = p.copy()
    bad[7, 1] = np.nan
    with pytest.raises(FormatError) as caught:
        rc.identify(arm, rc.measurements(q, position=bad, units=("rad", "mm")))
    assert caught.value.argument == "position" and "nan at [7, 1]" in str(caught.value)
    for wrong, words in (
        ({"position": p[:9]}, "rows"), ({"position": p[:, :2]}, "shape"), ({"position": p, "units": ("rad", "furlong")}, "unit"),
        ({"position": p, "units": ("rad", "deg")}, "unit"), ({"position": p, "units": ("degC", "mm")}, "unit"),
        ({"position": p, "sigma": [1, 2]}, "shape"), ({"position": p, "turn_sigma": 1}, "rotation"),
        ({"position": [["a", "b", "c"]] * 50}, "numbers"), ({"position": p, "columns": {"temperature [degC]": [1]}}, "shape"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=words):
            rc.identify(arm, rc.measurements(q, **{"units": ("rad", "mm")} | wrong))
    with pytest.raises(InputError, match="joint"):
        rc.identify(arm, rc.measurements(q[:, :5], position=p, units=("rad", "mm")))


def test_wrong_units_are_doubted_as_of_a_file(rig):
    arm, q, p = rig
    with pytest.raises(InputError, match="mm|inch|unit"):
        rc.identify(arm, rc.measurements(q, position=p, units=("rad", "m")))


def test_options_are_those_of_the_command_line(rig):
    arm, q, p = rig
    data = rc.measurements(q, position=p, units=("rad", "mm"), sigma=0.05)
    with pytest.raises(ModelError, match=r"hold_out"):
        rc.identify(arm, data, holdout=0.3)
    with pytest.raises(ModelError, match="huber"):
        rc.identify(arm, data, loss="hubert")
    made = rc.identify(arm, [data], free="theta", hold_out=0.4, exclude=[])
    assert made.result.provenance.options["free"] == ["theta"]
    assert {p.name.partition(".")[2] for p in made.result.parameters if p.status == "identified"} <= {
        "theta",
        *"xyz",
        "rx",
        "ry",
        "rz",
    }


def test_a_watcher_may_stop(rig):
    arm, q, p = rig

    def enough(event):
        raise Cancelled()

    with pytest.raises(Cancelled):
        rc.identify(arm, rc.measurements(q, position=p, units=("rad", "mm")), watch=enough)


def test_names_are_few_documented_and_loaded_when_asked_for():
    assert len(rc.__all__) < 40 and dir(rc) == sorted(rc.__all__)
    for name in set(rc.__all__) - {"__version__"}:
        assert getattr(rc, name).__doc__
    with pytest.raises(AttributeError, match="identfy"):
        _ = rc.identfy
    code = "import sys, robocal; print([m for m in sys.modules if m.split('.')[0] in ('numpy', 'scipy', 'numba', 'pydantic')])"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


def test_types_and_names_are_the_same_list():
    stub = Path(rc.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    body = ast.parse(stub).body
    listed = next(n.value for n in body if isinstance(n, ast.Assign) and n.targets[0].id == "__all__")
    told = set(ast.literal_eval(listed))
    assert told == set(rc.__all__)
    made = {n.name for n in body if isinstance(n, ast.FunctionDef)}
    assert all(f" as {n}\n" in stub or n in made for n in told)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: rc.robot(3), "names no robot"),
        (lambda: rc.cable.robot([1, 2]), "names no robot"),
        (lambda: rc.table([[1, 2]]), "no table"),
        # Two letters are no two units: this was read as metres and metres.
        (lambda: rc.measurements([[1.0, 2.0]], position=[[1.0, 2.0, 3.0]], units="mm"), "one by one"),
        (lambda: rc.measurements([[1.0, 2.0]], position=[[1.0, 2.0, 3.0]], units=("deg",)), "one by one"),
    ],
)
def test_what_is_no_robot_table_or_unit_is_said(make, word: str) -> None:
    with pytest.raises(InputError, match=word):
        make()


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda arm: arm.inverse(2 * np.eye(4)), "this is no pose"),
        (lambda arm: arm.inverse(np.diag([1.0, 1, -1, 1])), "this is no pose"),
        (lambda arm: arm.tension(np.full((1, 4, 4), np.nan)), "argument poses: not a finite number"),
        (lambda arm: arm.tension(np.eye(4), wrench="down"), "argument wrench: these are no numbers"),
        (lambda arm: arm.forward("long"), "argument lengths: these are no numbers"),
        (lambda arm: arm.forward(arm.inverse(np.eye(4)), sigma="fine"), "argument sigma"),
    ],
)
def test_what_a_cable_robot_cannot_take_is_said(call, word: str) -> None:
    arm = rc.cable.robot(Path(__file__).parents[2] / "examples" / "cable-laval" / "robot.yaml")
    with pytest.raises(InputError, match=word):
        call(arm)


def test_results_survive_pickle(tmp_path: Path) -> None:
    """They go to other processes, and keep everything that they say."""
    small(tmp_path)
    found = rc.identify(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])
    again = pickle.loads(pickle.dumps(found))
    assert again.verdict == found.verdict and again.values == found.values
    assert again.document == found.document and again.summary() == found.summary()

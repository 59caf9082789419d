"""Models handed on (URDF, offsets, tables) say the same as the model; what is simulated says so; results keep their numbers."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from called import called, export, identify, simulate
from cli.runs import small
from simulated import true_chain

from robocal.arms import catalog
from robocal.arms.chain import joint_offsets
from robocal.arms.conventions import chain
from robocal.errors import ModelError
from robocal.files.csvtext import csv_text
from robocal.files.plain import plain
from robocal.files.robot import describe
from robocal.files.runfolder import RESIDUAL_COLUMNS, read_residuals
from robocal.files.templates import convention_chain
from robocal.files.text import Source
from robocal.files.urdf import read_urdf
from robocal.files.urdf_into import urdf_text
from robocal.session.inputs import open_arm
from robocal.session.simulated_robot import Errors, sample_joints
from robocal.verbs.demo.cases import example_folder
from robocal.verbs.export.result import parameter_table


@pytest.mark.parametrize("name", catalog.names())
def test_a_urdf_has_the_kinematics_of_the_arm(name: str, rng: np.random.Generator) -> None:
    arm = true_chain(catalog.get(name), Errors(0.01, 0.05), rng)
    back = read_urdf(Source(Path("arm.urdf"), urdf_text(arm)[0], "0" * 64)).chain
    q = sample_joints(arm, 50, rng)
    assert np.abs(back.pose(q) - arm.pose(q)).max() < 1e-12


def test_a_urdf_with_a_sliding_joint_and_without_gains(rng: np.random.Generator) -> None:
    rows = [{"a": 0.1}, {"type": "prismatic", "alpha": 0.3, "limits": (0.0, 0.5)}, {"alpha": 1.2, "d": 0.2}]
    arm = chain("gantry", "mdh", rows, base=(0.1, 0, 0, 0, 0.2, 0), tool=(0, 0, 0.1, 0.3, 0, 0))
    back = read_urdf(Source(Path("arm.urdf"), urdf_text(arm)[0], "0" * 64)).chain
    q = sample_joints(arm, 20, rng)
    assert np.abs(back.pose(q) - arm.pose(q)).max() < 1e-12
    with pytest.raises(ModelError, match="gain"):
        urdf_text(arm.with_values({"j1.gain": 1.01}))


@pytest.mark.parametrize("name", ["rv-2aj", "panda", "small-arm"])
def test_offsets_added_to_joint_values_do_what_the_model_does(name: str, rng: np.random.Generator) -> None:
    arm = catalog.get(name)
    rule = {f"{j}.theta": arm.table[f"{j}.theta"].value + rng.normal(0, 0.01) for j in arm.joint_names}
    moved = arm.with_values(rule)
    q = sample_joints(arm, 10, rng)
    shift = np.array([v for _, v in joint_offsets(arm, {p.name: p.value for p in moved.table.rows})])
    assert np.abs(arm.pose(q + shift) - moved.pose(q)).max() < 1e-12


def test_the_table_names_units_and_every_frame(tmp_path: Path) -> None:
    header, *rows = parameter_table(open_arm("panda"))
    assert "a [mm]" in header and "alpha [deg]" in header
    assert [row[0] for row in rows][-2:] == ["base", "tool"] and rows[-1][header.index("frame_z [mm]")] == "107"
    assert parameter_table(open_arm("small-arm"))[0] == ["parameter", "value", "unit"]
    (tmp_path / "own.yaml").write_text(describe(convention_chain("urdf", 2)), encoding="utf-8")
    own, *_ = parameter_table(open_arm(tmp_path / "own.yaml"))
    assert {"xyz_z [mm]", "rpy_yaw [deg]", "axis_x"} <= set(own)


def test_everything_simulated_says_so(tmp_path: Path) -> None:
    made = simulate("irb-120", tmp_path, poses=12, seed=4)
    assert all("SIMULATED" in p.read_text(encoding="utf-8") for p in made.written if p.name != "robot.yaml")
    assert 1e-4 < made.largest_error < 1e-2
    again = simulate("irb-120", tmp_path / "again", poses=12, seed=4)
    assert [p.read_bytes() for p in again.written] == [p.read_bytes() for p in made.written]


def test_residuals_are_complete_and_come_back(tmp_path: Path) -> None:
    small(tmp_path)
    found = identify(str(tmp_path / "robot.yaml"), [str(tmp_path / "data.yaml")], {"seed": 2}, output=tmp_path / "run")
    rows = found.residuals
    assert tuple(rows) == RESIDUAL_COLUMNS and {len(v) for v in rows.values()} == {30}
    held = [v for v in rows["held_out_mm"] if v is not None]
    stated = found.result.residuals.held_out
    assert stated is not None and stated.mean == pytest.approx(np.mean(held)) and stated.n == len(held)
    lengths = np.linalg.norm([rows[f"d{a}_after_mm"] for a in "xyz"], axis=0)
    assert np.allclose(lengths, rows["after_mm"])
    back = read_residuals(tmp_path / "run" / "residuals.csv")
    assert back["set"] == rows["set"] and np.allclose(back["after_mm"], rows["after_mm"], rtol=1e-7)
    # Folders of older versions say nothing of rows that were set aside.
    table = [line.split(",") for line in (tmp_path / "run" / "residuals.csv").read_text().splitlines()]
    at = table[0].index("set_aside")
    (tmp_path / "old.csv").write_text("".join(",".join(r[:at] + r[at + 1 :]) + "\n" for r in table))
    old = read_residuals(tmp_path / "old.csv")
    assert "set_aside" not in old and old["after_mm"] == back["after_mm"]


def test_numbers_of_a_result_are_in_the_robot_files_units(tmp_path: Path) -> None:
    texts = small(tmp_path)
    in_mm = identify(str(tmp_path / "robot.yaml"), [str(tmp_path / "data.yaml")])
    metres = (
        texts["robot.yaml"].replace("length: mm", "length: m").replace("r: 300", "r: 0.3").replace("d: 40", "d: 0.04")
    )
    metres = (
        metres.replace("d: 250", "d: 0.25").replace("r: 30,", "r: 0.03,").replace("[160, 0, 20]", "[0.16, 0, 0.02]")
    )
    (tmp_path / "metres.yaml").write_text(metres, encoding="utf-8")
    in_m = identify(str(tmp_path / "metres.yaml"), [str(tmp_path / "data.yaml")])
    for a, b in zip(in_mm.result.parameters, in_m.result.parameters, strict=True):
        k = 1e-3 if a.unit == "mm" else 1.0
        assert b.unit == ("m" if a.unit == "mm" else a.unit) and b.identified == pytest.approx(
            a.identified * k, rel=1e-6, abs=1e-9
        )
        assert (a.sigma is None) == (b.sigma is None) and (
            a.sigma is None or b.sigma == pytest.approx(a.sigma * k, rel=1e-5)
        )
    assert in_m.result.residuals.unit == in_mm.result.residuals.unit == "mm"


def test_plain_values_are_strict_json() -> None:
    assert plain({"a": np.float64("nan"), "b": np.arange(2), "c": (1, Path("x")), 4: {float("inf")}}) == {
        "a": None, "b": [0, 1], "c": [1, "x"], "4": [None]
    }  # fmt: skip


def test_examples_are_found_and_can_be_checked() -> None:

    for name, robot, data in (("rv-2aj", "robot.yaml", "data.yaml"), ("arm-with-camera", "robot.yaml", "data.yaml")):
        folder = example_folder(name)
        assert called("check", robot=folder / robot, data=[folder / data]).result.identifiability is not None


def test_csv_cells_are_quoted_where_needed() -> None:
    text = csv_text(["x", "y"], [["a,b", 'c"d']])
    assert list(csv.reader(io.StringIO(text))) == [["x", "y"], ["a,b", 'c"d']]


def test_offsets_are_refused_where_they_are_not(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    small(tmp_path)
    files = str(tmp_path / "robot.yaml"), [str(tmp_path / "data.yaml")]
    identify(*files, output=folder, free=("alpha", "d"), leave_one_out=False)
    with pytest.raises(ModelError, match=r"no joint offset differs.*yaml or urdf"):
        export(str(folder), form="offsets")
    for name in ("cpc", "urdf", "poe-local"):
        arm = chain("two", name, [{"axis": (0, 0, 1)} if name != "cpc" else {}] * 2)
        bent = arm.with_values({n: arm.table[n].value + 0.01 for n in arm.geometric})
        for which, robot in (("arm", arm), ("bent", bent)):
            (tmp_path / f"{which}.yaml").write_text(describe(robot), encoding="utf-8")
        with pytest.raises(ModelError, match="inside its frames"):
            export(str(tmp_path / "bent.yaml"), form="offsets", nominal=str(tmp_path / "arm.yaml"))

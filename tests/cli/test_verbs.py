"""Every verb on real files, from the command line to what lies on the disk."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli.runs import files, robocal, small
from listings import rows_of

from robocal.files.result import read_result
from robocal.files.robot import read_robot


def test_identify_writes_a_run_folder_and_says_so(case: Path) -> None:
    ran = robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    assert ran.status == 0, ran.err
    assert (
        ran.out.index("IMPROVED")
        < ran.out.index("error [mm]")
        < ran.out.index("j2.alpha")
        < ran.out.index("Written to run")
    )
    assert files(case / "run") == {
        "result.json",
        "covariance.json",
        "accuracy_map.csv",
        "calibrated.yaml",
        "residuals.csv",
        "report.html",
    }
    result = read_result(case / "run" / "result.json")
    truth, found = read_robot("truth.yaml").chain, read_robot("run/calibrated.yaml").chain
    q = np.random.default_rng(0).uniform(-0.5, 0.5, (100, 3))
    assert np.linalg.norm(truth.pose(q) - found.pose(q), axis=(1, 2)).max() < 1e-3
    held = result.residuals.held_out
    assert held is not None and held.mean is not None and held.mean < 0.2
    assert [Path(i.file).name for i in result.provenance.inputs] == ["robot.yaml", "data.yaml", "data.csv"]
    assert result.provenance.started.endswith("+00:00") and result.provenance.options["method"] == "lm"


def test_json_is_the_result_and_nothing_else(case: Path) -> None:
    ran = robocal("identify", "robot.yaml", "data.yaml", "--json", "-o", "run")
    written = json.loads((case / "run" / "result.json").read_text(encoding="utf-8"))
    assert ran.status == 0
    assert ran.document["parameters"] == written["parameters"] and ran.document["verdict"]["status"] == "improved"


def test_the_same_seed_gives_the_same_result(case: Path) -> None:
    runs = [robocal("identify", "robot.yaml", "data.yaml", "--json", "--seed", seed).document for seed in (5, 5, 6)]
    assert runs[0]["split"] == runs[1]["split"] != runs[2]["split"]
    assert runs[0]["parameters"] == runs[1]["parameters"]


@pytest.mark.parametrize("method", ["lm", "gauss-newton", "pinv", "lse"])
def test_methods(case: Path, method: str) -> None:
    ran = robocal("identify", "robot.yaml", "data.yaml", "--json", "--method", method)
    seen = ran.document
    # The pseudo-inverse methods hold nothing out by themselves, so they prove nothing.
    assert ran.status == (0 if method in ("lm", "gauss-newton") else 3)
    assert seen["residuals"]["after"]["mean"] < (0.15 if method != "lse" else 1.0)
    assert bool(seen["split"]["held_out"]) == (method in ("lm", "gauss-newton"))


@pytest.mark.parametrize("loss", ["none", "huber", "cauchy", "tukey"])
def test_a_gross_row_is_set_aside_whatever_the_loss(case: Path, loss: str) -> None:
    lines = (case / "data.csv").read_text(encoding="utf-8").splitlines()
    cells = lines[8].split(",")
    cells[4] = str(float(cells[4]) + 30.0)
    lines[8] = ",".join(cells)
    (case / "data.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = robocal("identify", "robot.yaml", "data.yaml", "--json", "--loss", loss).document
    truth = read_robot("truth.yaml")

    def off(document):  # largest wrong length, mm
        return max(
            abs(p["identified"] - truth.unit_of(p["name"]).from_si(truth.chain.table[p["name"]].value))
            for p in document["parameters"] if p["name"] in ("j2.d", "j3.d")
        )  # fmt: skip

    assert off(found) < 0.2
    assert [o["row"] for o in found["outliers"] if o["set_aside"]] == [9]
    assert found["residuals"]["all_rows"]["after"]["max"] > 20 > found["residuals"]["after"]["max"]


def test_free_fix_prior(case: Path) -> None:
    ran = robocal(
        "identify", "robot.yaml", "data.yaml", "--json", "--free", "theta,d", "--fix", "j1", "--prior", "length=0.001"
    )
    status = {p["name"]: p["status"] for p in ran.document["parameters"]}
    assert status["j2.alpha"] == status["j1.theta"] == status["tool.x"] == "fixed"
    assert status["j2.theta"] != "fixed" and status["j2.d"] == "prior"
    held = robocal("identify", "robot.yaml", "data.yaml", "--json", "--fix", "tracker").document
    assert {p["status"] for p in held["parameters"] if p["name"].startswith("tracker.")} == {"fixed"}


def test_everything_is_held_out_once(case: Path) -> None:
    found = robocal("identify", "robot.yaml", "data.yaml", "--json", "--folds", "3", "-o", "run").document
    left = found["residuals"]
    assert (
        left["held_out"] is None
        and left["k_fold"]["n"] == 30
        and left["k_fold"]["mean"] < left["k_fold_before"]["mean"]
    )
    assert [f["n"] for f in left["folds"]] == [10, 10, 10] and left["folds"][0]["name"] == "fold 1"
    assert found["split"]["how"] == "3 folds" and len(found["split"]["fit"]) == 30
    assert "Every fold" in Path("run/report.html").read_text(encoding="utf-8")
    shown = robocal("identify", "robot.yaml", "data.yaml", "--hold-out", "blocks", "--folds", "3")
    assert shown.status == 0 and "every fold, after" in shown.out and "block 3" in shown.out
    blocks = robocal("identify", "robot.yaml", "data.yaml", "--hold-out", "blocks", "--blocks", "5", "--json").document
    assert len(blocks["split"]["held_out"]) == 6 and blocks["provenance"]["options"]["hold_out"] == "blocks"


def test_hold_out_zero_judges_by_leave_one_out(case: Path) -> None:
    found = robocal("identify", "robot.yaml", "data.yaml", "--json", "--hold-out", "0").document
    assert found["residuals"]["held_out"] is None and found["residuals"]["leave_one_out"]["n"] == 30
    without = robocal("identify", "robot.yaml", "data.yaml", "--json", "--hold-out", "0", "--no-leave-one-out")
    assert without.status == 3 and "nothing is proven" in str(without.document["verdict"]["reasons"])


def test_several_data_files_share_frames_by_name(case: Path) -> None:
    lines = (case / "data.csv").read_text(encoding="utf-8").splitlines()
    (case / "one.csv").write_text("\n".join(lines[:17]) + "\n", encoding="utf-8")
    (case / "two.csv").write_text("\n".join(lines[:2] + lines[17:]) + "\n", encoding="utf-8")
    text = (case / "data.yaml").read_text(encoding="utf-8")
    for name in ("one", "two"):
        (case / f"{name}.yaml").write_text(text.replace("data.csv", f"{name}.csv"), encoding="utf-8")
    both = robocal("identify", "robot.yaml", "one.yaml", "two.yaml", "--json")
    assert both.status == 0, both.err
    assert (
        sum(p["name"].endswith(".rz") and not p["name"].startswith("tool") for p in both.document["parameters"]) == 2
    )  # base, tracker


def test_validate_measures_other_data_only(case: Path) -> None:
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    robocal(
        "simulate",
        "truth.yaml",
        "--length-error",
        0,
        "--angle-error",
        0,
        "-n",
        25,
        "--noise",
        0.05,
        "--seed",
        9,
        "-o",
        "other",
    )
    ran = robocal("validate", "run", "other/data.yaml", "--against", "robot.yaml", "--json", "-o", "validation")
    assert ran.status == 0, ran.err
    found = ran.document
    assert found["errors"]["this"]["mean"] < 0.2 < found["errors"]["against"]["mean"]
    assert found["errors"]["this"]["profiled"] and len(found["profiled"]) == 6 and len(rows_of(found["poses"])) == 25
    assert found["gain"]["low"] > 0
    assert (
        json.loads((case / "validation" / "validation.json").read_text(encoding="utf-8"))["errors"] == found["errors"]
    )
    again = robocal("validate", "run", "data.yaml")
    assert again.status == 3 and "proves nothing" in again.out


def test_validate_refuses_to_judge_with_too_little(case: Path) -> None:
    lines = (case / "data.csv").read_text(encoding="utf-8").splitlines()
    (case / "data.csv").write_text("\n".join(lines[:4]) + "\n", encoding="utf-8")
    ran = robocal("validate", "robot.yaml", "data.yaml")
    assert ran.status == 3 and "NOT TO BE TRUSTED" in ran.out


def test_check_says_what_will_be_dropped(case: Path) -> None:
    ran = robocal("check", "robot.yaml", "data.yaml", "--json")
    assert (
        ran.status == 0
        and ran.document["identifiability"]["n_free"] == 12
        and ran.document["instruments"][0]["rows"] == 30
    )
    robot = (case / "robot.yaml").read_text(encoding="utf-8").replace("[j2.alpha, j2.d,", "[j1.r, j2.alpha, j2.d,")
    (case / "more.yaml").write_text(robot, encoding="utf-8")
    told = robocal("check", "more.yaml", "data.yaml")
    assert "j1.r cannot be separated from tracker.z" in told.out
    alone = robocal("check", "rv-2aj")
    assert alone.status == 0 and "Mitsubishi" in alone.out


def test_check_knows_parallel_axes(case: Path) -> None:
    text = (
        (case / "robot.yaml")
        .read_text(encoding="utf-8")
        .replace("alpha: 20", "alpha: 0")
        .replace("khalil-hayati", "khalil")
    )
    (case / "parallel.yaml").write_text(text, encoding="utf-8")
    assert "parallel axes" in robocal("check", "parallel.yaml").out


def test_new_never_replaces_a_file(case: Path) -> None:
    made = robocal("new", "panda", "-o", "cell", "--json")
    assert made.status == 0 and len(made.document["written"]) == 3
    assert robocal("check", "cell/robot.yaml", "cell/data.yaml").status == 0
    robocal("new", "panda", "-o", "cell").assert_refused("cell/robot.yaml", "--force")
    assert robocal("new", "panda", "-o", "cell", "--force", "--kind", "pose").status == 0
    assert robocal("new", "mdh-hayati", "--joints", 4, "-o", "own").status == 0
    assert "irb-120" in robocal("new", "--list").out and robocal("new", "--list", "--json").document["conventions"]
    robocal("new", "pandda").assert_refused("panda")
    robocal("new").assert_refused("robocal new --list")


def test_new_writes_what_a_robot_with_a_file_lacks(case: Path) -> None:
    robocal("export", "ur10", "--format", "urdf", "-o", "arm.urdf")
    made = robocal("new", "arm.urdf", "-o", "cell")
    assert made.status == 0 and "robocal check arm.urdf cell/data.yaml" in made.out
    assert {p.name for p in Path("cell").iterdir()} == {"data.yaml", "measurements.csv"}
    assert robocal("check", "arm.urdf", "cell/data.yaml").status == 0
    assert "robocal check arm.urdf 'my cell/data.yaml'" in robocal("new", "arm.urdf", "-o", "my cell").out


def test_export_every_form(case: Path) -> None:
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    assert robocal("export", "run").out == (case / "run" / "calibrated.yaml").read_text(encoding="utf-8")
    assert robocal("export", "run", "--format", "markdown").out.startswith("| name | type |")
    assert robocal("export", "run", "--format", "csv").out.splitlines()[1].startswith("j1,revolute,")
    assert robocal("export", "run", "--format", "urdf", "-o", "arm.urdf").status == 0
    q = np.random.default_rng(1).uniform(-1, 1, (20, 3))
    assert np.abs(read_robot("arm.urdf").chain.pose(q) - read_robot("run/calibrated.yaml").chain.pose(q)).max() < 1e-12
    robocal("export", "run", "--format", "urdf", "-o", "arm.urdf").assert_refused("arm.urdf")
    ran = robocal("export", "run", "--format", "offsets")
    rows = [line.split(",") for line in ran.out.splitlines() if not line.startswith("#")][1:]
    alone = json.loads(Path("run/result.json").read_text(encoding="utf-8"))["offsets"]
    assert {r[0]: float(r[1]) for r in rows} == pytest.approx({p["joint"]: p["offset"] for p in alone["parameters"]})
    assert "offsets only: " in ran.err and "offsets only: " in ran.out
    robocal("export", "robot.yaml", "--format", "offsets").assert_refused("--nominal")


def test_simulate_then_identify_recovers_a_set_value(case: Path) -> None:
    ran = robocal(
        "simulate", "robot.yaml", "--set", "j3.d=251.25", "--length-error", 0, "--angle-error", 0, "-o", "sim", "--json"
    )
    assert (
        ran.status == 0
        and ran.document["simulated"]
        and "SIMULATED" in (case / "sim" / "data.csv").read_text(encoding="utf-8")
    )
    found = robocal("identify", "sim/robot.yaml", "sim/data.yaml", "--json").document
    value = next(p for p in found["parameters"] if p["name"] == "j3.d")
    assert abs(value["identified"] - 251.25) < 5 * value["sigma"] < 1
    robocal("simulate", "robot.yaml", "-o", "sim").assert_refused("--force")
    robocal("simulate", "robot.yaml", "-o", "x", "--set", "j3.dd=1").assert_refused("j3.d")


@pytest.mark.sampled(3)
@pytest.mark.parametrize("kind", ["position", "pose"])
@pytest.mark.parametrize("frame", ["auto", "none", "100,200,300,0,0,90"])
def test_simulate_kinds_and_frames(case: Path, kind: str, frame: str) -> None:
    robocal("simulate", "robot.yaml", "--kind", kind, "--frame", frame, "-o", "sim", "-n", 40)
    ran = robocal("identify", "sim/robot.yaml", "sim/data.yaml", "--free", "alpha,beta,d,theta,r,tool", "--json")
    assert ran.status == 0, ran.out
    assert (ran.document["residuals"]["angle"] is None) == (kind == "position")
    same = robocal("simulate", "robot.yaml", "--at", "sim/data.yaml", "-o", "again", "--json")
    assert same.document["configurations"] == 40


def test_report_is_written_again(case: Path) -> None:
    robocal("identify", "robot.yaml", "data.yaml", "-o", "run")
    page = (case / "run" / "report.html").read_text(encoding="utf-8")
    (case / "run" / "report.html").unlink()
    assert robocal("report", "run").status == 0
    # The CSV holds nine digits, so the page is the same but for the last ones.
    assert abs(len((case / "run" / "report.html").read_text(encoding="utf-8")) - len(page)) < 0.01 * len(page)
    robocal("report", "data.csv").assert_refused("run folder")


def test_a_urdf_stays_a_urdf(case: Path) -> None:
    robocal("export", "robot.yaml", "--format", "urdf", "-o", "arm.urdf")
    ran = robocal("identify", "arm.urdf", "data.yaml", "-o", "run", "--tip", "tool")
    assert ran.status == 0, ran.err + ran.out
    assert "calibrated.urdf" in files(case / "run") and "calibrated.yaml" not in files(case / "run")
    assert robocal("export", "run", "--format", "markdown").status == 0


def test_a_catalogue_name_gives_way_to_a_file(case: Path) -> None:
    (case / "ur10").write_text((case / "robot.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    assert "three axes" in robocal("check", "ur10").out


def test_not_improved_is_three_with_everything_written(tmp_path: Path) -> None:
    small(tmp_path, error=0.0)
    ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "data.yaml", "-o", tmp_path / "run")
    assert ran.status == 3 and "NOT IMPROVED" in ran.out
    assert "result.json" in files(tmp_path / "run")


def test_the_recipe_holds_every_option(case: Path) -> None:
    found = robocal("identify", "robot.yaml", "data.yaml", "--json", "--method", "lse").document
    assert found["fit"]["reason"] == "as many steps as were asked for"
    options = found["provenance"]["options"]
    assert {"free", "fix", "prior", "keep_all", "seed", "iterations", "particles", "method", "loss"} <= set(options)
    assert options["hold_out"] == 0.0 and options["leave_one_out"] is False

"""Studies: the same bytes however many workers there are and whatever becomes of them; numbers that theory foretells; specs that cannot be
meant."""

from __future__ import annotations

import contextlib
import csv
import json
import os
import random
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal
from listings import points_of
from studies.specs import EXAMPLES, TEXT, conducted, of

from robocal.files.pose_table import read_poses
from robocal.files.robot import open_robot
from robocal.files.studyfile import read_study
from robocal.parameters import FRAME_SYMBOLS
from robocal.planning.pose_selection import PlanOptions, plan
from robocal.prove.identify import identify
from robocal.studies.arms import coverage
from robocal.studies.run import parts_of
from robocal.studies.work import chunks, do, trials_of


def test_any_number_of_workers_writes_the_same_bytes(study):
    one = conducted(study, "one.npz", workers=1)
    assert conducted(study, "two.npz", workers=2) == one and conducted(study, "four.npz", workers=4) == one
    assert not any(study.parent.glob("*.parts"))


def test_a_worker_that_is_killed_loses_nothing(study):
    """By its process id, in the middle, more than once."""
    study.write_text(TEXT.replace("trials: 60", "trials: 3000").replace("chunk: 10", "chunk: 50"))
    calm = conducted(study, "calm.npz", workers=1)
    result = study.parent / "wild.npz"
    run = subprocess.Popen(
        [sys.executable, "-m", "robocal", "study", str(study), "-o", str(result), "--workers", "2"],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip
    killed = 0
    while run.poll() is None and killed < 3:
        for pid in workers_of(run.pid):
            if len(list(parts_of(result).glob("*.npz"))) > 2 + 10 * killed:
                os.kill(pid, signal.SIGKILL)
                killed += 1
                break
        time.sleep(0.02)
    _, said = run.communicate()
    assert run.returncode == 0 and killed >= 1, said
    assert result.read_bytes() == calm


def workers_of(pid):
    """The processes that work for another."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if int((place / "stat").read_text().rpartition(")")[2].split()[1]) == pid:
                found.append(int(place.name))
    return found


@pytest.mark.parametrize("seed", range(3))
def test_a_study_that_is_killed_resumes_with_the_same_bytes(study, seed):
    study.write_text(TEXT.replace("trials: 60", "trials: 2000").replace("chunk: 10", "chunk: 50"))
    calm = conducted(study, "calm.npz", workers=2)
    result, rng = study.parent / "killed.npz", random.Random(seed)
    call = [sys.executable, "-m", "robocal", "study", str(study), "-o", str(result), "--workers", "2"]
    for _ in range(4):
        run = subprocess.Popen([*call, "--resume"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(rng.uniform(0.7, 2.0))
        run.send_signal(signal.SIGKILL)
        run.wait()
        if result.exists():
            break
    if not result.exists():
        assert subprocess.run([*call, "--resume"], capture_output=True).returncode == 0
    assert result.read_bytes() == calm


def test_an_interrupted_study_is_not_begun_anew_unasked(study):
    read = read_study(study)
    parts = parts_of(study.with_suffix(".npz"))
    for work in chunks(read, parts)[:3]:
        do(work)
    (parts / "study.json").write_text(read.text)
    ran = robocal("study", study)
    assert ran.status == 2 and "--resume" in ran.remarks
    (parts / chunks(read, parts)[1].place.name).write_bytes(b"PK half a file")
    assert robocal("study", study, "--resume", "--workers", 1).status == 0
    assert study.with_suffix(".npz").read_bytes() == conducted(study, "again.npz", workers=1)


def test_chunks_of_another_study_are_refused(study):
    read = read_study(study)
    parts = parts_of(study.with_suffix(".npz"))
    do(chunks(read, parts)[0])
    (parts / "study.json").write_text(read.text)
    study.write_text(TEXT.replace("seed: 3", "seed: 4"))
    ran = robocal("study", study, "--resume")
    assert ran.status == 2 and "another study" in ran.remarks
    assert robocal("study", study, "--force", "--workers", 1).status == 0


def test_theory_foretells_what_is_drawn(study):
    study.write_text(
        TEXT.replace("trials: 60", "trials: 1500").replace("chunk: 10\n", "").replace("count: 40", "count: 100")
    )
    ran = robocal("study", study, "--json", "-o", study.parent / "out.npz")
    points = points_of(json.loads(ran.out))
    for point, tolerance in zip(points, (0.03, 0.1), strict=True):  # linear in the noise; of squares to second order
        for name in ("anchors", "zeros"):
            assert (
                point[name]["rms"] == pytest.approx(point[name]["foretold"], rel=tolerance) and point[name]["lost"] == 0
            )
    with np.load(study.parent / "out.npz") as file:
        assert file["anchors"].shape == (2, 1500) and list(file["varied.residual"]) == ["length", "squared"]


def test_a_table_of_every_trial(study):
    conducted(study, "out.csv", workers=1)
    rows = list(csv.reader((study.parent / "out.csv").read_text().splitlines()))
    assert rows[0] == ["residual", "trial", "anchors [m]", "zeros [m]"] and len(rows) == 1 + 2 * 60
    conducted(study, "one.npz", workers=1)
    with np.load(study.parent / "one.npz") as file:
        np.testing.assert_allclose([float(r[2]) for r in rows[1:]], file["anchors"].ravel(), rtol=1e-8)


def test_a_list_of_poses_instead_of_random_ones(study):
    lines = ["x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]"]
    rng = np.random.default_rng(0)
    for v in np.hstack([rng.uniform(-500, 500, (30, 3)) + [0, 0, 1900], rng.uniform(-15, 15, (30, 3))]):
        lines.append(",".join(f"{x:.4f}" for x in v))
    (study.parent / "list.csv").write_text("\n".join(lines) + "\n")
    study.write_text(TEXT.replace("{count: 40, shift: 0.7 m, turn: 15 deg}", "{file: list.csv}"))
    assert conducted(study, "out.npz", workers=1)


def test_arms(tmp_path):
    text = (EXAMPLES / "studies" / "poses-of-an-arm.yaml").read_text().replace("trials: 40", "trials: 3\nchunk: 2")
    (tmp_path / "arm.yaml").write_text(text.replace("[30, 56, 100]", "[30]"))
    ran = robocal("study", tmp_path / "arm.yaml", "--workers", 1, "--json")
    (point,) = points_of(json.loads(ran.out))
    assert point["improved"]["mean"] == 1 and 0 < point["after"]["mean"] < 0.3 * point["before"]["mean"]


def test_planned_poses_are_those_of_plan(arm):
    """Those that the verb chooses with the study's seed, in every trial."""
    said = robocal("plan", "rv-2aj", "-n", 25, "--noise", 0.1, "--seed", 5, "-o", arm.parent / "plan")
    assert said.status == 0, said.said
    chain = open_robot("rv-2aj").chain
    _, q, _ = read_poses(arm.parent / "plan" / "poses.csv", chain)
    poses = trials_of(read_study(of(arm, "count: 25", "count: 25, choose: planned")), 0).poses
    one, two = (poses.draw_joints(np.random.default_rng(i)) for i in range(2))
    np.testing.assert_array_equal(one, two)
    np.testing.assert_allclose(one[np.lexsort(one.T)], q[np.lexsort(q.T)], atol=1e-9)
    others = [poses.draw_tests(np.random.default_rng(i)) for i in range(2)]
    assert others[0].shape == (300, 5) and (others[0] != others[1]).all()


def test_planned_poses_are_the_same_in_every_process(arm):
    of(arm, "{count: 25}", "{count: 25, choose: planned}\nsweep: {poses.criterion: [I, D]}")
    one = conducted(arm, "one.npz", workers=1)
    assert conducted(arm, "two.npz", workers=2) == one
    with np.load(arm.parent / "one.npz") as file:
        assert file["elsewhere"].shape == (2, 4) and (file["elsewhere"][0] != file["elsewhere"][1]).all()


def test_where_a_list_says_the_robot_has_to_be_accurate(arm):
    """Its first, third, ... are planned for, the others judged; another list is another study."""
    read = read_study(of(arm, "count: 25", "count: 25, choose: planned, tests: tests.csv"))
    chain = open_robot("rv-2aj").chain
    place = arm.parent / "tests.csv"
    _, q, _ = read_poses(place, chain)
    poses = trials_of(read, 0).poses
    np.testing.assert_array_equal(poses.draw_tests(np.random.default_rng(0)), q[1::2])
    wanted = plan(chain, poses.template, PlanOptions(25, seed=5), tests=q[::2]).q
    np.testing.assert_array_equal(poses.draw_joints(np.random.default_rng(0)), wanted)
    place.write_text("".join(place.read_text().splitlines(keepends=True)[:-1]))
    assert read_study(arm).text != read.text


def test_an_arm_is_measured_at_a_list_of_poses(arm):
    study = of(arm, "count: 25", "file: listed.csv")
    poses = trials_of(read_study(study), 0).poses
    assert poses.draw_joints(np.random.default_rng(0)).shape == (30, 5)
    assert conducted(study, "out.npz", workers=1)


@pytest.mark.parametrize("noise", ["position: 0.1 mm", "position: 0.1 mm, orientation: 0.2 mrad"])
def test_the_error_elsewhere_falls_with_the_noise(arm, noise):
    """And is that of the tracker's view: a thousandth of the noise leaves a thousandth of the error."""
    fine = noise.replace("0.1 mm", "0.1 um").replace("0.2 mrad", "0.2 urad")
    of(arm, "noise: {position: 0.1 mm}", f"sweep: {{noise: [{{{noise}}}, {{{fine}}}]}}")
    conducted(arm, "out.npz", workers=1)
    with np.load(arm.parent / "out.npz") as file:
        coarse, small = file["elsewhere"].mean(axis=1)
    assert 2e-5 < coarse < 2e-4 and small == pytest.approx(1e-3 * coarse, rel=0.3)


def test_coverage_counts_the_intervals_that_hold_the_truth(arm):
    trials = trials_of(read_study(of(arm, "{position: 0.1 mm}", "{position: 0.1 mm, stated: false}")), 0)
    truth, frame, data = trials._measure(np.random.default_rng(1))
    assert data.observations[0].sigma is None and frame.value != data.observations[0].frame.value
    found = identify(trials.arm.chain, data, trials.options)
    fitted = [p.name for p in found.parameters if p.interval is not None]
    assert {"j2.theta", "tracker.x"} <= set(fitted)
    # Where the estimate is the truth every interval holds it, far from it none does, and each parameter counts alike.
    at = {n: found.table[n].value for n in fitted}
    here = truth.with_values({n: v for n, v in at.items() if n in truth.table})
    there = replace(frame, value=tuple(found.table[f"tracker.{s}"].value for s in FRAME_SYMBOLS))
    assert coverage(found, here, there) == 1
    one = here.with_values({"j2.theta": at["j2.theta"] + 1})
    assert coverage(found, one, there) == pytest.approx(1 - 1 / len(fitted))
    away = here.with_values({n: v + 1 for n, v in at.items() if n in truth.table})
    assert coverage(found, away, replace(there, value=tuple(v + 100 for v in there.value))) == 0


def test_the_tool_of_a_true_arm_is_off_where_that_is_said(arm):
    for said, off in (("", False), ("\nerrors: {length: 1 mm, angle: 5 mrad, tool: true}", True)):
        trials = trials_of(read_study(of(arm, "seed: 5", f"seed: 5{said}")), 0)
        truth = trials._true(np.random.default_rng(1))
        assert (truth.table["tool.x"].value != trials.arm.chain.table["tool.x"].value) == off


def test_settings_of_a_sweep_do_not_leak_into_each_other(arm):
    read = read_study(
        of(arm, "noise: {position: 0.1 mm}", "sweep: {noise: [{position: 0.1 mm}], noise.stated: [true, false]}")
    )
    assert [dict(p.varied)["noise"] for p in read.points] == ["position 0.1 mm"] * 2
    assert [p["noise.stated"] for p in read.points] == [True, False]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("count: 25", "count: 25, choose: plan", "planned"),
        ("count: 25", "count: 501, choose: planned", "1 to 500"),
        ("count: 25", "file: listed.csv, choose: planned", "poses.count"),
        ("count: 25", "count: 25, criterion: O9", "O1"),
        ("count: 25", "count: 25, tests: none.csv", "none.csv"),
        ("position: 0.1 mm", "position: 0.1 mm, stated: maybe", "stated"),
    ],
)
def test_poses_of_arms_that_cannot_be_meant_are_refused(arm, old, new, words):
    ran = robocal("study", of(arm, old, new), "--workers", 1)
    assert ran.status == 2 and words in ran.remarks, ran.said


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("trials: 60", "trials: 0", "trials"),
        ("length: 3 mm", "length: 3", "noise.length"),
        ("length: 3 mm", "length: -3 mm", "noise.length"),
        ("length: 3 mm", "length: 3 deg", "another quantity"),
        ("robot: robot.yaml", "robot: rebot.yaml", "rebot.yaml"),
        ("of: cable-calibration", "of: calibration", "of"),
        ("residual: [length", "residual: [lenth", "lenth"),
        ("sweep: {residual", "sweep: {residuals", "residuals"),
        ("sweep: {residual", "sweep: {seed", "cannot be varied"),
        ("[length, squared]", "[]", "nothing to vary"),
        (", shift: 0.7 m", "", "shift"),
        ("count: 40", "count: 0", "count"),
        ("chunk: 10", "chunk: 0", "chunk"),
        ("chunk: 10", "chunks: 10", "chunks"),
        ("seed: 3", "seed: -3", "seed"),
        ("count: 40", "count: 2", "too few poses"),
        ("count: 40", "count: 40, choose: planned", "poses.choose"),
        ("count: 40", "count: 40, tests: tests.csv", "poses.tests"),
    ],
)
def test_what_cannot_be_meant_is_refused(study, old, new, words):
    assert old in TEXT
    study.write_text(TEXT.replace(old, new))
    ran = robocal("study", study, "--workers", 1)
    assert ran.status == 2 and words in ran.remarks, ran.said
    assert not study.with_suffix(".npz").exists() and not any(study.parent.glob("*.parts"))


def test_a_worker_s_error_is_told_as_one_s_own(study):
    study.write_text(TEXT.replace("sweep: {residual: [length, squared]}", "sweep: {poses.count: [40, 2]}"))
    ran = robocal("study", study, "--workers", 2)
    assert ran.status == 2 and "study.yaml" in ran.remarks and "poses.count: 2" in ran.remarks, ran.said


def test_another_suffix_is_refused_before_anything_is_worked_out(study):
    ran = robocal("study", study, "-o", study.parent / "out.xlsx")
    assert ran.status == 2 and ".npz or .csv" in ran.remarks and not any(study.parent.glob("*.parts"))


@pytest.mark.parametrize("name", sorted(p.name for p in (EXAMPLES / "studies").glob("*.yaml")))
def test_the_shipped_specs_are_read(name):
    read = read_study(EXAMPLES / "studies" / name)
    assert read.points and read.trials >= 40


@pytest.fixture(scope="module")
def scheduler():
    """A local cluster of two processes, as two commands would start it."""
    pytest.importorskip("distributed")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
    dask = [
        sys.executable,
        "-m",
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--no-dashboard",
        "--port",
        address.rpartition(":")[2],
    ]
    work = [
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        address,
        "--nthreads",
        "1",
        "--no-dashboard",
        "--no-nanny",
    ]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    ran = [subprocess.Popen(dask, **quiet), *(subprocess.Popen(work, **quiet) for _ in range(2))]
    yield address
    for process in reversed(ran):
        process.kill()
        process.wait()


@pytest.mark.slow
def test_a_cluster_writes_the_same_bytes(study, scheduler):
    here = conducted(study, "here.npz", workers=1)
    # In a process of its own: what a cluster's client leaves open at its end is no concern of this one.
    there = study.parent / "there.npz"
    call = [sys.executable, "-m", "robocal", "study", str(study), "-o", str(there), "--cluster", scheduler]
    ran = subprocess.run(call, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert there.read_bytes() == here


@pytest.mark.slow
def test_a_cluster_that_is_not_there(study, monkeypatch):
    """With a second of patience in place of twenty: nobody answers sooner or later."""
    pytest.importorskip("distributed")
    code = "import sys; from robocal.studies import cluster; from robocal.cli.main import main; cluster.PATIENCE = 1.0; sys.exit(main(sys.argv[1:]))"
    call = [sys.executable, "-c", code, "study", str(study), "--cluster", "tcp://127.0.0.1:9"]
    ran = subprocess.run(call, capture_output=True, text=True)
    assert ran.returncode == 2 and "no scheduler answers" in ran.stderr and "Traceback" not in ran.stderr, ran.stderr


BIASED = """robocal: 1
kind: study
of: cable-calibration
robot: robot.yaml
trials: 3
poses: {file: poses.csv}
bias: {along: [1, 2, -2]}
sweep:
  bias.WHAT: [SIZE]
  residual: [length, squared]
"""


@pytest.mark.parametrize(("what", "size"), [("length", "5 mm"), ("position", "5 mm"), ("orientation", "0.001 deg")])
def test_constant_errors_end_where_theory_says(study, what, size):
    """Of one list: a length's in the zeros alone, a position's in the anchors alone, an orientation's as (3.63) has it."""
    rng = np.random.default_rng(4)
    rows = np.column_stack(
        [rng.uniform(-500, 500, (30, 2)), rng.uniform(1500, 2500, 30), rng.uniform(-15, 15, (30, 3))]
    )
    head = "x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]"
    np.savetxt(study.parent / "poses.csv", rows, delimiter=",", header=head, comments="", fmt="%.6f")
    study.write_text(BIASED.replace("WHAT", what).replace("SIZE", size))
    for p in points_of(robocal("study", study, "--json", "--workers", 1).document):
        for output in ("anchors", "zeros"):
            assert p[output]["rms"] == pytest.approx(p[output]["foretold"], rel=2e-3, abs=1e-11)
        moved = {"length": ("zeros", 5e-3), "position": ("anchors", 5e-3 / 3**0.5)}.get(what)
        if moved:
            assert p[moved[0]]["rms"] == pytest.approx(moved[1], rel=1e-9)
            assert p[{"zeros": "anchors", "anchors": "zeros"}[moved[0]]]["rms"] < 1e-11


def test_a_sweep_is_drawn_beside_its_numbers(study):
    ran = robocal("study", study, "--json")
    page = study.with_suffix(".html")
    assert [Path(p).name for p in ran.document["written"]] == ["study.npz", "study.json", "study.html"]
    assert json.loads(study.with_suffix(".json").read_text())["outputs"] == ran.document["outputs"]
    read = [Path(i["file"]).name for i in ran.document["provenance"]["inputs"]]
    assert read == ["study.yaml", "robot.yaml"] and all(
        i["sha256"] in page.read_text() for i in ran.document["provenance"]["inputs"]
    )
    text = page.read_text()
    assert text.count("<svg") == 2 and "anchors: rms [mm]" in text and "as linear theory foretells" in text
    robocal("study", study).assert_refused("exists", "--force")
    for suffix in (".npz", ".json"):
        study.with_suffix(suffix).unlink()
    robocal("study", study).assert_refused("study.html", "exists")
    study.write_text(TEXT.partition("sweep")[0])
    robocal("study", study, "--force")  # nothing to draw: the page of another study does not stay
    assert study.with_suffix(".npz").exists() and not page.exists()


@pytest.mark.parametrize(
    ("along", "found"), [("[0, 0, 0]", "[0.0, 0.0, 0.0]"), ("[1, 2]", "[1.0, 2.0]"), ("[.inf, 0, 0]", "inf")]
)
def test_a_bias_has_a_direction(study, along, found):
    study.write_text(TEXT + f"bias: {{length: 1 mm, along: {along}}}\n")
    robocal("study", study).assert_refused("bias.along", "not a direction")


def test_a_value_is_varied_once(study):
    study.write_text(TEXT.replace("[length, squared]", "[length, squared, length]"))
    robocal("study", study).assert_refused("sweep.residual", "given twice")


@pytest.mark.parametrize("key", ["errors: {length: 1 mm}", "options: {loss: huber}", "gross: {share: 0.1}"])
def test_what_another_kind_of_study_knows_is_refused(study, key):
    study.write_text(TEXT + key + "\n")
    robocal("study", study).assert_refused(key.partition(":")[0], "not a key of this kind of study")


@pytest.mark.parametrize("key", ["residual", "bias.length", "noise.length", "poses.shift"])
def test_also_where_it_is_varied(study, key):
    study.write_text("robocal: 1\nkind: study\nof: identification\nrobot: irb-120\ntrials: 2\nposes: {count: 30}\n")
    with study.open("a") as file:
        file.write(f"sweep: {{{key}: [{'length' if key == 'residual' else '1 mm'}]}}\n")
    robocal("study", study).assert_refused("not a key of this kind of study", key.partition(".")[0])


def test_outputs_are_those_that_the_file_names(study):
    study.write_text(TEXT + "outputs: [zeros]\n")
    ran = robocal("study", study, "-o", study.parent / "zeros.npz", "--json")
    assert list(ran.document["outputs"]) == ["zeros"]
    with np.load(study.parent / "zeros.npz") as file:
        assert sorted(file.files) == ["varied.residual", "zeros"]
    for outputs, said in (
        ("[zeroes]", "zeros"),
        ("[]", "outputs"),
        ("[coverage]", "anchors, zeros"),
        ("[zeros, zeros]", "outputs"),
    ):
        study.write_text(TEXT + f"outputs: {outputs}\n")
        robocal("study", study, "--force").assert_refused("no such outputs", said)

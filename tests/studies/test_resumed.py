"""What a study makes of whatever comes between its first trial and its last, and what it tells before the first."""

from __future__ import annotations

import errno
import os
import pickle
import subprocess
import sys
import time

import numpy as np
import pytest
from cli.runs import robocal
from cli.test_cable_import import spatial
from listings import points_of
from studies.specs import TEXT, conducted, of

from robocal._version import __version__
from robocal.errors import FileError
from robocal.files.studyfile import read_study
from robocal.files.writing import alone
from robocal.studies.run import parts_of
from robocal.studies.work import chunks, do, pack

DAMAGED = {
    "empty": lambda place: place.write_bytes(b""),
    "half": lambda place: place.write_bytes(place.read_bytes()[:300]),
    "one array": lambda place: (
        np.save(place.with_suffix(".npy"), np.ones(10)),
        place.with_suffix(".npy").replace(place),
    ),
    "other arrays": lambda place: np.savez(place, anchors=np.ones(10)),
    "other sizes": lambda place: np.savez(place, anchors=np.ones((10, 2)), zeros=np.ones(10)),
    "pickled": lambda place: np.savez(place, anchors=np.array([{}] * 10), zeros=np.ones(10)),
}


@pytest.fixture
def begun(study):
    """A study of which three chunks are done."""
    read = read_study(study)
    parts = parts_of(study.with_suffix(".npz"))
    for work in chunks(read, parts)[:3]:
        do(work)
    (parts / "study.json").write_text(read.text)
    return study


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_chunk_that_is_damaged_is_done_again(begun, damage):
    DAMAGED[damage](chunks(read_study(begun), parts_of(begun.with_suffix(".npz")))[1].place)
    ran = robocal("study", begun, "--resume", "--workers", 1)
    assert ran.status == 0, ran.said
    assert begun.with_suffix(".npz").read_bytes() == conducted(begun, "again.npz", workers=1)


def test_chunks_of_another_version_are_refused(begun):
    about = parts_of(begun.with_suffix(".npz")) / "study.json"
    assert __version__ in about.read_text()
    about.write_bytes(about.read_bytes().replace(__version__.encode(), b"0.0\xff"))
    robocal("study", begun, "--resume").assert_refused("another version", "--force")


def test_what_was_begun_goes_on_where_it_replaces_an_older_result(begun):
    """--resume --force keeps what is done: with --force alone it would be done again."""
    begun.with_suffix(".npz").write_bytes(b"old")
    robocal("study", begun, "--resume").assert_refused("exists", "--force")
    done = chunks(read_study(begun), parts_of(begun.with_suffix(".npz")))[0].place
    done.write_bytes(pack({n: np.full(10, 7.0) for n in ("anchors", "zeros")}))
    assert robocal("study", begun, "--resume", "--force", "--workers", 1).status == 0
    with np.load(begun.with_suffix(".npz")) as file:
        assert (file["anchors"][0, :10] == 7).all() and (file["anchors"][0, 10:] != 7).all()


@pytest.mark.parametrize("how", [(), ("--resume",), ("--force",), ("--resume", "--force")])
def test_two_processes_do_not_work_on_one_result(begun, how):
    parts = parts_of(begun.with_suffix(".npz"))
    before = sorted(p.name for p in parts.iterdir())
    with alone(parts):
        robocal("study", begun, *how).assert_refused("another process", "study.npz.parts")
        assert sorted(p.name for p in parts.iterdir()) == sorted([*before, "lock"])
    assert sorted(p.name for p in parts.iterdir()) == before
    assert robocal("study", begun, "--resume", "--workers", 1).status == 0 and not parts.exists()


def test_a_robot_that_changes_while_a_study_runs_is_told(study):
    """Points that are opened later would be of another robot."""
    study.write_text(TEXT.replace("[length, squared]", "[squared, length]"))
    every = chunks(read_study(study), parts_of(study.with_suffix(".npz")))
    do(every[0])
    robot = study.parent / "robot.yaml"
    robot.write_text(robot.read_text().replace("-1813.3", "-1913.3"))
    with pytest.raises(FileError, match="changed while the study ran"):
        do(every[-1])


def test_bodies_of_a_model_belong_to_the_study(study, tmp_path):
    """Half of a model of CASPR stands in another file: chunks of one body are not those of another."""
    spatial().write(tmp_path)
    study.write_text(TEXT.replace("robot.yaml", str(tmp_path / "model_cables.xml")))
    before = read_study(study)
    bodies = tmp_path / "model_bodies.xml"
    bodies.write_text(bodies.read_text().replace("<mass>8.5", "<mass>9.5"))
    after = read_study(study)
    assert before.text != after.text and before.read != after.read


@pytest.mark.parametrize("name", ["out.npz", "out.json", "out.html"])
def test_a_folder_in_the_way_is_told_before_the_first_trial(study, name):
    (study.parent / name).mkdir()
    ran = robocal("study", study, "-o", study.parent / "out.npz", "--force", "--workers", 1)
    ran.assert_refused("folder of this name", name)
    assert not parts_of(study.parent / "out.npz").exists()


def test_a_study_that_is_refused_leaves_no_folder(study):
    study.write_text(TEXT.replace("robot.yaml", "none.yaml"))
    robocal("study", study, "-o", study.parent / "new" / "within" / "out.npz", "--workers", 1).assert_refused(
        "none.yaml"
    )
    assert not (study.parent / "new").exists()


def test_a_disk_without_locks_is_no_other_process(tmp_path, monkeypatch):
    def flock(*_):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("robocal.files.writing.fcntl.flock", flock)
    with pytest.raises(FileError, match="cannot be locked: no locks available"), alone(tmp_path / "parts"):
        pass


def test_every_robot_of_a_sweep_is_opened_before_the_first_trial(study):
    study.write_text(TEXT.replace("{residual: [length, squared]}", "{robot: [robot.yaml, none.yaml]}"))
    robocal("study", study, "--workers", 1).assert_refused("none.yaml")
    assert not any(study.parent.glob("*.parts"))


@pytest.mark.parametrize(
    ("sweep", "lengths"),
    [
        ("{noise.length: [1 mm, 2 mm], noise: [{position: 1 mm}]}", [1e-3, 2e-3]),
        ("{noise: [{position: 1 mm}], noise.length: [1 mm, 2 mm]}", [1e-3, 2e-3]),
    ],
)
def test_a_key_within_another_is_varied_in_either_order(study, sweep, lengths):
    study.write_text(TEXT.replace("{residual: [length, squared]}", sweep))
    points = read_study(study).points
    assert [p["noise.length"] for p in points] == lengths and all(p["noise.position"] == 1e-3 for p in points)
    study.write_text(study.read_text().replace("{position: 1 mm}", "{length: 3 mm}"))
    robocal("study", study).assert_refused("sweep.noise.length", "given twice")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("sweep: {residual", "sweep: {noise.length: [1 mm, thick], residual", "noise.length"),
        ("length: 3 mm", "length: 3 deg", "noise.length"),
    ],
)
def test_a_quantity_that_is_none_is_told_with_its_file(study, old, new, words):
    study.write_text(TEXT.replace(old, new))
    robocal("study", study).assert_refused("study.yaml", words)


@pytest.mark.parametrize(
    ("options", "words"),
    [("loss: hubert", "huber"), ("hold_out: 0.6", "0 to 0.5"), ("hold_out: .nan", "0 to 0.5"), ("method: lmm", "lm")],
)
def test_options_that_no_trial_knows_are_told_before_the_first(arm, options, words):
    key, _, value = options.partition(": ")
    of(
        arm,
        "outputs:",
        f"sweep: {{options.{key}: [{'lm' if key == 'method' else 'none' if key == 'loss' else 0.2}, {value}]}}\noutputs:",
    )
    robocal("study", arm, "--workers", 1).assert_refused(f"options.{key}", words)
    assert not any(arm.parent.glob("*.parts"))


@pytest.mark.parametrize("workers", [1, 2])
def test_a_study_in_which_nothing_ends_is_not_to_be_trusted(study, workers):
    study.write_text(TEXT.replace("{residual: [length, squared]}", "{noise.length: [3 mm, 100 m]}"))
    ran = robocal("study", study, "--workers", workers)
    assert ran.status == 3 and "at 1 of 2 points no trial has a number" in ran.out, ran.said
    document = robocal("study", study, "--force", "--json", "--workers", workers).document
    assert [r["code"] for r in document["remarks"]] == ["no-trial-ended"] * 2 and points_of(document)[1]["anchors"][
        "lost"
    ] == 60
    assert points_of(document)[1]["anchors"]["rms"] is None
    study.write_text(TEXT.replace("count: 40", "count: 5"))
    ran = robocal("study", study, "--force", "--workers", workers)
    assert ran.status == 0 and "trials are lost" in ran.out, ran.said


def test_workers_look_for_modules_where_their_caller_does(study):
    """Not in the folder in which they start: a file of the name of a module is somebody's own."""
    calm = conducted(study, "calm.npz", workers=1)
    (study.parent / "numba.py").write_text("raise SystemExit(3)\n")
    command = [sys.executable, "-P", "-m", "robocal", "study", "study.yaml", "-o", "own.npz", "--workers", "2"]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    ran = subprocess.run(command, cwd=study.parent, env=env, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert (study.parent / "own.npz").read_bytes() == calm


def test_workers_of_a_caller_that_is_gone_say_nothing(study):
    study.write_text(TEXT.replace("trials: 60", "trials: 200000").replace("chunk: 10", "chunk: 50"))
    run = subprocess.Popen(
        [sys.executable, "-m", "robocal", "study", str(study), "--workers", "2"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    while not any(parts_of(study.with_suffix(".npz")).glob("*.npz")) and run.poll() is None:
        time.sleep(0.05)
    run.kill()
    _, said = run.communicate()  # ends when the workers are gone, too
    assert "Traceback" not in said


def test_what_is_sent_of_a_sweep_does_not_grow_with_it(study):
    study.write_text(TEXT.replace("[length, squared]", "[length]"))
    few = len(pickle.dumps(chunks(read_study(study), study.parent)[0]))
    study.write_text(
        TEXT.replace("{residual: ", "{poses.count: [" + ", ".join(map(str, range(10, 210))) + "], residual: ")
    )
    assert len(pickle.dumps(chunks(read_study(study), study.parent)[0])) < 1.1 * few


@pytest.mark.parametrize("option", ["--tls-ca", "--tls-cert", "--tls-key"])
def test_what_is_said_of_a_cluster_needs_one(study, option):
    (study.parent / "a.pem").write_text("")
    robocal("study", study, option, study.parent / "a.pem").assert_refused(option, "--cluster")
    robocal("study", study, option, "none.pem", "--cluster", "tls://127.0.0.1:9").assert_refused("none.pem")
    robocal("study", study, "--workers", 2, "--cluster", "tcp://127.0.0.1:9").assert_refused("--workers")

"""A run folder is one thing: files of two calibrations are never read together, and nothing of a person's is overwritten."""

from __future__ import annotations

import itertools
import json
import shutil
from pathlib import Path

import pytest
from called import identify, simulate, validate
from cli.runs import robocal
from run_folders import content, earlier

from robocal.errors import FileError, FormatError
from robocal.files.covariance import read_covariance
from robocal.files.runfolder import PARTS, RESULT, find_run, obstacle, open_run
from robocal.remarks.code import Code

VERBS = {
    "report": ("report", "RUN", "-o", "page.html"),
    "predict": ("predict", "RUN", "q.csv"),
    "export": ("export", "RUN", "--format", "urdf"),
    "drift": ("drift", "RUN", "other"),
    "drift, second": ("drift", "other", "RUN"),
    "compensate": ("compensate", "RUN", "q.csv"),
    "validate": ("validate", "RUN", "again/data.yaml"),
    "against": ("validate", "robot.yaml", "again/data.yaml", "--against", "RUN"),
    "identify": ("identify", "RUN", "again/data.yaml"),
    "check": ("check", "RUN", "again/data.yaml"),
    "plan": ("plan", "RUN", "-n", "12"),
    "simulate": ("simulate", "RUN", "-o", "sim"),
    "robot file": ("export", "RUN/calibrated.yaml"),
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two calibrations of one robot, and data that neither has seen."""
    home = tmp_path_factory.mktemp("runs")
    for name, seed in (("one", 1), ("two", 2), ("again", 3)):
        simulate("irb-120", home / name, poses=40, seed=seed)
    shutil.copy(home / "one" / "robot.yaml", home / "robot.yaml")
    (home / "q.csv").write_text("j1 [deg],j2 [deg],j3 [deg],j4 [deg],j5 [deg],j6 [deg]\n10,20,30,0,5,6\n")
    for name in ("one", "two"):
        choices = {"leave_one_out": False}
        identify(str(home / "robot.yaml"), [str(home / name / "data.yaml")], choices, output=home / f"run-{name}")
    return home


def at(home, words, folder):
    """The words of a command with their files where they are."""
    given = {"RUN": folder, "RUN/calibrated.yaml": folder / "calibrated.yaml", "other": home / "run-one"}
    return [given.get(w) or (home / w if (home / w).exists() or w in ("page.html", "sim") else w) for w in words]


@pytest.mark.slow
def test_every_verb_reads_a_run_as_it_was_written(runs):
    for name, words in VERBS.items():
        assert robocal(*at(runs, words, runs / "run-two")).status in (0, 3), name


@pytest.mark.sampled(4)
@pytest.mark.parametrize("verb", VERBS)
def test_every_mixture_of_two_runs_is_refused(runs, tmp_path, verb):
    names = sorted(content(runs / "run-one").keys() - {"report.html"})
    assert RESULT in names and len(names) == 5
    for count in range(1, len(names)):
        for taken in itertools.combinations(names, count):
            folder = Path(shutil.copytree(runs / "run-one", tmp_path / "-".join(taken)))
            for name in taken:
                shutil.copy(runs / "run-two" / name, folder / name)
            ran = robocal(*at(runs, VERBS[verb], folder))
            ran.assert_refused("belongs to another run")
            said = [n for n in names if str(folder / n) in ran.err]
            mine = set(taken) if RESULT not in taken else set(names) - set(taken)
            assert len(said) == 1 and said[0] in mine, (taken, ran.err)


@pytest.mark.parametrize("verb", VERBS)
def test_a_missing_and_a_superfluous_file_are_named(runs, tmp_path, verb):
    for name in PARTS:
        folder = Path(shutil.copytree(runs / "run-one", tmp_path / name))
        if (folder / name).exists():
            (folder / name).unlink()
            if verb == "robot file" and name == "calibrated.yaml":
                continue  # that file is asked for by name, and is not there
            robocal(*at(runs, VERBS[verb], folder)).assert_refused(str(folder / name), "missing")
        else:
            (folder / name).write_text("{}")
            robocal(*at(runs, VERBS[verb], folder)).assert_refused(str(folder / name), "not belong to the run")


def test_a_folder_of_an_earlier_version_is_read_with_a_remark(runs, tmp_path):
    folder = earlier(Path(shutil.copytree(runs / "run-one", tmp_path / "run")))
    assert [r.code for r in open_run(folder).remarks] == [Code.RUN_UNRECORDED]
    for name in ("predict", "export", "compensate", "validate", "drift"):
        ran = robocal(*at(runs, VERBS[name], folder))
        assert ran.status in (0, 3) and "earlier version" in ran.out + ran.err, name


def test_a_knowledge_that_is_not_of_the_robot_beside_it(runs, tmp_path):
    """Where no hash tells, the values do."""
    folder = earlier(Path(shutil.copytree(runs / "run-one", tmp_path / "run")))
    shutil.copy(runs / "run-two" / "covariance.json", folder / "covariance.json")
    for name in ("predict", "drift", "compensate"):
        robocal(*at(runs, VERBS[name], folder)).assert_refused("covariance.json", "not belong to the calibrated robot")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c["noise"][1].__setitem__(0, c["noise"][1][0] + 1.0), "not symmetric"),
        (lambda c: c["noise"][2].__setitem__(2, -1.0), "a variance below 0"),
        (lambda c: c["covariance"][2].__setitem__(2, -1.0), "a variance below 0"),
        (lambda c: c["covariance"].pop(), "wrong number"),
        (lambda c: c["names"].__setitem__(1, c["names"][0]), "given twice"),
        (lambda c: c["values"].__setitem__(0, float("nan")), "values"),
        (lambda c: c["expected"].__setitem__(0, -1.0), "below 0"),
        (lambda c: c.__setitem__("dof", 0.0), "degrees of freedom"),
        (lambda c: c["response"][0].__setitem__(1, c["response"][0][1] + 5.0), "noise and response"),
    ],
)
def test_a_matrix_that_is_no_covariance_is_refused(runs, tmp_path, change, words):
    known = json.loads((runs / "run-one" / "covariance.json").read_text())
    change(known)
    (tmp_path / "covariance.json").write_text(json.dumps(known))
    with pytest.raises(FormatError, match=words):
        read_covariance(tmp_path / "covariance.json")


@pytest.mark.slow
def test_a_run_is_written_over_nothing_but_an_untouched_run(runs, tmp_path):
    words = ("identify", runs / "robot.yaml", runs / "two" / "data.yaml", "--no-leave-one-out")
    for name, spoil in (
        ("foreign", lambda f: (f / "notes.txt").write_text("mine")),
        ("changed", lambda f: (f / "calibrated.yaml").write_text("mine")),
        ("lost", lambda f: (f / "residuals.csv").unlink()),
        ("no run", lambda f: (f / "result.json").unlink()),
        ("earlier", earlier),
    ):
        folder = Path(shutil.copytree(runs / "run-one", tmp_path / name))
        spoil(folder)
        before = content(folder)
        robocal(*words, "-o", folder).assert_refused("--force", str(folder))
        assert content(folder) == before
        assert robocal(*words, "-o", folder, "--force").status == 0
        after = content(folder)
        assert after.keys() - content(runs / "run-two").keys() == before.keys() & {"notes.txt"}
        assert open_run(folder).recorded is not None and find_run(folder / "calibrated.yaml") is not None


def test_an_empty_folder_and_an_untouched_run_are_free(runs, tmp_path):
    assert obstacle(tmp_path) is None and obstacle(tmp_path / "new") is None and obstacle(runs / "run-one") is None
    folder = Path(shutil.copytree(runs / "run-one", tmp_path / "run"))
    (folder / "report.html").write_text("changed by hand")
    (folder / ".calibrated.yaml.999999999-0123abcd.robocal").write_text("left over")
    assert obstacle(folder) is None
    (folder / "sub").mkdir()
    assert isinstance(obstacle(folder), FileError)


# --- measurements that a run has seen ---


def joined(home, first, second, rows):
    """A new file with all rows of one data set and some of another."""
    a, b = ((home / n / "data.csv").read_text().splitlines() for n in (first, second))
    folder = home / f"{first}-{second}-{rows}"
    folder.mkdir(exist_ok=True)
    # Ids are names of rows, not part of what was measured.
    measured = [line.partition(",")[2] for line in (*a[2:], *b[2 : 2 + rows])]
    lines = [a[1], *(f"n{i},{line}" for i, line in enumerate(measured))]
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    (folder / "data.yaml").write_text((home / first / "data.yaml").read_text())
    return str(folder / "data.yaml")


def test_validate_knows_single_rows_again_in_another_file(runs):
    run = str(runs / "run-one")
    alone = validate(run, [str(runs / "again" / "data.yaml")])
    mixed = validate(run, [joined(runs, "again", "one", 20)])
    assert Code.SEEN_LEFT_OUT in [w.code for w in mixed.warnings] and mixed.trusted
    told = next(w for w in mixed.warnings if w.code is Code.SEEN_LEFT_OUT).numbers
    assert (told["count"], told["total"], told["left"]) == (20, 60, 40)
    assert mixed.errors == alone.errors
    few = validate(run, [joined(runs, "one", "again", 4)])
    assert not few.trusted and [r.code for r in few.reasons][:1] == [Code.FEW_UNSEEN_HERE]
    assert validate(run, [joined(runs, "one", "again", 12)]).trusted
    whole = validate(run, [str(runs / "one" / "data.yaml")])
    assert not whole.trusted and [r.code for r in whole.reasons][:1] == [Code.FITTED_TO_THESE]
    other = validate(str(runs / "run-two"), [str(runs / "one" / "data.yaml")])
    assert other.trusted and Code.SEEN_LEFT_OUT not in [w.code for w in other.warnings]

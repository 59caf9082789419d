"""Verbs as functions: the same numbers as on the command line, options told once, and a repr that fits a screen."""

from __future__ import annotations

import inspect
import io
import json
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal, small
from cli.worlds import CABLE as CABLE_ROBOT
from cli.worlds import PLACES, POSES, TARGETS
from files.test_cable import caspr
from printed import draw_images
from report.markup import Page
from rich.console import Console

import robocal as rc
from robocal.cli.draw import drawn
from robocal.errors import Cancelled, InputError, MissingExtra, ModelError
from robocal.files.cable.write import describe_cable
from robocal.front.verb_result import Found
from robocal.report.html import html
from robocal.report.page import page
from robocal.verbs.option import entries
from robocal.verbs.registry import GROUPS, VERBS

# What Python and the command line are called with, in one place: the verb, its words, and the same as Python says them.
PAIRS = {
    "check": ("check robot.yaml data.yaml", lambda: rc.check("robot.yaml", "data.yaml")),
    "identify": (
        "identify robot.yaml data.yaml --loss huber",
        lambda: rc.identify("robot.yaml", ["data.yaml"], loss="huber"),
    ),
    "validate": (
        "validate run data.yaml --against robot.yaml --seed 3",
        lambda: rc.validate("run", "data.yaml", against="robot.yaml", seed=3),
    ),
    "predict": ("predict run poses.csv --absolute", lambda: rc.predict(Path("run"), "poses.csv", absolute=True)),
    "drift": ("drift run run --matters 0.2mm", lambda: rc.drift("run", "run", matters="0.2mm")),
    "compensate": ("compensate run targets.csv --tool own", lambda: rc.compensate("run", "targets.csv", tool="own")),
    "export": ("export run --format csv", lambda: rc.export("run", form="csv")),
    "plan": ("plan robot.yaml -n 8 --draw 60", lambda: rc.plan("robot.yaml", poses=8, draw=60)),
    "verify": ("verify places.csv others.csv", lambda: rc.verify("places.csv", "others.csv")),
    "new": ("new --list", lambda: rc.new(listing=True)),
    "import": ("import flat_cables.xml --cables used", lambda: rc.import_model("flat_cables.xml", cables="used")),
    "inverse": ("cable inverse cable.yaml places.csv", lambda: rc.cable.inverse("cable.yaml", "places.csv")),
    "forward": (
        "cable forward cable.yaml lengths.csv --sigma 0.5",
        lambda: rc.cable.forward("cable.yaml", "lengths.csv", sigma=0.5),
    ),
    "tension": (
        "cable tension cable.yaml places.csv --payload 1",
        lambda: rc.cable.tension("cable.yaml", "places.csv", payload=1.0),
    ),
    "workspace": (
        "cable workspace cable.yaml --cells 7 --rays 100",
        lambda: rc.cable.workspace("cable.yaml", cells=7, rays=100),
    ),
    "poses": ("cable poses free.yaml -n 5", lambda: rc.cable.poses("free.yaml", poses=5)),
    "cable.drift": (
        "cable drift cable.yaml cable.yaml --base-moves",
        lambda: rc.cable.drift(["cable.yaml", "cable.yaml"], base_moves=True),
    ),
    "require": (
        "cable require cable.yaml list.csv --sigma 2mm --accuracy 4mm",
        lambda: rc.cable.require("cable.yaml", "list.csv", sigma="2mm", accuracy="4mm"),
    ),
    "camera.detect": (
        "vision detect images --dictionary 6x6_250 --size 48",
        lambda: rc.camera.detect(Path("images"), dictionary="6x6_250", size=48.0),
    ),
    "camera.sheet": (
        "vision sheet --ids 3,4 --columns 2 --rows 1 --force",
        lambda: rc.camera.sheet(ids=(3, 4), columns=2, rows=1, force=True),
    ),
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from cables.cable_robots import box
    from cli.test_cable_poses import robot as free
    from cli.test_cable_require import listed

    folder = tmp_path_factory.mktemp("calls")
    small(folder)
    texts = {
        "poses.csv": POSES,
        "targets.csv": TARGETS,
        "cable.yaml": CABLE_ROBOT,
        "places.csv": PLACES,
        "others.csv": PLACES.replace("low,100", "low,101"),
    }
    for name, text in (texts | {"free.yaml": describe_cable(free())}).items():
        (folder / name).write_text(text, encoding="utf-8")
    assert robocal("identify", folder / "robot.yaml", folder / "data.yaml", "-o", folder / "run").status == 0
    with suppress(MissingExtra):
        draw_images(folder / "images")
    caspr(folder)
    listed(folder / "list.csv", 12, robot=box())
    (folder / "lengths.csv").write_text(robocal("cable", "inverse", folder / "cable.yaml", folder / "places.csv").out)
    return folder


def same(a: object, b: object, where: str = "") -> None:
    """Two documents, but for what says when and by whom they were made."""
    if isinstance(a, dict) and isinstance(b, dict):
        assert a.keys() == b.keys(), where
        for key in a.keys() - {"provenance", "seconds", "command"}:
            same(a[key], b[key], f"{where}.{key}")
    elif isinstance(a, list) and isinstance(b, list):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            same(x, y, f"{where}[{i}]")
    elif isinstance(a, float) and isinstance(b, int | float):
        assert a == pytest.approx(b, rel=1e-12, abs=1e-12), where
    else:
        assert a == b, where


@pytest.mark.parametrize("name", PAIRS)
def test_python_and_the_command_line_say_the_same(place: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    from robocal.files.plain import plain

    monkeypatch.chdir(place)
    words, call = PAIRS[name]
    if name.startswith("camera"):
        pytest.importorskip("cv2")
    ran, found = robocal(*words.split(), "--json"), call()
    assert ran.status == (0 if found.trusted else 3), ran.err
    same(json.loads(ran.out), json.loads(json.dumps(plain(found.document))))
    # A few lines, whatever it is; the summary says what the terminal says, a notebook shows what it says with --verbose.
    assert 0 < len(repr(found).splitlines()) <= 20, repr(found)
    html, said = found.report(place / "page.html").read_text(encoding="utf-8"), found.summary()
    for verbose in (False, True):
        for section in filter(None, (s.short(verbose) for s in found.sections)):
            assert verbose or section.heading in said
            for row in (row for block in section.blocks for row in getattr(block, "rows", ())):
                first = row[0] if isinstance(row[0], str) else getattr(row[0], "word", None) or row[0][0]
                shown = first.replace("&", "&amp;").replace("<", "&lt;") if verbose else first.strip()
                assert shown in (html if verbose else said), first
    everywhere(found)


def everywhere(found: Found) -> None:
    """What a verb says fits terminals of three widths, and is a whole page, in a notebook too."""
    for width in (60, 80, 120):
        stream = io.StringIO()
        console = Console(file=stream, width=width, highlight=False, markup=False, emoji=False)
        for part in drawn(found.sections):
            console.print(part)
        shown = stream.getvalue()
        assert max(map(len, shown.splitlines()), default=0) <= width
        assert bool(shown.strip()) == any(s.short(verbose=False) is not None for s in found.sections)
    whole = page("Everything", found.sections, kind="Test")
    # Under `default-src 'self'` no browser takes a style or a script that stands in the sections.
    inside = html(found.sections)
    assert not re.search(r"<style|\sstyle=|\son\w+=", inside)
    assert all('type="application/json"' in tag for tag in re.findall(r"<script[^>]*>", inside))
    for text in (whole, found._repr_html_()):
        read = Page(text)
        assert len(set(read.ids)) == len(read.ids), sorted(read.ids)
        assert not re.search(r"\b(None|nan|inf)\b", read.text), read.text


@pytest.mark.parametrize(
    "name", [*rc.CALLS, *(f"{word}.{name}" for word, group in GROUPS.items() for name in group.verbs)]
)
def test_every_option_is_named_with_its_default(name: str) -> None:
    from importlib import import_module

    word, _, verb = name.rpartition(".")
    call = getattr(getattr(rc, GROUPS[word].python), verb) if word else getattr(rc, name)
    told = entries(import_module(f"robocal.verbs.{name}").Options)
    signature = inspect.signature(call)
    assert list(signature.parameters) == [*(e.python for e in told), "watch"]
    for entry in told:
        # One name on both sides; Python keeps a few words for itself.
        assert (
            entry.python == entry.word.lstrip("-").replace("-", "_")
            or not entry.word.startswith("--")
            or (entry.word in ("--format", "--list", "--range", "--set"))
        ), entry.word
        default = signature.parameters[entry.python].default
        assert default is inspect.Parameter.empty if entry.required else default == entry.default
        assert f"{entry.python}: " in call.__doc__
    assert "Raises InputError" in call.__doc__ and "\b" not in call.__doc__


def test_the_stubs_are_as_the_verbs_say() -> None:
    root = Path(__file__).parents[2]
    ran = subprocess.run(
        [sys.executable, root / "scripts" / "front_stub.py"], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stdout


def test_the_front_door_is_small_and_documented() -> None:
    assert len(rc.__all__) < 40 and set(rc.CALLS) == set(VERBS) - {"demo", "report"}
    for name in rc.__all__:
        thing = getattr(rc, name)
        assert name == "__version__" or inspect.getdoc(thing), name
    assert set(dir(rc)) == set(rc.__all__)
    with pytest.raises(AttributeError):
        rc.nothing  # noqa: B018
    with pytest.raises(AttributeError, match="workspace"):
        rc.cable.nothing  # noqa: B018
    with pytest.raises(AttributeError, match="detect"):
        rc.camera.nothing  # noqa: B018
    assert {group.python: word for word, group in GROUPS.items()} == rc.GROUPS
    assert dir(rc.camera) == sorted(GROUPS["vision"].verbs)


@pytest.mark.parametrize("call", [rc.check, rc.study, rc.predict], ids=["check", "study", "predict"])
def test_what_a_verb_needs_is_not_none(call):
    with pytest.raises(InputError, match="not what this takes"):
        call(
            *[None]
            * sum(
                p.default is p.empty and p.kind == p.POSITIONAL_OR_KEYWORD
                for p in inspect.signature(call).parameters.values()
            )
        )


def test_tables_and_runs_are_given_as_they_are(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    found = rc.identify("robot.yaml", "data.yaml")
    with pytest.raises(InputError, match="output=FOLDER"):
        rc.predict(found, "poses.csv")
    kept = rc.identify("robot.yaml", "data.yaml", output="kept")
    q = rc.table({"j1 [deg]": [10.0, 20.0], "j2 [deg]": [0.0, 5.0], "j3 [deg]": [3.0, 4.0]})
    rows = list(rc.predict(kept, q).result.poses.rows)
    assert len(rows) == 2 and np.allclose(
        [rows[0][k] for k in "xyz"], kept.pose(np.radians([[10.0, 0.0, 3.0]]))[0, :3, 3] * 1e3, atol=1e-9
    )
    assert rc.compensate(kept, q).result.compensation.reachable.any()
    page = kept.report("page.html").read_text()
    assert page == Path("kept/report.html").read_text()


def test_a_data_frame_is_a_table() -> None:
    class Frame:
        """What any data frame offers: the names of its columns by the interchange protocol, columns by name."""

        def __init__(self, **columns: object) -> None:
            self.columns = columns

        def __dataframe__(self) -> Frame:
            return self

        def column_names(self) -> list[str]:
            return list(self.columns)

        def __getitem__(self, name: str) -> object:
            return self.columns[name]

    assert rc.table(Frame(**{"x [mm]": [1.0, 2.0]})).text == rc.table({"x [mm]": np.array([1.0, 2.0])}).text
    with pytest.raises(InputError, match="different lengths"):
        rc.table({"x [mm]": [1.0], "y [mm]": [1.0, 2.0]})


def test_unknown_options_ranges_and_cancelling(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    with pytest.raises(ModelError, match="loss"):
        rc.identify("robot.yaml", "data.yaml", los="huber")
    with pytest.raises(ModelError, match="20 to 200000"):
        rc.cable.workspace("cable.yaml", rays=3)
    with pytest.raises(TypeError):
        rc.identify("robot.yaml")

    def enough(event: dict[str, object]) -> None:
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        rc.identify("robot.yaml", "data.yaml", watch=enough, output="cancelled")
    assert not Path("cancelled").exists()


def test_a_cable_robot_from_arrays(place: Path) -> None:
    arm = rc.cable.robot(place / "cable.yaml")
    assert "cables" in repr(arm)
    home = arm.model.robot.home
    poses = np.repeat(home[None], 3, axis=0)
    poses[:, 0, 3] += [0.0, 0.01, -0.02]
    lengths = arm.inverse(poses)
    assert lengths.shape == (3, len(arm.cables))
    found = arm.forward(lengths, sigma=1e-3)
    assert np.allclose(found.pose, poses, atol=1e-8) and found.converged.all()
    held = arm.tension(poses, wrench=(0, 0, -1.0, 0, 0, 0))
    assert held.tension.shape == lengths.shape and held.feasible.any()
    for wrong in (np.zeros((3, 3)), np.full((4, 4), np.nan), "poses"):
        with pytest.raises(InputError, match="poses"):
            arm.inverse(wrong)


def test_what_would_be_a_quiet_wrong_answer_is_refused(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    q, p = [[0.0] * 3] * 2, np.ma.array([[1.0, 2, 3], [9999] * 3], mask=[[0] * 3, [1] * 3])
    for call, said in (
        (lambda: rc.measurements(q, position=p), "masked"),
        (lambda: rc.table({"x [mm]": p[:, 0]}), "masked"),
        (lambda: rc.measurements(q, position=np.zeros((2, 3)), columns={"x [m]": [7.0, 7.0]}), "already"),
        (lambda: rc.measurements(q, position=np.zeros((2, 3)) + 1j), "no numbers"),
        (lambda: rc.measurements(q, position=np.zeros((2, 3)), units=("mm", "rad")), "not a unit of positions"),
        (lambda: rc.measurements(q, position=np.zeros((2, 3)), units=("degC", "mm")), "not a unit of joints"),
        (lambda: rc.identify("robot.yaml", "data.yaml", iterations=None), "needs a value"),
        (lambda: rc.predict("run", np.zeros((2, 3))), "argument poses: .*rc.table"),
        (lambda: rc.check("robot.yaml", {"q1 [rad]": [1.0]}), "argument data: .*rc.measurements"),
        (lambda: rc.cable.robot("cable.yaml").forward([[1.0]], sigma=-1), "standard deviation"),
    ):
        with pytest.raises(InputError, match=said):
            call()


def test_what_goes_beside_a_list_is_said(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On the terminal it goes to stderr; here there is no such place."""
    monkeypatch.chdir(place)
    far = rc.table(
        {"x [m]": [90.0], "y [m]": [0.0], "z [m]": [90.0], "rx [deg]": [0.0], "ry [deg]": [0.0], "rz [deg]": [0.0]}
    )
    arm = rc.cable.robot("cable.yaml")
    found = rc.cable.tension(arm, far)
    assert not found.trusted and found.remarks
    for said in (found.summary(), found._repr_html_()):
        assert all(h in said for h in found.text.splitlines()[0].split(",")) and all(
            r.sentence[:30] in said for r in found.remarks
        )
    json.dumps(found.document)


def test_a_result_shown_twice_has_two_sets_of_identifiers(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    found = rc.identify("robot.yaml", ["data.yaml"])
    read = Page(f"<div>{found._repr_html_()}{found._repr_html_()}</div>")
    assert len(set(read.ids)) == len(read.ids)
    named = {n for _, a in read.tags for n in (a.get("aria-labelledby") or "").split()}
    assert named <= set(read.ids)

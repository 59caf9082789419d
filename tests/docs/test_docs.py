"""The documentation is true: links resolve, Python runs, commands exist, pictures are there."""

from __future__ import annotations

import ast
import json
import math
import re
import shlex
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
PAGES = sorted(
    [
        *PROJECT.glob("*.md"),
        *PROJECT.glob("docs/*.md"),
        *PROJECT.glob("docs/kinds/*.md"),
        *PROJECT.glob("docs/cables/*.md"),
        *PROJECT.glob("examples/**/*.md"),
    ]
)
NAMES = [str(p.relative_to(PROJECT)) for p in PAGES]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def text(page):
    return (PROJECT / page).read_text(encoding="utf-8")


def blocks(page, *languages):
    return [body for language, body in FENCE.findall(text(page)) if language in languages]


def anchors(path):
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", path.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


@pytest.mark.parametrize("page", NAMES)
def test_links_resolve(page):
    for target in LINK.findall(FENCE.sub("", text(page))):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        place = (PROJECT / page).parent / name if name else PROJECT / page
        assert place.exists(), f"{page}: {target}"
        assert not anchor or anchor in anchors(place), f"{page}: {target}"


PYTHON = [(page, i) for page in NAMES if page != "CONTRIBUTING.md" for i in range(len(blocks(page, "python")))]


@pytest.mark.parametrize(("page", "number"), PYTHON)
def test_python_runs(page, number, monkeypatch, capsys):
    monkeypatch.chdir(PROJECT)
    exec(compile(blocks(page, "python")[number], f"{page}[{number}]", "exec"), {"__name__": "docs"})


def commands(page):
    """Every robocal command of a page: in shell blocks, and in running text between backticks."""
    lines = [line for body in blocks(page, "sh", "console", "bash") for line in body.splitlines()]
    lines += re.findall(r"`(robocal [^`]+)`", FENCE.sub("", text(page)))
    stripped = (line.removeprefix("$ ").partition(" #")[0].strip() for line in lines)
    return [line for line in stripped if line.startswith("robocal ")]


def verbs():
    from robocal.cli.app import build

    return build()


@pytest.mark.parametrize("page", [p for p in NAMES if commands(p)])
def test_commands_exist(page):
    group = verbs()
    for command in commands(page):
        words = [w for w in shlex.split(command)[1:] if w != "..."]
        assert words[0] in group.commands, f"{page}: {command}"
        verb = group.commands[words[0]]
        if hasattr(verb, "commands"):
            assert words[1] in verb.commands, f"{page}: {command}"
            verb = verb.commands[words[1]]
        known = {o for p in verb.params for o in (*p.opts, *p.secondary_opts)} | {"-h", "--help"}
        for word in words[1:]:
            if word.startswith("-"):
                assert word.partition("=")[0] in known, f"{page}: {command}: {word}"


def test_complete_commands_parse():
    """Those of the quickstart, arguments and all."""
    group = verbs()
    for body in blocks("docs/quickstart.md", "sh"):
        for line in body.splitlines():
            verb, *rest = shlex.split(line)[1:]
            group.commands[verb].make_context(verb, rest)


@pytest.mark.parametrize("page", NAMES)
def test_make_targets_exist(page):
    makefile = text("Makefile")
    for body in blocks(page, "sh", "console", "bash"):
        for target in re.findall(r"^\$? ?make (\w+)", body, re.MULTILINE):
            assert re.search(rf"^{target}:", makefile, re.MULTILINE), f"{page}: make {target}"


def test_every_page_is_linked():
    """Nothing in docs/ that no reader can find."""
    linked = {
        ((PROJECT / page).parent / target.partition("#")[0]).resolve()
        for page in NAMES
        for target in LINK.findall(text(page))
        if not re.match(r"[a-z]+:", target)
    }
    for page in PROJECT.glob("docs/*.md"):
        assert page.resolve() in linked, page.name


def test_robot_and_data_files_in_the_format_page_are_valid(tmp_path):
    from robocal.files.dataset import read_dataset
    from robocal.files.lens import read_lens
    from robocal.files.map import read_map
    from robocal.files.pose_table import read_region
    from robocal.files.robot import read_robot
    from robocal.files.sheet import read_sheet

    robot, data, lens, marker_map, region, sheet = blocks("docs/files.md", "yaml")
    (tmp_path / "robot.yaml").write_text(robot)
    head = "pose;T;q1;q2;q3;q4;q5;x;y;z\n"
    (tmp_path / "tracker.csv").write_text(head + "a;20,5;10;20;;;;1,5;2;3\n".replace(";;;;", ";30;40;50;"))
    chain = read_robot(tmp_path / "robot.yaml").chain
    assert chain.joint_names[:2] == ("j1", "j2")
    assert "j2.beta" not in chain.table.free
    # The data file speaks of five joints, the robot file shows two: name as many as there are.
    (tmp_path / "data.yaml").write_text(data.replace("[q1, q2, q3, q4, q5]", "[q1, q2]"))
    made = read_dataset(tmp_path / "data.yaml", chain).dataset
    assert made.observations[0].frame.name == "tracker"
    (tmp_path / "lens.yaml").write_text(lens)
    assert read_lens(tmp_path / "lens.yaml").lens.known == ("fx", "fy", "k1")
    (tmp_path / "map.yaml").write_text(marker_map)
    assert read_map(tmp_path / "map.yaml").map.size == pytest.approx([0.12])
    (tmp_path / "region.yaml").write_text(region)
    ranges = read_region(tmp_path / "region.yaml", chain).ranges
    assert ranges is not None and ranges[0] == pytest.approx([-math.pi / 2, math.pi / 2])
    pytest.importorskip("cv2")
    (tmp_path / "sheet.yaml").write_text(sheet)
    printed = read_sheet(tmp_path / "sheet.yaml")
    assert printed.markers[0].size == pytest.approx(0.04) and printed.checkers[0].rows == 9


@pytest.mark.parametrize(("call", "name"), [("draw", "before-after"), ("robot", "cable-robot")])
def test_picture_is_what_the_script_draws(call, name, capsys, monkeypatch):
    """Titles and numbers; the last digit of a coordinate may differ between machines."""
    place = PROJECT / "docs" / "img"
    namespace = {"__name__": "make", "__file__": str(place / "make.py")}
    exec(compile((place / "make.py").read_text(), "make.py", "exec"), namespace)
    words = re.compile(r">([^<>]+)<")
    assert words.findall(namespace[call]()) == words.findall((place / f"{name}.svg").read_text())


# --- the ways to measure --------------------------------------------------------------------------------------------------


def kinds():
    from robocal.files.kinds.registry import READERS

    return tuple(READERS)


@pytest.mark.parametrize("kind", kinds())
def test_every_kind_has_a_page(kind):
    """Its rig, its numbers, its data file and its command, which are those of the example that the examples' tests run."""
    page = f"docs/kinds/{kind}.md"
    folder = PROJECT / "examples" / "instruments" / kind
    (data,) = blocks(page, "yaml")
    assert (folder / "data.yaml").read_text(encoding="utf-8").endswith(data) and f"kind: {kind}\n" in data
    (command,) = [c for c in commands(page) if "examples/" in c]
    assert commands(f"examples/instruments/{kind}/README.md") == [command]
    said = text(page)
    assert f"]({kind}.svg)" in said and (PROJECT / f"docs/kinds/{kind}.svg").is_file()
    for heading in (
        "## When to use it",
        "## What is observable, and what not",
        "## The data file",
        "## Noise",
        "## Traps",
    ):
        assert heading in said
    assert (
        re.search(r"80 poses: \d+ of \d+ free parameters are observable", said)
        and "| poses | 10 | 20 | 40 | 80 |" in said
    )
    assert f"({kind}.md)" in text("docs/kinds/README.md") and f"| `{kind}` |" in text("docs/files.md")


def test_the_rigs_are_what_the_script_draws():
    namespace = {"__name__": "drawings"}
    source = (PROJECT / "docs" / "kinds" / "drawings.py").read_text(encoding="utf-8")
    exec(compile(source, "drawings.py", "exec"), namespace)
    drawn = namespace["drawings"]()
    assert set(drawn) == set(kinds())
    for kind, svg in drawn.items():
        assert svg == (PROJECT / "docs" / "kinds" / f"{kind}.svg").read_text(encoding="utf-8"), kind


def test_the_measured_block_is_what_the_script_measures():
    """One cell anew: the rest takes minutes (docs/kinds/make.py numbers)."""
    import numpy as np

    namespace = {"__name__": "make", "__file__": str(PROJECT / "docs" / "kinds" / "make.py")}
    source = (PROJECT / "docs" / "kinds" / "make.py").read_text(encoding="utf-8")
    exec(compile(source, "make.py", "exec"), namespace)
    errors = []
    for seed in namespace["SEEDS"]:
        _, truth, found = namespace["trial"]("pose", "irb-120", 20, seed)
        errors.append(namespace["tool_error"](found.corrected, truth))
    row = next(line for line in text("docs/kinds/pose.md").splitlines() if line.startswith("| six axes"))
    assert float(row.split("|")[3]) == pytest.approx(float(np.median(errors)), rel=0.06)


@pytest.mark.parametrize("name", ["robocal-in-python.ipynb"])
def test_a_notebook_runs_and_its_cells_show_pages(name, monkeypatch):
    """As a kernel would run it: cell by cell in one namespace, the last expression shown."""
    monkeypatch.chdir(PROJECT)
    book = json.loads((PROJECT / "docs" / name).read_text(encoding="utf-8"))
    space: dict[str, object] = {"__name__": "docs"}
    shown = []
    for cell in book["cells"]:
        if cell["cell_type"] != "code":
            continue
        assert not cell["outputs"] and cell["execution_count"] is None, "outputs are made where it is read"
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, name, "exec"), space)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), name, "eval"), space)
            shown.append(value._repr_html_() if hasattr(value, "_repr_html_") else repr(value))
    assert any("<table" in page and "Improved</h2>" in page for page in shown)

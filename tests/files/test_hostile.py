"""Files that were made to harm: huge, endless, with characters that a terminal obeys, with formulas, with names of other files."""

from __future__ import annotations

import csv
import gc
import io
import json
import time

import pytest
from cli.runs import ROBOT, robocal, small
from files.kind_samples import ARM, texts
from files.test_cable import caspr
from files.test_urdf import TEXT as URDF
from files.test_urdf import read as read_urdf_text

from robocal import errors
from robocal.errors import MESSAGE_LIMIT, FileError, FormatError, InputError, ModelError, ToWrite, nearest
from robocal.files import csvtable, yamlio
from robocal.files.cable.cable_robot import read_cable
from robocal.files.csvtable import read_csv
from robocal.files.csvtext import csv_text
from robocal.files.dataset import read_dataset
from robocal.files.result import read_result
from robocal.files.robot import parse_robot, read_robot
from robocal.files.text import Source, harmless, meant
from robocal.files.yamlio import parse
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

ESCAPES = ("\x1b[31m", "\x07", "\x9b5m", "\x7f", "\u202e", "\u2028", "\x85", "\x0b", "\x08")
BREAKS = ("\n", "\r", "\t")


# --- what takes long --------------------------------------------------------------------------------------------------


def test_looking_for_a_slip_is_bounded(monkeypatch):
    """A word of 20 kB is nobody's slip, and among very many words only so many letters are compared."""
    cells, plain = [], errors._distance

    def counted(a, b):
        cells.append((len(a) + 1) * (len(b) + 1))
        return plain(a, b)

    monkeypatch.setattr(errors, "_distance", counted)
    assert nearest("x" * 20_000, ["y" * 20_000, "z"]) is None and not cells
    assert nearest("alhpa", ["y" * 20_000, "alpha"]) == "alpha" and len(cells) == 1
    cells.clear()
    known = [f"name_{i}" for i in range(100_000)]
    nearest("name_x1", known)
    assert sum(cells) <= errors.WORK_LIMIT
    assert nearest("name", ["nmae", *known]) == "nmae"


def yaml_keys(folder, n):
    return lambda: parse(Source(folder / "a.yaml", "".join(f"key{i}: {i}\n" for i in range(n)), ""))


def yaml_text(folder, n):
    return lambda: parse(Source(folder / "a.yaml", "a:\n" + "  word\n" * 20 * n, ""))


def csv_rows(folder, n):
    place = folder / f"rows{n}.csv"
    place.write_text("a [mm],b\n" + "1.25,2.5\n" * 30 * n)

    def act():
        table = read_csv(place)
        table.numbers(["a", "b"])
        table.digits(["a", "b"])
        table.texts("a")

    return act


def csv_columns(folder, n):
    place = folder / f"columns{n}.csv"
    place.write_text(",".join(f"c{i}" for i in range(20 * n)) + "\n" + ",".join(["1.5"] * 20 * n) + "\n")
    return lambda: read_csv(place)


def csv_header(what):
    def made(folder, n):
        place = folder / f"header{n}.csv"
        place.write_text("a" + what * 15 * n + ",b\n1,2\n")
        return lambda: read_csv(place)

    return made


def caspr_text(folder, n):
    place = folder / str(n)
    place.mkdir()
    made = caspr(place, change=("<force_max>100", "<force_max>" + "1\n" * 40 * n))

    def act():
        with pytest.raises(FormatError, match="not numbers"):
            read_cable(made)

    return act


def urdf_attributes(folder, n):
    text = URDF.replace('name="f1"', 'name="f1" ' + " ".join(f'a{i}="1"' for i in range(10 * n)))
    return lambda: read_urdf_text(text)


def urdf_links(folder, n):
    text = URDF.replace("<gazebo>", "".join(f'<link name="x{i}"/><joint name="y{i}" type="fixed"><parent link="c"/>'
                                            f'<child link="x{i}"/></joint>' for i in range(3 * n)) + "<gazebo>")  # fmt: skip
    return lambda: read_urdf_text(text)


GROWING = {
    "keys": yaml_keys, "yaml text": yaml_text, "rows": csv_rows, "columns": csv_columns, "brackets": csv_header("["),
    "spaces": csv_header(" "), "quotes": csv_header("]["), "CASPR text": caspr_text, "attributes": urdf_attributes, "links": urdf_links,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("what", GROWING)
def test_time_grows_as_the_file_does(tmp_path, what):
    """Four times the file takes four times as long, not sixteen times."""
    few, many = (GROWING[what](tmp_path, n) for n in (500, 2000))

    def seconds(act):
        began = time.process_time()
        act()
        return time.process_time() - began

    seconds(few)
    ratios = []
    gc.disable()  # a collection among what thousands of tests left alive falls to the larger file alone, and is not its own
    try:
        for _ in range(4):  # a busy machine may spoil one
            ratios.append(seconds(many) / max(seconds(few), 1e-4))
            if ratios[-1] < 8:
                return
    finally:
        gc.enable()
    raise AssertionError(ratios)


@pytest.mark.parametrize(
    ("name", "text", "limit"),
    [
        ("a.yaml", "robocal: 1\n" + "".join(f"k{i}: {i}\n" for i in range(3_000)), 4_000),
        ("a.yaml", "a: [" + "1," * 10_000 + "1]", 4_000),
        ("a.yaml", "a: " + "word " * 300_000, "at most 1 MB"),
        ("a.csv", "a,b\n" + "1.5,2.5\n" * 3_000_000, "at most 20 MB"),
        ("a.csv", "a\n" + "1\n" * (csvtable.ROW_LIMIT + 1), csvtable.ROW_LIMIT),
        ("a.csv", ",".join("abcdefgh") + "\n" + "1,1,1,1,1,1,1,1\n" * 400_000, csvtable.CELL_LIMIT),
    ],
)
def test_what_is_too_big_is_refused_with_the_limit(tmp_path, monkeypatch, name, text, limit):
    monkeypatch.setattr(yamlio, "NODE_LIMIT", 4_000)  # the true one takes three seconds
    place = tmp_path / name
    place.write_text(text)
    with pytest.raises((FileError, FormatError)) as info:
        (read_csv if name.endswith("csv") else yamlio.load)(place)
    assert str(limit) in str(info.value) and name in str(info.value)


@pytest.mark.parametrize("name", ["a.yaml", "a.urdf"])
def test_arms_of_endless_joints(tmp_path, name):
    n = 300
    links = "".join(f'<link name="x{i}"/>\n' for i in range(n + 1))
    joint = '<joint name="y{0}" type="revolute"><parent link="x{0}"/><child link="x{1}"/><limit lower="-1" upper="1"/></joint>\n'
    yaml = "robocal: 1\nname: a\nunits: {length: m, angle: deg}\nconvention: dh\njoints:\n" + "- {a: 1}\n" * n
    urdf = f'<robot name="a">{links}{"".join(joint.format(i, i + 1) for i in range(n))}</robot>'
    (tmp_path / name).write_text(yaml if name == "a.yaml" else urdf)
    with pytest.raises(FormatError, match=r"not so many joints; found 300; expected at most 200"):
        read_robot(tmp_path / name)
    (tmp_path / name).write_text("<!-- x -->\n" * 900_000)
    with pytest.raises(FileError, match="at most 8 MB"):
        read_robot(tmp_path / name)


# --- what is said -----------------------------------------------------------------------------------------------------


def test_messages_can_be_read_whatever_they_speak_of():
    """Less than 400 characters on one line, file name and end of every part included, none that a terminal obeys."""
    long = {
        "file": "/very" * 80 + "/data.csv", "column": "c" * 900, "key": "k" * 900, "found": ["x" * 900] * 9_000,
        "expected": ", ".join(f"name{i}" for i in range(9_000)), "suggestion": "s" * 900,
    }  # fmt: skip
    for kept in ({}, *({k: v} for k, v in long.items()), long):
        for message in ("wrong", "m" * 5_000, "\x1b[31mred\n\u202e"):
            said = str(FormatError(message, **kept))
            assert len(said) < MESSAGE_LIMIT and said.isprintable(), said
            assert "file" not in kept or "data.csv" in said
    line = ToWrite("{" + "key: value, " * 60 + "}")
    assert str(line) in str(FormatError("wrong" * 200, file="a.csv", expected=line)), "what is to be copied is whole"
    short = FormatError("wrong", file="a.csv", row=3, column="x", key="k", found="1", expected="2", suggestion="y")
    assert str(short) == "a.csv, row 3, column x, key k: wrong; found '1'; expected 2; did you mean 'y'?"


def test_sentences_name_a_dozen_and_count_the_rest():
    names = tuple(f"j{i}.alpha" + "x" * 300 for i in range(3_000))
    said = Remark.of(Code.RUN_HOLDS_MORE, file="f" * 900, names=names, folder="g")
    assert len(said.sentence) < 1_500 and "(3000 in all)" in said.sentence and said.numbers["names"] == names


@pytest.mark.parametrize("what", [*ESCAPES, *BREAKS])
def test_names_are_one_line_of_plain_text(tmp_path, what):
    """Raw where a format lets it through, and as each format spells it: refused where it comes in, and spelt out in the message."""
    spelt = json.dumps(what)
    xml = "".join(f"&#{ord(c)};" for c in what)
    table = texts("position")
    cases = {
        "robot.yaml": ROBOT.replace("name: three axes", f"name: {spelt}"),
        "joint.yaml": ROBOT.replace("name: j2", f"name: {spelt}"),
        "key.yaml": ROBOT.replace("source:", f"{spelt}:"),
        "arm.urdf": URDF.replace('name="j1"', f'name="{xml}"'),
        "robot.urdf": URDF.replace('name="two"', f'name="{xml}"'),
        "link.urdf": URDF.replace('"f1"', f'"{xml}"'),
        "data.yaml": table[0].replace("frame: {name: ", f"frame: {{name: {spelt[:-1]}", 1).replace("tracker,", 'tracker",', 1),
        "target.yaml": table[0] + f"targets: {{{spelt}: {{}}}}\n",
    }  # fmt: skip
    for name, text in cases.items():
        (tmp_path / "table.csv").write_text(table[1], encoding="utf-8")
        (tmp_path / name).write_text(text, encoding="utf-8", newline="")
        with pytest.raises(InputError) as info:
            read_dataset(tmp_path / name, ARM) if name in ("data.yaml", "target.yaml") else read_robot(tmp_path / name)
        assert str(info.value).isprintable(), name
    if what not in BREAKS:
        for text in (
            table[1].replace("p1", f"p{what}1", 1),
            table[1].replace("configuration", f"configu{what}ration", 1),
        ):
            (tmp_path / "table.csv").write_text(text, encoding="utf-8", newline="")
            (tmp_path / "data.yaml").write_text(table[0], encoding="utf-8")
            with pytest.raises(InputError) as info:
                read_dataset(tmp_path / "data.yaml", ARM)
            assert str(info.value).isprintable()


def test_a_source_may_have_several_lines():
    text = ROBOT.replace("source: invented for tests", "source: |\n  one\n  two")
    assert parse_robot(Source("robot.yaml", text, "")).chain.source == "one\ntwo\n"
    with pytest.raises(FormatError, match=r"source: a control character.*x1b"):
        parse_robot(Source("robot.yaml", ROBOT.replace("source: invented for tests", 'source: "\\e[31m"'), ""))


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    small(folder)
    assert robocal("identify", folder / "robot.yaml", folder / "data.yaml", "-o", folder / "run").status == 0
    return folder / "run"


@pytest.mark.parametrize("at", ["robot", "parameters", "split", "remarks", "options"])
def test_a_strangers_result_is_one_line_of_plain_text(tmp_path, calibrated, at):
    found = json.loads((calibrated / "result.json").read_text())
    match at:
        case "robot":
            found["robot"]["name"] = "a\x1b[31m"
        case "parameters":
            found["parameters"][0]["name"] += "\n  evil: 1"
        case "split":
            found["split"]["fit"][0] = "\u202ep1"
        case "remarks":
            found["warnings"].append("\x9b5m")
        case "options":
            found["provenance"]["options"]["a\x07"] = 1
    (tmp_path / "result.json").write_text(json.dumps(found))
    with pytest.raises(FormatError, match=f"key {at if at not in ('remarks', 'options') else ''}") as info:
        read_result(tmp_path / "result.json")
    assert str(info.value).isprintable()


# --- what a spreadsheet runs ------------------------------------------------------------------------------------------

RUN = ("=1+1", "=cmd|' /C calc'!A0", "+SUM(A1)", "-2+3+cmd", "@SUM(A1)", "'=x", "+x", "-")
KEPT = ("-1.5", "+3", "-1e-3", "-inf", "p=1", "a-b", "", "1", "'x", "it's")


def test_no_cell_is_a_formula_and_every_name_comes_back():
    header = ["id", "=head"]
    written = csv_text(header, [[cell, 1.5] for cell in (*RUN, *KEPT)])
    cells = list(csv.reader(io.StringIO(written)))
    assert cells[0] == ["id", "'=head"]
    for (found, _), meant_by in zip(cells[1:], (*RUN, *KEPT), strict=True):
        assert found == meant_by if meant_by in KEPT else found == "'" + meant_by
        assert found[:1] not in "=+-@" or found in KEPT
        assert meant(found) == meant_by
    assert harmless(-1.5) == -1.5


def test_names_that_look_like_formulas_go_round(tmp_path):
    """As ids of a table, a target and a joint's column: written by one verb, read by the next."""
    (tmp_path / "robot.yaml").write_text(
        ROBOT.replace("name: j2", 'name: "=j2"').replace("j2.", "=j2."), encoding="utf-8"
    )
    small_robot = tmp_path / "robot.yaml"
    ran = robocal("simulate", small_robot, "--kind", "plane", "-n", 12, "-o", tmp_path / "sim")
    assert ran.status == 0, ran.err
    with (tmp_path / "sim" / "data.csv").open() as stream:
        cells = [c for row in csv.reader(stream) for c in row if not row[0].startswith("#")]
    assert any(c.startswith("'=j2") for c in cells)
    assert not any(c[:1] in ("=", "+", "@") for c in cells)
    assert robocal("check", small_robot, tmp_path / "sim" / "data.yaml", "--json").status == 0


def test_two_names_that_a_spreadsheet_would_make_one(tmp_path):
    (tmp_path / "a.csv").write_text("id,x\n=a,1\n'=a,2\n")
    with pytest.raises(FormatError, match=r"column id.*differ in an apostrophe"):
        read_csv(tmp_path / "a.csv").texts("id")


def test_model_errors_are_short_too():
    assert len(str(ModelError("x" * 900))) < MESSAGE_LIMIT

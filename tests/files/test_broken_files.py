"""Whatever happens to a valid file, it is read or refused with an InputError: never another traceback."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from files.data_samples import ARM, DATA, TABLE, put
from files.kind_samples import ARM as SMALL
from files.kind_samples import KINDS, texts
from files.test_real_data import TRACKER
from files.test_result import result
from files.test_robot import TEXT as ROBOT
from files.test_urdf import TEXT as URDF
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robocal.arms.conventions import CONVENTIONS
from robocal.errors import InputError
from robocal.files.dataset import read_dataset
from robocal.files.result import read_result
from robocal.files.robot import read_robot, render_robot
from robocal.files.templates import convention_chain, templates

POSE = """\
robocal: 1
kind: pose
file: table.csv
joints: {columns: [q1, q2, q3]}
position: {columns: [x, y, z], unit: mm}
orientation: {columns: [sx, sy, sz], form: euler, order: XYZ, frame: intrinsic, unit: deg}
targets: {p1: {}, p2: {}, p3: {}, p4: {}}
target: name
"""
WORDS = [
    "-1",
    "1e400",
    ".nan",
    ".inf",
    "true",
    "null",
    "[]",
    "{}",
    "[1, 2, 3]",
    "{a: 1}",
    "x",
    "''",
    "0",
    '"',
    "9" * 400,
    "\u00e9",
    "~",
    "&a",
    "*a",
    "!a",
]


@st.composite
def damage(draw, text):
    """Bytes flipped, lines lost or doubled, values swapped or replaced."""
    data = text.encode()
    for _ in range(draw(st.integers(1, 3))):
        lines = data.split(b"\n")
        act = draw(
            st.sampled_from(["flip", "insert", "delete", "duplicate", "swap", "truncate", "word", "word", "word"])
        )
        at = draw(st.integers(0, max(len(data) - 1, 0)))
        line = draw(st.integers(0, len(lines) - 1))
        other = draw(st.integers(0, len(lines) - 1))
        if act == "flip":
            data = data[:at] + bytes([draw(st.integers(0, 255))]) + data[at + 1 :]
        elif act == "insert":
            data = data[:at] + draw(st.binary(max_size=3)) + data[at:]
        elif act == "truncate":
            data = data[:at]
        else:
            if act == "delete":
                del lines[line]
            elif act == "duplicate":
                lines.insert(other, lines[line])
            elif act == "swap":
                lines[line], lines[other] = lines[other], lines[line]
            else:
                spots = [i for i, c in enumerate(lines[line]) if c in b":,[ "]
                if spots:
                    start = draw(st.sampled_from(spots)) + 1
                    end = next(
                        (i for i in range(start + 1, len(lines[line])) if lines[line][i] in b",]}:"), len(lines[line])
                    )
                    lines[line] = lines[line][:start] + b" " + draw(st.sampled_from(WORDS)).encode() + lines[line][end:]
            data = b"\n".join(lines)
    return data


def only_input_errors(act):
    with contextlib.suppress(InputError):
        act()


quick = settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])


def use(place):
    robot = read_robot(place)
    render_robot(robot, {n: robot.chain.table[n].value + 0.01 for n in robot.chain.table.names})


@quick
@given(data=damage(ROBOT))
def test_robot(tmp_path, data):
    (tmp_path / "robot.yaml").write_bytes(data)
    only_input_errors(lambda: use(tmp_path / "robot.yaml"))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("convention", CONVENTIONS)
@settings(parent=quick, max_examples=30)
@given(data=st.data())
def test_robot_of_any_convention(tmp_path, convention, data):
    text = templates(convention_chain(convention, 2))["robot.yaml"]
    (tmp_path / "robot.yaml").write_bytes(data.draw(damage(text)))
    only_input_errors(lambda: use(tmp_path / "robot.yaml"))


@quick
@given(data=damage(URDF))
def test_urdf(tmp_path, data):
    (tmp_path / "arm.urdf").write_bytes(data)
    only_input_errors(lambda: use(tmp_path / "arm.urdf"))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("text", [DATA, POSE, TRACKER.replace("FILE", "table.csv")])
@quick
@given(data=st.data())
def test_data_file(tmp_path, text, data):
    put(tmp_path)
    (tmp_path / "data.yaml").write_bytes(data.draw(damage(text)))
    only_input_errors(lambda: read_dataset(tmp_path / "data.yaml", ARM))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("kind", KINDS)
@settings(parent=quick, max_examples=40)
@given(data=st.data())
def test_every_kind(tmp_path, kind, data):
    """A data file or its table, of every kind of measurement."""
    described, table = (text.encode() for text in texts(kind))
    if data.draw(st.booleans()):
        described = data.draw(damage(texts(kind)[0]))
    else:
        table = data.draw(damage("\n".join(texts(kind)[1].splitlines()[:5])))
    (tmp_path / "data.yaml").write_bytes(described)
    (tmp_path / "table.csv").write_bytes(table)
    only_input_errors(lambda: read_dataset(tmp_path / "data.yaml", SMALL))


@pytest.mark.parametrize("text", [DATA, POSE])
@quick
@given(table=damage(TABLE))
def test_table(tmp_path, text, table):
    put(tmp_path, text, table)
    only_input_errors(lambda: read_dataset(tmp_path / "data.yaml", ARM))


@quick
@given(table=damage(TABLE.replace("x,y,z,sx,sy,sz", "x [mm],y [mm],z [mm],sx [mm],sy [mm],sz [mm]")))
def test_table_that_describes_itself(tmp_path, table):
    put(tmp_path, table=table)
    only_input_errors(lambda: read_dataset(tmp_path / "table.csv", ARM))


@quick
@given(data=damage(result().to_json()))
def test_result(tmp_path, data):
    (tmp_path / "result.json").write_bytes(data)
    only_input_errors(lambda: read_result(tmp_path / "result.json"))


@quick
@given(st.binary(max_size=200))
def test_anything(tmp_path, data):
    for name in ("robot.yaml", "arm.urdf", "data.yaml", "table.csv", "result.json"):
        (tmp_path / name).write_bytes(data)
    only_input_errors(lambda: read_robot(tmp_path / "robot.yaml"))
    only_input_errors(lambda: read_robot(tmp_path / "arm.urdf"))
    only_input_errors(lambda: read_dataset(tmp_path / "data.yaml", ARM))
    only_input_errors(lambda: read_dataset(tmp_path / "table.csv", ARM))
    only_input_errors(lambda: read_result(tmp_path / "result.json"))
    assert Path(tmp_path).exists()

"""Every wrong data file or table gives one message: file, row, column or key, what was found, what was expected."""

from __future__ import annotations

import pytest
from files.data_samples import ARM, DATA, TABLE, put, read

from robocal.errors import FileError, FormatError, InputError
from robocal.files.dataset import read_dataset


def german(text):
    return text.replace(",", ";").replace(".", ",")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("kind: position\n", "", ["key kind", "missing", "position, pose"]),
        ("kind: position", "kind: positon", ["row 2", "key kind", "did you mean 'position'"]),
        ("file: table.csv", "file: tabel.csv", ["tabel.csv", "no such file", "did you mean 'table.csv'"]),
        ("file: table.csv\n", "", ["data.yaml", "key file", "missing"]),
        ("frame:", "frmae:", ["row 6", "key frmae", "unknown key", "did you mean 'frame'"]),
        ("free: true", "fre: true", ["row 6", "frame.fre", "did you mean 'free'"]),
        ("name: tracker", "name: tool", ["frame.name", "belongs to the robot"]),
        ("name: tracker", "name: j1", ["frame.name", "belongs to the robot"]),
        ("name: tracker", "name: a.b", ["frame.name", "not a usable name"]),
        ("frame: {", "frame: {mount: wall, ", ["frame.mount", "base or tool"]),
        ("unit: mm", "unit: mmm", ["row 5", "position.unit", "unknown unit", "did you mean 'mm'"]),
        ("unit: mm", "unit: deg", ["row 5", "position.unit", "a length"]),
        (", unit: mm", "", ["row 5", "column x", "position.unit", "unit is missing"]),
        (
            "[q1, q2, q3]",
            "[q1, q2]",
            ["row 4", "joints.columns", "wrong number of joint columns", "found 2", "3 for small"],
        ),
        ("[q1, q2, q3]", "[q1, q2, qq3]", ["table.csv", "column qq3", "no such column", "did you mean 'q3'"]),
        ("[q1, q2, q3]", "[q1, q2, 30]", ["table.csv", "column 30", "0 to 10"]),
        ("[q1, q2, q3]", "[q1, q2, true]", ["joints.columns", "not columns"]),
        (
            "[q1, q2, q3]}",
            "[q1, q2, q3], unit: rad}",
            ["table.csv", "column q1", "header states another unit", "'deg'", "expected rad"],
        ),
        ("[q1, q2, q3]}", "[q1, q2, q3], unit: [deg, deg]}", ["joints.unit", "wrong number of units"]),
        ("[q1, q2, q3]}", "[q1, q2, q3], unit: [deg, deg, deg]}", ["joints.unit", "a length"]),
        ("[x, y, z]", "[x, y]", ["row 5", "position.columns", "found 2"]),
        ("{columns: [sx, sy, sz]}", "0", ["row 5", "position.sigma", "above 0", "found 0"]),
        ("{columns: [sx, sy, sz]}", "-0.1", ["position.sigma", "above 0", "found -0.1"]),
        ("{columns: [sx, sy, sz]}", ".nan", ["position.sigma", "nan"]),
        ("{columns: [sx, sy, sz]}", "small", ["position.sigma", "'small'"]),
        ("[sx, sy, sz]", "[sx, sy]", ["position.sigma.columns", "found 2"]),
        ("temperature: T", "temprature: name", ["configuration.temprature", "did you mean 'temperature'"]),
        ("temperature: T", "payload: sx", ["configuration.payload", "unit is missing"]),
        ("id: name", "id: nmae", ["table.csv", "column nmae", "did you mean 'name'"]),
        ("robocal: 1", "robocal: 9", ["row 1", "key robocal"]),
        ("position:", "csv: {separator: ';;'}\nposition:", ["csv.separator", "';;'"]),
        ("position:", "csv: {decimal: x}\nposition:", ["csv.decimal", "'x'"]),
        ("position:", "targets: {a: {}, b: {}}\nposition:", ["key target", "several targets"]),
        ("position:", "targets: {j1: {}}\nposition:", ["targets.j1", "name is taken"]),
        (
            "position:",
            "targets: {p1: {}}\ntarget: name\nposition:",
            ["table.csv", "row 4", "column name", "unknown target", "'p2'", "did you mean 'p1'"],
        ),
        ("kind: position", "kind: pose", ["key orientation", "missing"]),
        ("kind: position", "kind: [position]", ["key kind"]),
        ("file: table.csv", "file: [table.csv, 3]", ["key file", "not a file name"]),
    ],
)
def test_faults_of_the_data_file(tmp_path, old, new, words):
    assert old in DATA
    with pytest.raises(InputError) as info:
        read(tmp_path, DATA.replace(old, new, 1))
    for word in words:
        assert word in str(info.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("p2,30,20,50,300", "p2,30,20,50,abc", ["row 4", "column x", "not a number", "'abc'"]),
        ("p2,30,20,50,300", "p2,30,20,50,", ["row 4", "column x", "cell is empty"]),
        ("p2,30,20,50,300", "p2,30,20,50, ", ["row 4", "column x", "cell is empty"]),
        ("p2,30,20,50,300", "p2,30,20,50,nan", ["row 4", "column x", "not a finite number", "'nan'"]),
        ("p2,30,20,50,300", "p2,30,20,50,-inf", ["row 4", "column x", "not a finite number", "'-inf'"]),
        ("p2,30,20,50,300", "p2,30,20,50,1e999", ["row 4", "column x", "not a finite number"]),
        ("p2,30,20,50,300", "p2,30,20,50,1_0", ["row 4", "column x", "not a number"]),
        ("p2,30,20,50,300", 'p2,30,20,50,"300,5"', ["row 4", "column x", "decimal comma", "'300,5'", "announce"]),
        ("p3,60", "p3,sixty", ["row 6", "column q1", "'sixty'"]),
        ("p3,60,-30,0", "p3,60,-30", ["row 6", "wrong number of columns", "found 10", "11 columns", "','"]),
        ("p3,60", "p3,60,60", ["row 6", "wrong number of columns", "found 12"]),
        ("p3,60,-30,0,200", "p3;60;-30;0;200", ["row 6", "wrong number of columns"]),
        (
            "p4,80,-10,20,100,-250,500,0.01",
            "p4,80,-10,20,100,-250,500,0",
            ["row 7", "column sx", "above 0", "found 0.0"],
        ),
        (
            "p4,80,-10,20,100,-250,500,0.01",
            "p4,80,-10,20,100,-250,500,-0.01",
            ["row 7", "column sx", "above 0", "-0.01"],
        ),
        ("p4", "", ["row 7", "column name", "empty"]),
        ("p4,", '"p4,', ["row 7", "cannot be split"]),
        ("p4,", '"p4"x,', ["row 7", "cannot be split"]),
        ("name,q1 [deg],q2 [deg]", "name,q1 [degg],q2 [deg]", ["column q1", "'degg'", "did you mean 'deg'"]),
        ("name,q1 [deg],q2 [deg]", "name,q1,q2 [deg]", ["column q1", "unit is missing"]),
        ("name,q1 [deg],q2 [deg]", "name,q1 [deg],q1 [deg]", ["several columns have this name"]),
        ("name,q1 [deg],q2 [deg]", "name,q1 [mm],q2 [deg]", ["column q1", "an angle"]),
    ],
)
def test_faults_of_the_table(tmp_path, old, new, words):
    assert old in TABLE
    with pytest.raises(FormatError) as info:
        read(tmp_path, table=TABLE.replace(old, new, 1))
    for word in ["table.csv" if "missing" not in words[-1] else "data.yaml", *words]:
        assert word in str(info.value)


@pytest.mark.parametrize(
    ("csv", "words"),
    [
        ("{separator: ';', decimal: '.'}", ["row 4", "decimal comma", "'-20,5'", "announce"]),
        ("{separator: ',', decimal: '.'}", ["wrong number of columns"]),
        ("{separator: ';', decimal: ','}", []),
        ("{separator: ';'}", []),
    ],
)
def test_a_decimal_comma_is_refused_where_a_point_is_announced(tmp_path, csv, words):
    data, table = DATA + f"csv: {csv}\n", german(TABLE)
    if not words:
        read(tmp_path, data, table)
        return
    with pytest.raises(FormatError) as info:
        read(tmp_path, data, table)
    for word in words:
        assert word in str(info.value)


def test_a_decimal_point_where_a_comma_is_announced(tmp_path):
    table = german(TABLE).replace("-20,5", "-20.5")
    with pytest.raises(
        FormatError, match=r"row 4, column y: a decimal point where the file announces a decimal comma; found '-20\.5'"
    ):
        read(tmp_path, DATA + "csv: {separator: ';', decimal: ','}\n", table)


def test_headers_that_do_not_say_enough(tmp_path):
    def fails(table, pattern):
        put(tmp_path, table=table)
        with pytest.raises(FormatError, match=pattern):
            read_dataset(tmp_path / "table.csv", ARM)

    fails(
        "q1 [deg],q2 [deg],q3 [mm],x [mm],y [mm],z\n0,0,0,1,1,1",
        r"table\.csv, column z: the unit is missing; expected a header such as z \[mm\]",
    )
    fails("q1 [deg],q2 [deg],x [mm],y [mm],z [mm]\n0,0,1,1,1", r"no columns for the joints; .*expected 3 columns")
    fails(
        "q1 [deg],q2 [deg],q3 [mm],q4 [deg],x [mm],y [mm],z [mm]\n0,0,0,0,1,1,1",
        "wrong number of joint columns; found 'q4 as well'; expected 3",
    )
    fails("q1 [deg],q2 [deg],q3 [mm]\n0,0,0", "no columns for the position")
    fails(
        "0,0,0,1,1,1",
        r"row 1: there is no header in the first row; expected the names of the columns, as x \[mm\]; or in a data file csv: \{header: false\}",
    )
    fails("q1 [deg],q2 [deg],q3 [mm],x [mm],y [mm],z [mm]\n", "header but no rows")
    fails("# nothing\n\n", "no rows")
    fails("", "empty")


@pytest.mark.parametrize(
    ("words", "row", "pattern"),
    [
        (
            "columns: [a, b, c, d], form: quaternion_xyzw",
            "1,1,1,1",
            r"row 3, column a: not a unit quaternion; found 2\.0",
        ),
        (
            "columns: [a, b, c, d], form: quaternion",
            "0,0,0,1",
            "orientation.form: unknown form; .*did you mean 'quaternion_",
        ),
        (
            "columns: [a, b, c], form: quaternion_xyzw",
            "0,0,0,1",
            "orientation.columns: wrong number of columns; found 3; expected 4",
        ),
        (
            "columns: [a, b, c], form: euler, unit: deg, frame: intrinsic",
            "0,0,0,1",
            "orientation.order: a key is missing",
        ),
        ("columns: [a, b, c], form: euler, unit: deg, order: XYZ", "0,0,0,1", "orientation.frame: a key is missing"),
        (
            "columns: [a, b, c], form: euler, unit: deg, order: XXY, frame: intrinsic",
            "0,0,0,1",
            "orientation.order: not an order of axes; found 'XXY'",
        ),
        ("columns: [a, b, c], form: rotation_vector", "0,0,0,1", "the unit is missing"),
        ("columns: [a, b, c], form: rotation_vector, unit: mm", "0,0,0,1", "an angle is needed"),
        (
            "columns: [a, b, c], form: rotation_vector, unit: deg, sigma: 1",
            "0,0,0,1",
            "position.sigma: only one of two standard deviations",
        ),
        ("columns: [a, a, a, b, b, b, c, c, c], form: matrix", "1,0,0,0", "row 2, column a: not a rotation matrix"),
        ("columns: [d, a, a, a, b, a, a, a, d], form: matrix", "0,-1,0,1", r"row 2, column d: a reflection"),
    ],
)
def test_faults_of_orientations(tmp_path, words, row, pattern):
    data = f"robocal: 1\nkind: pose\nfile: table.csv\nposition: {{columns: [x, y, z], unit: m}}\norientation: {{{words}}}\n"
    first = "0,1,0,1" if "reflection" not in pattern else row
    table = f"q1 [deg],q2 [deg],q3 [mm],x,y,z,a,b,c,d\n0,0,0,1,1,1,{first if 'row 2' in pattern else '0,0,0,1'}\n0,0,0,1,1,1,{row}\n"
    with pytest.raises(FormatError, match=pattern):
        read(tmp_path, data, table)


def test_wrong_encoding_of_the_table(tmp_path):
    """Windows-1252, as spreadsheets write, is read; a byte that is no letter there either is refused."""
    made = read(tmp_path, table=TABLE.replace("p2", "p\u00fc").encode("latin-1"))
    assert made.dataset.configurations.ids[1] == "p\u00fc" and [w.code for w in made.warnings] == ["csv-western"]
    with pytest.raises(FileError, match=r"table\.csv, row 4: wrong encoding: byte .* '0x81'"):
        read(tmp_path, table=TABLE.encode().replace(b"p2", b"p\x81"))

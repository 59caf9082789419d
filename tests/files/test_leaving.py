"""Rows that are left out: by hand, in every way in which people name rows, and where something is missing."""

from __future__ import annotations

import pytest
from files.data_samples import ARM, DATA, TABLE, put, read

from robocal.errors import FormatError
from robocal.files.dataset import read_datasets
from robocal.remarks.code import Code

# Lines of the table: p1 3, p2 4, p3 6, p4 7.
NUMBERED = TABLE.replace("p1", "11").replace("p2", "12").replace("p3", "13").replace("p4", "14")
NAMELESS = DATA.replace("configuration: {id: name, temperature: T}\n", "")


@pytest.mark.parametrize(
    ("words", "left"),
    [
        (["p2"], [3, 6, 7]),
        (["p1,p4"], [4, 6]),
        (["4"], [3, 6, 7]),
        (["4-6"], [3, 7]),
        (["table.csv:4-6", "p4"], [3]),
        (["table:3"], [4, 6, 7]),
    ],
)
@pytest.mark.parametrize("where", ["file", "command"])
def test_rows_by_every_name(tmp_path, words, left, where):
    said = f"exclude: [{', '.join(f'{chr(34)}{w}{chr(34)}' for w in words)}]\n"
    place = put(tmp_path, DATA + said if where == "file" else DATA)
    reading = read_datasets([place], ARM, exclude=words if where == "command" else ())
    assert reading.dataset.observations[0].rows.tolist() == left
    (gone,) = reading.left_out
    assert gone.why == "excluded" and sorted((*gone.rows, *left)) == [3, 4, 6, 7]
    assert [w.code for w in reading.warnings] == [Code.ROWS_EXCLUDED] and reading.warnings[0].numbers["count"] == len(
        gone.rows
    )


def test_ids_that_are_numbers_come_before_rows(tmp_path):
    reading = read_datasets([put(tmp_path, table=NUMBERED)], ARM, exclude=["12-13", "table.csv:3"])
    assert reading.dataset.configurations.ids == ("14",)


def test_rows_are_numbers_where_nothing_has_an_id(tmp_path):
    put(tmp_path, NAMELESS + "exclude: 4-6\n")
    assert read_datasets([tmp_path / "data.yaml"], ARM).dataset.observations[0].rows.tolist() == [3, 7]
    # A default id is FILE:ROW already.
    put(tmp_path, NAMELESS + "exclude: table.csv:7\n")
    assert read_datasets([tmp_path / "data.yaml"], ARM).dataset.observations[0].rows.tolist() == [3, 4, 6]


@pytest.mark.parametrize("where", ["file", "command"])
def test_a_name_that_excludes_nothing_is_an_error(tmp_path, where):
    place = put(tmp_path, DATA + "exclude: [p22]\n" if where == "file" else DATA)
    with pytest.raises(FormatError) as error:
        read_datasets([place], ARM, exclude=() if where == "file" else ["p1", "p22"])
    assert error.value.found == "p22" and error.value.suggestion == "p2"
    assert error.value.key == ("exclude" if where == "file" else "--exclude")


def test_everything_cannot_be_left_out(tmp_path):
    with pytest.raises(FormatError, match="every row is left out"):
        read(tmp_path, DATA + "exclude: 3-7\n")


@pytest.mark.parametrize("cell", ["", "NaN", "nan", "NA"])
@pytest.mark.parametrize("column", ["-20.5", "20,50", "0.02", "20.5\n"])
def test_missing_cells(tmp_path, cell, column):
    """An error that says how to go on; with the key, the row is left out, counted and said."""
    table = TABLE.replace("p2,30,20,50,300,-20.5,650,0.01,0.02,0.03,20.5\n", _row(cell, column))
    with pytest.raises(FormatError, match=r"missing: skip") as error:
        read(tmp_path, table=table)
    assert error.value.row == 4
    reading = read(tmp_path, DATA + "csv: {missing: skip}\n", table)
    assert reading.dataset.configurations.ids == ("p1", "p3", "p4")
    assert reading.left_out[0].rows == (4,) and reading.left_out[0].why == "missing"
    assert [w.code for w in reading.warnings] == [Code.ROWS_MISSING]


def _row(cell, column):
    cells = dict(
        zip(
            "name q1 q2 q3 x y z sx sy sz T".split(),
            "p2,30,20,50,300,-20.5,650,0.01,0.02,0.03,20.5".split(","),
            strict=True,
        )
    )
    name = {"-20.5": "y", "20,50": "q2", "0.02": "sy", "20.5\n": "T"}[column]
    return ",".join((cells | {name: cell}).values()) + "\n"


def test_what_is_wrong_is_not_missing(tmp_path):
    """A word where a number should be is an error whatever is skipped."""
    with pytest.raises(FormatError, match="not a number"):
        read(tmp_path, DATA + "csv: {missing: skip}\n", TABLE.replace("-20.5", "oops"))
    with pytest.raises(FormatError, match="not a finite number"):
        read(tmp_path, DATA + "csv: {missing: skip}\n", TABLE.replace("-20.5", "inf"))


def test_columns_that_nobody_reads_may_be_empty(tmp_path):
    table = (
        TABLE.replace("name,", "note,name,")
        .replace("p1,", ",p1,")
        .replace("p2,", "x,p2,")
        .replace("p3,", ",p3,")
        .replace("p4,", ",p4,")
    )
    reading = read(tmp_path, DATA + "csv: {missing: skip}\n", table)
    assert len(reading.dataset.configurations) == 4 and reading.left_out == ()

"""What is written or read at once is what would be written or read one by one."""

import csv
import io
import json

import numpy as np
import pytest

from robocal.files.csvtable import read_csv
from robocal.files.csvtext import csv_columns
from robocal.files.display import _cell, _cells
from robocal.files.plain import json_text, plain
from robocal.quantities import Column

ODD = [0.0, -0.0, float("nan"), float("inf"), -float("inf"), 1e300, -1e-300, 1234567.0, -1e-9]


@pytest.mark.parametrize(("digits", "decimals"), [(15, None), (6, None), (15, 3), (9, 2)])
@pytest.mark.parametrize("odd", [True, False])
def test_a_column_of_a_listing(rng, digits, decimals, odd):
    values = [*(rng.normal(size=300) * 10.0 ** rng.integers(-20, 20, 300)).tolist(), *rng.normal(size=300).tolist()]
    values += ODD if odd else []
    column = Column("x", "mm", values, digits=digits, decimals=decimals)
    assert _cells(values, column) == [_cell(v, column) for v in values]


def test_a_document():
    flat = {"a": [1.5, -0.0, 1e-30, None, True], "b": [], "c": {}, "d": 'quote " and é', "e": {"x": 1, "y": "z"}}
    deep = {"numbers": np.arange(3) / 7, "rows": [[1.0, 2.0], [], [{"a": [flat]}]], "none": None, **flat, "nan": ODD}
    for value in (deep, [], {}, [deep, 1], "word", 1.5):
        assert json_text(value) == json.dumps(plain(value), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


@pytest.mark.parametrize("word", ["plain", "a,b", 'q"', "l\nm", "c\rd", ""])
@pytest.mark.parametrize("width", [1, 3])
def test_columns_of_a_csv(word, width):
    columns = [["1.5", word], ["", "x"], ["2", "3"]][:width]
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([["a", "b", "c"][:width], *zip(*columns, strict=True)])
    assert csv_columns(["a", "b", "c"][:width], columns) == stream.getvalue()


@pytest.mark.parametrize("between", [",", ";", "\t", " "])
@pytest.mark.parametrize("units", ["", "mm|deg|mm"])
def test_a_bare_table_and_the_same_with_quotes(tmp_path, between, units):
    lines = ["x|y|z", *([units] if units else []), "1.5|-2|3e4", "4|5|6.25"]
    for name, line in (("bare", "7|8|9"), ("quoted", '7|"8"|9')):
        text = "\n".join(between.join(each.split("|")) for each in [*lines, line])
        (tmp_path / f"{name}.csv").write_text(text + "\n")
    bare, quoted = (read_csv(tmp_path / f"{name}.csv") for name in ("bare", "quoted"))
    for part in ("names", "units", "cells", "separator", "head", "style"):
        assert getattr(bare, part) == getattr(quoted, part), part
    assert bare.lines.tolist() == quoted.lines.tolist()

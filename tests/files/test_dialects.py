"""Tables as spreadsheets and instruments write them are read as they mean, or refused: never as other numbers."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal

from robocal.arms import catalog
from robocal.errors import FormatError
from robocal.files.csvtable import read_csv
from robocal.files.dataset import read_dataset

HEAD = ["j1 [deg]", "j2 [deg]", "j3 [deg]", "j4 [deg]", "j5 [deg]", "j6 [deg]", "x [mm]", "y [mm]", "z [mm]"]


@pytest.fixture(scope="module")
def rows():
    rng = np.random.default_rng(3)
    return np.hstack([rng.uniform(-90, 90, (12, 6)), rng.uniform(-3000, 3000, (12, 3))]).round(4)


def comma(value):
    return f"{value:.4f}".replace(".", ",")


def thousands(value, sign=".", decimal=","):
    return f"{value:,.4f}".replace(".", "_").replace(",", sign).replace("_", decimal)


def text(rows, separator=";", number=comma, quoted=False, head=HEAD):
    cells = [[f'"{number(v)}"' if quoted else number(v) for v in row] for row in rows]
    return "\n".join(separator.join(line) for line in [head, *cells]) + "\n"


def plain(value):
    return f"{value:.4f}"


WRITTEN = {
    "semicolons and commas": lambda r: text(r),
    "quoted commas": lambda r: text(r, ",", quoted=True),
    "a line sep=": lambda r: "sep=;\r\n" + text(r).replace("\n", "\r\n"),
    "a line sep= of bars": lambda r: "\ufeffsep=|\n" + text(r, "|"),
    "comments of //": lambda r: "// Exported, points: 12\n// Frame: WORLD\n" + text(r, ",", plain),
    "comments of %": lambda r: "% a, b, c\n" + text(r, ",", plain),
    "a title": lambda r: "Export of 14 March;;;;;;;;\n" + text(r),
    "a title and the date": lambda r: "Laser tracker, hall 3\nDate;2026-03-14\n\n" + text(r),
    "points between thousands": lambda r: text(r, number=thousands),
    "commas between thousands": lambda r: text(r, ",", lambda v: thousands(v, ",", "."), quoted=True),
    "apostrophes between thousands": lambda r: text(r, ";", lambda v: thousands(v, "'", ".")),
    "narrow spaces between thousands": lambda r: text(r, ";", lambda v: thousands(v, "\u202f")),
    "typographic apostrophes": lambda r: text(r, ";", lambda v: thousands(v, "’", ".")),
    "spaces before points": lambda r: text(r, "\t", lambda v: thousands(v, " ", ".")),
    "narrow spaces before points": lambda r: text(r, ",", lambda v: thousands(v, "\u202f", ".")),
    "a minus of its own": lambda r: text(r).replace("-", "\u2212"),
    "a minus of its own in exponents": lambda r: text(r, ",", lambda v: f"{v:.9e}".replace("-", "\u2212")),
    "a header behind %": lambda r: "% made by a program\n%" + text(r, ",", plain),
    "a header behind #": lambda r: "# " + text(r, "\t", plain),
    "a line of units": lambda r: text(r, head=["A1", "A2", "A3", "A4", "A5", "A6", "X", "Y", "Z"]).replace(
        "\n", "\n" + ";".join(["°"] * 6 + ["mm"] * 3) + "\n", 1
    ),
    "capitals and round brackets": lambda r: text(
        r, head=[f"Axis{i} (deg)" for i in range(1, 7)] + ["X (mm)", "Y (mm)", "Z (mm)"]
    ),
}


@pytest.mark.parametrize("written", WRITTEN)
def test_numbers_are_what_they_mean(tmp_path, rows, written):
    place = tmp_path / "table.csv"
    place.write_text(WRITTEN[written](rows), encoding="utf-8")
    found = read_dataset(place, catalog.get("ur10")).dataset
    np.testing.assert_allclose(np.degrees(found.configurations.joints), rows[:, :6], atol=1e-12)
    np.testing.assert_allclose(1e3 * found.observations[0].value, rows[:, 6:], atol=1e-12)


def test_a_table_in_windows_1252_is_said_to_be_one(tmp_path, rows):
    place = tmp_path / "table.csv"
    place.write_bytes(text(rows).replace("[deg]", "[°]").encode("cp1252"))
    made = read_dataset(place, catalog.get("ur10"))
    assert [w.code for w in made.warnings] == ["csv-western"]
    np.testing.assert_allclose(1e3 * made.dataset.observations[0].value, rows[:, 6:], atol=1e-12)


def test_a_title_is_told_with_the_row_of_the_header(tmp_path, rows):
    place = tmp_path / "table.csv"
    place.write_text("Laser tracker\nDate;2026-03-14\n" + text(rows))
    (said,) = read_dataset(place, catalog.get("ur10")).warnings
    assert said.sentence.endswith("the header is read in row 3, after a title of 2 rows")


@pytest.mark.parametrize(
    ("cells", "numbers"),
    [
        (["29,323", "18,565"], None),  # may be 29323
        (["29,323", "18,56"], [29.323, 18.56]),
        (["0,323", "18,565"], [0.323, 18.565]),
        (["29,323", "1.5"], None),  # both signs
        (["1.234,5", "29,323"], [1234.5, 29.323]),
        (["1,234.5", "29,323"], [1234.5, 29323.0]),
        (["1.234", "29,32"], None),  # 1234, or a decimal point
        (["1.2,3", "4,5"], None),
        (["-1 234,5", "4"], [-1234.5, 4.0]),
    ],
)
def test_what_can_mean_two_things_is_refused(tmp_path, cells, numbers):
    place = tmp_path / "table.csv"
    place.write_text("a;b\n" + ";".join(cells) + "\n")
    if numbers is None:
        with pytest.raises(FormatError, match="row 2, column [ab]: (a decimal|not a number)"):
            read_csv(place).numbers(["a", "b"])
    else:
        np.testing.assert_array_equal(read_csv(place).numbers(["a", "b"]), [numbers])


@pytest.mark.parametrize(
    ("cells", "csv", "numbers"),
    [
        (["1.770", "673"], {}, None),  # 1770 beside 673, or 1.77
        (["1.770", "673"], {"thousands": "."}, [1770.0, 673.0]),
        (["1.770", "673"], {"decimal": "."}, [1.77, 673.0]),
        (["1.770", "0.673"], {}, [1.77, 0.673]),
        (["1.770", "673.25"], {}, [1.77, 673.25]),
        (["1.770", "2.673"], {}, [1.77, 2.673]),  # three digits behind every dot, as programs write
        (["1.769.593", "673.360"], {}, [1769593.0, 673360.0]),  # of two dots neither is a decimal point
        (["1,769,593", "673,360"], {}, [1769593.0, 673360.0]),
        (["1’769’593", "673"], {}, [1769593.0, 673.0]),
        (["1.769.593", "0.25"], {}, None),
        (["1.769.59", "673.360"], {}, None),
        (["1,770", "673"], {}, None),
        (["1,770", "673"], {"thousands": ","}, [1770.0, 673.0]),
    ],
)
def test_whole_numbers_with_thousands(tmp_path, cells, csv, numbers):
    place = tmp_path / "table.csv"
    place.write_text("name;a\n" + "".join(f"p{i};{cell}\n" for i, cell in enumerate(cells)))
    if numbers is None:
        with pytest.raises(
            FormatError, match="row 2, column a: (a dot that may stand between thousands|a decimal comma|not a number)"
        ):
            read_csv(place, **csv).numbers(["a"])
    else:
        np.testing.assert_array_equal(read_csv(place, **csv).numbers(["a"])[:, 0], numbers)


def test_quoted_cells_between_commas_may_have_thousands_too(tmp_path):
    place = tmp_path / "table.csv"
    place.write_text('a [mm],b\n"1.770",1\n"673",2\n')
    with pytest.raises(FormatError, match="row 2, column a: a dot that may stand between thousands"):
        read_csv(place).numbers(["a"])
    place.write_text("a [mm],b\n1.770,1\n673,2\n")
    assert read_csv(place).numbers(["a"])[0] == 1.77


def test_names_say_nothing_of_numbers(tmp_path):
    """A text column 1,2 beside columns with units is no decimal comma, and 1.10 no decimal point."""
    place = tmp_path / "table.csv"
    place.write_text("seen;a [mm]\n1,2;1.770\n2,3;673.5\n")
    np.testing.assert_array_equal(read_csv(place).numbers(["a"])[:, 0], [1.77, 673.5])
    place.write_text("name;a [mm]\n1.10;1.770,25\n1.11;673,5\n")
    np.testing.assert_array_equal(read_csv(place).numbers(["a"])[:, 0], [1770.25, 673.5])


def test_a_header_with_data_below_is_no_title(tmp_path):
    place = tmp_path / "table.csv"
    place.write_text("name,q [deg]\na,\nb,2\n")
    table = read_csv(place)
    assert table.names == ("name", "q") and len(table) == 2 and table.remarks == ()


def test_new_describes_a_table(tmp_path, rows):
    """Two commands from the export of an instrument to a data file that says the same."""
    head = [h.replace("j", "A").replace("deg", "°").upper().replace("[MM]", "[mm]") for h in HEAD]
    lines = (
        "Export, hall 3;;;;;;;;;\n" + text(rows, number=thousands, head=[*head, "Note"]).replace("\n", ";\n")
    ).split("\n")
    lines[4] = ";".join([*lines[4].split(";")[:6], "", "", "", "", ""])  # a lost beam
    place = tmp_path / "export.csv"
    place.write_bytes("\n".join(lines).encode("cp1252"))
    made = robocal("new", "ur10", "--table", place, "-o", tmp_path / "cell")
    assert made.status == 0 and "is described; next: robocal check" in made.said
    written = (tmp_path / "cell" / "data.yaml").read_text()
    assert 'csv: {separator: ";", decimal: ",", thousands: ".", missing: skip}' in written and "row 5" in written
    found = read_dataset(tmp_path / "cell" / "data.yaml", catalog.get("ur10"))
    kept = np.delete(rows, 2, axis=0)
    np.testing.assert_allclose(np.degrees(found.dataset.configurations.joints), kept[:, :6], atol=1e-12)
    np.testing.assert_allclose(1e3 * found.dataset.observations[0].value, kept[:, 6:], atol=1e-12)
    assert robocal("check", tmp_path / "cell" / "robot.yaml", tmp_path / "cell" / "data.yaml").status in (0, 3)


def test_new_leaves_units_open_that_no_header_states(tmp_path, rows):
    place = tmp_path / "export.csv"
    place.write_text(text(rows, head=[h.split()[0] for h in HEAD]))
    robocal("new", "ur10", "--table", place, "-o", tmp_path / "cell")
    ran = robocal("check", tmp_path / "cell" / "robot.yaml", tmp_path / "cell" / "data.yaml")
    assert ran.status != 0 and "unknown unit" in ran.said


@pytest.mark.parametrize("joints", [".0f", ".1f"])
def test_columns_of_thousands_alone_are_no_fractions(tmp_path, rows, joints):
    """1.770 among numbers above a thousand means 1770 where another column has whole numbers beside its dots."""
    place = tmp_path / "table.csv"
    far = np.round(np.hstack([rows[:, :6], 1500 + np.abs(rows[:, 6:8]), 400 + np.abs(rows[:, 8:])]))
    cells = [[*(f"{v:{joints}}" for v in r[:6]), *(f"{v:,.0f}".replace(",", ".") for v in r[6:])] for r in far]
    place.write_text("\n".join(";".join(line) for line in [HEAD, *cells]) + "\n")
    if joints == ".0f":
        with pytest.raises(FormatError, match="row 2, column x: a dot that may stand between thousands"):
            read_dataset(place, catalog.get("ur10"))
    else:  # 12.3 is no thousand: all dots are decimal points
        assert read_dataset(place, catalog.get("ur10")).dataset.observations[0].value.max() < 1.0


def test_a_recording_is_read_by_its_header(tmp_path, rows):
    """`%time` of a recording counts nanoseconds."""
    place = tmp_path / "table.csv"
    lines = text(rows, ",", plain).splitlines()
    stamps = [1_700_000_000_000_000_000 + 250_000_000 * i for i in range(len(rows))]
    place.write_text(
        "\n".join(["%time," + lines[0], *(f"{t},{line}" for t, line in zip(stamps, lines[1:], strict=True))]) + "\n"
    )
    made = read_dataset(place, catalog.get("ur10"))
    assert [w.code for w in made.warnings] == ["csv-commented"]
    np.testing.assert_allclose(1e3 * made.dataset.observations[0].value, rows[:, 6:], atol=1e-12)
    time = made.dataset.configurations.columns["time"]
    np.testing.assert_allclose(np.diff(time), 0.25, atol=1e-6)


def test_a_comment_of_another_width_is_a_comment(tmp_path):
    place = tmp_path / "table.csv"
    place.write_text("# one, two, three\n1,2\n3,4\n")
    with pytest.raises(FormatError, match="row 2: there is no header"):
        read_csv(place)


def test_a_unit_that_nobody_states_is_not_called_described(tmp_path, rows):
    place = tmp_path / "table.csv"
    for head, said in ((HEAD, "is described; next"), ([h.split()[0] for h in HEAD], "where data.yaml says STATE_IT")):
        place.write_text(text(rows, ",", plain, head=head))
        ran = robocal("new", "ur10", "--table", place, "-o", tmp_path / str(len(said)))
        assert ran.status == 0 and said in ran.said, ran.said


def test_any_way_to_write_a_table_is_read_as_meant_or_refused(tmp_path):
    """Decimal signs, signs between thousands, separators and minus signs in every combination, 400 drawn."""
    rng, place, read = np.random.default_rng(31), tmp_path / "table.csv", 0
    for _ in range(400):
        decimal, separator = str(rng.choice([".", ","])), str(rng.choice([";", "\t", ",", "|", " "]))
        signs = ["", "", *(s for s in (".", ",", "'", "’", " ", "\u00a0", "\u202f") if s not in (decimal, separator))]
        between, minus = str(rng.choice(signs)), str(rng.choice(["-", "\u2212"]))
        quoted = separator == "," and "," in decimal + between
        values, cells = [], []
        for _ in range(int(rng.integers(1, 6))):
            digits = int(rng.integers(0, 6))
            size = float(rng.choice([1.0, 100.0, 3e3, 3e3, 1e7]))
            plain = [f"{v:,.{digits}f}" for v in rng.uniform(-size, size, 40)]
            values.append([float(v.replace(",", "")) for v in plain])
            swapped = (v.replace(",", "_").replace(".", decimal).replace("_", between) for v in plain)
            cells.append([('"{}"' if quoted else "{}").format(v.replace("-", minus)) for v in swapped])
        head = [f"c{i}" + ("" if separator == " " else " [mm]") for i in range(len(cells))]
        place.write_text("\n".join(separator.join(line) for line in [head, *zip(*cells, strict=True)]) + "\n")
        try:
            found = read_csv(place).numbers([f"c{i}" for i in range(len(cells))])
        except FormatError:
            continue
        read += 1
        np.testing.assert_array_equal(found, np.transpose(values), err_msg=place.read_text()[:300])
    assert read > 320, read

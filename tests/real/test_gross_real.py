"""Gross rows of real files, through the command line: named with their cause, and nothing else is; the gain stays."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal
from real import controls as c

ZEROED = (100, 700, 1300, 1901, 2500)
SWAPPED = 42  # pairs: 3 % of the rows


def ran(words):
    done = robocal("identify", *words, "--json")
    return done, done.document


def series_c(folder, shared, spoil=lambda rows, place: None):
    """UR10, series C, its rows spoiled; the words of the command line."""
    words = c.ur10("C")(folder, shared)
    lines = (folder / "some.csv").read_text().splitlines()
    rows = [line.split(";") for line in lines[1:]]
    spoil(rows, [lines[0].split(";").index(f"measurement_{a}") for a in "xyz"])
    (folder / "some.csv").write_text("\n".join([lines[0], *map(";".join, rows)]) + "\n")
    return words


def gain(document, everything=False):
    found = document["residuals"]
    found = found["all_rows"] if everything else found
    return found["held_out_before"]["mean"] - found["held_out"]["mean"]


@pytest.fixture(scope="module")
def clean(shared_data, tmp_path_factory):
    done, document = ran(series_c(tmp_path_factory.mktemp("clean"), shared_data))
    assert done.status == 0
    return document


def same_gain(document, clean):
    """Within 15 % of the clean file's, on the same held-out rows but those that are gross."""
    assert document["verdict"]["status"] == "improved" and document["verdict"]["region"] == "working"
    assert document["split"]["held_out"] == clean["split"]["held_out"]
    assert gain(document) == pytest.approx(gain(clean), rel=0.15)


def test_a_clean_file_has_no_gross_row(clean):
    print(f"\n{len(clean['outliers'])} rows named, gain {gain(clean):.4f} mm")
    assert clean["outliers"] == [] and clean["residuals"]["all_rows"] is None


def test_zeroed_rows_are_dropped_beams(shared_data, tmp_path, clean):
    def spoil(rows, place):
        for i in ZEROED:
            for at in place:
                rows[i][at] = "0"

    done, found = ran(series_c(tmp_path, shared_data, spoil))
    print(f"\n{found['verdict']['reasons'][0]}")
    told = {o["row"]: o for o in found["outliers"]}
    assert done.status == 0 and set(told) == {i + 2 for i in ZEROED}
    for o in told.values():
        assert o["set_aside"] and o["cause"]["code"] == "cause-zeros" and o["value"] == [0, 0, 0]
    same_gain(found, clean)
    # The mean with them is printed too, and says something else.
    assert found["residuals"]["all_rows"] is not None


def test_swapped_rows_are_told_with_their_partners(shared_data, tmp_path, clean):
    pairs = np.random.default_rng(5).choice(2773, (SWAPPED, 2), replace=False)

    def spoil(rows, place):
        for a, b in pairs:
            for at in place:
                rows[a][at], rows[b][at] = rows[b][at], rows[a][at]

    done, found = ran(series_c(tmp_path, shared_data, spoil))
    print(f"\n{found['verdict']['reasons'][0]}")
    told = {o["row"]: o["cause"] for o in found["outliers"]}
    partner = {int(a) + 2: int(b) + 2 for pair in pairs for a, b in (pair, pair[::-1])}
    assert done.status == 0 and set(told) == set(partner)
    for row, cause in told.items():
        assert cause["code"] == "row-swapped" and cause["numbers"]["partner"] == partner[row], cause
    same_gain(found, clean)


@pytest.mark.parametrize(("kind", "rows"), [("position", []), ("pose", [115])])
def test_the_flagged_rows_of_a_real_board_are_listed_and_counted(shared_data, tmp_path, kind, rows):
    """FR3: a pose at which the camera errs most is told, by row; the printed figure is the one with all rows."""
    done, found = ran(c.fr3(kind)(tmp_path, shared_data))
    print(f"\n{kind}: {[(o['row'], round(o['distance'], 1), o['set_aside']) for o in found['outliers']]}")
    assert done.status == 0 and [o["row"] for o in found["outliers"]] == rows
    assert not any(o["set_aside"] for o in found["outliers"])
    assert (
        found["residuals"]["all_rows"] is None
        and len(found["split"]["held_out"]) == found["residuals"]["held_out"]["n"]
    )

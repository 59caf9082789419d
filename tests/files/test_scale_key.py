"""The scale of an instrument in a data file: read, written again, its errors at the key."""

from __future__ import annotations

import pytest

from robocal.errors import FormatError
from robocal.files.dataset import read_dataset
from robocal.files.datawrite import data_text, table_text
from robocal.files.robot import open_robot
from robocal.measure.rows import kind_of, scale_of

DATA = """robocal: 1
kind: {kind}
file: data.csv
joints: {{columns: [a, b, c, d, e, f], unit: deg}}
{values}
{scale}
"""
POSITION = "position: {columns: [x, y, z], unit: mm, sigma: 0.1}"
PIXELS = """pixels: {columns: [x, y], sigma: 0.2}
corners: {column: corner, size: 0.06}
camera: {fx: 900, fy: 900, cx: 640, cy: 480}"""


def read(folder, kind, scale):
    rows = ["a,b,c,d,e,f,x,y,z,corner"] + [f"{i},{-i},{i},{i},{i},{i},{i},2,3,{i % 4}" for i in range(1, 9)]
    (folder / "data.csv").write_text("\n".join(rows) + "\n")
    (folder / "data.yaml").write_text(
        DATA.format(kind=kind, values=PIXELS if kind == "pixels" else POSITION, scale=scale)
    )
    return read_dataset(folder / "data.yaml", open_robot("ur10").chain).dataset.observations[0]


@pytest.mark.parametrize(
    ("kind", "scale", "sigma"),
    [
        ("pixels", "", 5e-3),
        ("position", "", 0.0),
        ("pixels", "scale: known", 0.0),
        ("pixels", "scale: {sigma: 0.2 %}", 2e-3),
        ("position", "scale: {sigma: 0.3%}", 3e-3),
        ("position", "scale: {sigma: 0.004}", 4e-3),
        ("position", "scale: {sigma: '0.004 1'}", 4e-3),
    ],
)
def test_it_is_read_as_a_share(tmp_path, kind, scale, sigma):
    assert scale_of(read(tmp_path, kind, scale)) == pytest.approx(sigma)


@pytest.mark.parametrize(
    "scale",
    [
        "{sigma: 0.3 mm}",
        "{sigma: 0}",
        "{sigma: -0.1 %}",
        "{sigma: 60 %}",
        "{sigma: true}",
        "unknown",
        "0.1 %",
        "{}",
        "[0.1]",
    ],
)
def test_what_is_no_scale_is_told_at_its_key(tmp_path, scale):
    with pytest.raises(FormatError) as raised:
        read(tmp_path, "position", f"scale: {scale}")
    words = str(raised.value)
    assert "data.yaml" in words and "scale" in words and "expected" in words


@pytest.mark.parametrize("scale", ["scale: known", "scale: {sigma: 0.2 %}", ""])
def test_it_is_written_again(tmp_path, scale):
    seen, chain = read(tmp_path, "position", scale), open_robot("ur10").chain
    data = read_dataset(tmp_path / "data.yaml", chain).dataset
    (tmp_path / "data.yaml").write_text(data_text(data, chain, "again.csv"))
    (tmp_path / "again.csv").write_text(table_text(data, chain))
    assert read_dataset(tmp_path / "data.yaml", chain).dataset.observations[0].scale == seen.scale


def test_the_size_of_a_print_is_a_number_of_its_own(tmp_path):
    obs = read(tmp_path, "pixels", "scale: {sigma: 0.3 %, free: true}")
    (size,) = [p for p in kind_of(obs).parameters(obs) if p.name == "print.size"]
    assert size.free and size.value == 1.0 and size.prior == pytest.approx(3e-3)
    assert scale_of(obs) == 0.0  # what is fitted is not counted once more
    other = read(tmp_path, "pixels", "scale: {free: true, name: board}")
    assert "board.size" in [p.name for p in kind_of(other).parameters(other)]


def test_only_a_print_has_a_size_to_find(tmp_path):
    with pytest.raises(FormatError) as error:
        read(tmp_path, "position", "scale: {sigma: 0.3 %, free: true}")
    assert error.value.key == "scale.free" and error.value.expected == "pixels"

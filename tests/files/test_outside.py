"""A data file may name a table anywhere, and no line of it comes back in messages."""

from __future__ import annotations

import pytest
from files.kind_samples import ARM, KINDS, texts

from robocal.errors import FormatError, InputError
from robocal.files.dataset import read_dataset

SECRET = "root:hunter2:0:0:sekret words,7,8:/root:/bin/zsh\nalice:swordfish:1000:1000:quux,1,2:/home/alice:/bin/zsh\n"
SECRETS = ("hunter2", "sekret", "swordfish", "alice", "quux", "zsh", "root:")
SPLIT = (
    "",
    'csv: {separator: ":"}\n',
    'csv: {separator: ":", header: false}\n',
    'csv: {separator: ";", header: false}\n',
)


@pytest.mark.parametrize(
    ("kind", "how"), [*((kind, "dots") for kind in KINDS), ("position", "absolute"), ("position", "link")]
)
def test_no_line_of_another_file_comes_back(tmp_path, kind, how):
    """Whatever a data file says of a file outside its folder: by name, by number, split in any way."""
    home = tmp_path / "theirs"
    home.mkdir()
    seen = set()
    (tmp_path / "passwd").write_text(SECRET)
    named = {"dots": "../passwd", "absolute": str(tmp_path / "passwd"), "link": "table.csv"}[how]
    if how == "link":
        (home / "table.csv").symlink_to(tmp_path / "passwd")
    described = texts(kind)[0].replace("file: table.csv", f"file: {named}").replace("table.csv", named)
    for split in SPLIT:
        for text in (described, described.replace("j1", "0").replace("x,", "1,")):
            (home / "data.yaml").write_text(text + split)
            with pytest.raises(InputError) as info:
                read_dataset(home / "data.yaml", ARM)
            error = info.value
            said = " ".join(
                map(str, (error, error.found, error.column, error.expected, error.suggestion, error.__cause__))
            )
            assert not [s for s in SECRETS if s in said] and error.file is not None, said
            seen.add(error.file == str(home / "data.yaml"))
    assert False in seen  # not the description alone was looked at


def test_a_table_in_another_folder_is_read_and_its_rows_are_named(tmp_path):
    """The honest case: it works, and an error still says where."""
    described, table = texts("position")
    (tmp_path / "raw").mkdir()
    (tmp_path / "data.yaml").write_text(described.replace("table.csv", "../raw/table.csv"))
    (tmp_path / "cell").mkdir()
    (tmp_path / "data.yaml").rename(tmp_path / "cell" / "data.yaml")
    (tmp_path / "raw" / "table.csv").write_text(table)
    assert len(read_dataset(tmp_path / "cell" / "data.yaml", ARM).dataset.configurations) == 9
    rows = table.splitlines()
    at = next(i for i, r in enumerate(rows) if r.startswith("#") is False) + 2
    rows[at] = rows[at].replace(rows[at].split(",")[1], "private")
    (tmp_path / "raw" / "table.csv").write_text("\n".join(rows))
    with pytest.raises(FormatError, match=rf"table\.csv, row {at + 1}, column j1: not a number.*lies outside") as info:
        read_dataset(tmp_path / "cell" / "data.yaml", ARM)
    assert "private" not in str(info.value)
    (tmp_path / "cell" / "table.csv").write_text("\n".join(rows))
    (tmp_path / "cell" / "data.yaml").write_text(described)
    with pytest.raises(FormatError, match="found 'private'"):
        read_dataset(tmp_path / "cell" / "data.yaml", ARM)


def test_a_neighbour_of_a_file_that_is_not_there_is_not_named(tmp_path):
    (tmp_path / "cell").mkdir()
    (tmp_path / "secrets.csv").write_text("a,b\n1,2\n")
    (tmp_path / "cell" / "data.yaml").write_text(texts("position")[0].replace("table.csv", "../secretz.csv"))
    with pytest.raises(InputError) as info:
        read_dataset(tmp_path / "cell" / "data.yaml", ARM)
    assert "secrets.csv" not in str(info.value)

"""What a process leaves that ends while it writes: the old files, the new ones, or none that anybody reads."""

from __future__ import annotations

import os

import pytest
from killing import FOREIGN, count_calls, judge, killed_at, readable

from robocal.errors import FileError
from robocal.files.text import read_text
from robocal.files.writing import JOURNAL, announce, write_files, write_text

OLD = {"a.txt": b"old a", "b.txt": b"old b", "gone.txt": b"old c"}
NEW = {"a.txt": "new a", "b.txt": "new b", "d.txt": "new d"}


def filled(folder):
    """A folder as it was, with files of others in it."""
    folder.mkdir()
    for name, content in {**OLD, **FOREIGN}.items():
        (folder / name).write_bytes(content)
    return folder


def again(folder):
    write_files(folder, NEW, remove=("gone.txt", "never.txt"))


@pytest.mark.parametrize("link", [True, False])
def test_every_moment_of_writing_several_files(tmp_path, link, monkeypatch):
    if not link:  # some file systems have none
        monkeypatch.setattr("robocal.files.writing.os.link", lambda *a: (_ for _ in ()).throw(OSError("no links")))
    new = {n: t.encode() for n, t in NEW.items()} | FOREIGN
    total = count_calls(lambda: again(filled(tmp_path / "whole")))
    found = []
    for number in range(1, total + 1):
        folder = filled(tmp_path / str(number))
        killed_at(lambda f=folder: again(f), number)
        found.append(judge(folder, OLD | FOREIGN, new))
        if found[-1] == "refused":
            with pytest.raises(FileError, match="once more"):
                read_text(folder / "a.txt")
        again(folder)
        assert readable(folder) == new, "nothing is left over"
    assert set(found) == {"old", "refused", "new"}
    assert found == sorted(found, key=["old", "refused", "new"].index)


def test_one_file_is_old_or_new(tmp_path):
    place = tmp_path / "a.txt"
    write_text(place, "old")
    states = []
    for number in range(1, count_calls(lambda: write_text(place, "new")) + 1):
        write_text(place, "old")
        killed_at(lambda: write_text(place, "new"), number)
        states.append(judge(tmp_path, {"a.txt": b"old"}, {"a.txt": b"new"}))
        write_text(place, "new")
        assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert set(states) == {"old", "new"}


def test_a_file_that_somebody_else_is_writing_is_left_alone(tmp_path):
    """The process of another command that writes here at the same time is alive: its files are its own affair."""
    (tmp_path / f".a.txt.{os.getppid()}-0123abcd.robocal").write_text("theirs")
    (tmp_path / ".a.txt.notapid-0123abcd.robocal").write_text("nobody's")
    (tmp_path / ".b.txt.999999999-0123abcd.robocal").write_text("of another name")
    write_text(tmp_path / "a.txt", "mine")
    assert len(list(tmp_path.iterdir())) == 4


def test_an_announcement_that_cannot_be_made_changes_nothing(tmp_path, monkeypatch):
    for name, content in OLD.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / JOURNAL).mkdir()
    with pytest.raises(FileError, match="cannot be written"):
        again(tmp_path)
    (tmp_path / JOURNAL).rmdir()
    assert readable(tmp_path) == OLD


def test_what_one_command_left_unfinished_another_does_not_make_readable(tmp_path):
    announce(tmp_path, ["a.txt", "b.txt"])
    for name, content in OLD.items():
        (tmp_path / name).write_bytes(content)
    write_files(tmp_path, {"b.txt": "new", "c.txt": "new"})
    assert readable(tmp_path)["a.txt"] is None and readable(tmp_path)["b.txt"] == b"new"
    write_files(tmp_path, {"a.txt": "new", "c.txt": "newer"})
    assert None not in readable(tmp_path).values() and not (tmp_path / JOURNAL).exists()


def test_a_failure_leaves_unfinished_what_was_unfinished(tmp_path, monkeypatch):
    announce(tmp_path, ["a.txt", "b.txt"])
    for name, content in OLD.items():
        (tmp_path / name).write_bytes(content)
    real = os.replace

    def failing(source, target):
        if str(target).endswith("b.txt"):
            raise OSError(30, "Read-only file system")
        real(source, target)

    monkeypatch.setattr(os, "replace", failing)
    with pytest.raises(FileError, match="read-only"):
        write_files(tmp_path, {"a.txt": "new", "b.txt": "new", "d.txt": "new"})
    found = readable(tmp_path)
    assert found["a.txt"] is None and found["b.txt"] is None and "d.txt" not in found

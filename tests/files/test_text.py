"""Files are read with one clear complaint, and written whole or not at all."""

from __future__ import annotations

import os
import signal
import stat

import pytest

from robocal.errors import FileError, FormatError
from robocal.files import text
from robocal.files.text import read_text
from robocal.files.writing import write_bytes, write_files, write_text


def test_reads_utf8_with_and_without_mark(tmp_path):
    plain, marked = tmp_path / "a", tmp_path / "b"
    plain.write_bytes("ä\r\n1".encode())
    marked.write_bytes(b"\xef\xbb\xbf" + "ä\r\n1".encode())
    assert read_text(plain).text == read_text(marked).text == "ä\r\n1"
    assert read_text(plain).sha256 != read_text(marked).sha256
    assert (read_text(plain).mark, read_text(marked).mark) == ("", "\ufeff")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ["empty"]),
        (b" \r\n\t\n", ["empty"]),
        ("a\nb: Gr\u00fc\u00df\n".encode("latin-1"), ["row 2", "byte 7", "0xfc", "Windows-1252", "UTF-8"]),
        ("a: 1".encode("utf-16"), ["UTF-16", "UTF-8"]),
        (b"\xef\xbb\xbfa\n\xff", ["row 2", "byte 5"]),
        (b"a\nb\0c", ["row 2", "byte 0"]),
        (b"x" * (text.LINE_LIMIT + 1), ["row 1", "line is too long"]),
        (b"a\n" + b"x" * (text.LINE_LIMIT + 1) + b"\nb", ["row 2", "line is too long"]),
    ],
)
def test_bad_content(tmp_path, content, words):
    place = tmp_path / "file.csv"
    place.write_bytes(content)
    with pytest.raises((FileError, FormatError)) as info:
        read_text(place)
    for word in ["file.csv", *words]:
        assert word in str(info.value)


def test_a_100_mb_line_is_not_even_read_whole(tmp_path):
    place = tmp_path / "bomb.yaml"
    with place.open("wb") as stream:
        stream.truncate(100 << 20)
    with pytest.raises(FileError, match="too big"):
        read_text(place)


def test_a_zero_byte_in_place_of_a_line_end_is_damage_that_can_be_read(tmp_path):
    place = tmp_path / "file.csv"
    place.write_bytes(b"a;b\0\n1;2\0\n")
    assert read_text(place).text == "a;b\n1;2\n"


def test_missing_folder_and_device(tmp_path):
    (tmp_path / "robot.yaml").write_text("a")
    with pytest.raises(FileError, match=r"robot\.yml: there is no such file; did you mean 'robot\.yaml'"):
        read_text(tmp_path / "robot.yml")
    with pytest.raises(FileError, match="this is a folder"):
        read_text(tmp_path)
    with pytest.raises(FileError, match="not an ordinary file"):
        read_text("/dev/zero")
    with pytest.raises(FileError):
        read_text(tmp_path / "a\0b")


def test_unreadable(tmp_path, monkeypatch):
    place = tmp_path / "a"
    place.write_text("x")

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(place), "open", refuse)
    with pytest.raises(FileError, match=r"a: cannot be read: permission denied"):
        read_text(place)


def test_writes_whole_and_makes_the_folder(tmp_path):
    place = tmp_path / "new" / "deep" / "a.txt"
    assert write_text(place, "ä\n") == place
    assert place.read_bytes() == "ä\n".encode()
    write_bytes(place, b"2")
    assert place.read_bytes() == b"2"
    assert [p.name for p in place.parent.iterdir()] == ["a.txt"]


def test_a_file_in_place_of_the_folder(tmp_path):
    (tmp_path / "out").write_text("I am a file")
    with pytest.raises(FileError, match="out"):
        write_files(tmp_path / "out", {"a": "1"})
    with pytest.raises(FileError, match="out"):
        write_files(tmp_path / "out" / "deeper", {"a": "1"})
    assert (tmp_path / "out").read_text() == "I am a file"


def test_a_folder_in_place_of_the_file(tmp_path):
    (tmp_path / "b").mkdir()
    with pytest.raises(FileError, match="b: cannot be written: there is a folder of this name"):
        write_files(tmp_path, {"a": "1", "b": "2"})
    assert [p.name for p in tmp_path.iterdir()] == ["b"]


def failing(number, error):
    """os.replace that fails at its n-th call."""
    real, calls = os.replace, []

    def replace(a, b):
        calls.append(b)
        if len(calls) == number:
            raise error
        real(a, b)

    return replace


@pytest.mark.parametrize("number", [1, 2, 3])
def test_all_or_none_when_a_rename_fails(tmp_path, monkeypatch, number):
    for name in "ab":
        (tmp_path / name).write_text(f"old {name}")
    monkeypatch.setattr(text.os, "replace", failing(number, OSError(30, "Read-only file system")))
    with pytest.raises(FileError, match="read-only file system"):
        write_files(tmp_path, {"a": "new", "b": "new"})
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a": "old a", "b": "old b"}


def test_nothing_is_left_when_the_disk_is_full(tmp_path, monkeypatch):
    def full(fd):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(text.os, "fsync", full)
    with pytest.raises(FileError, match=r"a: cannot be written: no space left on device"):
        write_files(tmp_path / "new" / "folder", {"a": "1", "b": "2"})
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_left_after_ctrl_c(tmp_path, monkeypatch):
    def interrupt(fd):
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(text.os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_files(tmp_path / "new", {"a": "1"})
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_waits_for_the_renames(tmp_path, monkeypatch):
    real = os.replace

    def replace(a, b):
        signal.raise_signal(signal.SIGINT)
        real(a, b)

    monkeypatch.setattr(text.os, "replace", replace)
    with pytest.raises(KeyboardInterrupt):
        write_files(tmp_path, {"a": "1", "b": "2"})
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_or_device_is_not_replaced_by_a_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match="not an ordinary file"):
        write_files(tmp_path, {"a": "1", "pipe": "2"})
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    assert [p.name for p in tmp_path.iterdir()] == ["pipe"]

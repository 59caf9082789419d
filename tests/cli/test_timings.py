"""`--timings` says where the time of a command went, and changes nothing else."""

from __future__ import annotations

import re

from cli.runs import files, robocal, small

PARTS = ["import", "read", "check", "fit", "prove", "write", "all"]


def seconds(text):
    return {part: float(number) for part, number in re.findall(r"(\w+) (\d+\.\d+) s", text)}


def test_the_parts_of_an_identification_make_up_the_whole(tmp_path):
    small(tmp_path)
    words = ("identify", tmp_path / "robot.yaml", tmp_path / "data.yaml")
    timed = robocal(*words, "-o", tmp_path / "one", "--timings")
    plain = robocal(*words, "-o", tmp_path / "two")
    line = next(line for line in timed.err.splitlines() if line.startswith("timings: "))
    told = seconds(line)
    assert list(told) == PARTS
    assert abs(sum(told[part] for part in PARTS[:-1]) - told["all"]) < 0.01
    assert min(told[part] for part in ("read", "check", "fit", "prove", "write")) > 0
    assert timed.status == plain.status and "timings" not in plain.err
    assert files(tmp_path / "one") == files(tmp_path / "two")


def test_json_carries_them_and_is_the_same_otherwise(tmp_path):
    small(tmp_path)
    words = ("check", tmp_path / "robot.yaml", tmp_path / "data.yaml", "--json")
    timed, plain = robocal("--timings", *words).document, robocal(*words).document
    assert list(timed.pop("timings")) == PARTS
    assert timed == plain


def test_a_command_that_fails_says_them_too(tmp_path):
    ran = robocal("check", tmp_path / "nothing.yaml", tmp_path / "data.yaml", "--timings")
    assert ran.status == 2 and "timings: import" in ran.err

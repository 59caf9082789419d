"""Every reader of files, with files damaged byte by byte, line by line, by odd numbers, types and encodings: a file is read, or it is
refused with an error that names it; no other exception, no hang, nothing written.

`test_mutations` damages texts and lets whole commands judge them; here every reader is asked by itself, and some of the commands.
"""

from __future__ import annotations

import functools
import random
from collections import Counter
from pathlib import Path

import pytest
from cli.mutations import damaged_bytes
from cli.readers import Reader, readers
from cli.runs import Ran, files
from cli.test_mutations import attempt
from cli.worlds import run
from sizes import size

from robocal.errors import InputError

COUNT = size(10_000, 2_000)
CHUNKS = 8  # the first of them is quick
RUNS = 0.06  # of them by the command that reads the files


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> list[list[Reader]]:
    return readers(tmp_path_factory.mktemp("samples"))


def read(reader: Reader, folder: Path) -> Ran:
    """What a reader makes of the files in a folder."""
    try:
        reader.read(folder)
    except InputError as error:
        return Ran(2, "", f"error: {error}\n")
    return Ran(0, "", "")


def command(reader: Reader, folder: Path) -> Ran:
    """The same by its command."""
    assert reader.command is not None
    return run(folder, [folder / "out" if word == "out" else word for word in reader.command])


@pytest.mark.slow
def test_samples_are_right(samples: list[list[Reader]], tmp_path: Path) -> None:
    for i, reader in enumerate(r for group in samples for r in group):
        folder = tmp_path / str(i)
        write(folder, reader)
        assert read(reader, folder).status == 0, reader.name
        if reader.command is not None:
            ran = command(reader, folder)
            assert ran.status in (0, 3), (reader.name, ran.said)


def write(folder: Path, reader: Reader) -> None:
    for name, data in reader.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


@pytest.mark.parametrize("chunk", [pytest.param(i, marks=[pytest.mark.slow] if i else []) for i in range(CHUNKS)])
def test_damaged_files_are_read_or_refused(
    samples: list[list[Reader]], tmp_path: Path, one_app: None, chunk: int
) -> None:
    rng, ended, placed = random.Random(f"readers {chunk}"), Counter[int](), 0
    for i in range(COUNT // CHUNKS // (1 if chunk else 5)):
        reader = rng.choice(samples[i % len(samples)])
        at = rng.choice([name for name in reader.files if name not in reader.still])
        how, data = damaged_bytes(rng, reader.files[at])
        folder = tmp_path / str(i)
        write(folder, reader)
        (folder / at).write_bytes(data)
        before = files(folder)
        about = f"readers {chunk}.{i}: {how} of {at} ({reader.name})\n{data[:3000]!r}"
        asked = reader.command is not None and rng.random() < RUNS
        ran = attempt(about, functools.partial(command if asked else read, reader, folder))
        ended[ran.status] += 1
        if ran.status == 2:
            assert files(folder) == before, about
            # A table that a damaged data file names and nobody has is named too.
            assert f"{folder}/" in ran.err, f"{ran.err}\n{about}"
            placed += any(word in ran.err for word in (", row ", ", column ", ", key "))
    assert ended[2] > 0.4 * sum(ended.values()) and ended[0] > 0.05 * sum(ended.values()), ended
    assert placed > 0.5 * ended[2], (placed, ended)

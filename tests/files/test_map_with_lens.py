"""What a map shares with the lens of its images: written, read, moved with the map, and refused by key where it is wrong."""

from __future__ import annotations

import re

import numpy as np
import pytest
from held_map_world import lens_known, room
from lens_world import LENS

from robocal._record import replace
from robocal.errors import FormatError
from robocal.files.map import map_covariance_text, map_text, read_map
from robocal.geometry import se3
from robocal.vision.map_gauge import move_map, rigid_projector, take_markers
from robocal.vision.maps import MapLens


def map_with_lens(sizes=False):
    """A room whose markers share a part of their error with three numbers of the lens."""
    bare, rng = room(2), np.random.default_rng(3)
    count = len(bare.names)
    a = rng.normal(size=(7 * count + 3, 7 * count + 3)) * np.repeat([1e-4, 1.0, 1e-3], [7 * count, 2, 1])[:, None]
    a[: 6 * count] = rigid_projector(bare) @ a[: 6 * count]
    joint = a @ a.T
    own, edges, lens = slice(0, 6 * count), slice(6 * count, 7 * count), slice(7 * count, None)
    numbers = tuple(LENS.values())
    found = tuple(v + 0.1 for v in numbers)
    shared = joint[lens, lens], joint[own, lens], joint[edges, lens] if sizes else None
    through = MapLens("brown", ("fx", "cy", "k1"), numbers, found, *shared)
    made = replace(bare, covariance=joint[own, own], lens=through)
    if sizes:
        made = replace(
            made, size_covariance=np.hstack([joint[edges, own], joint[edges, edges]]), size_errors=(2e-4, 3e-3)
        )
    return made


def write(folder, known, form="robocal"):
    (folder / "map.covariance.csv").write_text(map_covariance_text(known))
    (folder / "map.yaml").write_text(map_text(known, form, "map.covariance.csv"))
    return folder / "map.yaml"


@pytest.mark.parametrize("form", ["robocal", "json"])
@pytest.mark.parametrize("sizes", [False, True])
def test_the_lens_of_a_map_comes_back(tmp_path, form, sizes):
    given = map_with_lens(sizes)
    back = read_map(write(tmp_path, given, form)).map
    scale = np.sqrt(np.outer(np.diag(given.joint), np.diag(given.joint))) + 1e-30
    assert np.abs((back.joint - given.joint) / scale).max() < 1e-10
    assert back.lens.known == ("fx", "cy", "k1") and back.lens.before == given.lens.before
    assert back.lens.after == pytest.approx(given.lens.after, rel=1e-14)
    some = take_markers(move_map(back, se3.from_vector([1, 2, 3, 0.4, 0.5, 0.6])), back.names[1:3])
    count, more = len(back.names), [6 * len(back.names) + i for i in (1, 2)] if sizes else []
    last = len(given.joint)
    rows = [*range(6, 18), *more, *range(last - 3, last)]
    assert np.linalg.eigvalsh(some.joint) == pytest.approx(
        np.linalg.eigvalsh(given.joint[np.ix_(rows, rows)]), rel=1e-3
    )
    assert len(given.joint) == (7 if sizes else 6) * count + 3


def test_without_its_table_a_map_shares_nothing(tmp_path):
    path = write(tmp_path, map_with_lens())
    (tmp_path / "map.covariance.csv").unlink()
    assert read_map(path).map.lens is None


@pytest.mark.parametrize(
    ("old", "new", "words", "key"),
    [
        ("model: brown", "model: browm", "no such model of lenses", "lens.model"),
        (r"known: \[fx, cy, k1\]", "known: [fx, cy, q1]", "not a number of a brown lens", "lens.known[2]"),
        (r"known: \[fx, cy, k1\]", "known: [fx, cy, cy]", "a number stands twice", "lens.known[2]"),
        (r"given: \[[^,]*, ", "given: [", "a lens with other numbers", "lens.given"),
        (r"covariance: [^\n]*", "source: none", "a lens, but no covariance", "lens"),
        (r"known: \[fx, cy, k1\]", "known: [fx, cy]", "of other markers than the map", None),
    ],
)
def test_what_is_no_lens_of_a_map_is_refused_by_key(tmp_path, old, new, words, key):
    path = write(tmp_path, map_with_lens())
    text = re.sub(r"\nsource: [^\n]*", "", path.read_text())
    path.write_text(re.sub(old, new, text, count=1))
    with pytest.raises(FormatError, match=words) as error:
        read_map(path)
    assert error.value.key == key


def test_a_lens_is_that_of_the_map_by_its_numbers():
    from robocal.session.vision.map_lens import is_lens_of

    known, lens = map_with_lens().lens, lens_known()
    assert is_lens_of(known, replace(lens, known=tuple(LENS)))
    assert is_lens_of(known, replace(lens, known=tuple(LENS), numbers=known.after))
    assert not is_lens_of(known, replace(lens, known=tuple(LENS), numbers=tuple(v + 0.01 for v in lens.numbers)))
    assert not is_lens_of(known, replace(lens, known=("fx",)))  # nobody says how surely the others are known
    assert not is_lens_of(None, lens)

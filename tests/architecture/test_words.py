"""Names that an engineer understands at once: a function is an order or a noun, a class and a file are called as nothing else is,
and no image stands where the field has a word of its own. `python scripts/size.py` prints the same counts."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "size.py"
MOST_ADJECTIVES = 0.04  # of all functions; 0 to 6.6 % in well named libraries
MOST_CLASSES_TWICE = 10
MOST_SHARED_FILES = 60


@pytest.fixture(scope="module")
def size() -> ModuleType:
    """The script that counts."""
    spec = importlib.util.spec_from_file_location("size_of_the_project", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_functions_are_orders_or_nouns(size, programs):
    first, count = size.adjectives(programs)
    assert len(first) <= MOST_ADJECTIVES * count, first


def test_a_class_has_a_name_of_its_own(size, programs):
    twice = size.classes_twice(programs)
    assert len(twice) <= MOST_CLASSES_TWICE, twice


def test_a_file_has_a_name_of_its_own(size, programs):
    shared = size.shared_base_names(programs)
    assert sum(map(len, shared.values())) <= MOST_SHARED_FILES, shared


def test_no_file_is_named_by_an_image(size, programs):
    assert size.image_files(programs) == []


def test_no_public_name_is_an_image(size, programs):
    assert size.image_names(programs) == []


def test_no_help_speaks_in_images(size):
    assert size.image_helps() == []


@pytest.mark.parametrize("name", ["fitted", "_told", "measured_range", "kept_rows", "likely", "_known"])
def test_the_rule_finds(size, name):
    assert size.begins_with_adjective(name)


@pytest.mark.parametrize("name", ["fit", "feed", "apply", "seed_of", "cables_moved", "_embed", "ed", "__init__"])
def test_the_rule_lets_pass(size, name):
    assert not size.begins_with_adjective(name)


def test_images_are_words_and_not_parts_of_words(size):
    assert size.images_in("held_number") == {"held"} and size.images_in("SeenRows") == {"seen"}
    assert not size.images_in("held out, held_out_ids, foundation, threshold, stages, latest")

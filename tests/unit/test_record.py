"""Late methods of dataclasses are those that the standard library writes at once."""

from __future__ import annotations

import copy
import dataclasses
import itertools
import pickle
from dataclasses import field

import pytest

from robocal._record import dataclass

SOURCE = """
@dataclass({options})
class Base:
    a: float
    b: tuple = ()
    c: list = field(default_factory=list, compare={compare})
    d: str = field(default="none", repr=False, kw_only=True)
    e: float = field(default=0.0, init=False)
    def __post_init__(self):
        object.__setattr__(self, "e", 2 * self.a)
@dataclass({options})
class Derived(Base):
    {more}f: int = 7
    def shown(self):
        return f"{{self.a}} {{self.f}}"
"""
OPTIONS = [
    {"frozen": frozen, "eq": eq, "repr": shown, "kw_only": named}
    for frozen, eq, shown, named in itertools.product((True, False), repeat=4)
]


def made(decorator, options):
    names = {"dataclass": decorator, "field": field, "__name__": __name__}
    written = ", ".join(f"{k}={v}" for k, v in options.items())
    exec(SOURCE.format(options=written, compare=not options["eq"], more=""), names)
    return names["Derived"]


def tried(call, *given, **words):
    try:
        return call(*given, **words)
    except Exception as error:
        return type(error), str(error)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_methods_do_what_the_library_s_do(options):
    late, whole = made(dataclass, options), made(dataclasses.dataclass, options)
    for words in ({"a": 1.5}, {"a": 1, "b": (2,), "d": "x", "f": 3}, {}, {"a": 1, "e": 2}, {"a": 1, "g": 2}):
        one, other = tried(late, **words), tried(whole, **words)
        if isinstance(other, tuple):
            assert one == other
            continue
        if options["repr"]:
            assert repr(one) == repr(other)
        assert vars(one) == vars(other) and one.shown() == other.shown()
        assert vars(dataclasses.replace(one, a=4.0)) == vars(dataclasses.replace(other, a=4.0))
        assert (one == late(**words)) == (other == whole(**words))
        assert one != dataclasses.replace(one, a=5.0)
        assert (one == other) is False
        for call in (lambda x: setattr(x, "a", 3), lambda x: delattr(x, "a"), lambda x: setattr(x, "z", 3)):
            assert tried(call, copy.copy(one)) == tried(call, copy.copy(other))
        hashed, expected = tried(hash, one), tried(hash, other)
        assert isinstance(hashed, int) == isinstance(expected, int)
        if options["eq"] and isinstance(hashed, int):
            assert hashed == expected
    assert [f.name for f in dataclasses.fields(late)] == [f.name for f in dataclasses.fields(whole)]
    assert late.__match_args__ == whole.__match_args__


@dataclass(frozen=True)
class Kept:
    one: int
    two: tuple[int, ...] = ()


def test_what_was_made_can_be_kept_and_copied():
    kept = Kept(1, (2, 3))
    assert pickle.loads(pickle.dumps(kept)) == kept == copy.deepcopy(kept)
    assert {kept: 1}[Kept(1, (2, 3))] == 1
    assert dataclasses.asdict(kept) == {"one": 1, "two": (2, 3)}


def test_a_method_of_the_class_s_own_stays():
    @dataclass(frozen=True)
    class Own:
        x: int

        def __repr__(self):
            return "own"

        def __eq__(self, other):
            return True

    assert repr(Own(1)) == "own" and Own(1) == Own(2) and hash(Own(1)) == hash(Own(1))


def test_classes_of_both_kinds_inherit_from_each_other():
    @dataclasses.dataclass(frozen=True)
    class More(Kept):
        three: int = 3

    @dataclass(frozen=True)
    class Most(More):
        four: int = 4

    most = Most(1, four=5)
    assert repr(most).endswith("Most(one=1, two=(), three=3, four=5)") and hash(most) == hash(Most(1, four=5))
    assert Kept.__dataclass_params__.frozen and More(2).three == 3
    with pytest.raises(dataclasses.FrozenInstanceError):
        most.four = 6
    for decorator in (dataclass, dataclasses.dataclass):
        with pytest.raises(TypeError, match="cannot inherit non-frozen"):
            decorator(type("Free", (Kept,), {"__annotations__": {"five": int}}))


def test_a_default_that_changes_is_refused():
    with pytest.raises(ValueError, match="mutable default"):
        dataclass(type("Shared", (), {"__annotations__": {"x": list}, "x": []}))

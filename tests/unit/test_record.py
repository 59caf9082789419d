"""A record does what `dataclass(frozen=True)` makes of the same class, and whoever reads it as a dataclass finds the same."""

from __future__ import annotations

import copy
import inspect
import pickle
from dataclasses import FrozenInstanceError, asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import pytest

import robocal
from robocal._record import record


def define(decorate: Any) -> tuple[type[Any], ...]:
    @decorate
    class Part:
        first: float
        kind: ClassVar[str] = "part"
        second: list[int] = field(default_factory=list)
        third: str = field(default="c", compare=False, repr=False)
        memo: dict[str, int] = field(init=False, compare=False, repr=False, default_factory=dict)
        name: str = field(default="n", init=False)

    @decorate(kw_only=True)
    class Whole(Part):
        """With a docstring."""

        first: float = 4.0
        most: float

        def __post_init__(self) -> None:
            if self.first > self.most:
                raise ValueError(f"{self.first} is more than {self.most}")

    @decorate(eq=False)
    class Alone:
        parts: tuple[Any, ...] = ()

        def __repr__(self) -> str:
            return "own"

    @dataclass(frozen=True)
    class Heir(Part):  # not by us
        more: int = 1

    return Part, Whole, Alone, Heir


OURS, THEIRS = define(record), define(lambda cls=None, **k: dataclass(cls, frozen=True, **k))
CALLS = [((1.0,), {}), ((1.0, [2]), {"third": "x"}), ((), {"first": 1.0, "most": 2.0}), ((), {"most": 5.0, "second": [1]}), ((), {}),
         ((), {"most": 1.0}), ((1.0, [2], "x", 3, 4), {}), (([1],), {}), ((), {"memo": {}}), ((), {"parts": (1, 2)})]  # fmt: skip


def tell(act: Any) -> Any:
    """What comes of it: the value, or the error's kind and words."""
    try:
        return act()
    except Exception as fault:
        return type(fault), str(fault)


@pytest.mark.parametrize("given", range(len(CALLS)))
@pytest.mark.parametrize("which", range(4))
def test_a_record_is_made_shown_compared_and_changed_as_a_dataclass_is(which, given):
    words, named = CALLS[given]
    seen = []
    for cls in (OURS[which], THEIRS[which]):
        made = tell(lambda cls=cls: cls(*words, **named))
        if not isinstance(made, cls):
            seen.append(made)
            continue
        again = cls(*words, **named)
        assert made.__class__.__init__ is cls.__init__ and (copy.deepcopy(made) == made) == (made == again)
        seen.append((
            repr(made), asdict(made), made == again, made != again, made == replace(again, **({"first": 0.5} if which != 2 else {})),
            made == 3, tell(lambda made=made, again=again: hash(made) == hash(again)),
            tell(lambda made=made: setattr(made, "first", 2.0))[0], tell(lambda made=made: delattr(made, "first"))[0],
            tell(lambda made=made: setattr(made, "other", 2.0))[0], tell(lambda made=made: replace(made, unknown=1)),
        ))  # fmt: skip
    assert seen[0] == seen[1]


@pytest.mark.parametrize("which", range(4))
def test_a_record_tells_of_itself_what_a_dataclass_tells(which):
    def told(cls: type[Any]) -> Any:
        names = [(f.name, f.type, f.init, f.kw_only, f.compare) for f in fields(cls)]
        heads = [
            (p.name, p.kind, p.annotation, p.default is p.empty) for p in inspect.signature(cls).parameters.values()
        ]
        return (
            names,
            heads,
            cls.__match_args__,
            cls.__init__.__qualname__,
            cls.__dataclass_params__.frozen,
            cls.__hash__ is None,
        )

    assert told(OURS[which]) == told(THEIRS[which])


def test_what_is_frozen_is_a_record():
    root = Path(robocal.__file__).parent
    assert not [p.name for p in root.rglob("*.py") if "@dataclass(frozen" in p.read_text(encoding="utf-8")]


def test_what_changes_inherits_from_no_record():
    with pytest.raises(TypeError, match="non-frozen"):
        dataclass(type("Open", (OURS[0],), {}))


@record
class Kept:
    near: int
    inner: Any = None


def test_a_record_outlives_a_file_and_holds_itself():
    assert pickle.loads(pickle.dumps(Kept(1, Kept(2)))) == Kept(1, Kept(2))
    held: list[Any] = []
    round_trip = Kept(1, held)
    held.append(round_trip)
    assert repr(round_trip) == "Kept(near=1, inner=[...])"
    with pytest.raises(FrozenInstanceError, match="'near'"):
        round_trip.near = 2  # type: ignore[misc]

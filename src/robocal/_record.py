"""Frozen dataclasses that cost little to define.

For each class `dataclasses` writes and compiles six methods (0.4 ms in Python 3.11, and a command defines 300 classes). Here all
classes share five, and `__init__` is compiled when it is first looked up. `field` and `replace` are those of `dataclasses`, which
knows no difference. `cached_property` is that of `functools` as Python 3.12 has it: the lock of 3.11 takes longer than a small result.
"""

from __future__ import annotations

import functools
import reprlib
from collections.abc import Callable
from dataclasses import MISSING, FrozenInstanceError, dataclass, field, fields, is_dataclass, replace
from operator import attrgetter
from typing import Any, Generic, Self, TypeVar, dataclass_transform, overload

__all__ = ["cached_property", "field", "record", "replace"]

T = TypeVar("T")


@overload
def record(cls: type[T], /) -> type[T]: ...
@overload
def record(*, kw_only: bool = False, eq: bool = True) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def record(cls: type[Any] | None = None, /, *, kw_only: bool = False, eq: bool = True) -> Any:
    """The class as `dataclass(frozen=True)` makes it. Without `eq` two objects are never equal."""
    if cls is None:
        return functools.partial(record, kw_only=kw_only, eq=eq)
    cls.__doc__ = cls.__doc__ or cls.__name__  # else dataclasses asks for the signature, which is compiled
    # What inherits from a dataclass says itself whether it is frozen, or dataclasses refuses it.
    made: Any = dataclass(init=False, repr=False, eq=False, frozen=is_dataclass(cls), kw_only=kw_only)(cls)
    made.__dataclass_params__.frozen = True
    methods = {"__init__": _Init(made), "__repr__": _repr, "__setattr__": _refuse, "__delattr__": _refuse}
    if eq:
        made._key = staticmethod(attrgetter(*[f.name for f in fields(made) if f.compare], "__class__"))
        methods |= {"__eq__": _eq, "__hash__": _hash}
    for name, method in methods.items():
        if cls.__dict__.get(name) is None:
            setattr(cls, name, method)
    return cls


class cached_property(Generic[T]):
    """A property that is worked out once; of two threads that ask first, both may work it out."""

    def __init__(self, func: Callable[[Any], T]) -> None:
        self.func, self.name, self.__doc__ = func, func.__name__, func.__doc__

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> T: ...
    def __get__(self, instance: object, owner: type[Any] | None = None) -> Any:
        if instance is None:
            return self
        found = instance.__dict__[self.name] = self.func(instance)
        return found


class _Init:
    """`__init__` of a class, until somebody looks it up."""

    def __init__(self, cls: type[Any]) -> None:
        self.cls = cls

    def __get__(self, instance: object, owner: type[Any]) -> Any:
        ordered, named, values, defaults, makers = ["self"], ["*"], [], {}, {}
        for f in fields(self.cls):
            name = value = f.name
            if f.default_factory is not MISSING:
                makers[name], defaults[name] = f.default_factory, MISSING
                value = f"_make[{name!r}]()" + (f" if {name} is _missing else {name}" if f.init else "")
            elif f.default is not MISSING:
                defaults[name] = f.default
            if f.init:
                (named if f.kw_only else ordered).append(name)
            if f.init or name in makers:
                values.append(f"{name}={value}")
        head = ", ".join([*ordered, *(named if named[1:] else [])])
        then = "; self.__post_init__()" if hasattr(self.cls, "__post_init__") else ""
        known: dict[str, Any] = {"_make": makers, "_missing": MISSING}
        exec(f"def __init__({head}): self.__dict__.update({', '.join(values)}){then}", known)
        made: Any = known["__init__"]
        made.__qualname__ = f"{self.cls.__qualname__}.__init__"
        made.__annotations__ = {f.name: f.type for f in fields(self.cls) if f.init} | {"return": None}
        made.__defaults__ = tuple([defaults[name] for name in ordered if name in defaults])
        made.__kwdefaults__ = {name: defaults[name] for name in named if name in defaults}
        self.cls.__init__ = made
        return made.__get__(instance, owner)


@reprlib.recursive_repr()
def _repr(self: Any) -> str:
    told = ", ".join([f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if f.repr])
    return f"{type(self).__qualname__}({told})"


def _eq(self: Any, other: Any) -> Any:
    return self._key(self) == self._key(other) if type(other) is type(self) else NotImplemented


def _hash(self: Any) -> int:
    return hash(self._key(self))


def _refuse(self: Any, name: str, value: object = None) -> None:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")

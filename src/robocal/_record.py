"""`dataclass` of the standard library, whose methods are written when somebody calls them.

The standard library writes and compiles six methods of every class while its module is imported, 0.6 ms each time: a fifth of all
that a command imports. Most classes of a command are never made, compared or shown. Types, fields, `replace` and the rest are the
library's own, and so is what the methods do.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True, repr=True, kw_only=False):
        """As `dataclasses.dataclass`, for the four of its options that are used here."""
        if cls is None:
            return lambda given: dataclass(given, frozen=frozen, eq=eq, repr=repr, kw_only=kw_only)
        undocumented = cls.__doc__ is None
        if undocumented:
            cls.__doc__ = cls.__name__  # else the library looks for a signature to say
        parents = [b.__dataclass_params__ for b in cls.__mro__[1:] if "__dataclass_params__" in b.__dict__]
        alike = [p for p in parents if p.frozen == frozen]  # the library refuses the others
        try:
            for p in alike:
                p.frozen = False  # so that it does not write what freezes
            dataclasses.dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
        finally:
            for p in alike:
                p.frozen = frozen
        own = cls.__dataclass_params__
        own.init, own.repr, own.eq, own.frozen = True, repr, eq, frozen
        if undocumented:
            cls.__doc__ = None
        wanted = {"__init__": True, "__repr__": repr, "__eq__": eq, "__hash__": eq and frozen}
        late = [name for name, is_wanted in wanted.items() if is_wanted and cls.__dict__.get(name) is None]
        if eq and not frozen and "__hash__" not in cls.__dict__:
            cls.__hash__ = None
        for name in late:
            setattr(cls, name, _late(cls, name, frozen))
        if frozen:
            cls.__setattr__, cls.__delattr__ = _refuse, _keep
        return cls


def _late(cls: type, name: str, frozen: bool) -> Any:
    """A method that has itself written at its first call."""

    def method(self: Any, *args: Any, **words: Any) -> Any:
        own = _write_init(cls, frozen) if name == "__init__" else _written(cls, name)
        setattr(cls, name, own)
        return own(self, *args, **words)

    method.__name__, method.__qualname__ = name, f"{cls.__qualname__}.{name}"
    return method


def _written(cls: Any, name: str) -> Any:
    """The library's own method for the fields of a class."""
    same = [
        (f.name, object, dataclasses.field(repr=f.repr, hash=f.hash, compare=f.compare))
        for f in dataclasses.fields(cls)
    ]
    return getattr(dataclasses.make_dataclass(cls.__name__, same, frozen=True), name)


def _write_init(cls: Any, frozen: bool) -> Any:
    """What the library writes for `__init__`."""
    given: dict[str, Any] = {"_set": object.__setattr__, "_none": dataclasses.MISSING}
    first, named, lines = ["self"], list[str](), list[str]()
    for f in dataclasses.fields(cls):
        value = f.name
        if f.default_factory is not dataclasses.MISSING:
            given[f"_{f.name}"] = f.default_factory
            value = f"_{f.name}() if {f.name} is _none else {f.name}" if f.init else f"_{f.name}()"
            default = "=_none"
        elif f.default is not dataclasses.MISSING:
            given[f"_{f.name}"] = f.default
            default = f"=_{f.name}"
            value = f.name if f.init else f"_{f.name}"
        else:
            default = ""
            if not f.init:
                continue
        if f.init:
            (named if f.kw_only else first).append(f.name + default)
        lines.append(f" _set(self, {f.name!r}, {value})" if frozen else f" self.{f.name} = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append(" self.__post_init__()")
    head = ", ".join([*first, *(["*", *named] if named else [])])
    exec(f"def __init__({head}):\n" + "\n".join(lines or [" pass"]), given)
    made = given["__init__"]
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    return made


def _refuse(self: Any, name: str, value: object) -> None:
    """The `__setattr__` of what is frozen."""
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _keep(self: Any, name: str) -> None:
    """Its `__delattr__`."""
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")

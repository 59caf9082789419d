"""What a language says of a code."""

from __future__ import annotations

from dataclasses import field

from robocal._record import dataclass

__all__ = ["Phrase"]


@dataclass
class Phrase:
    """A sentence without its full stop, and what to do about it ("" where nothing is to be done).

    As an attribute of a class it reads as its code, which follows from its name: ONE_PLACE is "one-place".
    """

    sentence: str
    advice: str = ""
    code: str = field(default="", init=False, compare=False)

    def __set_name__(self, owner: type, name: str) -> None:
        self.code = name.lower().replace("_", "-")

    def __get__(self, instance: object, owner: type) -> str:
        return self.code

"""Arguments of a call: a name that no function has, one that is missing, and an error of a file that an argument stands for."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from robocal.errors import InputError, ModelError, nearest
from robocal.files.scratch import is_scratch
from robocal.front.spelling import python_error

__all__ = ["locate_argument", "named_arguments", "refuse_unknown"]

P = ParamSpec("P")
R = TypeVar("R")


def refuse_unknown(names: Sequence[str], known: Sequence[str]) -> None:
    """Raises ModelError for a name that is none of the arguments, with the nearest."""
    for name in names:
        if name not in known:
            near = nearest(name, known)
            raise ModelError("unknown argument", argument=name, expected=", ".join(known), suggestion=near)


def named_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, whose errors name arguments of Python: those of robocal's options too, and unknown names."""
    signature = inspect.signature(function)
    known = [name for name in signature.parameters if name != "self"]
    flexible = any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values())

    @wraps(function)
    def call(*words: P.args, **options: P.kwargs) -> R:
        if not flexible:
            refuse_unknown(list(options), known)
        try:
            return function(*words, **options)
        except InputError as error:
            python_error(locate_argument(error, options))
            raise

    return call


def locate_argument(error: InputError, given: Mapping[str, Any]) -> InputError:
    """The same error at the argument that holds what was wrong, where that is no file of the caller's.

    `given` are values by argument: what one of them holds is in a file that only this program has, or is the word that was found."""
    kept = error.file is not None and is_scratch(error.file)
    if error.argument is None:
        owners = (name for name, value in given.items() if _owns(value, error, kept))
        error.argument = next(owners, None)
    if kept:
        error.file = error.row = None
    if error.key == error.argument:
        error.key = None
    error.args = (str(error),)
    return error


def _owns(value: Any, error: InputError, kept: bool) -> bool:
    words = {str(value)} if not isinstance(value, tuple | list) else {str(v) for v in value}
    if kept:
        return error.file in words
    if error.column is not None and str(error.column) in words:
        return True  # --group-by names a column
    return error.file is None and error.key is None and isinstance(error.found, str) and error.found in words

"""Checking what a YAML file says against a model, with one message a person can act on.

pydantic finds the fault; the words are ours: key path, line, what was found, what was expected, the nearest known key.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    FiniteFloat,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from robocal.errors import nearest, one_of
from robocal.files.parts import SCHEMA
from robocal.files.text import forbidden_character
from robocal.files.yamlio import Path_, YamlDocument, read_json
from robocal.parameters import FRAME_SYMBOLS
from robocal.quantities import LARGEST

__all__ = [
    "Columns",
    "FileModel",
    "FrameModel",
    "Free",
    "Name",
    "Triple",
    "UnitsModel",
    "Version",
    "adapter",
    "read_document",
    "refuse",
    "validate",
]

T = TypeVar("T")
_ADAPTERS: dict[type[Any], TypeAdapter[Any]] = {}


def refuse(message: str, *, found: object = None, expected: object = None, suggestion: str | None = None) -> NoReturn:
    """Raised inside a validator: becomes a FormatError at the key that is being checked."""
    facts = {"message": message, "found": found, "expected": expected, "suggestion": suggestion}
    raise PydanticCustomError("robocal", "{message}", facts)


class FileModel(BaseModel):
    """A mapping of a file: unknown keys are refused and named, numbers are not made from texts."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _check_keys(cls, data: Any) -> Any:
        known = [f.alias or name for name, f in cls.model_fields.items()]
        for key in data if isinstance(data, dict) else ():
            if key not in known:
                raise PydanticCustomError("unknown_key", "unknown key", {"key": key, **one_of(key, known)})
        return data


WORDS = {
    "string_type": "a text",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "a mapping",
    "dataclass_type": "a mapping of keys",
    "model_type": "a mapping of keys",
    "model_attributes_type": "a mapping of keys",
    "finite_number": "a finite number",
}


def adapter(kind: type[T]) -> TypeAdapter[T]:
    """What reads a model, or a plain dataclass, and tells its schema."""
    if kind not in _ADAPTERS:
        _ADAPTERS[kind] = TypeAdapter(kind)
    return _ADAPTERS[kind]


def validate(kind: type[T], document: YamlDocument, data: Any = None, at: Path_ = ()) -> T:
    """The model or dataclass of a document, or of its part `data` at a key path. Raises FormatError for the first fault."""
    try:
        return adapter(kind).validate_python(document.data if data is None else data)
    except ValidationError as error:
        _explain(_likeliest(error.errors(include_url=False)), document, at)


def read_document(path: Path, kind: type[T]) -> T:
    """A document of robocal, as the verb that wrote it had it. Raises FileError, or FormatError naming line or key."""
    document = read_json(path, "this is not a document of robocal", "an object with the key robocal")
    version = document.data.get("robocal")
    document.insist(
        version == SCHEMA, "this document has another schema", ("robocal",), found=version, expected=str(SCHEMA)
    )
    return validate(kind, document)


UNION = re.compile(r"[A-Z]\w*Model$|literal\[")  # what pydantic puts into a place where a value may be of several kinds


def _place(fault: ErrorDetails) -> Path_:
    return tuple(p for p in fault["loc"] if not (isinstance(p, str) and UNION.match(p)))


def _likeliest(faults: list[ErrorDetails]) -> ErrorDetails:
    """The first fault; where a word was written for a value that is a mapping or one of some words, what is said of the words."""
    first = faults[0]
    if isinstance(first.get("input"), str):
        of_words = (f for f in faults if f["type"] == "literal_error" and _place(f) == _place(first))
        return next(of_words, first)
    return first


def _explain(fault: ErrorDetails, document: YamlDocument, at: Path_) -> NoReturn:
    path = (*at, *_place(fault))
    context, kind, found = fault.get("ctx", {}), fault["type"], fault.get("input")
    if isinstance(context.get("error"), ValidationError):
        _explain(_likeliest(context["error"].errors(include_url=False)), document, path)
    if kind == "missing":
        document.fail("a key is missing", path)
    facts = {word: context.get(word) for word in ("expected", "suggestion")}
    if kind == "unknown_key":
        document.fail("unknown key", (*path, context["key"]), **facts)
    if kind == "unexpected_keyword_argument":
        document.fail("unknown key", path)
    if kind == "robocal":
        document.fail(context["message"], path, found=found if context["found"] is None else context["found"], **facts)
    if found is None:
        document.fail("the value is empty", path, expected=WORDS.get(kind))
    if kind == "literal_error":
        options = str(context["expected"])
        words = [w.strip(" '\"") for part in options.split(",") for w in part.split(" or ")]
        suggestion = nearest(found, words) if isinstance(found, str) else None
        document.fail("unknown value", path, found=found, expected=options.replace("'", ""), suggestion=suggestion)
    if kind in WORDS:
        document.fail(f"not {WORDS[kind]}", path, found=found, expected=WORDS[kind])
    document.fail(fault["msg"].lower(), path, found=found)


def _version(value: Any) -> Any:
    if value != 1 or isinstance(value, bool):
        refuse("this file has another schema", expected="robocal: 1")
    return value


# The number in `robocal: 1`, which says how to read the file.
Version = Annotated[Any, BeforeValidator(_version)]


def _name(value: str) -> str:
    if not value.strip() or any(c in value for c in ".,;:\"'") or value != value.strip() or forbidden_character(value):
        refuse("not a usable name", found=value, expected="a word without dots, commas, quotes or outer spaces")
    return value


Name = Annotated[str, AfterValidator(_name)]


def _three(value: list[float]) -> list[float]:
    if len(value) != 3:
        refuse(f"{len(value)} numbers instead of 3", found=value, expected="a list of 3 numbers")
    return value


Triple = Annotated[list[FiniteFloat], AfterValidator(_three)]


def _columns(value: Any) -> Any:
    parts = value if isinstance(value, list) else [value]
    if not parts or any(isinstance(p, bool) or not isinstance(p, str | int) or p in ("",) for p in parts):
        refuse("not columns", found=value, expected="column names, or zero-based column numbers")
    return parts


Columns = Annotated[Any, BeforeValidator(_columns)]


def _free(value: Any) -> Any:
    """true, false, or some of x y z rx ry rz."""
    if isinstance(value, bool) or value is None:
        return value
    parts: Sequence[Any] = value if isinstance(value, list) else [value]
    for part in parts:
        if part not in FRAME_SYMBOLS:
            expected = f"true, false, or a list of {', '.join(FRAME_SYMBOLS)}"
            refuse("not a part of a frame", found=part, expected=expected, suggestion=nearest(str(part), FRAME_SYMBOLS))
    return list(parts)


Free = Annotated[Any, BeforeValidator(_free)]


class UnitsModel(FileModel):
    """units: {length, angle}."""

    length: str
    angle: str


class FrameModel(FileModel):
    """A frame: xyz with a rotation vector or roll-pitch-yaw, and what of it is free."""

    xyz: Triple | None = None
    rotation_vector: Triple | None = None
    rpy: Triple | None = None
    free: Free = None

    @model_validator(mode="after")
    def _one_rotation(self) -> FrameModel:
        if self.rotation_vector is not None and self.rpy is not None:
            refuse("a rotation is given twice", found="rotation_vector and rpy", expected="one of them")
        largest = max((abs(v) for part in (self.xyz, self.rotation_vector, self.rpy) for v in part or ()), default=0.0)
        if largest >= LARGEST:
            refuse("no frame has so large a number", found=largest, expected=f"below {LARGEST:g}")
        return self

    @property
    def given(self) -> bool:
        """Whether any value is stated."""
        return any(v is not None for v in (self.xyz, self.rotation_vector, self.rpy))

    @property
    def has_details(self) -> bool:
        """Whether more is stated than a name."""
        return bool(self.model_fields_set - {"name"})

    def free_flags(self, default: bool) -> tuple[bool, ...]:
        """Six flags."""
        chosen = default if self.free is None else self.free
        return (chosen,) * 6 if isinstance(chosen, bool) else tuple(s in chosen for s in FRAME_SYMBOLS)

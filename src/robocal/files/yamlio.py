"""YAML, read as data only and written back byte for byte but for the values that change.

Tags, anchors, aliases, directives and several documents are refused: a robot needs none of them, and they are how a
small file becomes a big one or runs code. Every value remembers its line.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

from robocal._record import record
from robocal._version import __version__
from robocal.errors import FormatError, one_of
from robocal.files.text import FORBIDDEN, MEGABYTE, Source, forbidden_character, line_of, read_text
from robocal.files.units import Unit, number, parse_unit

__all__ = [
    "YamlDocument",
    "add_stamp",
    "edit",
    "flow",
    "load",
    "mapping_text",
    "parse",
    "path_text",
    "quote",
    "read_json",
]

SIZE_LIMIT = MEGABYTE
DEPTH_LIMIT = 30
NODE_LIMIT = 40_000  # events of the parser: three seconds
# What the parser answers to some malformed files, beside errors of its own making.
MALFORMED = (ValueError, TypeError, AttributeError, LookupError, AssertionError, NotImplementedError)

CALIBRATED = "# Calibrated by robocal"

Path_ = tuple[str | int, ...]
_TAG = "tag:yaml.org,2002:"


@record
class YamlDocument:
    """A YAML file: `data` as plain mappings, lists, numbers and texts, and the line of every key path."""

    path: Path
    text: str
    sha256: str
    data: dict[str, Any]
    lines: Mapping[Path_, int] = field(default_factory=dict)

    def row(self, path: Path_) -> int | None:
        """The line of a key path, or of the nearest path above it."""
        for n in range(len(path), -1, -1):
            if path[:n] in self.lines:
                return self.lines[path[:n]]
        return None

    def fail(self, message: str, path: Path_ = (), **facts: Any) -> NoReturn:
        """Raises FormatError at a key path of this file."""
        raise FormatError(message, file=self.path, row=self.row(path), key=path_text(path) or None, **facts)

    def insist(self, good: object, message: str, path: Path_ = (), **facts: Any) -> None:
        """Raises FormatError at a key path of this file where what has to be so is not."""
        if not good:
            self.fail(message, path, **facts)

    def insist_known(self, word: object, known: Collection[str], message: str, path: Path_) -> None:
        """Raises FormatError at a key path for a word that is none of the known ones, with the nearest of them."""
        if word not in known:
            self.fail(message, path, found=word, **one_of(word, known))

    def unit(self, name: object, si: str | None, path: Path_, key: str = "") -> Unit:
        """The unit that is stated at a key path. Raises FormatError."""
        return parse_unit(name, si, file=self.path, row=self.row(path), key=key or path_text(path))


def path_text(path: Path_) -> str:
    """A key path as people read it: joints[1].theta (counted from 0)."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else str(part))
    return text


def load(path: str | os.PathLike[str]) -> YamlDocument:
    """Reads a YAML file whose content is a mapping. Raises FileError or FormatError."""
    return parse(read_text(path, limit=SIZE_LIMIT))


def parse(source: Source) -> YamlDocument:
    """The same from text that was read already."""
    root = _compose(source.text, source.path)
    lines: dict[Path_, int] = {}
    data = _build(root, (), lines, source.path)
    if not isinstance(data, dict):
        found = "a list" if isinstance(data, list) else "a text" if isinstance(data, str) else "a single value"
        expected = "lines such as `name: value`"
        raise FormatError("the file is not a mapping", file=source.path, found=found, expected=expected)
    return YamlDocument(source.path, source.text, source.sha256, data, lines)


def read_json(path: str | os.PathLike[str], otherwise: str, expected: str) -> YamlDocument:
    """A JSON file and its object. Raises FileError, or FormatError naming the line; `otherwise` is said of what is no object."""
    source = read_text(path)
    try:
        data = json.loads(source.text)
    except json.JSONDecodeError as error:
        raise FormatError(f"not valid JSON: {error.msg}", file=source.path, row=error.lineno) from None
    except (RecursionError, ValueError):
        raise FormatError("not valid JSON", file=source.path) from None
    if not isinstance(data, dict):
        raise FormatError(otherwise, file=source.path, found=type(data).__name__, expected=expected)
    return YamlDocument(source.path, source.text, source.sha256, data)


def add_stamp(text: str, origin: str, count: int) -> str:
    """The text of a calibrated robot below a line that says what it is, in place of an older one."""
    if text.startswith(CALIBRATED):
        text = text.partition("\n")[2]
    newline = "\r\n" if "\r\n" in text else "\n"
    return f"{CALIBRATED} {__version__} from {origin}: {count} numbers changed{newline}{text}"


def edit(text: str, changes: Mapping[Path_, float | str], path: object = None) -> str:
    """The text with other numbers at some key paths; a key that is missing is added to its mapping. All other bytes
    survive.

    A key path that needs a mapping or list that is not there raises FormatError.
    """
    root = _compose(text, path)
    splices: list[tuple[int, int, str]] = []
    added: dict[int, tuple[Any, list[tuple[str, str]]]] = {}
    for where, value in changes.items():
        key, node, rest = _find(root, where)
        shown = value if isinstance(value, str) else number(value)
        if not rest and key is not None and node.id == "scalar" and node.start_mark.index == node.end_mark.index:
            # `key:` with nothing behind it: the empty value's own mark lies at the next word, wherever that is.
            at = text.index(":", key.end_mark.index) + 1
            splices.append((at, at, " " + shown))
        elif not rest and (node.id == "scalar" or node.flow_style):
            splices.append((node.start_mark.index, node.end_mark.index, shown))
        elif len(rest) == 1 and node.id == "mapping" and isinstance(rest[0], str):
            added.setdefault(id(node), (node, []))[1].append((rest[0], shown))
        else:
            raise FormatError("no value can be written here", file=path, key=path_text(where))
    splices += [_insertion(text, node, pairs) for node, pairs in added.values()]
    # From the back, and at one place the later change first, so that all positions stay true and all orders are kept.
    for _, (start, end, new) in sorted(enumerate(splices), key=lambda s: (s[1][0], s[0]), reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _insertion(text: str, node: Any, pairs: list[tuple[str, str]]) -> tuple[int, int, str]:
    """Where and how to add keys to a mapping, in the style in which it is written."""
    if node.flow_style:
        words = ", ".join(f"{k}: {v}" for k, v in pairs)
        if not node.value:
            return node.start_mark.index + 1, node.start_mark.index + 1, words
        at = node.value[-1][1].end_mark.index
        return at, at, ", " + words
    column = node.value[0][0].start_mark.column
    newline = "\r\n" if "\r\n" in text else "\n"
    block = [f"{k}: {v}" for k, v in pairs]
    for name, value in reversed(node.value):
        one_piece = value.flow_style if value.id != "scalar" else value.style not in ("|", ">")
        if one_piece:
            empty = value.start_mark.index == value.end_mark.index
            at = text.find("\n", (name if empty else value).end_mark.index)
            end = len(text) if at < 0 else at
            end -= end > 0 and text[end - 1] == "\r"
            return end, end, "".join(newline + " " * column + line for line in block)
    at = node.value[0][0].start_mark.index
    return at, at, "".join(line + newline + " " * column for line in block)


def _find(node: Any, path: Path_) -> tuple[Any, Any, Path_]:
    """The deepest node on a key path with its key, and what of the path is not there."""
    key = None
    for i, part in enumerate(path):
        child = None
        if node.id == "mapping":
            key, child = next(((k, v) for k, v in node.value if k.value == str(part)), (None, None))
        elif node.id == "sequence" and isinstance(part, int) and part < len(node.value):
            key, child = None, node.value[part]
        if child is None:
            return None, node, path[i:]
        node = child
    return key, node, ()


@lru_cache(maxsize=8)  # a robot file is looked at, read, and written back with other numbers
def _compose(text: str, path: object) -> Any:
    """The node tree after the events were found harmless, which nobody changes. Raises FormatError for whatever is not
    YAML."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError
    from ruamel.yaml.parser import Parser
    from ruamel.yaml.reader import ReaderError

    inspect = _Inspector(path)

    class Inspected(Parser):
        """What harms is refused when it is met: the text is gone through once."""

        def get_event(self) -> Any:
            return inspect(super().get_event())

    yaml = YAML(typ="safe", pure=True)
    yaml.Parser = Inspected
    try:
        root = yaml.compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = error.problem or error.context or "malformed"
        row = None if mark is None else mark.line + 1
        raise FormatError(f"not valid YAML: {problem}", file=path, row=row) from None
    except ReaderError as error:
        row = line_of(text, error.position) if isinstance(error.position, int) else None
        message = "a control character that YAML does not allow"
        raise FormatError(message, file=path, row=row, found=str(error.character)) from None
    except (YAMLError, *MALFORMED) as error:
        first = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise FormatError(f"not valid YAML: {first}", file=path) from None
    if root is None:
        raise FormatError("the file is empty", file=path)
    return root


@dataclass
class _Inspector:
    """Passes the events of a file on, and raises FormatError at the first that a robot does not need."""

    path: object
    depth: int = 0
    documents: int = 0
    count: int = 0

    def __call__(self, event: Any) -> Any:
        name = type(event).__name__
        self.count += 1
        self.depth += name.endswith("StartEvent") - name.endswith("EndEvent")
        if name == "AliasEvent" or getattr(event, "anchor", None) is not None:
            self._refuse(event, "anchors and aliases (& and *) are not accepted", expected="plain values")
        if getattr(event, "tag", None) is not None and name != "DocumentStartEvent":
            self._refuse(event, "tags (!) are not accepted", found=str(event.tag), expected="plain values")
        if name == "DocumentStartEvent":
            self.documents += 1
            if self.documents > 1:
                self._refuse(event, "a second document (---) is not accepted")
            if event.version not in (None, (1, 2)) or event.tags:
                self._refuse(event, "directives (%) are not accepted")
        if self.depth > DEPTH_LIMIT:
            self._refuse(event, "too deeply nested", expected=f"at most {DEPTH_LIMIT} levels")
        if self.count > NODE_LIMIT:
            self._refuse(event, "too many keys and values", expected=f"at most {NODE_LIMIT}; tables belong into a CSV")
        return event

    def _refuse(self, event: Any, message: str, **facts: Any) -> NoReturn:
        raise FormatError(message, file=self.path, row=event.start_mark.line + 1, **facts)


def _build(node: Any, path: Path_, lines: dict[Path_, int], file: object) -> Any:
    """Plain data of a node; notes the line of every path."""
    lines.setdefault(path, node.start_mark.line + 1)
    if node.id == "scalar":
        return _scalar(node, path, file)
    if node.id == "sequence":
        return [_build(child, (*path, i), lines, file) for i, child in enumerate(node.value)]
    out: dict[str, Any] = {}
    for key, value in node.value:
        row = key.start_mark.line + 1
        if key.id != "scalar" or key.tag == _TAG + "merge":
            raise FormatError("a key must be a plain word", file=file, row=row, key=path_text(path) or None)
        _refuse_strange(key, (*path, key.value), file)
        if key.value in out:
            raise FormatError("this key is given twice", file=file, row=row, key=path_text((*path, key.value)))
        lines[(*path, key.value)] = row
        out[key.value] = _build(value, (*path, key.value), lines, file)
    return out


def _scalar(node: Any, path: Path_, file: object) -> Any:
    text, tag = node.value, node.tag.removeprefix(_TAG)
    try:
        if tag == "int":
            plain = text.replace("_", "")
            if len(plain) > 300:
                raise ValueError
            return int(plain, 0) if plain.lstrip("+-")[:2].lower() in ("0x", "0o") else int(plain)
        if tag == "float":
            plain = text.replace("_", "").lower()
            return math.nan if plain == ".nan" else float(plain.replace(".inf", "inf"))
        if tag == "bool":
            return text.lower() == "true"
    except ValueError:
        row = node.start_mark.line + 1
        raise FormatError("not a number", file=file, row=row, key=path_text(path), found=text) from None
    _refuse_strange(node, path, file, lines=path[-1:] == ("source",))
    return None if tag == "null" else text


def _refuse_strange(node: Any, path: Path_, file: object, *, lines: bool = False) -> None:
    if forbidden_character(node.value, lines=lines):
        row, key = node.start_mark.line + 1, path_text(path)
        raise FormatError(FORBIDDEN, file=file, row=row, key=key, found=node.value, expected="one line of text")


def quote(text: str) -> str:
    """A text as a YAML scalar: plain when it is one harmless word or phrase, else in double quotes."""
    plain = text.strip() == text and text and all(c.isalnum() or c in " _-./" for c in text) and text[0].isalpha()
    if plain and text.lower() not in ("true", "false", "null", "yes", "no", "on", "off"):
        return text
    return json.dumps(text, ensure_ascii=False)


def flow(value: Any) -> str:
    """A value as YAML in one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    return quote(value) if isinstance(value, str) else str(value)


def mapping_text(data: Mapping[str, Any]) -> str:
    """A mapping as the text of a file: a line for each key, and for each entry of its lists of mappings and its mappings of lists.

    Arrays and numpy's numbers count as Python's. Raises TypeError for anything that YAML has no word for.
    """
    lines = []
    for key, value in _plain(data).items():
        if isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            lines += [f"{_key(key)}:", *(f"  - {_flow(v)}" for v in value)]
        elif isinstance(value, dict) and value and any(isinstance(v, list | dict) for v in value.values()):
            lines += [f"{_key(key)}:", *(f"  {_key(k)}: {_flow(v)}" for k, v in value.items())]
        else:
            lines.append(f"{_key(key)}: {_flow(value)}")
    return "\n".join(lines) + "\n"


def _key(key: str) -> str:
    return (
        key
        if key.replace("_", "").replace(".", "").isalnum() and key[0].isalpha()
        else json.dumps(key, ensure_ascii=False)
    )


def _flow(value: Any) -> str:
    """As `flow`, with the words that YAML has for nothing, for a flag and for what is no finite number."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    return quote(value) if isinstance(value, str) else repr(value)


def _plain(value: Any) -> Any:
    """Mappings, lists, texts and numbers of Python. Raises TypeError for anything else."""
    if hasattr(value, "tolist") and not isinstance(value, Mapping):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(type(value).__name__)

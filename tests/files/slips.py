"""Slips of the pen in files: every key and column misspelt, doubled and left out, one at a time."""

from __future__ import annotations

import copy
import dataclasses
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from robocal.errors import InputError
from robocal.files.text import Source, read_text
from robocal.files.yamlio import YamlDocument, parse

Path_ = tuple[str | int, ...]
TWICE = "\x00again"
Read = Callable[[str], tuple[Any, tuple[object, ...]]]


def every_key(data: Any, at: Path_ = ()) -> Iterator[Path_]:
    """The path of every key of a document."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        if isinstance(data, dict):
            yield (*at, key)
        yield from every_key(value, (*at, key))


def misspelt(word: str) -> str:
    """A word with its last letter twice."""
    return word + word[-1]


def yaml_slips(data: Any, deep: int = 9) -> Iterator[tuple[str, Path_, str]]:
    """What was done to which key, and the text of the file."""
    for path in every_key(data):
        if len(path) > deep:
            continue
        for what in ("misspelt", "doubled", "deleted"):
            made = copy.deepcopy(data)
            owner = made
            for part in path[:-1]:
                owner = owner[part]
            key = path[-1]
            if what == "misspelt":
                renamed = {(misspelt(k) if k == key else k): v for k, v in owner.items()}
                owner.clear()
                owner.update(renamed)
            elif what == "doubled":
                owner[f"{key}{TWICE}"] = owner[key]
            else:
                del owner[key]
            yield what, path, yaml_text(made)


def yaml_text(data: Any) -> str:
    """A document as YAML in braces, with infinity as YAML writes it."""
    text = json.dumps(data).replace(json.dumps(TWICE)[1:-1], "")
    return text.replace("-Infinity", "-.inf").replace("Infinity", ".inf")


def quick(given: Source) -> YamlDocument:
    """A document in braces without the whole of YAML, which takes its time; a key that is given twice is left to it."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len({k for k, _ in pairs}) < len(pairs):
            raise ValueError
        return dict(pairs)

    try:
        data = json.loads(given.text, object_pairs_hook=once)
    except ValueError:
        return parse(given)
    return YamlDocument(given.path, given.text, given.sha256, data)


def header_slips(table: str) -> Iterator[tuple[str, Path_, str]]:
    """The same of the headers of a CSV: a column misspelt, called like the one before, without a name, or gone."""
    head, *rows = table.splitlines()
    names = head.split(",")
    for i, name in enumerate(names):
        plain, bracket, unit = name.partition(" [")
        others = {
            "misspelt": misspelt(plain) + bracket + unit,
            "doubled": names[i - 1] if i else names[1],
            "unnamed": "",
        }
        for what, new in others.items():
            yield what, (plain,), "\n".join([",".join([*names[:i], new, *names[i + 1 :]]), *rows]) + "\n"
        cells = [",".join(c for k, c in enumerate(line.split(",")) if k != i) for line in (head, *rows)]
        yield "deleted", (plain,), "\n".join(cells) + "\n"


def xml_slips(text: str) -> Iterator[tuple[str, Path_, str]]:
    """The same of elements and attributes, by their path of tags."""
    count = sum(1 for _ in ElementTree.fromstring(text).iter())
    for n in range(count):
        for what in ("misspelt", "doubled", "deleted"):
            root = ElementTree.fromstring(text)
            above = {child: parent for parent in root.iter() for child in parent}
            node = list(root.iter())[n]
            path: tuple[str, ...] = (node.tag,)
            up = node
            while up in above:
                up = above[up]
                path = (up.tag, *path)
            if what == "misspelt":
                node.tag = misspelt(node.tag)
            elif node not in above:
                continue
            elif what == "doubled":
                owner = above[node]
                owner.insert(list(owner).index(node), copy.deepcopy(node))
            else:
                above[node].remove(node)
            yield what, path, ElementTree.tostring(root, encoding="unicode")
        for what in ("misspelt", "deleted"):
            for name in list(ElementTree.fromstring(text).iter())[n].attrib:
                root = ElementTree.fromstring(text)
                node = list(root.iter())[n]
                value = node.attrib.pop(name)
                if what == "misspelt":
                    node.attrib[misspelt(name)] = value
                yield what, (*path, f"@{name}"), ElementTree.tostring(root, encoding="unicode")


def quicker(monkeypatch: Any) -> None:
    """All readers take documents by `quick`."""
    for module in ("robot", "cable.cable_robot"):
        monkeypatch.setattr(f"robocal.files.{module}.parse", quick)
    for module in ("dataset", "pose_table"):
        monkeypatch.setattr(f"robocal.files.{module}.load", lambda path: quick(read_text(path)))


def source(text: str) -> Source:
    """A text as a file."""
    return Source(Path("file.yaml"), text, "0")


def plain(value: Any) -> Any:
    """Whatever was read, as something that compares; where it was read from does not count."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes() if value.dtype != object else tuple(map(plain, value))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return tuple(
            plain(getattr(value, f.name)) for f in dataclasses.fields(value) if f.name not in ("meta", "source", "rows")
        )
    if isinstance(value, dict):
        return tuple((k, plain(v)) for k, v in value.items())
    return tuple(map(plain, value)) if isinstance(value, list | tuple) else value


def silent(read: Read, text: str, slips: Iterator[tuple[str, Path_, str]], may: Callable[[Path_], bool]) -> list[str]:
    """The slips of which nobody said anything though the result is another; `may` says which keys may be left out."""
    before, said = read(text)
    found = []
    for what, path, slip in slips:
        try:
            after, now = read(slip)
        except InputError:
            continue
        if set(now) - set(said) or plain(after) == plain(before) or (what == "deleted" and may(path)):
            continue
        found.append(f"{what} {'.'.join(map(str, path))}")
    return found

"""Types of the Python front door, from the options and results of the verbs: writes src/robocal/__init__.pyi and those of front/.

python scripts/front_stub.py            say whether they are as the verbs say; exit status 1 where they are not
python scripts/front_stub.py --write    write them
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from importlib import import_module
from pathlib import Path

import robocal
from robocal.front.calls import SIZE, docstring_of
from robocal.verbs.option import Arg, Option, OptionField, entries
from robocal.verbs.registry import GROUPS

ROOT = Path(__file__).parent.parent / "src" / "robocal"
HEAD = """# Made by scripts/front_stub.py from the options of the verbs.
import os
from collections.abc import Callable{mapping}, Sequence
from typing import Any

{imports}

_Path = str | os.PathLike[str]
_Given = _Path | {given}
_Watch = Callable[[dict[str, object]], None]

"""
EXPLICIT = "from {module} import {name} as {name}"


def stub(path: str) -> str:
    """One verb as a typed function."""
    told = entries(import_module(f"robocal.verbs.{path}").Options)
    first = [_parameter(e) for e in told if isinstance(e.facts, Arg)]
    named = [_parameter(e) for e in told if not isinstance(e.facts, Arg)]
    words = ",\n    ".join([*first, "*", *named, "watch: _Watch | None = None"])
    doc = "\n    ".join(line.strip() for line in docstring_of(path).replace('"', "'").splitlines())
    doc = "\n".join(line.rstrip() for line in doc.split("\n"))
    name = path.rpartition(".")[2]
    kind = "Identified" if path == "identify" else f"Found[{_result(path)[0]}]"
    return f'def {name}(\n    {words},\n) -> {kind}:\n    """{doc}\n    """\n'


def _result(path: str) -> tuple[str, list[str]]:
    """What `run(...) -> Outcome[T]` says of its result, and the imports that it takes: every name under one that only this verb has."""
    module = import_module(f"robocal.verbs.{path}")
    result = module.run.__annotations__["return"].removeprefix("Outcome[").removesuffix("]")
    verb = path.rpartition(".")[2]
    known: list[tuple[str, str, str]] = []  # name in this module, module that defines it, name there
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.ImportFrom) and node.col_offset in (0, 4) and node.module:
            known += [(alias.asname or alias.name, node.module, alias.name) for alias in node.names]
        elif isinstance(node, ast.ClassDef):
            known.append((node.name, module.__name__, node.name))
    imports: dict[str, str] = {}
    for name, home, there in known:
        own = f"_{verb}_{name}"
        if re.search(rf"\b{name}\b", result) and home != "typing" and own not in imports:
            result = re.sub(rf"\b{name}\b", own, result)
            imports[own] = f"from {home} import {there} as {own}"
    return result, list(imports.values())


def _parameter(entry: OptionField) -> str:
    plain = (
        "_Given | Mapping[str, Any]"
        if entry.word == "STUDY"
        else "_Given"
        if isinstance(entry.facts, Arg)
        else "_Path"
        if entry.kind is Path
        else entry.kind.__name__
    )
    if entry.numeric:
        plain = "str | float"
    if getattr(entry.facts, "metavar", "") == SIZE:
        plain = "str | tuple[int, int]"
    facts = entry.facts
    if isinstance(facts, Option) and entry.kind is float and facts.unit:
        plain = "float | str"  # a number with its unit
    if isinstance(facts, Option) and entry.kind is str and (facts.numbers or "X,Y,Z" in facts.help):
        plain = "str | Sequence[float | str]"
    if entry.several:
        plain = f"{plain} | Sequence[{plain}]"
    default = (
        ""
        if entry.required
        else f" = {entry.default!r}"
        if entry.kind is not Path or entry.default is None
        else " = ..."
    )
    return f"{entry.python}: {plain}{' | None' if entry.optional else ''}{default}"


def _order(line: str) -> str:
    """That of ruff: by module."""
    return line.split()[1]


def texts() -> dict[Path, str]:
    """Both stubs, by file."""
    arrays = [EXPLICIT.format(module=f"robocal.front.{m}", name=n) for n, m in robocal.ARRAYS.items()]
    found = [EXPLICIT.format(module=f"robocal.front.{m}", name=n) for n, m in robocal.FOUND.items()]
    errors = [EXPLICIT.format(module="robocal.errors", name=n) for n in robocal.ERRORS]
    version = EXPLICIT.format(module="robocal._version", name="__version__")
    results = [line for name in robocal.CALLS if name != "identify" for line in _result(name)[1]]
    arrays.append("from robocal.front.cable_arrays import CableArm")
    groups = [f"from robocal.front import {word} as {name}" for name, word in robocal.GROUPS.items()]
    every = [version, *errors, *groups, *arrays, *found, *results]
    imports = "\n".join(sorted(every, key=_order))
    names = ",\n    ".join(f'"{n}"' for n in robocal.__all__)
    ours = HEAD.format(mapping=", Mapping", imports=imports, given="Arm | CableArm | Measurements | Found[Any]")
    ours += "".join(f"{n}: tuple[str, ...]\n" for n in ("ERRORS", "CALLS"))
    ours += "".join(f"{n}: dict[str, str]\n" for n in ("ARRAYS", "FOUND", "GROUPS"))
    ours += f"__all__ = [\n    {names},\n]\n\n"
    ours += "\n".join(stub(name) for name in robocal.CALLS)
    return {ROOT / "__init__.pyi": ours} | {ROOT / "front" / f"{word}.pyi": _grouped(word) for word in GROUPS}


def _grouped(word: str) -> str:
    """The verbs under one word."""
    paths = [f"{word}.{name}" for name in GROUPS[word].verbs]
    own = ["from robocal.front.measurements import Measurements", "from robocal.front.verb_result import Found"]
    if word == "cable":
        own += [EXPLICIT.format(module="robocal.front.cable_arrays", name=n) for n in ("CableArm", "robot")]
    own += [line for path in paths for line in _result(path)[1]]
    head = HEAD.format(
        mapping="",
        imports="\n".join(sorted(own, key=_order)),
        given=f"{'CableArm | ' if word == 'cable' else ''}Measurements | Found[Any]",
    )
    return head + "\n".join(map(stub, paths))


def main() -> int:
    """Writes or compares."""
    different = {file for file, text in texts().items() if not file.exists() or file.read_text() != text}
    if "--write" in sys.argv:
        for file in different:
            file.write_text(texts()[file])
        return 0
    for file in sorted(different):
        print(f"{file} is not what the verbs say: python scripts/front_stub.py --write")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())

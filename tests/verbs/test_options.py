"""Laws of verbs: each is one module that tells its options once, costs nothing to import, and knows no other verb."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from cli.runs import robocal

from robocal.errors import ModelError
from robocal.simulation.rigs import RIGS
from robocal.verbs import shared_options
from robocal.verbs.option import Arg, BaseOptions, Option, entries
from robocal.verbs.registry import COMMAND_NAMES, GROUPS, PATHS

SHARED = {"option", "outcome", "registry", "shared_options"}


@pytest.mark.parametrize("path", PATHS)
def test_a_verb_has_options_that_say_what_they_are(path: str) -> None:
    module = import_module(f"robocal.verbs.{path}")
    assert set(module.__all__) >= {"Options", "run", "sections"}
    assert list(inspect.signature(module.run).parameters) == ["o", "watch", "command"]
    assert (module.Options.__doc__ or "").strip()
    named = False
    for entry in entries(module.Options):
        assert entry.facts.help.strip(), entry.name
        assert not (named and isinstance(entry.facts, Arg)), f"{entry.name}: arguments come first"
        named |= isinstance(entry.facts, Option)
        if isinstance(entry.facts, Option):
            assert "[default" not in entry.facts.help and not entry.facts.help.endswith("."), entry.name
            if entry.kind in (int, float) and entry.kind is not bool and not entry.required:
                assert entry.facts.metavar, entry.name


@pytest.mark.parametrize("path", PATHS)
def test_help_says_every_option(path: str) -> None:
    ran = robocal(*(COMMAND_NAMES.get(word, word) for word in path.split(".")), "--help")
    said = " ".join(ran.out.split())
    for entry in entries(import_module(f"robocal.verbs.{path}").Options):
        assert entry.word in said, entry.word
        if isinstance(entry.facts, Option) and not entry.facts.otherwise:
            # A line may end after a hyphen.
            assert "".join(entry.facts.text.split()) in said.replace(" ", ""), entry.word
    assert "--json" in said


@pytest.mark.parametrize("path", PATHS)
def test_nothing_is_replaced_unasked(path: str) -> None:
    """Whatever writes where it is told to has --force; a demo and the page of a run are made again and again."""
    told = {e.name for e in entries(import_module(f"robocal.verbs.{path}").Options)}
    assert "output" not in told or ("force" in told) == (path not in ("demo", "report"))


def test_importing_every_verb_costs_nothing() -> None:
    code = (
        "import sys\n"
        f"for path in {PATHS!r}: __import__('robocal.verbs.' + path)\n"
        "heavy = {'numpy', 'scipy', 'numba', 'pydantic', 'rich', 'click'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


def test_help_of_a_verb_needs_no_numpy() -> None:
    code = (
        "import sys\nfrom robocal.cli.main import main\n"
        "for words in (['--help'], ['identify', '--help'], ['cable', 'poses', '--help']): assert main(words) == 0\n"
        "assert not {'numpy', 'numba', 'scipy'} & set(sys.modules)\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


def test_a_verb_knows_no_other_verb() -> None:
    root = Path(inspect.getfile(BaseOptions)).parent
    for file in root.rglob("*.py"):
        own = file.relative_to(root).with_suffix("").parts
        if own[0] == "demo":
            continue  # its cases are made of other verbs
        verb = ".".join(own[: 2 if own[0] in GROUPS else 1])
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("robocal.verbs"):
                last = (node.module or "").removeprefix("robocal.verbs").strip(".")
                names = {last} if last else {a.name for a in node.names}
                others = {n for n in names if n != verb and not n.startswith(f"{verb}.")}
                assert others <= SHARED, (file, node.module, names)


def test_no_default_of_an_option_stands_elsewhere() -> None:
    """What `run` calls takes what the options say: no function below repeats a default of the command line."""
    verbs = Path(inspect.getfile(BaseOptions)).parent
    below = [
        f
        for f in verbs.rglob("*.py")
        if f.name != "__init__.py" and f.parent not in (verbs, *(verbs / group for group in GROUPS))
    ]
    assert below
    told = {e.name for path in PATHS for e in entries(import_module(f"robocal.verbs.{path}").Options)}
    passed = {
        "base",
        "tip",
        "exclude",
        "group",
        "nominal",
        "free",
        "fix",
        "prior",
        "name",  # of a data file, which simulate --fresh writes twice
    }  # of readers that other code calls too
    for file in (*below, *(verbs.parent / "session").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                a = node.args
                pairs = list(zip(a.args[len(a.args) - len(a.defaults) :], a.defaults, strict=True))
                pairs += [(k, d) for k, d in zip(a.kwonlyargs, a.kw_defaults, strict=True) if d is not None]
                for argument, default in pairs:
                    empty = isinstance(default, ast.Constant) and default.value in (None, False, "")
                    assert empty or argument.arg not in told - passed, (file.name, node.name, argument.arg)


@dataclass(frozen=True)
class Sample(BaseOptions):
    """A sample."""

    place: Annotated[Path, Arg("PLACE", "Somewhere.")]
    loss: Annotated[str, Option("What outliers weigh", choices=("none", "huber"))] = "none"
    count: Annotated[int, Option("How many", metavar="N", least=1, most=9)] = 3
    share: Annotated[float | None, Option("Of it", unit="length", least=0, otherwise="all")] = None
    rows: Annotated[tuple[str, ...], Option("Which", listed=True)] = ()


def test_options_check_themselves_however_they_are_given() -> None:
    assert Sample(Path("a"), rows=("a, b", "c", "")).rows == ("a", "b", "c")
    numbers = Sample(Path("a"), count=np.int64(4), share=np.float32(0.5))
    assert (type(numbers.count), type(numbers.share)) == (int, float)
    for wrong, said in (
        ({"loss": "hubr"}, "huber"),
        ({"count": 0}, "1 to 9"),
        ({"count": 10}, "1 to 9"),
        ({"share": -1.0}, "0 or more"),
        ({"share": float("nan")}, "0 or more"),
        ({"count": 2.5}, "a whole number"),
        ({"count": True}, "a whole number"),
        ({"share": "half"}, "a number"),
        ({"loss": 3}, "a word"),
    ):
        with pytest.raises(ModelError, match=said) as caught:
            Sample(Path("a"), **wrong)
        assert caught.value.key == f"--{next(iter(wrong))}"


def test_an_entry_knows_its_kind() -> None:
    found = {e.name: e for e in entries(Sample)}
    assert found["place"].required and found["place"].kind is Path and found["place"].word == "PLACE"
    assert found["share"].optional and found["share"].kind is float and found["share"].default is None
    assert found["rows"].several and found["rows"].kind is str
    assert (
        found["share"].facts.text == "Of it, in the robot file's unit of length or its own, 0 or more.  [default: all]"
    )


def test_help_names_every_kind_that_can_be_simulated() -> None:
    assert ", ".join(RIGS) == shared_options.KINDS

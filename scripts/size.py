"""How large the project is, what a command loads, and how its things are called: figures that are to fall, not to grow.

    python scripts/size.py

Loads: the modules that `identify robot.yaml data.yaml -o run` imports and the files whose functions it runs, the modules of arms
and of the spine (fit, diagnose, prove) that `cable workspace` imports.
(a) Lines by package: lines of code without blanks, comments and docstrings; the edges are what stands around the computation.
(b) Adjectives first: functions whose name begins with a participle or an adverb ("fitted", "likely"). A function is an order or a
noun, so that a reader knows at the call what it does or what it returns.
(c) Classes twice: names that classes of several files have. Two ideas of one name are told apart only by their import.
(d) Files that share a base name (packages, kernels and `__main__` aside): an editor's list of files says which is which by it.
(e) Docstrings: their share of the lines of code and docstrings together; files of more than 350 lines.
(f) Images: words that mean something else in English than in this program, or nothing (`IMAGES`), in names of files, in public
identifiers, and in the help of the verbs. `OWN_TERMS` are the field's own, by the identifier or file that may have them.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import sys
import tempfile
import tokenize
from collections import defaultdict
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "robocal"
EDGES = ("cli", "verbs", "session", "report", "front")
SPINE = ("fit", "diagnose", "prove")
LONG = 350
# Participles that do not end in -ed.
IRREGULAR = frozenset("told said shown seen held kept made found spoken known lost gone borne met".split())
# Words in -ed and -ly that are orders or nouns, and two that are terms of programming.
NO_ADJECTIVES = frozenset(
    "embed speed feed need seed red shed fed shared apply supply multiply reply assembly only".split()
)
IMAGES = frozenset(
    "told said shown spoken worded seen held kept made found words opt doubts doubted strange farness likeness apart unmade beyond "
    "late pace thin summed atrest weighed pull way leaves foretold stories pen ruler stage paint nobody somebody door room house "
    "ladder floor".split()
)
# The field's own terms among them: in prose a platform is held by its cables, and a pose is found or not.
TERMS = re.compile(
    r"held[ _-]?out|hold[ _-]?out|one-way|beyond geometry|\b(?:be|are|is) held\b|\bnot found\b", re.IGNORECASE
)
# The field's own terms (the floor that a robot stands on), keys of documents, names of options and of the Python front.
OWN_TERMS = frozenset({
    *("Found", "Result.beyond", "Region.floor", "Options.floor", "Options.held", "Surroundings.floor"),
    *("GridPart.held", "Spot.held", "RaysPart.seen_share", "IdentifiabilityPart.kept", "Agreed.apart"),
})  # fmt: skip
TRACED = """
import sys
files = set()
def note(frame, event, argument):
    name = frame.f_code.co_filename
    if "/robocal/" in name and frame.f_code.co_flags & 1:  # a function, no body of a class or module
        files.add(name)
sys.setprofile(note)
from robocal.cli.main import main
status = main(sys.argv[1:])
sys.setprofile(None)
ours = sorted(m for m in sys.modules if m.split(".")[0] == "robocal")
others = (m for m in ours if m.split(".")[1:2] and m.split(".")[1] in ("arms", "fit", "diagnose", "prove"))
print("SIZE", status, len(ours), len(files), *others, file=sys.stderr)
"""
Functions = ast.FunctionDef | ast.AsyncFunctionDef


# --- programs --------------------------------------------------------------------------------------------------------


def programs(source: Path = SOURCE) -> dict[str, ast.Module]:
    """Every file of the package, by its path below it."""
    return {
        p.relative_to(source).as_posix(): ast.parse(p.read_text(encoding="utf-8")) for p in sorted(source.rglob("*.py"))
    }


def begins_with_adjective(name: str) -> bool:
    """Whether the first word of a function's name is a participle or an adverb."""
    first = re.match(r"_*([a-z]+)(?=_|$)", name)
    if first is None or first[1] in NO_ADJECTIVES:
        return False
    return first[1] in IRREGULAR or (len(first[1]) > 2 and first[1].endswith(("ed", "ly")))


def adjectives(trees: Mapping[str, ast.Module]) -> tuple[list[str], int]:
    """Functions and methods that begin with one, and the number of all; what Python names itself (`__init__`) is left out."""
    names = [
        f"{path}:{node.lineno} {node.name}"
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, Functions) and not node.name.startswith("__")
    ]
    return [n for n in names if begins_with_adjective(n.split()[1])], len(names)


def classes_twice(trees: Mapping[str, ast.Module]) -> dict[str, list[str]]:
    """Names of classes that stand in several places, with these; `Options` is one idea, which every verb has."""
    places: dict[str, list[str]] = defaultdict(list)
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(path)
    return {n: p for n, p in sorted(places.items()) if len(p) > 1}


def shared_base_names(trees: Mapping[str, ast.Module]) -> dict[str, list[str]]:
    """Base names that several files have, with these."""
    places: dict[str, list[str]] = defaultdict(list)
    for path in trees:
        if (name := path.rpartition("/")[2]) not in ("__init__.py", "__main__.py", "_kernels.py"):
            places[name].append(path)
    return {n: p for n, p in sorted(places.items()) if len(p) > 1}


# --- images ----------------------------------------------------------------------------------------------------------


def images_in(text: str) -> set[str]:
    """Images among the words of a text or an identifier, whose words are told apart by underscores and capitals."""
    plain = TERMS.sub(" ", text)
    return {w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", plain)} & IMAGES


def image_files(trees: Mapping[str, ast.Module]) -> list[str]:
    """Files and folders whose names have an image."""
    return [path for path in trees if images_in(path.removesuffix(".py"))]


def public_names(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Names that others may use: those in `__all__`, functions and classes, methods and fields as `Class.name`; with their lines."""
    for node in tree.body:
        if isinstance(node, Functions | ast.ClassDef) and not node.name.startswith("_"):
            yield node.lineno, node.name
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            yield from ((node.lineno, str(n.value)) for n in ast.walk(node.value) if isinstance(n, ast.Constant))
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            for part in node.body:
                if isinstance(part, Functions) and not part.name.startswith("_"):
                    yield part.lineno, f"{node.name}.{part.name}"
                if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
                    yield part.lineno, f"{node.name}.{part.target.id}"


def image_names(trees: Mapping[str, ast.Module]) -> list[str]:
    """Public identifiers with an image, kernels aside, which only their package calls."""
    return [
        f"{path}:{line} {name}"
        for path, tree in trees.items()
        if not path.endswith("_kernels.py")
        for line, name in dict.fromkeys(public_names(tree))
        if name not in OWN_TERMS and not name.startswith("_") and images_in(name.rpartition(".")[2])
    ]


def image_helps() -> list[str]:
    """Options whose help has an image, and verbs whose own help has one; a word between quotes is what the option takes."""
    from robocal.verbs.option import Option, entries
    from robocal.verbs.registry import PATHS

    out = []
    for verb in PATHS:
        options = import_module(f"robocal.verbs.{verb}").Options
        helps = {"": options.__doc__ or ""}
        for entry in entries(options):
            helps[entry.word] = entry.facts.text if isinstance(entry.facts, Option) else entry.facts.help
        own = images_in(" ".join(e.name for e in entries(options)))
        for word, text in helps.items():
            if more := images_in(text) - own:
                out.append(f"{verb} {word}: {', '.join(sorted(more))}")
    return out


# --- what a command loads ---------------------------------------------------------------------------------------------


def command(folder: Path, *words: str) -> list[str]:
    """Status, modules imported, files run, and those of arms and of the spine, of one command."""
    ran = subprocess.run([sys.executable, "-c", TRACED, *words], cwd=folder, capture_output=True, text=True, check=True)
    return next(line for line in ran.stderr.splitlines() if line.startswith("SIZE")).split()[1:]


def code(text: str) -> tuple[int, int]:
    """Lines of code without blanks, comments and docstrings; and lines of docstrings."""
    tree, docs = ast.parse(text), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | Functions) and ast.get_docstring(node):
            first = node.body[0]
            docs |= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    skip = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in skip:
            lines |= set(range(token.start[0], token.end[0] + 1))
    return len(lines - docs), len(docs)


def print_loads() -> None:
    """What two commands import and run."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        command(folder, "simulate", "irb-120", "-n", "80", "-o", "sim")
        for _ in range(2):  # the first may compile
            arm = command(folder, "identify", "sim/robot.yaml", "sim/data.yaml", "-o", "run")
        print(f"identify robot.yaml data.yaml -o run: {arm[1]} modules imported, functions of {arm[2]} files run")
        robot = ROOT / "examples" / "cable-planar" / "robot.yaml"
        cable = command(folder, "cable", "workspace", str(robot), "--cells", "9", "--rays", "100")
        others = ", ".join(cable[3:]) or "none"
        print(f"cable workspace: {cable[1]} modules, of arms, {', '.join(SPINE)} {len(cable) - 3}: {others}")


def print_lines() -> None:
    """Lines of code by package, docstrings, long files."""
    texts = {p.relative_to(SOURCE): p.read_text(encoding="utf-8") for p in sorted(SOURCE.rglob("*.py"))}
    counts = {p: code(text) for p, text in texts.items()}
    by_package: dict[str, int] = defaultdict(int)
    for path, (lines, _) in counts.items():
        by_package[path.parts[0] if len(path.parts) > 1 else "(files)"] += lines
    for package, lines in sorted(by_package.items(), key=lambda i: -i[1]):
        print(f"{package:12s} {lines:6d}")
    whole, docs = sum(n for n, _ in counts.values()), sum(d for _, d in counts.values())
    print(f"{' + '.join(EDGES)}: {sum(by_package[e] for e in EDGES)}; all of src: {whole}")
    print(f"docstrings: {100 * docs / (docs + whole):.1f} % of code and docstrings")
    long = [str(p) for p, text in texts.items() if len(text.splitlines()) > LONG]
    print(f"files of more than {LONG} lines: {', '.join(long) or 'none'}")


def print_names() -> None:
    """How functions, classes and files are called."""
    trees = programs()
    first, count = adjectives(trees)
    print(
        f"functions that begin with a participle or adverb: {len(first)} of {count} ({100 * len(first) / count:.1f} %)"
    )
    for what, twice in (("class names", classes_twice(trees)), ("base names", shared_base_names(trees))):
        uses = sum(map(len, twice.values()))
        print(f"{what} of several places: {len(twice)}, {uses} uses: {', '.join(twice)}")
    for where, hits in (
        ("names of files", image_files(trees)),
        ("public identifiers", image_names(trees)),
        ("help", image_helps()),
    ):
        print(f"images in {where}: {len(hits)}", *hits, sep="\n  ")


def main() -> None:
    """Prints all figures."""
    print_loads()
    print_lines()
    print_names()


if __name__ == "__main__":
    main()

"""How large the edges are, and what a command loads: figures that are to fall, not to grow.

    python scripts/size.py

Modules that `identify robot.yaml data.yaml -o run` imports and files whose functions it runs; what of arms and calibrate `cable
workspace` imports; lines of code without blanks, comments and docstrings, by package; the share of docstrings; long files.
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tempfile
import tokenize
from pathlib import Path

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "robocal"
EDGES = ("cli", "verbs", "jobs", "report", "front")
LONG = 350
TRACED = """
import sys
files = set()
def seen(frame, event, argument):
    name = frame.f_code.co_filename
    if "/robocal/" in name and frame.f_code.co_flags & 1:  # a function, no body of a class or module
        files.add(name)
sys.setprofile(seen)
from robocal.cli.main import main
status = main(sys.argv[1:])
sys.setprofile(None)
ours = sorted(m for m in sys.modules if m.split(".")[0] == "robocal")
print("SIZE", status, len(ours), len(files), *(m for m in ours if m.split(".")[1:2] in (["arms"], ["calibrate"])), file=sys.stderr)
"""


def command(folder: Path, *words: str) -> list[str]:
    """Status, modules imported, files run, and those of arms and calibrate, of one command."""
    ran = subprocess.run([sys.executable, "-c", TRACED, *words], cwd=folder, capture_output=True, text=True, check=True)
    return next(line for line in ran.stderr.splitlines() if line.startswith("SIZE")).split()[1:]


def code(text: str) -> tuple[int, int]:
    """Lines of code without blanks, comments and docstrings; and lines of docstrings."""
    tree, docs = ast.parse(text), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(
            node
        ):
            first = node.body[0]
            docs |= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    skip = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in skip:
            lines |= set(range(token.start[0], token.end[0] + 1))
    return len(lines - docs), len(docs)


def main() -> None:
    """Prints all figures."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        command(folder, "simulate", "irb-120", "-n", "80", "-o", "sim")
        for _ in range(2):  # the first may compile
            found = command(folder, "identify", "sim/robot.yaml", "sim/data.yaml", "-o", "run")
        print(
            f"identify robot.yaml data.yaml -o run: {found[1]} modules of robocal imported, functions of {found[2]} files run"
        )
        robot = ROOT / "examples" / "cable-planar" / "robot.yaml"
        held = command(folder, "cable", "workspace", str(robot), "--cells", "9", "--rays", "100")
        print(
            f"cable workspace: {held[1]} modules, of arms and calibrate {len(held) - 3}: {', '.join(held[3:]) or 'none'}"
        )
    counts = {p: code(p.read_text(encoding="utf-8")) for p in sorted(SOURCE.rglob("*.py"))}
    rooms = sorted({p.relative_to(SOURCE).parts[0] for p in counts if p.parent != SOURCE})
    for room in rooms:
        print(f"{room:12s} {sum(n for p, (n, _) in counts.items() if p.relative_to(SOURCE).parts[0] == room):6d}")
    edges = sum(n for p, (n, _) in counts.items() if p.relative_to(SOURCE).parts[0] in EDGES)
    all_, docs = sum(n for n, _ in counts.values()), sum(d for _, d in counts.values())
    print(f"{' + '.join(EDGES)}: {edges}; all of src: {all_}; docstrings {100 * docs / (docs + all_):.1f} % of both")
    long = [str(p.relative_to(SOURCE)) for p in counts if len(p.read_text(encoding="utf-8").splitlines()) > LONG]
    print(f"files of more than {LONG} lines: {', '.join(long) or 'none'}")


if __name__ == "__main__":
    main()

"""What is asked of Python, and what is measured: lines of an example, types, a cell of a notebook, answers to wrong calls.

python scripts/python_acceptance.py
"""

from __future__ import annotations

import ast
import os
import runpy
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

ROOT = Path(__file__).parent.parent
EXAMPLES = ROOT / "examples" / "python"
sys.path[:0] = [str(EXAMPLES), str(ROOT / "tests")]


def main() -> int:
    """Prints a line for each that is asked; exit status 1 where one is not met."""
    good = True
    for met, asked, measured in (*_examples(), _types(), _answers()):
        good = good and met
        print(f"{'met    ' if met else 'NOT MET'} {asked}: {measured}")
    return 0 if good else 1


def _examples() -> Iterator[tuple[bool, str, str]]:
    from front.test_cell import Lines

    for name in ("arm_from_arrays", "cables_from_arrays"):
        source = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
        steps = [s for s in ast.parse(source).body[1:] if not isinstance(s, ast.Import)]
        with redirect_stdout(StringIO()):
            space = runpy.run_path(str(EXAMPLES / f"{name}.py"))
        found = space["found"]
        shape, drawn = found.covariance.matrix.shape, len(list(space["laboratory"].OUT.glob("*.svg")))
        measured = f"{len(steps)} lines, {found.verdict}, covariance {shape}, {drawn} figures"
        yield len(steps) <= 10 and found.improved and drawn > 0, f"{name}: ten lines to covariance and plot", measured
        read = Lines(found._repr_html_())
        measured = f"{len(read.shown)} lines, {read.figures} figure"
        yield (
            len(read.shown) <= 60 and read.figures == 1,
            f"{name}: a cell of at most 60 lines and one figure",
            measured,
        )


def _types() -> tuple[bool, str, str]:
    words = ["-m", "mypy", "--strict", "--config-file", str(ROOT / "pyproject.toml"), *map(str, EXAMPLES.glob("*.py"))]
    place = os.environ | {"MYPYPATH": os.pathsep.join((str(ROOT / "src"), str(EXAMPLES)))}
    ran = subprocess.run([sys.executable, *words], cwd=ROOT, env=place, capture_output=True, text=True, check=False)
    return ran.returncode == 0, "mypy --strict on the examples", ran.stdout.strip().splitlines()[-1]


def _answers() -> tuple[bool, str, str]:
    from front.test_wrong_calls import CASES, lab

    from robocal.errors import InputError

    named = 0
    for name, (call, argument, expected) in CASES.items():
        try:
            call(lab())
            print(f"        {name}: no answer")
        except InputError as error:
            right = error.argument == argument and expected in str(error) and "--" not in str(error)
            named += right
            if not right:
                print(f"        {name}: {error}")
    asked = "wrong shapes, units and names answered by the argument and what was expected"
    return named == len(CASES), asked, f"{named} of {len(CASES)} calls"


if __name__ == "__main__":
    sys.exit(main())

"""A number on which something is decided is a limit (diagnose/limits.py and beside it): whoever compares with a named constant takes it from there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src"
WHERE = ("diagnose", "prove", "files/causes.py", "files/data_checks.py", "session", "fit/starts/unknown_zeros.py")
HOME = (
    "robocal.diagnose.limits",
    "robocal.diagnose.drive_limits",
    "robocal.diagnose.vision_limits",
    "robocal.fit.limits",
)
MARK = re.compile(r"# (tolerance|grid)\b")
ORDER = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)


def constants(text: str) -> dict[str, bool]:
    """Numeric constants of a module by name, and whether each is marked as a tolerance or the size of a grid."""
    lines = text.splitlines()
    out: dict[str, bool] = {}
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name) and n.id.isupper()]
        plain = [v for v in ast.walk(node.value) if isinstance(v, ast.Constant)]
        if any(isinstance(v.value, int | float) for v in plain) and not isinstance(node.value, ast.Set | ast.List):
            above = lines[node.lineno - 2] if node.lineno > 1 else ""
            marked = MARK.search(lines[node.lineno - 1]) or (above.startswith("#") and MARK.search(above))
            out |= dict.fromkeys(names, bool(marked))
    return out


def offences(text: str, read=None) -> list[str]:
    """Comparisons with a named number that is neither a limit nor marked; `read` gives the text of another module by name."""
    tree = ast.parse(text)
    own, taken, modules = constants(text), {}, {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            taken |= {a.asname or a.name: (node.module, a.name) for a in node.names if a.name.isupper()}
            modules |= {a.asname or a.name: f"{node.module}.{a.name}" for a in node.names}
    out = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Compare) or not any(isinstance(o, ORDER) for o in node.ops):
            continue
        compared = {
            n.id: taken.get(n.id, ("", n.id)) for n in ast.walk(node) if isinstance(n, ast.Name) and n.id.isupper()
        }
        for n in ast.walk(node):
            if (
                isinstance(n, ast.Attribute)
                and n.attr.isupper()
                and isinstance(n.value, ast.Name)
                and n.value.id in modules
            ):
                compared[f"{n.value.id}.{n.attr}"] = (modules[n.value.id], n.attr)
        for name, (module, there) in compared.items():
            if module in HOME:
                continue
            known = own if not module else constants(read(module)) if read else {}
            if known.get(there) is False:
                out.append(f"line {node.lineno}: {name}")
    return out


def module(name: str) -> str:
    path = SOURCE / Path(*name.split("."))
    file = path.with_suffix(".py") if path.with_suffix(".py").is_file() else path / "__init__.py"
    return file.read_text(encoding="utf-8") if file.is_file() else ""


def test_what_is_compared_is_a_limit():
    wrong = []
    for part in WHERE:
        place = SOURCE / "robocal" / part
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            wrong += [f"{path.relative_to(SOURCE)}, {o}" for o in offences(path.read_text(encoding="utf-8"), module)]
    assert not wrong, "a limit, or marked `# tolerance: why` or `# grid: why`:\n" + "\n".join(wrong)


@pytest.mark.parametrize(
    "bad",
    [
        "SURE = 5.0  # sigma\ndef f(z):\n    return z > SURE",
        "SURE: float = 5.0\nf = lambda z: SURE * 2 <= z",
        "A, B = 1.0, 2.0\nf = [z for z in range(3) if A < z]",
        "SMALL = {'m': 1e-5}\ndef f(v):\n    return v <= SMALL['m']",
        "from robocal.elsewhere import FAR\ndef f(v):\n    return v < FAR",
        "from robocal import elsewhere\ndef f(v):\n    return v < elsewhere.FAR",
    ],
)
def test_the_rule_finds(bad):
    assert offences(bad, lambda name: "FAR = 3.0  # stated sigma")


@pytest.mark.parametrize(
    "fair",
    [
        "from robocal.diagnose.limits import NUMBER_SIGMA\ndef f(z):\n    return z > NUMBER_SIGMA",
        "from robocal.diagnose import limits\ndef f(z):\n    return z > limits.NUMBER_SIGMA",
        "EPS = 1e-12  # tolerance: of the largest eigenvalue\ndef f(v):\n    return v > EPS",
        "# grid: more would leave the cache\nMANY = 400\ndef f(n):\n    return n < MANY",
        "KINDS = ('pose',)\ndef f(k):\n    return set(k) <= set(KINDS)",
        "ROUNDS = 8\ndef f():\n    return range(ROUNDS)",
        "from robocal.elsewhere import FAR\ndef f(v):\n    return v < FAR",
    ],
)
def test_the_rule_lets_pass(fair):
    assert not offences(fair, lambda name: "FAR = 3.0  # tolerance: of rounding")

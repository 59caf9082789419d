"""No module asks which machine it has: what only one machine has is a word of the protocol, a part, or hangs on the opened machine."""

from __future__ import annotations

import ast
from pathlib import Path

import robocal

SRC = Path(robocal.__file__).parent
# Beside their machines: here a machine may be asked what it is.
OWN = ("arms/", "cables/", "geometry/path/unjointed.py")
# What belongs to one machine alone, and is reached with that machine only.
CABLE = ("files/cable/", "session/cable/", "verbs/cable/", "measure/cable/", "report/cable/", "diagnose/cables/")
TYPES = {
    "Chain",
    "CableRobot",
    "Rig",
    "Mechanism",
    "Robot",
    "CableFile",
    "Bare",
    "MachineFile",
    "Opened",
    "OpenedArm",
    "OpenedCable",
}
MACHINES = {"machine", "mechanism", "robot", "chain", "arm", "nominal", "corrected", "truth", "opened"}


def names(node: ast.AST) -> set[str]:
    """Every name in an expression."""
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)} | {
        n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)
    }


def asked(tree: ast.Module, cable: bool = False) -> list[str]:
    """The calls of a module that ask a machine which it is."""
    out = []
    own = {
        a.name for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module == "robocal.measure.machine" for a in n.names
    }  # fmt: skip
    types = TYPES | (own & {"Model"})
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name) or not node.args:
            continue
        what, first = node.func.id, node.args[0]
        by_type = what in ("isinstance", "issubclass") and names(node.args[-1]) & types
        casts = what == "cast" and (names(first) & types or names(node.args[-1]) & MACHINES)
        last = first.attr if isinstance(first, ast.Attribute) else getattr(first, "id", "")
        by_name = not cable and what in ("getattr", "hasattr") and last in MACHINES
        if by_type or casts or by_name:
            out.append(ast.unparse(node))
    return out


def test_nobody_asks_a_machine_which_it_is(programs):
    found = {}
    for place, tree in programs.items():
        if not place.startswith(OWN) and (calls := asked(tree, place.startswith(CABLE))):
            found[place] = calls
    assert not found


def test_the_rule_sees_what_it_forbids():
    for line in (
        "isinstance(machine, CableRobot)", "isinstance(x, (Chain, int))", "getattr(self.machine, 'cables', ())",
        "cast(Identification[Chain], outcome.identification)", "hasattr(found.robot, 'chain')", "cast(Any, machine)",
    ):  # fmt: skip
        assert asked(ast.parse(line)), line
    for line in ("isinstance(value, str)", "getattr(model, 'second', None)"):
        assert not asked(ast.parse(line)), line


def test_no_attribute_is_taken_past_the_protocol():
    forbidden = "type: ignore[attr-defined]"
    rooms = ("measure", "fit", "diagnose", "prove", "apply", "session")
    every = [p for room in rooms for p in (SRC / room).rglob("*.py")]
    assert every and not [p.name for p in every if forbidden in p.read_text(encoding="utf-8")]

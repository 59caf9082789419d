"""No code looks into sentences: what is said of data is decided by codes and numbers (robocal.remarks), and its words are for
people. And the table of words is whole: every code is spoken, used, and given the numbers that its sentence names."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from string import Formatter

import pytest

from robocal.diagnose.check_registry import ALL, checks
from robocal.remarks import english
from robocal.remarks.code import Code
from robocal.remarks.english import DECLARED, TABLE, declare
from robocal.remarks.remark import Quantity, Remark, documents, remark_fields, sentences

SOURCE = Path(__file__).parents[2] / "src" / "robocal"
# Names that hold sentences for people, as variables, fields or keys of documents. A combination's `text` is one too.
PROSE = {
    *("advice", "combinations", "doubt", "doubts", "hint", "hints", "message", "note", "notes", "reason", "reasons"),
    *("remark", "remarks", "sentence", "sentences", "warning", "warnings"),
}
LOOKS = {
    *("startswith", "endswith", "find", "rfind", "index", "count", "split", "rsplit", "splitlines", "partition", "rpartition"),
    *("replace", "removeprefix", "removesuffix", "translate"),
}  # fmt: skip
PATTERNS = {"search", "match", "fullmatch", "findall", "finditer", "sub", "subn", "split"}
# Pure facts: nothing is to be done about them.
FACTS = {
    "poses-from-points",
    "rig-not-improved",
    # Guards: no file is known that leads to them, so no advice could be tried.
    *(Code.ENDED_ELSEWHERE, Code.FRAMES_NOT_CONVERGED, Code.NOT_FINITE, Code.PARTICLES_STUCK),
    *(
        Code.STRETCH_TAKEN,
        Code.TENSIONS_FROM_CURRENTS,
        Code.SAG_TAKEN,
        Code.BEYOND_TAKEN,
        Code.ZEROS_LEFT_ASIDE,
        Code.ZEROS_OF_ONE_POSE,
        Code.NOTHING_MOVED,
        Code.SMALLEST_DRIFT,
        Code.CALIBRATION_CARRIED,
        Code.SHAPE_CARRIED,
    ),
    Code.JOINT_LOADS_APART,
    *(Code.HAND_EYE_LOST,),  # beside what explains it
    *(Code.DRIVE_GAIN_PROVEN, Code.DRIVE_GAIN_NOT_PROVEN, Code.DRIVE_REPEATED_ROWS, Code.DRIVE_TIME_ANEW),
    *(Code.LENS_GAIN_PROVEN, Code.LENS_NOT_CONVERGED, Code.POSES_WITHOUT_VIEW),
    *(
        Code.DRIVE_WINDING,
        Code.DRIVE_SENSOR_ORDERS,
        Code.DRIVE_IDEAL,
        Code.DRIVE_HELD_BACK,
        Code.DRIVE_LONE_ROWS,
        Code.DRIVE_NO_POSITION_TABLE,
        Code.DRIVE_PART_COMPARED,
    ),
    *(Code.GAIN_ANYWAY, Code.RESTARTED, Code.BOOTSTRAP_SPREAD, Code.ELSEWHERE, Code.NO_EFFECT, Code.CANNOT_BE_TOLD),
    *(
        Code.NO_RIPPLE,
        Code.BLOCKS_FALL,
        Code.BLOCKS_DO_NOT_FALL,
        Code.LARGEST_ANGLE,
        Code.SPREAD_UNLIKE,
        Code.SEEN_LEFT_OUT,
    ),
    *(Code.AS_STATED_UNFIT, Code.LAYER_ON_TOP, Code.LAYER_LEFT_OUT, Code.NEEDS_JOINTS, Code.BY_WAY_OF_LIMITS),
    *(Code.NEAREST_REACHED, Code.CORRECTION_LEAPS, Code.LOW_DEXTERITY, Code.ORIENTATION_RELAXED),
    *(Code.REPEATABILITY_UNCHANGED, Code.NO_STANDING_POSITIONS, Code.VISITED_ONCE, Code.NO_ORIENTATIONS),
    *(Code.ONE_DIRECTION, Code.DIRECTIONS_UNMARKED, Code.DISTANCES_ONCE),
    *(Code.TOOL_CHANGED, Code.TRIALS_LOST, Code.NO_KEY_FOR, Code.ONE_PLACE_PLANNED),
    *(Code.MOTIONS_OPEN, Code.AND_MORE, Code.HOLES, Code.FOLLOWS_TURN, Code.WORTH_ALONE),
    *(
        Code.HALF_TURNS_UNDONE,
        Code.TARGETS_SEEN_ONCE,
        Code.IMAGE_PLACES,
        Code.OVER_THE_RANGE,
        Code.SCALE_SEEN,
        Code.CHANGE_BELOW,
        Code.CHANGE_SETTLED_BY,
        Code.PREDICTIONS_APART,
    ),
    *(
        Code.PARAMETERS_DIFFER,
        Code.SHOWS_IN,
        Code.SHOWS_IN_SUMS,
        Code.ONE_CAUSE,
        Code.BELOW_SCATTER,
        Code.ERRORS_CANCEL,
    ),
    Code.FORMAT_LACKS,
    Code.MAP_LOCATED,
    Code.PLAN_UNSEEN,
    Code.PLAN_BLIND,
    *(Code.FREE_IN_ONE, Code.TRUTH_MET, Code.NOT_COMPARED, Code.NOT_LINEAR, Code.BAND_PROFILED),
}


# --- the rule -------------------------------------------------------------------------------------------------------


def looks(tree: ast.AST) -> list[int]:
    """Lines of a program that look into a sentence."""
    found: set[int] = set()
    for scope in scopes(tree):
        names = spoken_names(scope)
        found |= {node.lineno for node in scope if looks_into(node, names)}  # type: ignore[attr-defined]
    return sorted(found)


def scopes(tree: ast.AST) -> list[list[ast.AST]]:
    """The nodes of every outermost function, and those of the rest of the program."""
    rest: list[ast.AST] = []
    out, todo = [rest], [tree]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            out.append(list(ast.walk(node)))
        else:
            rest.append(node)
            todo += ast.iter_child_nodes(node)
    return out


def spoken_names(scope: list[ast.AST]) -> set[str]:
    """PROSE and the local names that are bound to something of it, by assignment or in a loop."""
    names = set(PROSE)
    bound: list[tuple[ast.expr, ast.expr]] = []
    for node in scope:
        if isinstance(node, ast.For | ast.comprehension):
            bound.append((node.target, node.iter))
        elif isinstance(node, ast.Assign):
            bound += [(t, node.value) for t in node.targets]
        elif isinstance(node, ast.NamedExpr):
            bound.append((node.target, node.value))
    while True:
        new = {t.id for t, value in bound if isinstance(t, ast.Name) and speaks(value, names)} - names
        if not new:
            return names
        names |= new


def speaks(node: ast.AST, names: set[str]) -> bool:
    """Whether an expression is a sentence, or a list of them, by its name."""
    match node:
        case ast.Name(id=name):
            return name in names
        case ast.Attribute(value=value, attr=attr):
            return attr in PROSE or (attr == "text" and speaks(value, names))
        case ast.Subscript(value=value, slice=ast.Constant(value=str(key))):
            return key in PROSE
        case ast.Subscript(value=value):
            return speaks(value, names)
        case ast.Call(func=ast.Attribute(attr="get"), args=[ast.Constant(value=str(key)), *_]):
            return key in PROSE
        case ast.Call(func=ast.Name(id="str" | "list" | "tuple" | "set" | "sorted" | "map" | "entries"), args=args):
            return any(speaks(a, names) for a in args)
        case ast.Call(func=ast.Name(id=name)) if name in PROSE:
            return True
        case ast.Call(func=ast.Attribute(attr="lower" | "strip" | "casefold" | "upper", value=value)):
            return speaks(value, names)
        case ast.Call(func=ast.Attribute(attr="join"), args=[first]):
            return speaks(first, names)
        case ast.ListComp(elt=elt) | ast.GeneratorExp(elt=elt) | ast.SetComp(elt=elt):
            return speaks(elt, names)
        case ast.BoolOp(values=values):
            return any(speaks(v, names) for v in values)
        case ast.IfExp(body=body, orelse=orelse):
            return speaks(body, names) or speaks(orelse, names)
    return False


def written(node: ast.AST) -> bool:
    """A text that stands in the program, not empty."""
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value != ""
    )


def looks_into(node: ast.AST, names: set[str]) -> bool:
    """Whether a node compares a sentence with a written text, or takes it apart."""
    match node:
        case ast.Compare(left=left, ops=ops, comparators=right):
            pairs = zip([left, *right[:-1]], ops, right, strict=True)
            return any(
                (isinstance(op, ast.In | ast.NotIn | ast.Eq | ast.NotEq) and written(a) and speaks(b, names))
                or (isinstance(op, ast.Eq | ast.NotEq) and written(b) and speaks(a, names))
                for a, op, b in pairs
            )
        case ast.Call(func=ast.Attribute(value=value, attr=attr), args=args):
            apart = attr in LOOKS and isinstance(value, ast.expr) and speaks(value, names)
            return apart or (attr in PATTERNS and any(speaks(a, names) for a in args))
        case ast.Match(subject=subject, cases=cases):
            texts = [c for case in cases for c in ast.walk(case.pattern) if written(c)]
            return bool(texts) and speaks(subject, names)
    return False


@pytest.fixture(scope="package")
def programs(programs):
    """Every file outside the tables of words, by its path."""
    return {path: tree for path, tree in programs.items() if not path.startswith("remarks/")}


def test_no_code_looks_into_sentences(programs):
    found = {f"{path}:{line}" for path, tree in programs.items() for line in looks(tree)}
    assert found == set(), "decide by code and numbers, not by words"


@pytest.mark.parametrize(
    "planted",
    [
        'if "run folder" in warning: pass',
        'told = tuple(w for w in arm.warnings if "result.json" in w)',
        'if warning.startswith("elsewhere in the "): pass',
        'note = note.replace("only a combination with ", "only with ")',
        "note = p.note\nshort = note.removesuffix(' is seen')",
        'quiet = [c.text.split(" ", 1)[0] for c in seen.combinations]',
        'quiet = [c for c in seen.combinations if c.text.endswith("has no effect")]',
        're.search(pattern, " | ".join(reasons))',
        'given = " | ".join(reasons(result)).lower()\nhit = re.search(pattern, given)',
        "given = ' '.join(verdict.reasons).lower()\nPATTERN.search(given)",
        'if str(m.get("reason") or "").startswith("stopped"): pass',
        'if document["verdict"]["reasons"][0] == "nothing was held out": pass',
        "for r in result.remarks:\n    if r.sentence.find('plane') >= 0: pass",
        'def f(found):\n    said = found.reason\n    return "falls" in said',
        "match found.reason:\n    case 'too many': pass",
        'if "digits" in str(error.message): pass',
    ],
)
def test_the_rule_fails_on(planted):
    assert looks(ast.parse(planted)), planted


@pytest.mark.parametrize(
    "fair",
    [
        "more = [w for w in other.warnings if w not in inputs.warnings]",
        "if remark.code == Code.ELSEWHERE: pass",
        'if found["status"] == "drifted": pass',
        "told = ', '.join(reasons)",
        'note = "" if p.status == "identified" else p.note',
        "if reason == '': pass",
        "if reason == Reason.SINGULAR: pass",
    ],
)
def test_the_rule_lets_pass(fair):
    assert not looks(ast.parse(fair)), fair


# --- the table of words ---------------------------------------------------------------------------------------------


def fields(template: str) -> tuple[set[str], set[str]]:
    """Names that a template needs, and those that it says only where they are given."""
    optional = "".join(re.findall(r"\[([^\[\]]*)\]", template))
    needed = re.sub(r"\[[^\[\]]*\]", "", template)
    return tuple({name for _, name, _, _ in Formatter().parse(part) if name} for part in (needed, optional))  # type: ignore[return-value]


def test_every_code_is_spoken_once():
    topics = [path.read_text(encoding="utf-8") for path in Path(english.__file__).parent.glob("*.py")]
    names = re.findall(r"^    ([A-Z]\w+) = Phrase\(", "\n".join(topics), re.MULTILINE)
    assert len(set(names)) == len(names)
    assert sorted(getattr(Code, name) for name in names) == sorted(TABLE)


def test_codes_are_kebab_case_and_called_alike():
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", c) and getattr(Code, attribute(c)) == c for c in TABLE)


def attribute(code: str) -> str:
    """What a code is called in programs."""
    return code.replace("-", "_").upper()


def test_every_code_has_a_sentence_and_an_advice():
    for code, words in TABLE.items():
        assert words.sentence and not words.sentence.endswith("."), f"{code}: a sentence without its full stop"
        assert words.sentence == words.sentence.strip() and words.advice == words.advice.strip(), code
        assert (words.advice == "") == (code in FACTS), code
        assert not words.advice or words.advice.rstrip("]").endswith("."), f"{code}: advice is a sentence of its own"


SAY = ("Remark.of", "refuse", "qualify", "doubt", "note")  # what gives numbers to a code


def test_what_a_check_declares_is_a_sentence_with_an_advice():
    for package in ALL:
        checks(package)
    assert DECLARED and not set(DECLARED) & set(TABLE)
    for code, words in DECLARED.items():
        assert re.fullmatch(r"[a-z]+(-[a-z]+)*", code), code
        assert words.sentence == words.sentence.strip() and not words.sentence.endswith("."), code
        assert not words.advice or words.advice.rstrip("]").endswith("."), code
    with pytest.raises(ValueError, match="has a sentence already"):
        declare("one-place", "another sentence")


def test_only_checks_declare_their_sentences(programs):
    # another module is not imported where the table of codes is made: its code would be missing there, or not, by what ran before
    calls = {
        path
        for path, tree in programs.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "declare"
    }
    packages = tuple(p.removeprefix("robocal.").replace(".", "/") for p in ALL)
    assert calls and {path for path in calls if not path.startswith(packages)} == set()


def uses(programs: dict[str, ast.Module]) -> dict[str, list[tuple[str, ast.Call | None]]]:
    """Where every code is named outside the tables, and the call of Remark.of that it is given to."""
    out: dict[str, list[tuple[str, ast.Call | None]]] = {}
    for path, tree in programs.items():
        given: dict[int, ast.Call] = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and node.args and ast.unparse(node.func) in SAY:
                given |= {id(n): node for n in ast.walk(node.args[0])}
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "Code":
                where = f"{path}:{node.lineno}"
                out.setdefault(node.attr, []).append((where, given.get(id(node))))
    return out


def test_every_code_is_used_and_its_sentence_is_given_its_numbers(programs):
    used = uses(programs)
    assert set(used) == set(map(attribute, TABLE))
    for code in TABLE:
        needed, optional = fields(TABLE[code].sentence + TABLE[code].advice)
        for where, call in used[attribute(code)]:
            if call is None or any(k.arg is None for k in call.keywords):
                continue  # named elsewhere, or given numbers that were gathered before
            names = {str(k.arg) for k in call.keywords}
            # A file is added to what is said of its content.
            assert needed - {"file"} <= names and names <= needed | optional, f"{where}: {code}"


# --- a remark -------------------------------------------------------------------------------------------------------


def test_a_remark_speaks():
    told_ = Remark.of(Code.UNEXPLAINED, explained=0.36, rms=Quantity(1.5e-3), stated=None)
    assert told_.sentence.endswith("1.5 mm rms") and told_.numbers["rms"] == Quantity(1.5e-3)
    more = Remark.of(Code.UNEXPLAINED, explained=0.36, rms=Quantity(1.5e-3), stated=Quantity(1e-4))
    assert more.sentence == told_.sentence + ", where 0.1 mm of noise was stated"
    assert more.document["numbers"] == {
        "explained": 0.36,
        "rms": {"value": 1.5, "unit": "mm"},
        "stated": {"value": 0.1, "unit": "mm"},
    }
    assert f"{Quantity(1e-3):.3g~} {Quantity(0.5, 'rad'):.3g} {Quantity(2.0, 'N')}" == "1 28.6 deg 2 N"


def test_remarks_are_told_once():
    one, other = Remark.of(Code.NO_DIAMETER), Remark.of(Code.TENSIONS_ASIDE, robot="r")
    assert sentences([one, other, one]) == [one.sentence, other.sentence]
    assert [d["code"] for d in documents([other, one, other])] == ["tensions-aside", "no-diameter"]
    assert remark_fields([one], "reasons") == {"reasons": [one.sentence], "remarks": [one.document]}


def test_what_is_said_of_a_file_begins_with_it():
    for code in (c for c in TABLE if "{file}" in TABLE[c].sentence):
        assert TABLE[code].sentence.startswith(("{file}", "[{file}: ]")), code

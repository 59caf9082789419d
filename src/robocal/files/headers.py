"""A CSV that describes itself: headers with units, `j1 [deg]`, `x [mm]`, to what a data.yaml would have said."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robocal.errors import FormatError
from robocal.files.csvtable import CsvTable
from robocal.files.unread import near_miss
from robocal.measure.machine import Model, joints_of
from robocal.measure.reach import names_of

__all__ = [
    "CONFIGURATION",
    "PER_JOINT",
    "configuration_columns",
    "joint_columns",
    "row_names",
    "self_description",
    "vocabulary",
]

# Columns of a configuration that have a meaning, and their SI unit.
CONFIGURATION = {
    "id": "", "time": "s", "temperature": "K", "payload": "kg", "approach": "1", "direction": "1", "place": "1",
}  # fmt: skip
PER_JOINT = ("approach", "torque")  # columns that exist once per joint, as approach.j2
STEMS = ("q", "j", "q_", "joint_", "joint", "a", "axis", "axis_", "j_", "theta")  # what numbered joints are called
IDS = ("id", "configuration", "pose_id")
SIGMAS = (("sx", "sy", "sz"), ("sigma_x", "sigma_y", "sigma_z"), ("std_x", "std_y", "std_z"))
TURN_SIGMAS = (("srx", "sry", "srz"), ("sigma_rx", "sigma_ry", "sigma_rz"))
POSITIONS = (("x", "y", "z"), ("px", "py", "pz"))
TURNS: tuple[tuple[tuple[str, ...], str], ...] = (
    (("qx", "qy", "qz", "qw"), "quaternion_xyzw"),
    (("rx", "ry", "rz"), "rotation_vector"),
)


def joint_columns(table: CsvTable, chain: Model) -> list[str]:
    """The columns named like the robot's joints, or q1, q2, ... Raises FormatError when there are none or too few."""
    n = len(joints_of(chain))
    if not n:
        return []
    numbered = (tuple(f"{stem}{i}" for i in range(1, n + 1)) for stem in STEMS)
    for names in (names_of(chain), *numbered):
        if all(map(table.has, names)):
            stem = names[-1].rstrip("0123456789")
            last = names[-1].removeprefix(stem)
            following = f"{stem}{int(last) + 1}" if last and names[0].startswith(stem) else ""
            if following and table.has(following):
                found, expected = f"{following} as well", f"{n} for {chain.name}"
                raise table.fail("wrong number of joint columns", found=found, expected=expected)
            return list(names)
    own = f"{names_of(chain)[0]} to {names_of(chain)[-1]}"
    expected = f"{n} columns {own} or q1 to q{n}, or a data file that names them"
    raise table.fail("there are no columns for the joints", found=", ".join(table.names), expected=expected)


def row_names(table: CsvTable, what: str) -> tuple[str, ...]:
    """The name of each row: its id, else file and line. Raises FormatError for one that is given twice, saying `what` share it."""
    named = next(filter(table.has, IDS), None)
    if named is None:
        return tuple(f"{table.path.name}:{line}" for line in table.lines)
    names, seen = table.texts(named), set[str]()
    for row, name in enumerate(names):
        if name in seen:
            raise table.fail(f"two {what} have one name", row, named, found=name, expected="a name for each")
        seen.add(name)
    return names


def vocabulary(chain: Model) -> tuple[str, ...]:
    """Every header that has a meaning in some table of this arm."""
    joints = names_of(chain)
    numbered = [f"{stem}{i}" for stem in ("q", "j") for i in range(1, len(joints) + 1)]
    each = [f"{stem}.{name}" for stem in ("second", "speed", *PER_JOINT) for name in (*joints, *numbered)]
    groups = (*POSITIONS, *SIGMAS, *(names for names, _ in TURNS), *TURN_SIGMAS)
    others = [n for sections in OTHERS.values() for _, names, spread in sections for n in (*names, *spread)]
    located = [n for names in groups for n in names]
    known = (*IDS, *CONFIGURATION, "group", "target", "second", *located, *others)
    cables = chain.parts.get("cable", ())
    return tuple(dict.fromkeys((*known, *joints, *numbered, *each, *cables, *(f"s_{name}" for name in cables))))


def self_description(table: CsvTable, chain: Model, kind: str | None) -> dict[str, Any]:
    """The mapping that a data.yaml for this table would hold. Raises FormatError when the headers do not say enough."""
    joints = joint_columns(table, chain)
    out: dict[str, Any] = {"robocal": 1, "file": table.path.name}
    if joints:
        out["joints"] = {"columns": joints}
    second = [f"second.{name}" for name in joints]
    two = bool(joints) and _first(table, (second,)) is not None
    cables = chain.parts.get("cable", ())
    if cables and kind in (None, "lengths") and all(map(table.has, cables)):
        spread = tuple(f"s_{name}" for name in cables)
        found: dict[str, Any] | None = {
            "kind": "lengths",
            "lengths": {"columns": list(cables)} | _sigma(table, (spread,)),
        }
    elif "rope" in chain.parts:
        found = _load(table)
    else:
        found = _other(table, two) if kind is None or kind in OTHERS else None
        if found is None and joints and kind in (None, "joint_torque"):
            found = _torques(table, joints, kind)
    out |= _position_headers(table, two, kind, cables) if found is None else found
    if two:
        out["second"] = {"columns": second}
    if table.has("target"):
        out["target"] = "target"
    group = {"group": "group"} if table.has("group") else {}
    out["configuration"] = configuration_columns(table) | group
    if out.get("kind") == "joint_torque":
        for name in out["torque"]["columns"]:
            out["configuration"].pop(name, None)
    return out


def configuration_columns(table: CsvTable, ids: tuple[str, ...] = IDS) -> dict[str, str]:
    """The columns of configurations, by their headers; the first of `ids` that is there names the rows."""
    columns = {name: name for name in CONFIGURATION if table.has(name) and name != "id"}
    columns |= {name: name for name in table.names if name.partition(".")[0] in PER_JOINT and "." in name}
    found_id = next(filter(table.has, ids), None)
    return columns | ({"id": found_id} if found_id else {})


def matrices(table: CsvTable) -> list[str]:
    """The prefixes of columns that hold a matrix: NAME_00 to NAME_22."""
    stems = [n.removesuffix("_00") for n in table.names if n.endswith("_00")]
    return [n for n in stems if f"{n}_22" in table.names]


def matrix_header(table: CsvTable, what: str, expected: str) -> dict[str, Any]:
    """What a data file would say of the one matrix of a table. Raises FormatError where several could be `what`."""
    prefixes = matrices(table)
    if len(prefixes) > 1:
        raise table.fail(f"several columns could be {what}", found=", ".join(prefixes), expected=expected)
    return {"columns": prefixes[0], "form": "matrix"}


# Kinds whose columns need no frame or place to be described: their key, columns and sigmas, from the most telling one.
OTHERS: dict[str, tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...]] = {
    "spherical": (
        ("range", ("range",), ("s_range",)),
        ("bearing", ("azimuth", "elevation"), ("s_azimuth", "s_elevation")),
    ),
    "bearing": (("bearing", ("azimuth", "elevation"), ("s_azimuth", "s_elevation")),),
    "displacement": (("displacement", ("dx", "dy", "dz"), ("sdx", "sdy", "sdz")),),
    "distance": (("distance", ("distance",), ("s_distance",)),),
}


# What was measured of a cable by itself.
LOADS = {"sag": (("s_sag",),), "elongation": (("s_elongation",),)}


def _load(table: CsvTable) -> dict[str, Any]:
    """What the headers of loads say. Raises FormatError where they are of none, or of both."""
    there = [name for name in LOADS if table.has(name)]
    if len(there) != 1:
        expected = f"one column {' or '.join(f'{n} [mm]' for n in LOADS)}, beside tension [N]"
        raise table.fail("these headers say of no load what it does", found=", ".join(table.names), expected=expected)
    return {"kind": there[0], there[0]: {"columns": there} | _sigma(table, LOADS[there[0]])}


def _torques(table: CsvTable, joints: list[str], kind: str | None) -> dict[str, Any] | None:
    """What the headers of torques at joints say, torque.j1 and speed.j1; None of a table with positions, where they are what the joints
    bore, unless the kind is asked for. Raises FormatError where some joints have none."""
    each = {key: [f"{key}.{name}" for name in joints] for key in ("torque", "speed")}
    there = {key: [n for n in names if table.has(n)] for key, names in each.items()}
    located = any(all(map(table.has, names)) for names in POSITIONS) or bool(matrices(table))
    if kind is None and (located or not there["torque"]):
        return None
    for key, names in each.items():
        lost = [n for n in names if n not in there[key]]
        if lost and (key == "torque" or there[key]):
            raise table.fail(f"a {key} of every joint is needed", column=lost[0], expected=", ".join(names))
    speed = {"speed": {"columns": each["speed"]}} if there["speed"] else {}
    return {"kind": "joint_torque", "torque": {"columns": each["torque"]}, **speed}


def _other(table: CsvTable, two: bool) -> dict[str, Any] | None:
    """What the headers of a kind without a position say; None when they are of none."""
    for kind, sections in OTHERS.items():
        needs_two = kind in ("displacement", "distance")
        if two == needs_two and all(table.has(n) for _, names, _ in sections for n in names):
            made = {key: {"columns": list(names)} | _sigma(table, (spread,)) for key, names, spread in sections}
            return {"kind": kind, **made}
    return None


def _position_headers(table: CsvTable, two: bool, kind: str | None, cables: Sequence[str] = ()) -> dict[str, Any]:
    """What the headers of positions and poses say."""
    out: dict[str, Any] = {}
    position = _first(table, POSITIONS, least=4)
    turn = next(((list(c), f) for c, f in TURNS if _first(table, (c,), least=2)), None)
    prefixes = matrices(table)
    if prefixes and turn is None:
        out["orientation"] = matrix_header(table, "the measured pose", "a data file that names one")
    elif turn is not None:
        out["orientation"] = {"columns": turn[0], "form": turn[1]}
    if position:
        out["position"] = {"columns": position} | _sigma(table, SIGMAS)
    elif not (prefixes and prefixes[0] + "_03" in table.names):
        expected = "x [mm], y [mm], z [mm]; or what another kind measures, or a data file"
        message = "there are no columns for the position"
        if cables and kind is None:
            message = "there are columns neither for the cables nor for the position"
            expected = f"{', '.join(cables)}, with a unit: {cables[0]} [mm]; or x [mm], y [mm], z [mm]"
        raise table.fail(message, found=", ".join(table.names), expected=expected)
    if "orientation" in out:
        out["orientation"] |= _sigma(table, TURN_SIGMAS)
    usual = "relative_pose" if two else "pose"
    return {**out, "kind": kind or (usual if "orientation" in out else "position")}


def _first(table: CsvTable, options: Sequence[Sequence[str]], least: int = 1) -> list[str] | None:
    """The first of some sets of columns that is there. Raises FormatError where `least` of a set are there and others are
    not, unless another set is whole: without a word the measurements would count as something else."""
    whole = next((list(o) for o in options if all(map(table.has, o))), None)
    for names in options if whole is None else ():
        there = list(filter(table.has, names))
        if len(there) >= least:
            absent = next(n for n in names if not table.has(n))
            free = [n for n in table.names if n and n not in names]
            found, expected = ", ".join(n for n in table.names if n.casefold() in there), ", ".join(names)
            raise FormatError(
                "some columns of a set are missing", file=table.path, row=table.head, column=absent,
                found=found, expected=expected, suggestion=near_miss(absent, free),
            )  # fmt: skip
    return whole


def _sigma(table: CsvTable, options: Sequence[Sequence[str]]) -> dict[str, Any]:
    columns = _first(table, options)
    return {"sigma": {"columns": columns}} if columns else {}

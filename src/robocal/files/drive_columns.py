"""Which columns of a log are the time, the angle and the effort of a motor: by names of robocal, by `--columns`, and by what the headers
of drives mean.

A file may have several motors. Their columns carry a name behind a point, or a number: `angle.left`, `current.left`, `angle 2`,
`motor2 current`. Time and flag may be those of all. What is missing is told at once, with the columns that it probably is: headers in
other languages, and those of ODrive, moteus and SimpleFOC, whose units are known.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from robocal.errors import ModelError, one_of
from robocal.files.csvtable import CsvTable

__all__ = ["COLUMNS", "EFFORTS", "SI", "Told", "by_headers", "insist_known", "named"]

EFFORTS = {"current": "A", "torque": "N m"}
SI = {"time": "s", "angle": "rad", **EFFORTS}
COLUMNS = {
    "time": ("time", "t"),
    "angle": ("angle", "position", "theta", "pos"),
    "current": ("current", "iq", "i"),
    "torque": ("torque", "tau"),
    "flag": ("flag", "compensation"),
}
SHARED = ("time", "flag")
Told = dict[str, tuple[str | int, str | None]]  # what a log holds of one motor: column and unit
NUMBERED = r"[A-Za-z]*[ _-]?\d+"
# What headers mean, the surest first; with the unit, where a program writes no other. Of short words the whole word counts.
MEANINGS: Mapping[str, Sequence[tuple[str, str | None]]] = {
    "time": (("time", None), ("zeit", None), ("temps", None), ("tiempo", None), ("tempo", None), ("seconds", "s"), ("t", None)),
    "angle": (
        ("pos_estimate", "turn"), ("shaft_angle", "rad"), ("winkel", None), ("lage", None), ("angle", None), ("theta", None),
        ("position", None), ("posicion", None), ("angolo", None), ("pos", None),
    ),
    "current": (
        ("iq_measured", "A"), ("q_current", "A"), ("strom", None), ("courant", None), ("corriente", None), ("corrente", None),
        ("iq_setpoint", "A"), ("current", None), ("iq", None), ("i", None),
    ),
    "torque": (("torque", None), ("drehmoment", None), ("moment", None), ("couple", None), ("coppia", None), ("tau", None)),
}  # fmt: skip
ELSE = ("vel", "speed", "geschw", "setpoint", "soll", "target", "error", "fehler", "elec", "elek")  # no angle
TURNS = {"q_current", "d_current"}  # beside these the position of moteus counts turns
WORDS = {"time": "the time", "angle": "the angle", "effort": "a current or a torque"}


def named(words: Sequence[str]) -> dict[str, Told]:
    """Columns from words such as angle=Position:rad or angle.left=p1:rad, by motor; one without a name is "". Raises ModelError."""
    told: dict[str, Told] = {}
    for word in words:
        key, _, rest = word.partition("=")
        what, _, motor = key.partition(".")
        column, _, unit = rest.rpartition(":") if ":" in rest else (rest, "", "")
        if what not in COLUMNS:
            raise ModelError("a log has no such column", key="--columns", found=what, **one_of(what, COLUMNS))
        if not column:
            raise ModelError("not a column", key="--columns", found=word, expected=f"{what}=COLUMN:UNIT")
        told.setdefault(motor, {})[what] = (int(column) if column.isdigit() else column, unit or None)
    return _share(told)


def by_headers(table: CsvTable) -> dict[str, Told]:
    """Columns that the headers of a file name, by motor. Raises FormatError."""
    told: Told = {}
    for what, words in COLUMNS.items():
        here = [w for w in words if table.has(w)]
        if len(here) > 1:
            raise table.fail(
                f"two columns may be the {what}", column=here[1], found=" and ".join(here), expected="--columns"
            )
        if here:
            told[what] = (here[0], None)
    if "angle" in told:
        return {"": told}
    several: dict[str, Told] = {}
    for name in table.names:
        for what, words in COLUMNS.items():
            any_word = "|".join(words)
            hit = re.fullmatch(
                rf"(?i:{any_word})(?:\.(?P<name>\S+)|[ _-]?(?P<number>{NUMBERED}))", name
            ) or re.fullmatch(rf"(?P<number>{NUMBERED})[ ._-](?i:{any_word})", name)
            if hit:
                motor = hit.groupdict().get("name") or hit["number"]
                several.setdefault(motor, {}).setdefault(what, (name, None))
    whole = {m: t for m, t in several.items() if "angle" in t and any(k in t for k in EFFORTS)}
    return _share({"": {k: v for k, v in told.items() if k in SHARED}, **whole}) if whole else {"": told}


def _share(told: dict[str, Told]) -> dict[str, Told]:
    """Time and flag of all to each of several motors."""
    every = told.get("", {})
    if set(told) <= {""} or any(k not in SHARED for k in every):
        return told or {"": {}}
    return {m: {**every, **t} for m, t in told.items() if m}


def insist_known(table: CsvTable, told: Told) -> None:
    """Raises FormatError with all that is missing: columns, then units; and with the columns that they probably are."""
    efforts = [k for k in EFFORTS if k in told]
    headers = ", ".join(n for n in table.names if n)
    if len(efforts) > 1:
        raise table.fail(
            "torque and current: one of them is the effort",
            found=headers,
            expected=f"--columns {efforts[0]}=COLUMN:UNIT alone",
        )
    missing = [*(w for w in ("time", "angle") if w not in told), *(() if efforts else ("effort",))]
    words = [WORDS[w] for w in missing]
    if missing:
        raise table.fail(
            f"no column is {_list(words, 'or')}", found=headers or "no headers", expected=_proposal(table, told)
        )
    bare = [k for k in ("time", "angle", *efforts) if told[k][1] is None and table.unit(told[k][0]) is None]
    if bare:
        columns = ", ".join(str(table.label(table.find(told[k][0]))) for k in bare)
        verb = "are" if len(bare) > 1 else "is"
        message = f"the unit of {_list([f'the {k}' for k in bare], 'and')} {verb} not named"
        raise table.fail(message, found=columns, expected=_proposal(table, told))
    at = told["angle"][0]
    title = str(table.label(table.find(at)))
    if re.search(r"(?i)\bele[ck]", title.replace("_", " ")):
        expected = "the angle of the shaft: an electrical turn is one of a pole pair"
        raise table.fail("the angle is an electrical one", column=title, expected=expected)


def _list(words: Sequence[str], last: str) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"


def _proposal(table: CsvTable, told: Told) -> str:
    """The words of `--columns` that would read the file, by what its headers mean."""
    guess = {w: _guess(table, w) for w in MEANINGS}
    effort = next((k for k in EFFORTS if k in told), None) or next((k for k in EFFORTS if guess[k]), "current")
    words, sure = list[str](), True
    for what in ("time", "angle", effort):
        column, unit = told.get(what) or guess[what] or ("COLUMN", None)
        meant = guess[what]
        unit = unit or (meant[1] if meant and column in (meant[0], meant[0].casefold()) else None)
        own = table.unit(column) if column != "COLUMN" else None
        sure = sure and bool(own or unit)
        words.append(f"{what}={column}:{own or unit or SI[what].replace(' ', '')}")
    line = ",".join(words)
    quoted = f"'{line}'" if re.search(r"[ ()*]", line) else line
    return f"--columns {quoted}{'' if sure else ', with the units that they have'}; or a data.yaml"


def _guess(table: CsvTable, what: str) -> tuple[str, str | None] | None:
    """The column whose header means something, with the unit that its program writes."""
    turns = any(n.casefold() in TURNS for n in table.names)
    for word, unit in MEANINGS[what]:
        for name in table.names:
            plain = name.casefold()
            tokens = re.split(r"[^a-z0-9_]+", plain)
            if (word in plain if len(word) > 3 else word in (*tokens, *re.split(r"[^a-z0-9]+", plain))) and not (
                what in ("angle", "torque") and any(w in plain for w in ELSE)
            ):
                return name, "turn" if turns and word == "position" else unit
    return None

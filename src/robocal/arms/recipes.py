"""Conventions whose parameters are the values of elementary transforms: DH and its relatives, S-model, MCPC, and free
lists of elements.

A recipe is an ordered list axis:symbol; the joint value adds to one symbol. Sources: Denavit and Hartenberg, A
kinematic notation for lower-pair mechanisms (1955); Hayati, Robot arm geometric link parameter estimation (1983) for
beta; Craig, Introduction to robotics (1986), and Khalil and Kleinfinger, A new geometric notation (1986), for the
modified form; Stone, Kinematic modeling, identification, and control of robotic manipulators (1987), for the S-model;
Zhuang, Wang and Roth, Error-model-based robot calibration using a modified CPC model (1993).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from robocal.arms.row_builder import Convention, Key, Row, RowBuilder, check_axis, finite
from robocal.errors import ModelError, one_of

__all__ = ["ELEMENTS", "RECIPES"]

MEANING = {
    "theta": "turn about the joint's z axis",
    "d": "shift along the joint's z axis",
    "a": "shift along the common normal x",
    "alpha": "twist about x",
    "beta": "second twist, about y (Hayati): what near-parallel axes need",
    "r": "shift along the joint's z axis",
    "gamma": "turn about the next joint's axis",
    "b": "shift along the next joint's axis",
    "x": "shift along x",
    "y": "shift along y",
}


# Few controllers have a place for Hayati's twist: where data cannot tell it from a parameter that they know, that is kept.
HAYATI, UNKNOWN = ("ry", "beta"), -1
# In the S-model beta is the joint's own turn, not Hayati's.
_MEANING_OF = {
    "s-model": {"beta": "turn about the joint's z axis"},
    "khalil": {"d": MEANING["a"]},
    "khalil-hayati": {"d": MEANING["a"]},
}


def _recipe(name: str, recipe: str, revolute: str, prismatic: str, complete: bool, source: str) -> Convention:
    """The convention of a recipe: one key per symbol, zero when absent; a joint drives the symbol that is named for its type."""
    steps = [(axis, symbol) for axis, _, symbol in (word.partition(":") for word in recipe.split())]

    def write(pen: RowBuilder) -> None:
        driven = {"revolute": revolute, "prismatic": prismatic}.get(pen.kind)
        for axis, symbol in steps:
            preference = UNKNOWN if (axis, symbol) == HAYATI else 0
            pen.step(axis, symbol, pen.number(symbol), driven=float(symbol == driven), preference=preference)

    quantity = {"t": "length", "r": "angle"}
    meaning = MEANING | _MEANING_OF.get(name, {})
    keys = tuple(Key(symbol, quantity[axis[0]], 0.0, meaning[symbol]) for axis, symbol in steps)
    # In words of the field, as `Rz(theta) Tz(d) Tx(a) Rx(alpha)`.
    formula = " ".join(f"{axis[0].upper()}{axis[1]}({symbol})" for axis, symbol in steps)
    return Convention(name, keys, write, revolute, prismatic, complete, formula, source)


KHALIL = "Khalil and Kleinfinger (1986)"
RECIPES = (
    _recipe("dh", "rz:theta tz:d tx:a rx:alpha", "theta", "d", False, "Denavit and Hartenberg (1955)"),
    _recipe("dh-hayati", "rz:theta tz:d tx:a rx:alpha ry:beta", "theta", "d", True, "Hayati (1983)"),
    _recipe("mdh", "rx:alpha tx:a rz:theta tz:d", "theta", "d", False, "Craig (1986)"),
    _recipe("mdh-hayati", "ry:beta rx:alpha tx:a rz:theta tz:d", "theta", "d", True, "Craig (1986), Hayati (1983)"),
    _recipe("khalil", "rx:alpha tx:d rz:theta tz:r", "theta", "r", False, KHALIL),
    _recipe("khalil-hayati", "ry:beta rx:alpha tx:d rz:theta tz:r", "theta", "r", True, f"{KHALIL}, Hayati (1983)"),
    _recipe("s-model", "rz:beta tz:d tx:a rx:alpha rz:gamma tz:b", "beta", "d", False, "Stone (1987)"),
    _recipe("mcpc", "rz:theta tz:d rx:alpha ry:beta tx:x ty:y", "theta", "d", True, "Zhuang, Wang and Roth (1993)"),
)


# --- a free list of elements ----------------------------------------------------------------------------------------

STEP_KEYS = ("axis", "value", "symbol", "driven")


def _steps(pen: RowBuilder) -> list[dict[str, Any]]:
    """The list of a row, each entry checked: axis, value, symbol (or None), driven (0, 1 or -1)."""
    given = pen.raw("elements")
    where = f"{pen.joint}.elements"
    if isinstance(given, str | bytes) or not isinstance(given, Sequence):
        raise ModelError("wrong shape", key=where, found=given, expected="a list of {axis, value, symbol, driven}")
    out = []
    for i, entry in enumerate(given):
        at = f"{where}[{i}]"
        if not isinstance(entry, Mapping):
            raise ModelError("wrong shape", key=at, found=entry, expected="{axis, value, symbol, driven}")
        for word in entry:
            if word not in STEP_KEYS:
                raise ModelError("unknown key", key=f"{at}.{word}", **one_of(word, STEP_KEYS))
        symbol, driven = entry.get("symbol"), entry.get("driven", 0)
        if symbol is not None and (
            not isinstance(symbol, str) or not symbol or "." in symbol or symbol in ("gain", "offset")
        ):
            expected = "a word without a dot, not gain, offset"
            raise ModelError("not a symbol", key=f"{at}.symbol", found=symbol, expected=expected)
        if driven not in (0, 1, -1):
            raise ModelError("not a sign", key=f"{at}.driven", found=driven, expected="true, or 1 or -1")
        value = finite(entry.get("value", 0.0), f"{at}.value")
        axis = check_axis(entry.get("axis"), f"{at}.axis")
        out.append({"axis": axis, "value": value, "symbol": symbol, "driven": int(driven)})
    return out


def _write_elements(pen: RowBuilder) -> None:
    steps = _steps(pen)
    driven = [s for s in steps if s["driven"]]
    letter = {"revolute": "r", "prismatic": "t"}.get(pen.kind)
    if (letter is None and driven) or (letter and (len(driven) != 1 or driven[0]["axis"][0] != letter)):
        one = f"exactly one, on an axis {letter}x, {letter}y or {letter}z"
        wanted = one if letter else "none for a fixed row"
        raise ModelError("wrong driven elements", key=f"{pen.joint}.elements", found=len(driven), expected=wanted)
    for s in steps:
        if s["driven"]:
            symbol = s["symbol"] or "offset"
            pen.step(s["axis"], symbol, s["value"], driven=s["driven"], held=symbol == "offset")
        elif s["symbol"]:
            pen.step(s["axis"], s["symbol"], s["value"])
        else:
            pen.constant(s["axis"], s["value"])


def _read_elements(row: Row, values: Mapping[str, float]) -> dict[str, object]:
    given = row["elements"]
    assert isinstance(given, Sequence)
    made = []
    for entry in given:
        symbol = entry.get("symbol") or ("offset" if entry.get("driven") else None)
        made.append({**entry, "value": values[symbol]} if symbol else dict(entry))
    return {**row, "elements": made}


_KEYS = (Key("elements", "steps", None, "the transforms in order; one without a symbol is a constant"),)
# Per joint a list of elementary transforms, each with a symbol and value of its own, one of them driven by the joint.
ELEMENTS = Convention(
    "elements", _KEYS, _write_elements, "the driven element", "the driven element", False, "the product of the listed elements",
    "complete when its elements are", read=_read_elements,
)  # fmt: skip

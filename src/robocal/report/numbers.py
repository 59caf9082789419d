"""Numbers as people read them: sigma decides the digits, a missing value is a dash, and minus is a minus sign."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

__all__ = [
    "MISSING", "align", "decimals", "finite", "instrument_frames", "plain", "power_of_ten", "ranges", "scientific",
    "significant", "unit_text", "with_decimals", "with_unit",
]  # fmt: skip

MISSING = "–"
_UNITS = {"deg": "°", "degree": "°", "degrees": "°", "um": "µm", "-": "", "1": ""}
LONG = 18  # digits: what is longer is no number of a row
ROBOT = {"base", "tool", "home"}  # frames of the robot itself


def finite(value: object) -> float | None:
    """A usable number, or None for everything else (null, text, NaN, infinity)."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def decimals(size: float, digits: int = 2) -> int:
    """How many decimals show `size` with that many significant digits, rounding up of 0.0996 to 0.10 included."""
    if not math.isfinite(size) or size == 0:
        return digits
    exponent = int(f"{abs(size):.{digits - 1}e}".split("e")[1])
    return min(max(digits - 1 - exponent, 0), 12)


def with_decimals(value: object, places: int) -> str:
    """A number with that many decimals; what rounds to zero carries no sign; what no column could hold becomes
    scientific."""
    number = finite(value)
    if number is None:
        return MISSING
    if abs(number) >= 1e9:
        return scientific(number, 2)
    text = f"{number:.{places}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "\u2212")


def significant(value: object, digits: int = 3) -> str:
    """A number with that many significant digits; scientific only where decimals would be silly."""
    number = finite(value)
    if number is None:
        return MISSING
    if number != 0 and not 1e-5 <= abs(number) < 1e7:
        return scientific(number, digits - 1)
    return with_decimals(number, decimals(number, digits))


def scientific(number: float, places: int) -> str:
    """A number as 4.10·10⁷."""
    mantissa, exponent = f"{number:.{places}e}".split("e")
    return mantissa.replace("-", "\u2212") + power_of_ten(exponent)


def power_of_ten(exponent: str) -> str:
    """What stands behind a mantissa: ·10⁻⁷ for -07."""
    return f"·10{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def plain(value: object) -> str:
    """A number that nothing gives digits to: as short as it was written."""
    number = finite(value)
    if number is None:
        return MISSING
    if number != 0 and not 1e-5 <= abs(number) < 1e7:
        return scientific(number, 3)
    text = f"{number:.7g}"
    return "0" if text == "-0" else text.replace("-", "\u2212")


def unit_text(unit: object) -> str:
    """A unit as it is printed."""
    text = "" if unit is None else str(unit)
    return _UNITS.get(text, text)


def with_unit(text: str, unit: object) -> str:
    """A printed number and its unit, kept on one line; the degree sign follows without a space."""
    shown = unit_text(unit)
    if not shown or text == MISSING:
        return text
    return text + shown if shown == "°" else f"{text}\u00a0{shown}"


def align(column: Sequence[str]) -> list[str]:
    """A column of printed numbers padded on the right with figure spaces so that decimal points stand below one
    another."""
    tails = [len(text) - text.find(".") if "." in text else 0 for text in column]
    most = max(tails, default=0)
    room = [("" if tail else "\u2008"[:most]).ljust(most - tail, "\u2007") for tail in tails]
    return [text if "·" in text else text + filled for text, filled in zip(column, room, strict=True)]


def ranges(names: Iterable[object]) -> str:
    """A list of names, consecutive whole numbers (also with one common prefix and width, p001 to p009) drawn
    together."""
    runs: list[list[str]] = []
    for name in map(str, names):
        if runs and _next(runs[-1][-1]) == name:
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(run) for run in runs)


def _next(name: str) -> str | None:
    last = name[-1:]
    if len(name) <= LONG and "0" <= last < "9":  # most of them
        return name[:-1] + chr(ord(last) + 1)
    head = name.rstrip("0123456789")
    tail = name[len(head) :]
    if not tail or not tail.isascii() or len(tail) > LONG:
        return None
    return head + str(int(tail) + 1).zfill(len(tail))


def instrument_frames(names: Iterable[str]) -> set[str]:
    """Owners of frames that belong to data files, of the names of all parameters: those with the six of a frame and no more that
    are not of the robot."""
    by_owner: dict[str, set[str]] = {}
    for name in names:
        owner, _, symbol = name.rpartition(".")
        by_owner.setdefault(owner, set()).add(symbol)
    frame = {"x", "y", "z", "rx", "ry", "rz"}
    return {o for o, own in by_owner.items() if own == frame and o not in ROBOT and not o.startswith("j")}

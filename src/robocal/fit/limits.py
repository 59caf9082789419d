"""The limits of a fit: where it may begin and end, and which configurations are one place; `diagnose.limits` has the others.

    LATE_SHARE = limit(0.5, "of the squares left", "why this number", "source")

A limit is a plain number where it is used; how it is declared stands here, since every package that has limits can import it.
"""

from __future__ import annotations

from typing import Any, TypeVar

from robocal._record import record

__all__ = [
    "BASELINE_LESS",
    "DECLARED",
    "FRAME_NEVER_TURNED",
    "FRAME_TURNED",
    "PLACE_DIAMETER",
    "PLACE_GAP",
    "PLACE_SHARE",
    "START_ASKS",
    "START_CLEARLY",
    "START_LOST",
    "START_POSES",
    "Limit",
    "limit",
    "topic",
]

T = TypeVar("T")
CHOICE = "choice"


@record
class Limit:
    """A number (or one for each unit) with its unit, the reason why it is no other, and where it comes from."""

    value: Any
    unit: str
    why: str
    source: str = CHOICE


DECLARED: list[tuple[str, Limit]] = []  # each under its topic
_TOPIC = [""]


def topic(title: str) -> None:
    """What follows belongs under this title."""
    _TOPIC[0] = title


def limit(value: T, unit: str, why: str, source: str = CHOICE) -> T:
    """Declares a limit, and returns its value."""
    DECLARED.append((_TOPIC[0], Limit(value, unit, why, source)))
    return value


# fmt: off

topic("Where a fit begins")
START_ASKS = limit(0.01, "of the mean distance of two frame anchors",
    "No making leaves lengths so far from poses, whatever the zeros.", "tests/unit/test_unknown_zeros.py")
START_CLEARLY = limit(0.5, "of that", "Another start must leave so much less, or the first one stands.", "tests/unit/test_unknown_zeros.py")
START_LOST = limit(0.01, "of the cost",
    "A lost closed form misses by half a turn; 0.3 rad leaves (0.3 / pi)^2 of that. To 1 rad nothing differs.",
    "tests/session/test_where_rank_is_asked.py")
START_POSES = limit(6, "poses", "Five give the four numbers of a cable, and one of them may be gross.")
BASELINE_LESS = limit(0.99, "of the cost",
    "Fits that end at one minimum agree to 1e-10; another minimum is rarely so near.", "tests/prove/test_baselines.py")

topic("Places that are visited again")
PLACE_DIAMETER = limit(0.15, "rad or m",
    "Fifty visits that scatter by a degree (sigma) in six joints are 6 deg apart, seldom 8.", "tests/prove/test_places.py")
PLACE_GAP = limit(4.0, "times its diameter",
    "What stands closer is no other place: rows of a path, poses of a dense list.", "tests/prove/test_places.py")
PLACE_SHARE = limit(1 / 3, "of the configurations",
    "Of poses drawn by chance fewer stand so: 1 in 20 with two joints, 1 in 5 along a line.", "tests/prove/test_places.py")

topic("Frames that nothing holds")
FRAME_NEVER_TURNED = limit(4e-3, "of what tells a frame at the fit",
    "So much is there at the nominal robot at least: one orientation has 0.001, encoders that stray on it 0.005.",
    "tests/prove/test_one_orientation.py")
FRAME_TURNED = limit(0.5, "of what tells a frame at the fit",
    "The same where a fit does not converge without it; ordinary data have 0.95 and more.", "tests/prove/test_one_orientation.py")

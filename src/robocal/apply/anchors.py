"""Which frame anchor of a cable robot moved between two calibrations.

    d = x_2 - x_1 = G m + E_i e + noise

x are frame anchors and zeros, m motions of the base that may differ, E_i the anchor of one cable; the tests are those of `difference`.
Three things differ from `drift`, because cables do. Anchors and zeros are all fitted, so every direction is seen and the covariance
has an inverse. Where the base is tells its coordinates alone, so motions of it are causes as any other. And what changes is a part,
three numbers of one anchor, beside a zero that looks the same along the line of sight: where zeros stand unchanged, d is
conditioned on that, and this direction is then known as well as any other; elsewhere zeros are nobody's business and are left out.
The cable whose e explains most is named while chance would show as much less than `DRIFT_PART_CHANCE` times in one comparison of all
cables. Before them comes one cause that moves all anchors: another size, about any point, as of an instrument whose scale is another
or of a frame that is warmer. It is named where it explains more than any one anchor, and is free when anchors are looked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.apply.difference import ROUNDING, TINY, Difference, Known, name_parts, smallest_named, tail
from robocal.cables.calibration.comparison import growth, sights
from robocal.cables.geometry import CableRobot
from robocal.diagnose.limits import DRIFT_PART_CHANCE
from robocal.errors import ModelError

__all__ = ["AnchorDrift", "CableChange", "compare_anchors"]

IN_PLANE = 0.99  # of a line of sight lies in the plane of the two numbers that were found: a robot in a plane
XYZ, ANCHOR = "xyz", ("ax", "ay", "az")
ZERO = "l0"


@record(eq=False)
class CableChange:
    """One cable: change of its anchor (3,), m, with its covariance (3, 3), and of its zero with its standard deviation; unit vector
    `sight` (3,) from the anchor towards the platform.

    `chance` is that of so large a change of the anchor without any, `of_all` the same of the most conspicuous of all cables; `moved`
    whether the anchor is named, `doubtful` whether anchor or zero changed and the data do not say which. `smallest` are drifts, m,
    that would be named with a chance of POWER: along the line of sight, and across it at worst; infinite where the anchor was not
    found in both.
    """

    cable: str
    shift: Array
    covariance: Array
    zero: float
    zero_sigma: float
    sight: Array
    chance: float
    of_all: float
    moved: bool
    doubtful: bool
    smallest: tuple[float, float]

    @property
    def sigma(self) -> Array:
        """Standard deviations (3,) of the change of the anchor, m."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def along(self) -> float:
        """The part of the change along the line of sight."""
        return float(self.shift @ self.sight)

    @property
    def along_sigma(self) -> float:
        """The standard deviation of that part."""
        return float(np.sqrt(self.sight @ self.covariance @ self.sight))

    @property
    def across(self) -> float:
        """The length of the part across it."""
        return float(np.linalg.norm(self.shift - self.along * self.sight))


@record(eq=False)
class AnchorDrift:
    """Two calibrations compared: every cable; motion of the base (6,) as (v, w) with standard deviations where it may differ; change of
    the size of the frame, 1, with its standard deviation, and whether it is named; and the chance of all of it without any change."""

    cables: tuple[CableChange, ...]
    base: Array | None
    base_sigma: Array | None
    scale: float
    scale_sigma: float
    grown: bool
    chance: float

    @property
    def cables_moved(self) -> tuple[str, ...]:
        """The cables whose anchors are named."""
        return tuple(c.cable for c in self.cables if c.moved)


def compare_anchors(
    robot: CableRobot, first: Known, second: Known, *, zeros_unchanged: bool = False, base_moves: bool = False
) -> AnchorDrift:
    """Compares two calibrations of a robot; `zeros_unchanged` says that its sensors counted on in between, `base_moves` that the
    coordinates of the two need not be the same. Raises ModelError where they know nothing in common."""
    robot.need_straight(fixed=True)
    names = tuple(n for n in first.names if n in second.names and n in robot.table)
    if not names:
        raise ModelError("the two calibrations found nothing in common", expected="anchors or zeros found in both")
    full = Difference.between(first, second, names)
    if zeros_unchanged:
        full = full.given([i for i, n in enumerate(names) if n.endswith(f".{ZERO}")])
    anchors = full.only([i for i, n in enumerate(full.names) if n.rpartition(".")[2].startswith("a")])
    rates = [v for k, v in robot.motions.items() if k.startswith("the base")] if base_moves else []
    ground = anchors.columns(rates)
    parts = {c: [robot.row(f"{c}.{s}") for s in ANCHOR] for c in robot.cables}
    both = {c: [*own, robot.row(f"{c}.{ZERO}")] for c, own in parts.items()}
    shifts = [] if base_moves else [v for k, v in robot.motions.items() if k.startswith("the base along")]
    grown = _is_grown(robot, anchors, ground, anchors.columns(shifts), parts)
    causes = [*rates, *shifts, growth(robot)] if grown else rates
    beside = anchors.columns(causes)
    moved = name_parts(anchors, beside, parts, len(ANCHOR))
    either = name_parts(full, full.columns(causes), both, len(ANCHOR) + 1, moved)
    own = anchors.own([i for c in moved for i in anchors.find(parts[c])])
    free = np.hstack([ground, own])
    base = sigma = None
    if base_moves:
        covariance = np.linalg.pinv(free.T @ anchors.weight @ free, hermitian=True, rcond=ROUNDING)
        motion = covariance @ free.T @ anchors.weight @ anchors.step
        base, sigma = motion[: len(rates)], np.sqrt(np.diag(covariance))[: len(rates)]
    u, _ = anchors.beside(ground)
    changes = _changes(robot, full, anchors, beside, parts, moved, either)
    chance = tail(float(anchors.step @ u), max(len(anchors.step) - len(rates), 1), np.inf)
    scale = _scale(robot, anchors, np.hstack([anchors.columns([*rates, *(shifts if grown else [])]), own]))
    return AnchorDrift(changes, base, sigma, *scale, grown, chance)


def _is_grown(
    robot: CableRobot, anchors: Difference, ground: Array, shifts: Array, parts: Mapping[str, Sequence[str]]
) -> bool:
    """Whether another size of the frame, about any point, explains more than any one anchor, and more than chance would."""
    about = np.hstack([ground, shifts])
    if len(anchors.step) <= about.shape[1] + 1:
        return False
    size, sigma = _scale(robot, anchors, about)
    alone = (size / sigma) ** 2
    u, _ = anchors.beside(ground)
    v, _ = anchors.beside(about)
    explained = alone + float(anchors.step @ u) - float(anchors.step @ v)
    best = max(anchors.explained(anchors.find(own), ground) for own in parts.values())
    return len(parts) * tail(alone, 1, np.inf) < DRIFT_PART_CHANCE and explained > best


def _scale(robot: CableRobot, anchors: Difference, free: Array) -> tuple[float, float]:
    """Change of the size of the frame beside what is free, and its standard deviation."""
    u, p = anchors.beside(free)
    grown = anchors.columns([growth(robot)])[:, 0]
    information = float(grown @ p @ grown)
    return (float(grown @ u) / information, information**-0.5) if information > TINY else (0.0, np.inf)


def _smallest(covariance: Array, sight: Array, parts: int) -> tuple[float, float]:
    """The smallest drifts that would be named along a line of sight and across it; infinite where the anchor was not found."""
    length = float(np.linalg.norm(sight))
    whole = len(sight) == len(XYZ) or (len(sight) == 2 and length > IN_PLANE)
    return smallest_named(covariance, sight / length, parts) if whole and length else (np.inf, np.inf)


def _changes(
    robot: CableRobot, full: Difference, anchors: Difference, ground: Array, parts: Mapping[str, Sequence[str]],
    moved: Sequence[str], either: Sequence[str],
) -> tuple[CableChange, ...]:  # fmt: skip
    """Of every cable, the others that were named free."""
    many = len(robot.cables)
    places = {c: anchors.find(own) for c, own in parts.items()}
    changes = []
    for cable, sight in zip(robot.cables, sights(robot), strict=True):
        at = places[cable]
        others = [i for c in moved if c != cable and places[c] != at for i in places[c]]
        estimate, covariance, chance = anchors.change(at, np.hstack([ground, anchors.own(others)]))
        axes = [XYZ.index(anchors.names[where][-1]) for where in at]
        shift, spread = np.zeros(3), np.zeros((3, 3))
        shift[axes], spread[np.ix_(axes, axes)] = estimate, covariance
        zero = [(float(full.step[i]), float(full.sigma[i])) for i in full.find([robot.row(f"{cable}.{ZERO}")])]
        smallest = _smallest(covariance, sight[axes], many)
        changes.append(
            CableChange(
                cable, shift, spread, *(zero[0] if zero else (0.0, 0.0)), sight, chance, min(1.0, many * chance),
                any(places[c] == at for c in moved), cable in either, smallest,
            )
        )  # fmt: skip
    return tuple(changes)

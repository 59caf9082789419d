"""The page of a hand-eye calibration: the error in mm, what is normal, the poses to add, where camera and target are, the pairs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from robocal.remarks.remark import sentences
from robocal.report.sections import Section, Text, VerdictBlock, ends, figure, listing_table, quiet

__all__ = ["hand_eye_sections"]

VERDICTS: dict[str, tuple[str, Any, str]] = {
    "located": ("located", "good", "Camera and target are where views that were left out have them."),
    "not_improved": ("not located", "doubtful", "These views do not tell where camera and target are."),
    "refused": ("refused", "bad", "Do not use these numbers; they are listed for diagnosis only."),
}
BRIEF = 12  # views that a terminal lists
GOOD = 0.5  # grid: of what is normal: as calibrated arms


def hand_eye_sections(found: Any, written: Sequence[Path]) -> Iterator[Section]:
    """Error and verdict first, then what to do, then the numbers."""
    said, errors = found.verdict, found.errors
    word, style, meaning = VERDICTS[said.status]
    advice = () if said.status == "located" else tuple(dict.fromkeys(r.advice for r in said.remarks if r.advice))
    yield Section.of("", *_error(errors))
    yield Section.of("", VerdictBlock(word, style, tuple(sentences(said.remarks)), advice, meaning))
    if errors.lost:  # numbers of frames that are nowhere help nobody
        yield from _readings(found)
        yield from _pairs(found)
        yield from ends(found.warnings, written)
        return
    now, further = found.further
    which = "the base in the flange, as the file has poses" if found.opened.inverse else "the flange in the base"
    note = f"now the place of the target is sure to {figure(1e3 * now, 2)} mm (one standard deviation); {which}, if it can go there"
    yield Section.of("Three poses to add", listing_table(further), *quiet(note), key="further")
    one = found.frames[0]
    words = f"`{one.title}` is T_{one.parent}_{one.child}: it takes coordinates of the {one.child} to those of the {one.parent}."
    axes = "Axes of a camera: x to the right, y down, z forward, of the image."
    yield Section.of("Where they are", *map(listing_table, found.places), *quiet(f"{words} {axes}"), key="frames")
    if found.lens_numbers is not None:
        yield Section.of(
            "The lens", listing_table(found.lens_numbers), *quiet(found.opened.source.description), key="lens"
        )
    if found.unknowns is not None:
        yield Section.of("Clock and size", listing_table(found.unknowns), key="unknowns")
    yield from _readings(found)
    yield from _pairs(found)
    yield from ends(found.warnings, written)


def _readings(found: Any) -> Iterator[Section]:
    """How the robot's poses fare as stated and in other ways."""
    if found.alternatives:
        yield Section.of(
            "How the robot's poses were read",
            Text.of(found.opened.robot.notation),
            listing_table(found.readings),
            key="readings",
        )


def _pairs(found: Any) -> Iterator[Section]:
    """View and pose of every pair."""
    table = listing_table(found.pairs)
    pairs = type(table)(table.columns, table.rows, table.right, brief=BRIEF)
    alone = found.opened.pairs.poses_alone
    rest = f" and {len(alone) - BRIEF} more" if len(alone) > BRIEF else ""
    more = (f"poses without a view: {', '.join(alone[:BRIEF])}{rest}",) if alone else ()
    yield Section.of(
        "Which view has which pose", pairs, *quiet(f"paired {found.opened.pairs.description}", *more), key="pairs"
    )


def _error(errors: Any) -> Iterator[Text]:
    """The number that is asked for, and what it is to be compared with."""
    left = errors.left_out
    if errors.lost:
        yield Text.of(
            "Views that were left out are missed by more than the distance of the target: no number of this fit helps."
        )
        return
    if left is None:
        yield Text.of("No view was left out: the error at the target is not known.")
        return
    median = f"95 % below {figure(1e3 * left.p95, 2)} mm, the largest {figure(1e3 * left.max, 2)} mm"
    yield Text.of(
        (f"{figure(1e3 * left.rms, 2)} mm", "strong"),
        f"   error at the target, rms of {left.n} views that were left out ({errors.how}); {median}",
    )
    times = left.rms / errors.normal
    grade = "better than" if times < GOOD else "as good as" if times <= 1.5 else f"{times:.2g} times as much as"
    yield Text.of(
        f"{figure(1e3 * errors.normal, 2)} mm is normal here for an arm that nobody calibrated: this is {grade} that"
    )
    if errors.pixels is not None:
        yield from quiet(f"corners of these views: {figure(errors.pixels.rms, 3)} px (rms of both axes together)")

"""An identification on one screen: errors on unseen measurements, where they hold, what moved, what was left out, and what to do.

The terminal says this unless more is asked for (`Section.brief`); the first screen of a page says it beside the verdict.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robocal.remarks.remark import Message
from robocal.report.numbers import instrument_frames
from robocal.report.sections import Remarks, figure

__all__ = ["CHANGES", "changes", "first_remarks", "omissions", "range_sentence"]

ROOM = 60  # words of remarks on one screen
REMARKS = 3
CHANGES = 4  # parameters on one screen


def range_sentence(result: Any) -> str:
    """Over which range, and how far off the model may be there; "" where nothing is known of it, or the model is refused. Beside
    errors in pixels or angles: in which lengths the correction is known, and which are not."""
    part, status = result.working_range, result.verdict.status
    if status == "located":
        return _where_located(result)
    if status == "refused":
        return "nowhere: nothing is proven of a model that is refused"
    if part is None or part.band is None:
        return ""
    text = f"over the {part.name}, wherever its base stands"
    if part.chance is not None and status == "improved":
        text += f": better than nominal with {_sure(1.0 - part.chance)}"
    text += f"; off by {figure(part.band, 3)} {part.unit} rms, noise apart"
    if result.residuals.unit == part.unit or not part.moved:
        return text
    much = f"and differs by {figure(part.moved, 3)} {part.unit} from the nominal one"
    return f"{text}, {much}; measured in {result.residuals.unit}, the error before is not known in {part.unit}"


def _sure(chance: float) -> str:
    """A probability in percent, never rounded up to certainty."""
    return "over 99.9 %" if chance > 0.999 else f"{100 * chance:.3g} %"


def _where_located(result: Any) -> str:
    """Where frames that were located hold: at what was measured, and how well readings are predicted beyond."""
    split, beyond = result.split, result.prediction
    text = f"tested at the {len(split.held_out) or len(split.fit)} unseen of {len(split.fit) + len(split.held_out)} configurations"
    if beyond is None or beyond.mean is None:
        return text
    much = f"{figure(beyond.mean, 3)} {beyond.unit}"
    return f"{text}; over the {beyond.region} a reading is predicted to {much} (one standard deviation)"


def changes(result: Any, most: int = CHANGES) -> list[Any]:
    """The robot's parameters that moved by more than two standard deviations, those of a unit together, the largest first."""
    owners = instrument_frames(p.name for p in result.parameters)
    fitted = [
        p for p in result.parameters if p.status in ("identified", "prior") and p.name.rpartition(".")[0] not in owners
    ]
    moved = [p for p in fitted if p.delta is not None and p.sigma and abs(p.delta) > 2 * p.sigma]
    units = list(dict.fromkeys(p.unit for p in moved))
    ordered = {u: sorted((p for p in moved if p.unit == u), key=lambda p: -abs(p.delta)) for u in units}
    share = dict.fromkeys(units, 0)
    for _ in range(min(most, len(moved))):  # the units in turn: mm and deg cannot be compared
        u = min((u for u in units if share[u] < len(ordered[u])), key=lambda u: share[u])
        share[u] += 1
    return [p for u in units for p in ordered[u][: share[u]]]


def omissions(result: Any) -> str:
    """What the fit did not use, and what it could not tell, in one line."""
    split, seen = result.split, result.identifiability
    aside = sum(o.rows for o in result.outliers if o.set_aside)
    parts = [
        f"{len(split.held_out)} of {len(split.held_out) + len(split.fit)} configurations held out"
        if split.held_out
        else ""
    ]
    parts += [f"{len(split.embargoed)} tied to these left out" if split.embargoed else ""]
    parts += [f"{aside} row{'' if aside == 1 else 's'} set aside" if aside else "no row set aside"]
    for why in ("excluded", "missing"):
        count = sum(len(one.rows) for one in result.provenance.left_out if one.why == why)
        parts += [f"{count} row{'' if count == 1 else 's'} {why}" if count else ""]
    # What is kept beside others (--keep-all) does not stay nominal, though no data tell it.
    lost, hidden = len(seen.dropped), seen.n_free - seen.rank
    told = f"{hidden} combinations of them" if hidden else "all of them"
    parts += [
        f"{lost} of {seen.n_free} free parameters cannot be told and stay nominal"
        if lost
        else f"{seen.n_free} parameters free, {told} {'cannot be told' if hidden else 'told'}"
    ]
    return "; ".join(p for p in parts if p)


def first_remarks(remarks: Sequence[Message]) -> Remarks | None:
    """The first remarks that say what to do, as many as one screen has room for; None where there is none."""
    kept: list[Message] = []
    room = ROOM
    for said in sorted(remarks, key=lambda r: not r.advice):
        room -= len(f"{said.sentence} {said.advice}".split())
        if len(kept) == REMARKS or (kept and room < 0) or not (said.advice or room >= 0):
            break
        kept.append(said)
    return Remarks(tuple(kept)) if kept else None

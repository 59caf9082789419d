"""The scale of an instrument beside the lengths of cables: both say how large everything is, and must say the same.

A machine that stands where its own sensors say has no lengths that were made; its anchors may be anywhere. But what an instrument
reads is as long as its scale says, and a cable as long as its drum says. With c the column of either, local poses projected out,

    s = -c_^T r / c_^T c_,    c_ = c - Q Q^T c,    t as of a stated number (`stated_numbers.score`)

An instrument that reads 1 + s too long looks almost like drums that all wind up 1 + s too little, so both are named. Where the scale
of the instrument is known, it is the drums. An arm has lengths that were made, and their common factor is the same law (`scale`).

A scale of which something is said is known no longer where it is decided where the correction holds (`prove/region`).
"""

from __future__ import annotations

import numpy as np

from robocal._record import record, replace
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Machines, check_fit_twice, doubt, once, refuse
from robocal.diagnose.scale import common_scale
from robocal.diagnose.stated_numbers import score
from robocal.estimate.elimination import beside_blocks, block_columns
from robocal.measure.machine import Model
from robocal.measure.rows import scale_of
from robocal.measure.stretch import stretch_columns
from robocal.remarks.english import declare
from robocal.remarks.remark import Number

__all__ = ["scale_errors"]

LENGTHS = "lengths"
# fmt: off
_SAID = (
    "against the cable lengths, {instrument} reads lengths {percent:.2f} % too {way}, or all drums show as much too {other} "
    "({z:.1f} sigma)"
)
# fmt: on
_GAIN = (
    "Free the gain of the drums: write gain: {{free: true}} into the data file of the lengths, or gain: {{free: true, each: true}} where "
    "one drum may be another than the others. "
)
UNLIKE_KNOWN = declare(
    "scale-of-drums",
    _SAID + "; the scale of {instrument} is stated as known, so the drums are likelier wrong",
    _GAIN
    + "If the drums are right, check scale, unit and temperature of {instrument}, and state scale: {{sigma: 0.5 %}} in its file.",
)
UNLIKE = declare(
    "scale-of-instrument",
    _SAID,
    "Check the scale of {instrument}: the edge of its marker, its focal length, its unit. Where it is certain, state scale: known in its "
    "file, and free the gain of the drums: gain: {{free: true}} in the data file of the lengths, with each: true where one may differ.",
)


@record
class Contradiction:
    """Instruments that read lengths 1 + `factor` times as long as cables say, within one of `z`, which share of the squares that
    explains, and whether their scale is stated as known."""

    instruments: tuple[str, ...]
    factor: float
    z: float
    share: float
    known: bool


@check_fit_twice(doubt=("instrument-scale", 215), refuse=("wrong-instrument-scale", 145), machines=Machines.POSED)
def beside_lengths(context: Context[Model]) -> list[Finding]:
    """Instruments that see the machine beside its cables, and do not agree with them on how long a length is."""
    found = unlike_lengths(context)
    if found is None:
        return []
    most = limits.SCALE_READ_SIGMA if found.known else limits.SCALE_SIGMA
    sure = found.z > most and found.share > limits.SCALE_SHARE
    way, other = ("long", "short") if found.factor > 0 else ("short", "long")
    level, code = refuse if sure else doubt, UNLIKE_KNOWN if found.known else UNLIKE
    amounts: dict[str, Number] = {"z": found.z, "factor": found.factor, "share": found.share}
    percent = 100 * abs(found.factor)
    words: dict[str, Number] = {
        "instrument": ", ".join(found.instruments),
        "percent": percent,
        "way": way,
        "other": other,
    }
    return [level(code, **words, **amounts)]


@once
def unlike_lengths(context: Context[Model]) -> Contradiction | None:
    """The instruments whose scale the cables contradict most; None where they contradict none."""
    fit = context.need_fit
    problem, x = fit.problem, fit.solution.x
    drawn = {t.group for t in problem.terms if t.kind == LENGTHS}
    others = sorted({t.group for t in problem.terms} - drawn)
    if not others or not drawn:
        return None
    choices = [[g] for g in others] + ([others] if len(others) > 1 else [])
    lin = context.jacobian
    c = stretch_columns(problem, x, [*choices, drawn])
    _, left = beside_blocks(replace(lin, j=np.hstack([lin.j, c])))
    n = lin.j.shape[1]
    found = score(left[:, :n], lin.r, problem.scales, left[:, n:], block_columns(lin) + problem.repeated)
    if found is None or found.t < limits.SCALE_DOUBT_SIGMA:
        return None
    drums = found.column == len(choices)
    named = others if drums else choices[found.column]
    own = [o for o in fit.data.observations if o.kind != LENGTHS and o.label in named]
    known = not any(scale_of(o) or o.options.get("print") for o in own)
    return Contradiction(tuple(named), -found.change if drums else found.change, found.t, found.share, known)


def scale_errors(context: Context[Model]) -> dict[str, float]:
    """By instrument, how far a scale that is known may be off (rms) where something is said of it: of a machine with lengths that were
    made what these say, of another what cables say."""
    told, off = scale_of_instruments(context)
    known = {o.label: not scale_of(o) for o in context.need_data.observations}
    return {g: off for g in told if known.get(g)}


def scale_of_instruments(context: Context[Model]) -> tuple[tuple[str, ...], float]:
    """The instruments whose scale seems to be wrong, and by how much (rms)."""
    if Machines.POSED.include(context.model):
        found = unlike_lengths(context)
        return ((), 0.0) if found is None else (found.instruments, abs(found.factor) * float(np.hypot(1, 1 / found.z)))
    scale = common_scale(context)
    if scale is None or not scale.unusual:
        return (), 0.0
    return tuple(o.label for o in context.need_data.observations), float(np.hypot(scale.factor, scale.sigma))

"""The scale of an instrument beside the lengths of cables: both say how large everything is, and must say the same.

A machine that stands where its own sensors say has no lengths that were made; its anchors may be anywhere. But what an instrument
reads is as long as its scale says, and a cable as long as its drum says. With c the column of either, local poses projected out,

    s = -c_^T r / c_^T c_,    c_ = c - Q Q^T c,    t as of a stated number (`stated_numbers.score`)

An instrument that reads 1 + s too long looks almost like drums that all wind up 1 + s too little, so both are named. Where the scale
of the instrument is known, it is the drums. An arm has lengths that were made, and their common factor is the same law (`scale`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Machines, check_fit_twice, doubt, once, refuse
from robocal.diagnose.stated_numbers import score
from robocal.estimate.elimination import beside_blocks, block_columns
from robocal.measure.machine import Model
from robocal.measure.rows import scale_of
from robocal.measure.stretch import stretch_columns
from robocal.remarks.english import declare
from robocal.remarks.remark import Number

__all__ = ["beside_lengths"]

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


@check_fit_twice(doubt=("instrument-scale", 215), refuse=("wrong-instrument-scale", 145), machines=Machines.POSED)
@once
def beside_lengths(context: Context[Model]) -> list[Finding]:
    """Instruments that see the machine beside its cables, and do not agree with them on how long a length is."""
    fit = context.need_fit
    problem, x = fit.problem, fit.solution.x
    drawn = {t.group for t in problem.terms if t.kind == LENGTHS}
    others = sorted({t.group for t in problem.terms} - drawn)
    if not others or not drawn:
        return []
    choices = [[g] for g in others] + ([others] if len(others) > 1 else [])
    lin = context.jacobian
    c = stretch_columns(problem, x, [*choices, drawn])
    _, left = beside_blocks(replace(lin, j=np.hstack([lin.j, c])))
    n = lin.j.shape[1]
    found = score(left[:, :n], lin.r, problem.scales, left[:, n:], block_columns(lin) + problem.repeated)
    if found is None or found.t < limits.SCALE_DOUBT_SIGMA:
        return []
    drums = found.column == len(choices)
    named = others if drums else choices[found.column]
    sign = -found.change if drums else found.change
    known = not any(scale_of(o) for o in fit.data.observations if o.kind != LENGTHS and o.label in named)
    sure = found.t > (limits.SCALE_READ_SIGMA if known else limits.SCALE_SIGMA) and found.share > limits.SCALE_SHARE
    way, other = ("long", "short") if sign > 0 else ("short", "long")
    level, code = refuse if sure else doubt, UNLIKE_KNOWN if known else UNLIKE
    amounts: dict[str, Number] = {"z": found.t, "factor": sign, "share": found.share}
    words: dict[str, Number] = {"instrument": ", ".join(named), "percent": 100 * abs(sign), "way": way, "other": other}
    return [level(code, **words, **amounts)]

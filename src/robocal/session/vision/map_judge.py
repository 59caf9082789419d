"""Whether a map holds: it is met by views that were left out, as well as the noise of corners allows.

Nothing nominal is there to be better than, so the verdict is `located`, as of frames alone (see `prove.frames_alone`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal.diagnose.check_registry import DIAGNOSE, PROVE, Finding, When, doubt, qualify
from robocal.diagnose.check_registry import run as run_checks
from robocal.diagnose.limits import LENS_CONTRADICTED, LENS_MISSES, MAP_ASIDE, MAP_MISSES, MAP_UNSEEN, MAP_WEAK
from robocal.measure.machine import Rig
from robocal.prove.decision import REGION, Decision
from robocal.prove.evidence import Gain
from robocal.prove.verdict import Verdict, fold
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.corner_errors import CornerErrors
from robocal.session.vision.map_moved import MarkerMotion
from robocal.session.vision.map_sizes import MarkerSize
from robocal.vision.lenses import Lens

__all__ = ["judge_map", "remarks_of_map"]

UNSTATED = 0.1  # px: of a corner, where nobody states it
SILENT = ("place", "coverage", REGION)  # checks that ask where the base of a machine is: here nothing has one
SHOWN = 8  # grid: names in a sentence
OWN = (Code.FRAMES_NOT_EXPLAINED, Code.ABOVE_STATED_NOISE)


def judge_map(
    made: Decision[Rig],
    off: CornerErrors,
    moved: Sequence[MarkerMotion],
    sizes: Sequence[MarkerSize],
    width: int,
    ids: Sequence[str],
) -> Verdict:
    """The verdict: located where the fit ended, no check refuses the data, and corners of views that were left out are met."""
    unseen = run_checks(When.UNSEEN, made, DIAGNOSE, PROVE)
    skip = (*made.silent, *SILENT)
    findings = [f for f in unseen if f.code not in OWN]
    findings += [f for f in run_checks(When.PROOF, made, DIAGNOSE, PROVE, found=unseen, skip=skip) if f.code not in OWN]
    findings += _against(made, off, moved, sizes, width, ids)
    singly = off.left_out
    gain = None
    if singly is not None and not unseen:
        told = Quantity(singly.rms, "px")
        gain = Gain(Remark.of(Code.MAP_LOCATED, unseen=told, noise=Quantity(off.noise, "px")), True, status="located")
    return fold(findings, gain)


def _against(
    made: Decision[Rig],
    off: CornerErrors,
    moved: Sequence[MarkerMotion],
    sizes: Sequence[MarkerSize],
    width: int,
    ids: Sequence[str],
) -> Iterator[Finding]:
    obs = made.need_data.observations[0]
    for m in moved:
        views = tuple(ids[v] for v in m.views)
        first = views[0] if m.later else None
        yield qualify(
            Code.MARKER_MOVED, marker=obs.targets[m.marker].name, apart=Quantity(m.distance, "m"), turned=Quantity(m.turned, "rad"),
            first=first, views=None if m.later else views[:SHOWN], count=len(views),
        )  # fmt: skip
    for size in sizes:
        yield qualify(
            Code.MARKER_SIZE_CONTRADICTED, marker=obs.targets[size.marker].name, told=Quantity(size.size, "m"),
            found=Quantity(size.apparent, "m"),
        )  # fmt: skip
    axis, singly = off.noise / np.sqrt(2.0), off.left_out
    stated = UNSTATED if obs.sigma is None else float(np.sqrt(np.mean(np.square(obs.sigma))))
    if axis > LENS_MISSES * width and axis > MAP_MISSES * stated:
        yield qualify(Code.MAP_MISSES, left=Quantity(axis, "px"), times=axis / stated)
    if singly is None:
        yield qualify(Code.MAP_UNPROVEN)
    elif singly.rms > MAP_UNSEEN * off.noise:
        yield qualify(Code.MAP_OVERFITTED, unseen=singly.rms, seen=off.noise, times=singly.rms / off.noise)
    if (share := float(np.mean(~off.used))) > MAP_ASIDE:
        yield qualify(Code.MAP_ASIDE, share=share)


def remarks_of_map(made: Decision[Rig], given: Lens, found: Lens, few: Sequence[str]) -> list[Remark]:
    """What else is to be said: of the data, of the fit, of the lens, and of markers that `few` views show."""
    out = [
        f.remark
        for when in (When.DATA, When.FIT)
        for f in run_checks(when, made, DIAGNOSE, PROVE, skip=(*made.silent, *SILENT))
        if f.code not in OWN
    ]
    sigma = given.sigma
    away = {
        s: abs(b - a) / sigma[s]
        for s, a, b in zip(given.kind.symbols, given.numbers, found.numbers, strict=True)
        if s in sigma
    }
    worst = max(away, key=lambda s: away[s]) if away else ""
    if away and away[worst] > LENS_CONTRADICTED:
        at = given.kind.symbols.index(worst)
        finding = doubt(
            Code.LENS_PRIOR_CONTRADICTED,
            name=worst,
            given=given.numbers[at],
            found=found.numbers[at],
            times=away[worst],
        )
        out.append(finding.remark)
    if few:
        out.append(Remark.of(Code.MARKERS_IN_FEW_VIEWS, markers=tuple(few[:SHOWN]), count=len(few), least=MAP_WEAK))
    return out

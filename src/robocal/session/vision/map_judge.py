"""Whether a map holds: it is met by views that were left out, as well as the noise of corners allows.

Nothing nominal is there to be better than, so the verdict is `located`, as of frames alone (see `prove.frames_alone`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._record import replace
from robocal.diagnose.check_registry import DIAGNOSE, PROVE, Finding, When, doubt, qualify
from robocal.diagnose.check_registry import run as run_checks
from robocal.diagnose.stated_priors import CONTRADICTED
from robocal.diagnose.vision_limits import LENS_CONTRADICTED, LENS_MISSES, MAP_ASIDE, MAP_MISSES, MAP_UNSEEN, MAP_WEAK
from robocal.measure.machine import Rig
from robocal.measure.pixels import EDGE
from robocal.prove.decision import REGION, Decision
from robocal.prove.evidence import Gain
from robocal.prove.frame_checks import OPEN
from robocal.prove.verdict import Verdict, fold
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.corner_errors import CornerErrors
from robocal.session.vision.corner_table import CAMERA
from robocal.session.vision.map_moved import MarkerMotion
from robocal.session.vision.map_sizes import MarkerSizes
from robocal.vision.lenses import Lens

__all__ = ["judge_map", "remarks_of_map"]

UNSTATED = 0.1  # px: of a corner, where nobody states it
# Checks that ask where the base of a machine is: here nothing has one. Whether a marker moved, beyond what a lens leaves: `map_moved`.
SILENT = ("place", "coverage", REGION, "frame-step", "wrong-frame")
SHOWN = 8  # grid: names in a sentence
PLACED = 4  # tolerance: corners that place a marker: three have four answers
OWN = (Code.FRAMES_NOT_EXPLAINED, Code.ABOVE_STATED_NOISE)
SHAPE = ("fx", "fy", "cx", "cy", "k1")  # of a lens: where one of them counts as exact, what is left bends the map


def judge_map(
    made: Decision[Rig],
    off: CornerErrors,
    moved: Sequence[MarkerMotion],
    sizes: MarkerSizes,
    width: int,
    ids: Sequence[str],
) -> Verdict:
    """The verdict: located where the fit ended, no check refuses the data, and corners of views that were left out are met."""
    unseen = run_checks(When.UNSEEN, made, DIAGNOSE, PROVE)
    skip = (*made.silent, *SILENT)
    proof = run_checks(When.PROOF, made, DIAGNOSE, PROVE, found=unseen, skip=skip)
    findings = [_of_map(f) for f in (*unseen, *proof) if f.code not in (*OWN, OPEN)]
    if loose := _open_markers(made, off, (*unseen, *proof)):
        findings.append(qualify(Code.MARKERS_OPEN, names=loose[:SHOWN], count=len(loose)))
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
    sizes: MarkerSizes,
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
    if sizes.larger is not None:
        yield qualify(
            Code.MAP_PRIOR_SCALED, share=100 * abs(sizes.larger), word="larger" if sizes.larger > 0 else "smaller"
        )
    if sizes.scatter is not None:
        yield qualify(Code.MARKER_SIZES_SCATTER, found=100 * sizes.scatter)
    if sizes.wrong:
        worst = sizes.wrong[0]
        yield qualify(
            Code.MARKER_SIZE_CONTRADICTED, marker=worst.name, told=Quantity(worst.size, "m"), found=Quantity(worst.apparent, "m"),
            others=tuple(f"{s.name}={1e3 * s.apparent:.4g}" for s in sizes.wrong[1:][:SHOWN]) or None,
        )  # fmt: skip
    missed, singly = _miss(made, off, width), off.left_out
    if missed is not None and missed.level == "qualify":
        yield missed
    if singly is None:
        yield qualify(Code.MAP_UNPROVEN)
    elif singly.rms > MAP_UNSEEN * off.noise:
        yield qualify(Code.MAP_OVERFITTED, unseen=singly.rms, seen=off.noise, times=singly.rms / off.noise)
    if (share := float(np.mean(~off.used))) > MAP_ASIDE:
        yield qualify(Code.MAP_ASIDE, share=share)


def _of_map(found: Finding) -> Finding:
    """What is said of a robot and its joints, of views and markers."""
    return replace(found, code=Code.VIEWS_FROM_ONE_PLACE) if found.code == Code.ONE_PLACE else found


def _open_markers(made: Decision[Rig], off: CornerErrors, found: Sequence[Finding]) -> tuple[str, ...]:
    """Markers that too few believed corners place, or that a check found to be open."""
    obs = made.need_data.observations[0]
    assert obs.target is not None
    used = np.bincount(obs.target[off.used], minlength=len(obs.targets))
    names = [t.name for t, count in zip(obs.targets, used.tolist(), strict=True) if count < PLACED]
    names += [str(n).rpartition(".")[0] for f in found if f.code == OPEN for n in f.numbers["names"]]  # type: ignore[union-attr]
    return tuple(dict.fromkeys(names))


def _miss(made: Decision[Rig], off: CornerErrors, width: int) -> Finding | None:
    """What a map leaves that is more than corners are known to: it counts against the map where it is much of the image, or where
    numbers of the lens that shape the map count as exact."""
    obs, axis = made.need_data.observations[0], off.noise / np.sqrt(2.0)
    stated = UNSTATED if obs.sigma is None else float(np.sqrt(np.mean(np.square(obs.sigma))))
    if axis <= MAP_MISSES * stated:
        return None
    free = made.proven.base.problem.table.free
    exact = tuple(s for s in SHAPE if f"{CAMERA}.{s}" not in free)
    level = qualify if (exact and obs.sigma is not None) or axis > LENS_MISSES * width else doubt
    return level(Code.MAP_MISSES, left=Quantity(axis, "px"), times=axis / stated, exact=exact or None)


def _told(name: str, sizes: MarkerSizes) -> bool:
    """Whether a contradicted prior is told in words of maps: of the lens always, of edges where the verdict has them."""
    owner, _, symbol = name.rpartition(".")
    return owner == CAMERA or (symbol == EDGE and sizes != MarkerSizes())


def remarks_of_map(
    made: Decision[Rig], off: CornerErrors, sizes: MarkerSizes, given: Lens, found: Lens, few: Sequence[str]
) -> list[Remark]:
    """What else is to be said: of the data, of the fit, of the lens, and of markers that `few` views show. Of `sizes` the verdict tells
    all; of the lens what is below."""
    out = [
        f.remark
        for when in (When.DATA, When.FIT)
        for f in run_checks(when, made, DIAGNOSE, PROVE, skip=(*made.silent, *SILENT))
        if f.code not in OWN and not (f.code == CONTRADICTED and _told(str(f.numbers["name"]), sizes))
    ]
    missed = _miss(made, off, given.size[0]) if given.size else None
    if missed is not None and missed.level == "doubt":
        out.append(missed.remark)
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

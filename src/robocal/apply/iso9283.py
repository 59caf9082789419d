"""The figures of ISO 9283 as a validation tells them: in mm and deg, place by place and summed up, and what cannot be
computed with its reason."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robocal._types import Array, Ints
from robocal.apply.validate import CYCLES, DIRECTION, DistanceFigures, PoseFigures, Visits, visits
from robocal.arms.chain import Chain
from robocal.errors import ModelError, nearest
from robocal.measure.data import DataSet
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, remark_fields

__all__ = ["WAYS", "Standard", "standard"]

Model = tuple[Chain, Mapping[str, float]]
# What --distances may be, besides the name of a configuration's column.
WAYS = {
    "consecutive": "every place with the next one",
    "all": "every pair of places",
    "group": "every pair of places in one group",
}
AXES = ("x", "y", "z"), ("a", "b", "c")
LISTED = 200  # pairs with the largest error that are listed one by one

Standard = dict[str, Any]


def standard(data: DataSet, this: Model, against: Model | None, distances: str) -> Standard:
    """The figures for one model and another to compare with, each with its parameters and those of the instruments'
    frames.

    Raises ModelError for an unknown way to choose distances.
    """
    found = visits(this[0], data, this[1])
    if found is None:
        _chosen(None, data, distances)
        none = dict.fromkeys(("AP", "RP", "AD", "RD"), Remark.of(Code.NO_STANDING_POSITIONS))
        return {"standard": "ISO 9283:1998", **_lacking(none)}
    other = None if against is None else visits(against[0], data, against[1])
    pair = _chosen(found, data, distances)
    mine, theirs = found.pose_figures(), None if other is None else other.pose_figures()
    far, their_far = found.distance_figures(pair), None if other is None else other.distance_figures(pair)
    n = found.count
    names = [data.configurations.ids[found.configuration[i]] for i in found.first]
    made: Standard = {
        "standard": "ISO 9283:1998",
        "places": len(n),
        "repeated": int((n >= 2).sum()),
        "visits": [int(n.min()), int(n.max())],
        "visits_asked_for": CYCLES,
        "pose": _poses(names, mine, theirs) if (n >= 2).any() else None,
        "distance": _distances(names, far, their_far, WAYS.get(distances, f"every pair of one {distances}")),
        **_lacking(_missing(found, mine, far)),
    }
    notes = [Remark.of(Code.REPEATABILITY_UNCHANGED)]
    if (n >= 2).any() and int(n[n >= 2].min()) < CYCLES:
        notes.append(Remark.of(Code.FEW_VISITS, asked=CYCLES, visits=int(n[n >= 2].min())))
    return made | remark_fields(notes, "notes")


def _lacking(why: Mapping[str, Remark]) -> dict[str, dict[str, str]]:
    """Figures that cannot be computed: the reason of each, as a sentence and as a code."""
    words, codes = {k: r.sentence for k, r in why.items()}, {k: r.code for k, r in why.items()}
    return {"not_computable": words, "not_computable_codes": codes}


def _chosen(found: Visits | None, data: DataSet, distances: str) -> Ints:
    """The pairs whose distances are asked for. Raises ModelError."""
    columns, labels = data.configurations.columns, data.configurations.groups
    known = [*WAYS, *columns]
    if distances not in known or (distances == "group" and labels is None):
        message = "unknown choice of distances" if distances not in known else "the configurations have no group"
        raise ModelError(
            message, key="--distances", found=distances, expected=", ".join(known), suggestion=nearest(distances, known)
        )
    if found is None:
        return np.zeros((0, 2), dtype=np.int64)
    if distances == "consecutive":
        return found.next_pairs()
    if distances == "all":
        return found.every_pair()
    if distances == "group" and found.group is not None:
        return found.every_pair(found.group[found.first])
    values = np.unique(columns[distances], return_inverse=True)[1].ravel()
    return found.every_pair(values[found.configuration[found.first]])


def _missing(found: Visits, mine: PoseFigures, far: DistanceFigures) -> dict[str, Remark]:
    """What cannot be computed, and why."""
    out: dict[str, Remark] = {}
    if not (found.count >= 2).any():
        needs = "a barycentre needs repeated visits (single errors are above)"
        out["AP"], out["RP"] = Remark.of(Code.VISITED_ONCE, what=needs), Remark.of(Code.VISITED_ONCE)
    if found.turn is None:
        out["AP_abc, RP_abc"] = Remark.of(Code.NO_ORIENTATIONS)
    if not np.isfinite(mine.vap).any():
        marked = found.direction is not None
        out["vAP"] = Remark.of(Code.ONE_DIRECTION) if marked else Remark.of(Code.DIRECTIONS_UNMARKED, column=DIRECTION)
    if not len(far.pair):
        out["AD"] = Remark.of(Code.FEW_PLACES, least=2, instrument="one instrument")
    if not np.isfinite(far.rd).any():
        out["RD"] = Remark.of(Code.DISTANCES_ONCE)
    return out


def _poses(names: list[str], mine: PoseFigures, theirs: PoseFigures | None) -> dict[str, Any]:
    rows = []
    for i in np.flatnonzero(mine.n >= 2):
        row: dict[str, Any] = {"place": names[i], "n": int(mine.n[i])}
        row |= _figures(mine, int(i))
        if theirs is not None:
            row["against"] = {k: v for k, v in _figures(theirs, int(i)).items() if k.startswith("AP")}
        rows.append(row)
    summary = {"this": _summary(mine)} | ({} if theirs is None else {"against": _summary(theirs)})
    return {"unit": "mm", "angle_unit": "deg", "summary": summary, "rows": rows}


def _figures(f: PoseFigures, i: int) -> dict[str, Any]:
    """AP, RP and their parts at place i, in mm and deg."""
    out: dict[str, Any] = {"AP": 1e3 * f.ap[i]} | {
        f"AP_{a}": 1e3 * v for a, v in zip(AXES[0], f.ap_xyz[i], strict=True)
    }
    out["RP"] = 1e3 * f.rp[i]
    for word, part in (("AP", f.ap_abc), ("RP", f.rp_abc)):
        if part is not None:
            out |= {f"{word}_{a}": np.degrees(v) for a, v in zip(AXES[1], part[i], strict=True)}
    if np.isfinite(f.vap[i]):
        out |= {"vAP": 1e3 * f.vap[i], "directions": int(f.directions[i])}
    return {k: v if isinstance(v, int) else float(v) for k, v in out.items()}


def _spread(values: Array, factor: float) -> dict[str, float | int]:
    """Mean and largest size of those values that there are."""
    known = np.abs(values[np.isfinite(values)]) * factor
    return {"mean": float(known.mean()), "max": float(known.max()), "n": len(known)} if len(known) else {}


def _summary(f: PoseFigures) -> dict[str, Any]:
    out = {"AP": _spread(f.ap, 1e3), "RP": _spread(f.rp, 1e3), "vAP": _spread(f.vap, 1e3)}
    for word, part in (("AP", f.ap_abc), ("RP", f.rp_abc)):
        if part is not None:
            degrees = 180 / np.pi
            out |= {f"{word}_{a}": _spread(part[:, i], degrees) for i, a in enumerate(AXES[1])}
    return {k: v for k, v in out.items() if v}


def _distances(
    names: list[str], mine: DistanceFigures, theirs: DistanceFigures | None, pairs: str
) -> dict[str, Any] | None:
    if not len(mine.pair):
        return None
    worst = np.argsort(-np.abs(mine.ad), kind="stable")[:LISTED]
    rows = []
    for i in worst:
        a, b = mine.pair[i]
        row = {"from": names[a], "to": names[b], "n": int(mine.n[i]), "commanded": 1e3 * float(mine.command[i])}
        row["AD"] = 1e3 * float(mine.ad[i])
        if theirs is not None:
            row["AD_against"] = 1e3 * float(theirs.ad[i])
        if np.isfinite(mine.rd[i]):
            row["RD"] = 1e3 * float(mine.rd[i])
        rows.append(row)
    summary = {"this": {"AD": _spread(mine.ad, 1e3), "RD": _spread(mine.rd, 1e3)}}
    if theirs is not None:
        summary["against"] = {"AD": _spread(theirs.ad, 1e3)}
    summary = {k: {w: s for w, s in v.items() if s} for k, v in summary.items()}
    listed = f"the {LISTED} largest of {len(mine.pair)}" if len(mine.pair) > LISTED else "all"
    return {
        "unit": "mm", "pairs": pairs, "number": len(mine.pair), "summary": summary, "listed": listed, "rows": rows
    }  # fmt: skip

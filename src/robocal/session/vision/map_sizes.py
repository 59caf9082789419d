"""How large markers were printed: their edges as parameters of a map, within what printing and measuring leave of them.

    edge_k = told_k + e_k,    cov(e) = shift^2 1 1^T + diag((scatter told_k)^2)

The shift is that of ink, paper and gauge: all edges are larger by as much. Views tell edges beside one another, and the shift where edges
of several sizes are told; how large all of them are together nothing tells but this prior, and distances that are known. So sigma of a
map holds the error of its scale. An edge that the others contradict, with P = C^-1 of the prior and D the covariance of the fit:

    w = P e,    S = P - P D P,    change_k = w_k / S_kk,    chi2_k = w_k^2 / S_kk

The worst is taken out of the prior, and the others are asked again.
Source: Baarda, A testing procedure for use in geodetic networks (1968).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.vision_limits import MARKER_SIZE, MARKER_SIZE_CHANCE
from robocal.errors import ModelError
from robocal.measure.pixels import EDGE, GROWTH
from robocal.parameters import Together
from robocal.session.vision.corner_table import CornerTable
from robocal.session.vision.map_prior import MapPrior

__all__ = [
    "EdgeErrors",
    "MarkerSize",
    "MarkerSizes",
    "edge_errors",
    "edges_of",
    "find_sizes",
    "prior_of",
    "size_of_all",
    "with_edges",
]

FINEST = 1e-6  # tolerance: m: no edge is known better, and a prior that is exact in some direction has no inverse
ENOUGH = 0.1  # tolerance: of the information on the size of all: a fit knows its own sigma to some percent
SEEN = 1e-4  # tolerance: of the information: the size of all together, which no view tells
SHARE = 0.2  # tolerance: of the markers: where more have another size, all scatter
LARGE = 1 / 3  # tolerance: of an edge, a sigma: at three sigma there would be none
UNKNOWN = 1.0  # tolerance: m: nobody knows less of an edge


@record
class EdgeErrors:
    """What told edges may be off by, standard deviations: all of them alike (m), and each by itself (of its edge)."""

    shift: float = 0.0
    scatter: float = 0.0

    def covariance(self, edges: Array) -> Array:
        """Of edges (M,) m, (M, M)."""
        own = (self.scatter * edges) ** 2 + FINEST**2
        return np.asarray(self.shift**2 + np.diag(own))


def edge_errors(o: Any, edges: Iterable[float]) -> EdgeErrors:
    """What edges (m) may be off by, as options tell it (mm, percent). Raises ModelError for as much as an edge itself."""
    shift, scatter = 1e-3 * float(o.size_sigma), 1e-2 * float(o.size_scatter)
    least = min(edges, default=float("inf"))
    if shift > LARGE * least:
        found, expected = (
            f"{1e3 * shift:g} mm beside an edge of {1e3 * least:g} mm",
            "how surely it is known, as 0.2; the edge itself is --size",
        )
        raise ModelError("no marker is known as badly", key="--size-sigma", found=found, expected=expected)
    if scatter > LARGE:
        raise ModelError(
            "no markers differ as much", key="--size-scatter", found=f"{100 * scatter:g} %",
            expected="percent of an edge, as 0.3; edges that differ are told one by one: --size 7=120",
        )  # fmt: skip
    return EdgeErrors(shift, scatter)


@record
class MarkerSizes:
    """Markers whose edges the others contradict; by how much edges scatter (of themselves), where that is more than was told; and by how
    much all are larger beside known distances (of themselves), where they are."""

    wrong: tuple[MarkerSize, ...] = ()
    scatter: float | None = None
    larger: float | None = None


@record
class MarkerSize:
    """A marker whose edge the others contradict: as it was told, and as it looks beside them (m), and the chi2 of that."""

    name: str
    size: float
    apparent: float
    chi2: float


def with_edges(table: CornerTable, errors: EdgeErrors | None, prior: MapPrior | None = None) -> CornerTable:
    """The same with edges that are free within their prior; exact ones where no errors are told.

    A map that found sizes has the error of its prints in its places: its own edges are not told anew, and those of other markers are
    known as they follow from them. With C of `errors`, and of the map's edges e found off by f with covariance E,

    K = C_oe C_ee^-1,   edge_o = told_o + K f,   cov = C_oo - K C_eo + K E K^T
    """
    if errors is None:
        return table
    obs = table.pixels
    edges, rows = edges_of(table), [f"{t.name}.{EDGE}" for t in obs.targets]
    together = obs.options.get("together", ())
    assert isinstance(together, tuple)
    covariance, new = errors.covariance(edges), edges
    for sized in prior.sized if prior else ():
        known, rest = ([i for i, r in enumerate(rows) if (r in sized.shared.names) == one] for one in (True, False))
        new = edges.copy()
        new[known] = [sized.edges[rows[i]] for i in known]
        k = covariance[np.ix_(rest, known)] @ np.linalg.inv(covariance[np.ix_(known, known)])
        new[rest] += k @ (new - edges)[known]
        names = [*sized.shared.names, *(rows[i] for i in rest)]
        joint = sized.shared.of(sized.shared.names)
        across = k @ joint[[sized.shared.names.index(rows[i]) for i in known]]
        own = covariance[np.ix_(rest, rest)] - k @ covariance[np.ix_(known, rest)]
        own += across[:, [sized.shared.names.index(rows[i]) for i in known]] @ k.T
        joint = np.block([[joint, across.T], [across, (own + own.T) / 2]])
        together = (*(t for t in together if t.names[0] not in names), _shared(names, joint))
    if not any(rows[0] in t.names for t in together):
        together = (*together, _shared(rows, covariance))
    assert obs.target is not None
    point = obs.extra["point"] * (new / edges)[obs.target][:, None]
    extra = {**obs.extra, "point": point, GROWTH: np.sign(point) / 2}
    obs = replace(obs, extra=extra, options={**obs.options, "together": together})
    return replace(table, data=replace(table.data, observations=(obs,)))


def prior_of(table: CornerTable) -> Array:
    """The covariance (M, M) of what is believed of edges that are free."""
    together = table.pixels.options["together"]
    assert isinstance(together, tuple)
    rows = [f"{t.name}.{EDGE}" for t in table.pixels.targets]
    (shared,) = (t for t in together if rows[0] in t.names)
    return np.asarray(shared.of(rows))


def _shared(names: Sequence[str], covariance: Array) -> Together:
    return Together(tuple(names), tuple(map(tuple, covariance.tolist())))


def edges_of(table: CornerTable) -> Array:
    """The edge (M,) of each marker, as told."""
    obs = table.pixels
    assert obs.target is not None
    first = np.unique(obs.target, return_index=True)[1]
    return np.asarray(2 * np.abs(obs.extra["point"][first, 0]))


def find_sizes(
    names: Sequence[str], told: Array, off: Array, spread: Array, believed: Array, scatter: float
) -> MarkerSizes:
    """Of edges that are told (M,), what they were found to be off by (M,) with its covariance (M, M), what was `believed` of it (M, M),
    and by how much each alone was; the worst first."""
    prior = believed.copy()
    seen = np.linalg.inv(spread)
    pull, data = seen @ off, seen - np.linalg.inv(prior)
    gone: dict[int, float] = {}
    while len(gone) < len(told) // 2:
        information = np.linalg.inv(prior)
        now = np.linalg.inv(data + information)
        e = now @ pull
        w, s = information @ e, np.diag(information - information @ now @ information)
        with np.errstate(divide="ignore", invalid="ignore"):
            change, chi2 = w / s, w**2 / s
        chi2[list(gone)] = 0.0
        chi2[~(s > 0) | (np.abs(change) <= MARKER_SIZE * told)] = 0.0
        worst = int(chi2.argmax())
        if scipy.special.chdtrc(1, chi2[worst]) * len(told) > MARKER_SIZE_CHANCE:
            break
        gone[worst] = float(chi2[worst])
        prior[worst, worst] += UNKNOWN**2
    if len(gone) > SHARE * len(told):  # so many are no single markers
        gone, prior = {}, believed
    now = np.linalg.inv(data + np.linalg.inv(prior))
    e = now @ pull
    wrong = tuple(MarkerSize(names[k], float(told[k]), float(told[k] + e[k]), g) for k, g in gone.items())
    return MarkerSizes(wrong, _scatter(e, now, prior, told, scatter))


def size_of_all(told: Array, off: Array, spread: Array, believed: Array) -> tuple[float, float]:
    """By how much all edges (M,) together are larger than told beside distances that are known, of themselves, and the chance of as much;
    of edges that were found to be off by (M,), with their covariance (M, M)."""
    information = np.linalg.inv(believed)
    pull = told @ information @ off
    seen = told @ (information - information @ spread @ information) @ told
    if seen <= ENOUGH * (told @ information @ told):
        return 0.0, 1.0
    return float(pull / seen), float(scipy.special.chdtrc(1, pull**2 / seen))


def _scatter(e: Array, now: Array, prior: Array, told: Array, scatter: float) -> float | None:
    """By how much edges scatter, where chance does not make as much of what was told: of all combinations that views see.

    w^T S^-1 w = dof + (found^2 - scatter^2) tr(S diag(told^2)) in the mean: views that see edges dimly stretch w by less.
    """
    information = np.linalg.inv(prior)
    scale = np.sqrt(np.diag(prior))
    w = scale * (information @ e)
    values, along = np.linalg.eigh(np.outer(scale, scale) * (information - information @ now @ information))
    some = values > SEEN * values[-1]
    chi2, dof = float(np.sum((along.T[some] @ w) ** 2 / values[some])), int(some.sum())
    seen = float(values[some] @ ((told / scale) ** 2 @ along[:, some] ** 2))
    found = float(np.sqrt(scatter**2 + max(chi2 - dof, 0.0) / seen)) if seen > 0 else 0.0
    return found if found > MARKER_SIZE and scipy.special.chdtrc(dof, chi2) < MARKER_SIZE_CHANCE else None

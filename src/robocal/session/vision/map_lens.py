"""What a map and the lens of its images have in common, as one prior of images that are placed in that map through that lens.

An image is seen through the lens that the map was made with, or through the one that it ended with: errors of both move markers and images
together. With P the covariance of the markers, L what the lens file states, and X that of markers and the numbers f that were free,

    [ P              X L_ff^-1 L_f ]
    [ L_f^T L_ff^-1 X^T      L     ]

is the prior of both: E[e_map e_f^T] = X for the numbers as found, and for those that were given (see `vision.maps.MapLens`).
"""

from __future__ import annotations

import numpy as np

from robocal._record import replace
from robocal.measure.data import DataSet
from robocal.measure.pixels import EDGE
from robocal.parameters import FRAME_SYMBOLS, Together
from robocal.session.vision.corner_table import CAMERA
from robocal.vision.lenses import Lens
from robocal.vision.maps import MapLens, MarkerMap

__all__ = ["is_lens_of", "with_lens"]

SAME = 1e-6  # tolerance: of a number, as files and pages print it


def is_lens_of(through: MapLens | None, lens: Lens) -> bool:
    """Whether a lens is that of the map's images, as it was given or as it was found."""
    if through is None or through.model != lens.model or not set(through.known) <= set(lens.known):
        return False
    return any(np.allclose(lens.numbers, n, rtol=SAME, atol=SAME**2) for n in (through.before, through.after))


def with_lens(data: DataSet, known: MarkerMap, lens: Lens) -> DataSet:
    """Data of images in a map, whose markers and lens have priors, with one prior of both where the map says what they share."""
    through = known.lens
    if through is None or not is_lens_of(through, lens):
        return data
    (obs,) = data.observations
    together = obs.options["together"]
    assert isinstance(together, tuple)
    rows = [f"{n}.{s}" for n in known.names for s in FRAME_SYMBOLS]
    across = through.across
    if through.edges is not None:
        rows += [f"{n}.{EDGE}" for n in known.names]
        across = np.vstack([across, through.edges])
    stated = np.array(lens.covariance)
    mine = [lens.known.index(s) for s in through.known]
    at = dict(zip(rows, across @ np.linalg.solve(stated[np.ix_(mine, mine)], stated[mine]), strict=True))
    of_map = next((p for p in together if set(p.names) <= set(rows)), None)
    if of_map is None:
        return data
    shared = np.array([at[n] for n in of_map.names])
    joint = np.block([[of_map.of(of_map.names), shared], [shared.T, stated]])
    names = (*of_map.names, *(f"{CAMERA}.{s}" for s in lens.known))
    one = Together(names, tuple(map(tuple, joint.tolist())))
    beside = (one if p is of_map else p for p in together)
    options = {**obs.options, "known": (), "covariance": (), "together": tuple(beside)}
    return replace(data, observations=(replace(obs, options=options),))

"""Random splits of real data: identify on one part, judge on the other, no hand tuning."""

from __future__ import annotations

import numpy as np

from robocal.fit.options import Options
from robocal.measure.base import problem
from robocal.prove.identify import baseline, identify


def mean_errors(model, data, values):
    """Mean error in mm and, for poses, in degrees, of a model with these parameter values."""
    made = problem(model, data, values=values)
    r = np.concatenate([part.value for part in made.residuals(made.start)])
    place = 1e3 * np.linalg.norm(r[:, :3], axis=1).mean()
    return place, np.rad2deg(np.linalg.norm(r[:, 3:], axis=1).mean()) if r.shape[1] == 6 else 0.0


def splits(model, data, fitted, held, seeds=range(10)):
    """Per split (frames only mm, deg, identified mm, deg) on held-out rows, (10, 4)."""
    out = []
    for seed in seeds:
        order = np.random.default_rng(seed).permutation(len(data.configurations))
        fit, other = data.take(order[:fitted]), data.take(order[fitted : fitted + held])
        result = identify(model, fit, Options(hold_out=0.0, leave_one_out=False, seed=seed))
        made, x = baseline(model, fit, np.arange(fitted))
        frames = dict(zip(made.table.names, x[0], strict=True))
        found = dict(zip(result.table.names, result.table.values, strict=True))
        out.append((*mean_errors(model, other, frames), *mean_errors(model, other, found)))
    return np.array(out)


def report(name, errors):
    before, turn_before, after, turn = np.median(errors, axis=0)
    angle = f", orientation {turn_before:.3f} -> {turn:.3f} deg" if turn_before else ""
    print(f"\n{name}: frames only {before:.3f} mm, identified {after:.3f} mm (median of {len(errors)} splits){angle}")
    return before, after

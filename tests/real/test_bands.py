"""95 % bands as fitted on real data: the share of held-out errors that lie inside must be 90 to 98 %."""

from __future__ import annotations

import numpy as np
import pytest
from real.test_franka import load as franka  # noqa: F401  (a fixture)
from real.test_ur10 import load as ur10  # noqa: F401
from unseen import bands_of_data

from robocal.fit.options import Options
from robocal.prove.bands import coverage
from robocal.prove.identify import identify


def shares(model, data, fitted, held, seeds):
    """Per split and quantity the share of held-out components in their bands, and of whole errors in their regions."""
    out = []
    for seed in seeds:
        order = np.random.default_rng(seed).permutation(len(data.configurations))
        fit, other = data.take(order[:fitted]), data.take(order[fitted : fitted + held])
        found = identify(model, fit, Options(hold_out=0.0, leave_one_out=False, seed=seed))
        values = dict(zip(found.table.names, found.table.values, strict=True))
        got = coverage(bands_of_data(found.nominal, other, values, found.total, found.groups), found.total.dof)
        assert [c.n for c in got] == [held] * len(got)
        out.append([(c.components, c.whole) for c in got])
    return np.array(out), [c.quantity for c in got]


def check(name, model, data, fitted, held, seeds):
    each, quantities = shares(model, data, fitted, held, seeds)
    for quantity, (components, whole), (low, high) in zip(quantities, each.mean(axis=0), _range(each), strict=True):
        print(
            f"\n{name} [{quantity}]: {components:.1%} of held-out components in their 95 % bands, {whole:.1%} of errors in their "
            f"regions (mean of {len(each)} splits; components of single splits {low:.1%} to {high:.1%})"
        )
        assert 0.90 <= components <= 0.98
        assert 0.90 <= whole <= 0.98


def _range(each):
    return np.stack([each[..., 0].min(axis=0), each[..., 0].max(axis=0)], axis=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("series", "kind", "held"), [("C", "position", 500), ("D", "position", 482), ("C", "pose", 500)]
)
def test_ur10(ur10, series, kind, held):  # noqa: F811
    check(f"UR10 series {series}, {kind}", *ur10(series, kind), 150, held, range(5))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["position", "pose"])
def test_fr3(franka, kind):  # noqa: F811
    check(f"FR3, {kind}", *franka(kind), 80, 34, range(10))

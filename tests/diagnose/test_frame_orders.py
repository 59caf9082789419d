"""A step is told where the order of time tells it, and no other order of the views does."""

import numpy as np
import pytest

from robocal.diagnose.frame_orders import order_proves
from robocal.measure.data import Configurations

VIEWS, STEP = 40, 15


def gains(errors):
    """What a step gains that parts errors (m,) in an order: n1 n2 / m of the squared difference of their means."""

    def of(order):
        e, k = errors[order], np.arange(1, len(errors))
        before = np.cumsum(e)[:-1]
        after = e.sum() - before
        out = np.full(len(e), np.nan)
        out[3:-3] = ((before / k - after / (len(e) - k)) ** 2 * k * (len(e) - k) / len(e))[2:-3]
        return out

    return of


def places(rng, sort):
    joints = rng.uniform(-1, 1, (VIEWS, 3))
    joints = joints[np.argsort(joints[:, 0])] if sort else joints
    return Configurations(tuple(map(str, range(VIEWS))), joints)


def test_what_moved_in_time_is_told():
    told = 0
    for seed in range(50):
        rng = np.random.default_rng(seed)
        errors = rng.normal(size=VIEWS) + 3.0 * (np.arange(VIEWS) >= STEP)
        told += order_proves(gains(errors), np.arange(VIEWS), places(rng, False), slow=True)
    assert told >= 45  # a joint that follows time by chance hides the others


def test_views_of_a_machine_that_errs_are_told_once_in_twenty_files():
    told = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        errors = rng.standard_t(2, VIEWS)
        told += order_proves(gains(errors), np.arange(VIEWS), places(rng, False), slow=False)
    assert told <= 20  # 10 are expected


@pytest.mark.parametrize("seed", range(20))
def test_errors_along_a_joint_are_no_step_in_time(seed):
    rng = np.random.default_rng(seed)
    at = places(rng, True)
    errors = 3.0 * at.joints[:, 0] + 0.3 * rng.normal(size=VIEWS)
    assert not order_proves(gains(errors), np.arange(VIEWS), at, slow=True)
    assert order_proves(gains(errors), np.arange(VIEWS), at, slow=False)

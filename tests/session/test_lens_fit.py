"""The lens of `vision intrinsics` beside OpenCV's and mrcal's, on the same rows."""

from __future__ import annotations

import os

import numpy as np
import pytest
from lens_world import BOARD, LENS, SIZE, look

from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.pixel_bands import pixel_covariance
from robocal.prove.results import parameter_results
from robocal.session.vision.corner_table import CAMERA, CornerTable
from robocal.session.vision.lens_fit import fit_lens, plain_lens
from robocal.vision.camera import SYMBOLS, project, unproject

TRUE = np.array(list(LENS.values()))


def table(uv, sigma=None, points=BOARD):
    """Views (count, m, 2) as corners whose lens is to be found."""
    count, m = uv.shape[:2]
    flat = uv.reshape(-1, 2)
    options = {"camera": CAMERA, "intrinsics": tuple(TRUE), "free": ()}
    obs = Observations(
        "pixels", np.repeat(np.arange(count), m), flat, None if sigma is None else np.full_like(flat, sigma), group="corners",
        extra={"point": np.tile(points, (count, 1))}, options=options,
    )  # fmt: skip
    views = Configurations(tuple(f"v{i + 1}" for i in range(count)))
    return CornerTable(
        data=DataSet(views, (obs,)),
        size=SIZE,
        marker=("",) * len(flat),
        corner=np.zeros(len(flat), dtype=int),
        family=None,
        upright=True,
        files=(),
        remarks=(),
    )


def noisy(seed, count, noise):
    rng = np.random.default_rng(seed)
    uv = look(rng, count)
    return uv + rng.normal(0, noise, uv.shape)


def test_the_lens_is_that_of_opencv():
    """Equal rows, equal free numbers, both to the end: within a millionth of sigma; and the same sigma."""
    cv2 = pytest.importorskip("cv2")
    uv = noisy(3, 15, 0.2).astype(np.float32)
    points = BOARD.astype(np.float32)
    start = np.array([[1000.0, 0, SIZE[0] / 2], [0, 1000.0, SIZE[1] / 2], [0, 0, 1]])
    rms, k, d, _, _, sigma, *_ = cv2.calibrateCameraExtended(
        [points] * len(uv), list(uv), SIZE, start, np.zeros(5), flags=cv2.CALIB_USE_INTRINSIC_GUESS, criteria=(3, 2000, 1e-16)
    )  # fmt: skip
    theirs = np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d.ravel()[:5]])
    made = fit_lens(table(uv.astype(float), points=points.astype(float)), plain_lens(SIZE, "brown"))
    found = parameter_results(made)
    ours, own = (np.array([getattr(p, name) for p in found]) for name in ("identified", "sigma"))
    apart = np.abs((ours - theirs) / own).max()
    print(f"\n1e-6 sigma asked, apart by {apart:.1e}")
    assert apart < 1e-6
    assert np.allclose(own, sigma.ravel()[:9], rtol=1e-4)
    left = np.concatenate([r.value for r in made.residuals])
    assert np.sqrt((left**2).sum(axis=1).mean()) == pytest.approx(rms, rel=1e-9)


# By mrcal 2.5.2 (projection_uncertainty, mean-pcam, its optimisation begun at our lens) for noisy(5, 12, 0.2): standard deviation along
# the worst direction in px, at 0.45 m and far away.
PLACES = np.array([(640.0, 480.0), (20, 20), (1260, 20), (640, 20), (300, 300)])
MRCAL = {
    False: [0.03972868, 4.73677759, 3.33753696, 0.08531158, 0.09214812],
    True: [0.30330228, 4.78335583, 3.38075375, 0.46739494, 0.45167944],
}


@pytest.mark.parametrize("far", [False, True])
def test_a_pixel_is_as_sure_as_mrcal_says(far):
    made = fit_lens(table(noisy(5, 12, 0.2)), plain_lens(SIZE, "brown"))
    lens = np.array([made.values[f"{CAMERA}.{s}"] for s in SYMBOLS])
    ways = unproject(PLACES, lens)
    points = ways / ways[:, 2:] * 0.45
    _, to_point, to_lens = project(points, lens)
    found = pixel_covariance(made, points, to_point, to_lens, [f"{CAMERA}.{s}" for s in SYMBOLS], far)
    # Noise is divided by the degrees of freedom here, by the number of rows there.
    ours = np.sqrt(np.linalg.eigvalsh(found)[:, -1])
    print(f"\n10 % asked, over mrcal's {ours / MRCAL[far]}")
    assert ours == pytest.approx(MRCAL[far], rel=0.05)


@pytest.mark.slow
def test_intervals_hold_the_truth():
    """95 % of them: f, c and k1 of many calibrations together; with ROBOCAL_FULL=1 of 200, each number alone."""
    full = bool(os.environ.get("ROBOCAL_FULL"))
    count = 200 if full else 50
    held = np.zeros((count, 9))
    for seed in range(count):
        found = parameter_results(fit_lens(table(noisy(1000 + seed, 15, 0.2)), plain_lens(SIZE, "brown")))
        for k, p in enumerate(found):
            assert p.interval is not None
            held[seed, k] = p.interval[0] <= TRUE[k] <= p.interval[1]
    share = held[:, :5].mean(axis=0)
    print("held:", dict(zip(SYMBOLS, held.mean(axis=0).round(3).tolist(), strict=True)))
    assert (share > 0.88).all() and (not full or (0.93 <= share.mean() <= 0.97))


@pytest.mark.slow
def test_a_sheet_that_curls_widens_the_intervals():
    """Each view has a bend of its own: its corners are off together, and an interval of even noise would hold the truth half as often."""
    count = 60 if os.environ.get("ROBOCAL_FULL") else 25
    held = np.zeros((count, 2, 5))
    for seed in range(count):
        rng = np.random.default_rng(2000 + seed)
        views = []
        for _ in range(20):
            curl = BOARD + [0.0, 0.0, 1.0] * (
                rng.normal(0, 0.15) * BOARD[:, :1] ** 2 + rng.normal(0, 0.15) * BOARD[:, 1:2] ** 2
            )
            views.append(look(rng, 1, curl)[0])
        uv = np.array(views)
        made = fit_lens(table(uv + rng.normal(0, 0.02, uv.shape)), plain_lens(SIZE, "brown"))
        even = made.uncertainty.sigma[:5]
        for k, p in enumerate(parameter_results(made)[:5]):
            assert p.interval is not None
            held[seed, :, k] = p.interval[0] <= TRUE[k] <= p.interval[1], abs(p.identified - TRUE[k]) < 1.96 * even[k]
    found, alone = held.mean(axis=(0, 2))
    print("held:", found.round(3), "by even noise:", alone.round(3))
    assert found > 0.85 and alone < 0.75

"""The 56-pose job that every contestant solves, made from a seed (numpy alone, no robocal).

Robot: a five-axis revolute arm in modified DH (Craig), `Rx(alpha) Tx(a) Rz(theta + q) Tz(d)` per joint, after the
Mitsubishi RV-2AJ, and a tool point. The full vector has 23 entries: alpha, a, theta, d of j1 .. j5, tool x, y, z.

Why these 19 are free. Measured points can tell 4 * 5 + 3 = 23 combinations of a five-axis arm. Here the base frame is
known and modified DH has no turn about y (Hayati's beta), so two terms of joint 1 are missing, and one each of joints 3
and 4, which are parallel to joint 2: 19. Among the 23 columns of the table that means
  d3, d4       repeat d2 exactly, the three axes being parallel                                  -> dropped
  theta5, d5   turn and shift the tool point about joint 5, as the tool's x, y, z do already     -> dropped
and the other 19 are independent *if the tool point lies off axis 5*. On the axis theta4 repeats a5 (both shift the
point along x4) and alpha5 repeats d2: rank 17. So the tool point sits 60 mm off the axis, 40 mm ahead of the flange.
With columns scaled by the errors that we expect (1 mrad, 0.3 mm) and rows by the noise (0.02 mm), the 19 singular
values then run from about 229 down to 13 (condition 17, medians of 20 instances), the 20th of all 23 columns is 2e-14,
and the worst parameter (theta4) is found to 8 % of its expected error. `python benchmarks/job.py` prints these numbers.

Units: metres and radians everywhere.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

JOINTS = 5
NAMES = tuple(f"j{i}.{s}" for i in range(1, JOINTS + 1) for s in ("alpha", "a", "theta", "d")) + (
    "tool.x",
    "tool.y",
    "tool.z",
)
DROPPED = ("j3.d", "j4.d", "j5.theta", "j5.d")
FREE = np.array([i for i, name in enumerate(NAMES) if name not in DROPPED])
ANGULAR = np.array([name.endswith(("alpha", "theta")) for name in NAMES])
LIMITS = np.radians([[-150, 150], [-60, 120], [-110, 120], [-90, 90], [-200, 200]])

SIGMA = 2e-5  # noise of one coordinate
ANGLE_ERROR, LENGTH_ERROR = 1e-3, 3e-4
EXPECTED = np.where(ANGULAR, ANGLE_ERROR, LENGTH_ERROR)  # size of the error of each parameter
POSES, HELD_OUT = 56, 500


def nominal() -> np.ndarray:
    """The full nominal vector, shape (23,)."""
    right = np.pi / 2
    table = [
        [0.0, 0.0, 0.0, 0.300],
        [-right, 0.0, -right, 0.0],
        [0.0, 0.250, 0.0, 0.0],
        [0.0, 0.160, right, 0.0],
        [right, 0.0, 0.0, 0.072],
    ]
    return np.concatenate([np.ravel(table), [0.060, 0.0, 0.040]])


def _frames(x, q):
    """Walk the arm: per joint the x axis and origin before it, the z axis and origin after it; then the last frame."""
    rotation = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    origin = np.zeros((len(q), 3))
    walked = []
    for i in range(JOINTS):
        alpha, a, theta, d = x[4 * i : 4 * i + 4]
        x_axis, start = rotation[:, :, 0], origin
        y_axis = np.cos(alpha) * rotation[:, :, 1] + np.sin(alpha) * rotation[:, :, 2]
        z_axis = np.cos(alpha) * rotation[:, :, 2] - np.sin(alpha) * rotation[:, :, 1]
        c, s = np.cos(theta + q[:, i, None]), np.sin(theta + q[:, i, None])
        rotation = np.stack([c * x_axis + s * y_axis, c * y_axis - s * x_axis, z_axis], axis=-1)
        origin = origin + a * x_axis + d * z_axis
        walked.append((x_axis, start, z_axis, origin))
    return walked, rotation, origin


def position(x, q) -> np.ndarray:
    """Tool point in the base, (n, 3), for the full vector x (23,) and configurations q (n, 5)."""
    _, rotation, origin = _frames(x, q)
    return origin + rotation @ x[-3:]


def jacobian(x, q) -> np.ndarray:
    """Derivative of `position` by all 23 parameters, (n, 3, 23).

    A turn about an axis moves the point by axis x lever, a shift along it by the axis.
    """
    walked, rotation, origin = _frames(x, q)
    point = origin + rotation @ x[-3:]
    out = np.empty((len(q), 3, len(NAMES)))
    for i, (x_axis, start, z_axis, end) in enumerate(walked):
        out[:, :, 4 * i] = np.cross(x_axis, point - start)
        out[:, :, 4 * i + 1] = x_axis
        out[:, :, 4 * i + 2] = np.cross(z_axis, point - end)
        out[:, :, 4 * i + 3] = z_axis
    out[:, :, -3:] = rotation
    return out


@dataclass(frozen=True)
class Job:
    """One instance. The contestants see a file without `true` and `held_out_positions`."""

    seed: int
    true: np.ndarray  # (23,)
    q: np.ndarray  # (56, 5)
    positions: np.ndarray  # (56, 3), noisy
    held_out_q: np.ndarray  # (500, 5)
    held_out_positions: np.ndarray  # (500, 3), exact

    def save(self, path: Path) -> Path:
        """Write what a contestant may see."""
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(
            path,
            names=np.array(NAMES),
            nominal=nominal(),
            free=FREE,
            expected=EXPECTED,
            limits=LIMITS,
            sigma=SIGMA,
            q=self.q,
            positions=self.positions,
            held_out_q=self.held_out_q,
        )
        return path

    def error_mm(self, predicted) -> float:
        """Mean distance between predicted and true held-out positions, in mm."""
        return 1e3 * float(np.linalg.norm(predicted - self.held_out_positions, axis=1).mean())


def make(seed: int, poses: int = POSES) -> Job:
    """The instance of a seed: random errors of the free parameters, random configurations within limits, noise."""
    rng = np.random.default_rng(seed)
    true = nominal()
    true[FREE] += rng.normal(size=len(FREE)) * EXPECTED[FREE]
    low, high = LIMITS.T
    q = rng.uniform(low, high, (poses, JOINTS))
    held_out_q = rng.uniform(low, high, (HELD_OUT, JOINTS))
    positions = position(true, q) + rng.normal(scale=SIGMA, size=(poses, 3))
    return Job(seed, true, q, positions, held_out_q, position(true, held_out_q))


def reference(job: Job) -> np.ndarray:
    """Full vector of the exact least-squares solution (Gauss-Newton to convergence), the yardstick."""
    x = nominal()
    for _ in range(20):
        residual = (job.positions - position(x, job.q)).ravel()
        columns = jacobian(x, job.q).reshape(-1, len(NAMES))[:, FREE] * EXPECTED[FREE]
        step = np.linalg.lstsq(columns, residual, rcond=None)[0]
        x[FREE] += step * EXPECTED[FREE]
        if np.abs(step).max() < 1e-12:
            break
    return x


def rank_report(seeds=range(20)) -> str:
    """The numbers behind the choice of the 19, over the instances."""
    lines = []
    for lateral in (0.0, 0.02, 0.06):
        low, high, beyond, worst = [], [], [], []
        for seed in seeds:
            x = nominal()
            x[-3] = lateral
            columns = jacobian(x, make(seed).q).reshape(-1, len(NAMES)) * EXPECTED / SIGMA
            free = columns[:, FREE]
            values = np.linalg.svd(free, compute_uv=False)
            low.append(values[-1])
            high.append(values[0])
            beyond.append(np.linalg.svd(columns, compute_uv=False)[len(FREE)])
            if values[-1] > 1e-6:
                worst.append(np.sqrt(np.diag(np.linalg.inv(free.T @ free)).max()))
        lines.append(
            f"tool {1e3 * lateral:3.0f} mm off axis 5: singular values {np.median(high):.1f} .. {np.median(low):.3g}, "
            f"20th of all 23 columns {np.median(beyond):.1e}, worst sigma / expected error "
            + (f"{max(worst):.3f}" if worst else "unbounded")
        )
    return "\n".join(lines)


if __name__ == "__main__":
    flange = np.concatenate([nominal()[:-3], np.zeros(3)])
    public = np.radians([[-107.7560, 32.1796, 104.1809, 42.9295, 66.1123]])
    print("public test point, mm:", np.round(1e3 * position(flange, public)[0], 4))
    print(rank_report())
    for seed in range(3):
        job = make(seed)
        before, after = (job.error_mm(position(x, job.held_out_q)) for x in (nominal(), reference(job)))
        print(f"seed {seed}: held-out mean error {before:.3f} mm before, {after:.5f} mm after")

"""scipy.optimize.least_squares on the joint jobs: trf with the sparse, compiled Jacobian and LSMR, x_scale="jac"."""

from itertools import pairwise

import numpy as np
from joint_kernel import eye_prior, rows_of
from protocol import serve
from scipy.optimize import least_squares
from scipy.sparse import block_diag, csr_matrix, vstack


def prepare(job):
    views, markers = len(job.views), len(job.markers)
    parts = [np.array(v, float) for v in (job.views, job.markers, job.eye, job.lens[:8])]
    parts.append(np.column_stack([job.anchors, np.zeros(8)]))
    sizes = np.cumsum([0, *(p.size for p in parts)])
    start = np.concatenate([p.ravel() for p in parts])
    view, marker = np.asarray(job.view), np.asarray(job.marker)
    six = np.arange(6)
    common = np.concatenate([sizes[2] + six, sizes[3] + np.arange(8)])
    columns = [
        np.tile(np.concatenate([6 * v + six, sizes[1] + 6 * m + six, common]), 8)
        for v, m in zip(view, marker, strict=True)
    ]
    columns += [np.concatenate([6 * (i // 8) + six, sizes[4] + 4 * (i % 8) + np.arange(4)]) for i in range(8 * views)]
    indices = np.concatenate(columns)
    rows = 8 * len(view) + 8 * views
    indptr = np.concatenate([[0], np.cumsum(np.repeat([26, 10], [8 * len(view), 8 * views]))])
    uv = np.ascontiguousarray(job.uv, float).reshape(len(view), 8)
    fixed = (
        np.array(job.platform, float), view.astype(np.int64), marker.astype(np.int64), uv, np.array(job.length, float).ravel(),
        np.ascontiguousarray(job.corners, float).ravel(), np.array([job.corner, job.sigma], float),
    )  # fmt: skip
    root, weight = np.linalg.inv(np.linalg.cholesky(job.eye_covariance)), 1 / np.asarray(job.lens_prior, float)
    known = np.zeros(len(start), bool)
    known[sizes[1] : sizes[1] + 6] = True  # the first marker
    seen = np.zeros(len(start), bool)
    seen[indices] = True
    free = np.flatnonzero(~known & seen)

    def split(x):
        full = start.copy()
        full[free] = x
        v, m, e, k, c = (full[a:b] for a, b in pairwise(sizes))
        return v.reshape(views, 6), m.reshape(markers, 6), e, k, c.reshape(8, 4)

    def evaluate(x):
        r, data = np.empty(rows), np.empty(len(indices))
        v, m, e, k, c = split(x)
        rows_of(v, m, e, k, c, *fixed, r, data)
        off, slope = eye_prior(e, parts[2], root)
        return np.concatenate([r, off, weight * (k - parts[3])]), data, slope

    def jacobian(x):
        _, data, slope = evaluate(x)
        top = csr_matrix((data, indices, indptr), shape=(rows, len(start)))
        below = block_diag([slope, np.diag(weight)]).tocoo()
        low = csr_matrix((below.data, (below.row, sizes[2] + below.col)), shape=(14, len(start)))
        return vstack([top, low]).tocsc()[:, free].tocsr()

    def solve():
        return least_squares(
            lambda x: evaluate(x)[0], start[free], jac=jacobian, method="trf", tr_solver="lsmr", x_scale="jac", ftol=1e-10, xtol=1e-15,
            gtol=1e-15, max_nfev=500,
        )  # fmt: skip

    def answer(result):
        return {"cost": float(result.cost), "iterations": int(result.njev), "corners": 4 * len(view)}

    return solve, answer


if __name__ == "__main__":
    serve(prepare, "least_squares(trf, lsmr), sparse compiled Jacobian", ("scipy", "numpy", "numba"))

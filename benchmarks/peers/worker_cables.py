"""Solvers on the cable jobs. Arguments: task (tension, grid, poses, margins, place), then the solver (see SOLVERS).

A solver is a function `make(count) -> balance`, `balance(W, w) -> t or None`: tensions t within the limits with W t + w = 0, of least
|t|^2 from a quadratic program, any from a linear one. What the programs of all poses have in common is set up once, in `make`;
data of one pose are written into the arrays, model or workspace that the solver's interface lets one keep.
"""

import sys

import cable_job as cables
import numpy as np
from cable_search import Search
from protocol import serve

M = cables.CABLES
LOW, HIGH = (np.ascontiguousarray(side) for side in cables.LIMITS.T)


def by_quadprog():
    """quadprog.solve_qp (Goldfarb and Idnani) with the factor of its Hessian, the identity, given."""
    from quadprog import solve_qp

    eye, nothing = np.eye(M), np.zeros(M)
    rows, bounds = np.zeros((M, 6 + 2 * M)), np.r_[np.zeros(6), LOW, -HIGH]
    rows[:, 6:] = np.hstack([eye, -eye])

    def balance(w, load):
        rows[:, :6], bounds[:6] = w.T, -load
        try:
            return solve_qp(eye, nothing, rows, bounds, 6, True)[0]
        except ValueError:
            return None

    return balance


def _daqp_arrays():
    sense = np.r_[np.zeros(M), np.full(6, 5)].astype(np.int32)
    return np.eye(M), np.zeros(M), np.r_[HIGH, np.zeros(6)], np.r_[LOW, np.zeros(6)], sense


def by_daqp():
    """daqp.solve, its arrays kept."""
    from daqp import solve

    hessian, linear, upper, lower, sense = _daqp_arrays()

    def balance(w, load):
        upper[M:] = lower[M:] = -load
        t, _, flag, _ = solve(hessian, linear, w, upper, lower, sense)
        return t if flag == 1 else None

    return balance


def by_daqp_model():
    """daqp.Model: one workspace, updated; it starts from the active set of the pose before."""
    from daqp import Model

    hessian, linear, upper, lower, sense = _daqp_arrays()
    model = Model()
    model.setup(hessian, linear, np.eye(6, M), upper, lower, sense)

    def balance(w, load):
        upper[M:] = lower[M:] = -load
        model.update(A=w, bupper=upper, blower=lower)
        t, _, flag, _ = model.solve()
        return t if flag == 1 else None

    return balance


def by_osqp():
    """OSQP: one workspace, updated, warm started; tolerances 1e-10, without which it is not comparable."""
    import osqp
    from scipy import sparse

    values = np.ones((M, 7))  # one column of W and the unit of its limit: what the sparse matrix keeps, cable by cable
    pattern = sparse.csc_matrix(np.vstack([np.ones((6, M)), np.eye(M)]))
    lower, upper = np.r_[np.zeros(6), LOW], np.r_[np.zeros(6), HIGH]
    model = osqp.OSQP()
    options = {"eps_abs": 1e-10, "eps_rel": 1e-10, "max_iter": 100_000}
    model.setup(sparse.eye(M, format="csc"), np.zeros(M), pattern, lower, upper, verbose=False, **options)

    def balance(w, load):
        values[:, :6] = w.T
        lower[:6] = upper[:6] = -load
        model.update(Ax=values.ravel(), l=lower, u=upper)
        found = model.solve(raise_error=False)
        return found.x if found.info.status_val == 1 else None

    return balance


def by_linprog():
    """scipy.optimize.linprog(method="highs") without an objective."""
    from scipy.optimize import linprog

    nothing = np.zeros(M)

    def balance(w, load):
        found = linprog(nothing, A_eq=w, b_eq=-load, bounds=cables.LIMITS, method="highs")
        return found.x if found.status == 0 else None

    return balance


def by_highspy():
    """HiGHS through highspy, one solver and one model object kept, without an objective, presolve off."""
    import highspy

    solver, model = highspy.Highs(), highspy.HighsLp()
    for option, value in (("output_flag", False), ("threads", 1), ("presolve", "off")):
        solver.setOptionValue(option, value)
    model.num_col_, model.num_row_ = M, 6
    model.col_cost_, model.col_lower_, model.col_upper_ = np.zeros(M), LOW, HIGH
    matrix = model.a_matrix_
    matrix.format_ = highspy.MatrixFormat.kColwise
    matrix.start_, matrix.index_ = np.arange(0, 6 * M + 1, 6), np.tile(np.arange(6), M)
    optimal = highspy.HighsModelStatus.kOptimal

    def balance(w, load):
        matrix.value_ = w.T.ravel()
        model.row_lower_ = model.row_upper_ = -load
        solver.passModel(model)
        solver.run()
        return np.array(solver.getSolution().col_value) if solver.getModelStatus() == optimal else None

    return balance


SOLVERS = {
    "quadprog": (by_quadprog, ("quadprog",)),
    "daqp": (by_daqp, ("daqp",)),
    "daqp.Model": (by_daqp_model, ("daqp",)),
    "osqp": (by_osqp, ("osqp", "scipy")),
    "linprog": (by_linprog, ("scipy",)),
    "highspy": (by_highspy, ("highspy",)),
}


def tension(job, make):
    """Tensions of every pose from its structure matrix and wrench, one after the other."""
    balance = make()
    none = [float("nan")] * M

    def solve():
        return [balance(w, load) for w, load in zip(job.structure, job.wrench, strict=True)]

    return solve, lambda found: {"tension": [none if t is None else t.tolist() for t in found]}


def grid(job, make):
    """Feasibility of the cells in the sample; structure matrices are built on the way, all at once."""
    balance, points = make(), job.points[job.sample]

    def solve():
        w = cables.structure(np.tile(np.eye(3), (len(points), 1, 1)), points)
        return [balance(*one) is not None for one in zip(w, cables.weight(len(points)), strict=True)]

    return solve, lambda found: {"feasible": found}


def poses(job, make):
    """Search along every ray with this solver, contacts by sampling; tensions by quadprog."""
    search = Search(make(), by_quadprog())

    def solve():
        motions = zip(job.translation, job.rotation, strict=True)
        return [np.array(x) for x in zip(*(search.reach(job.start, v, turn) for v, turn in motions), strict=True)]

    def answer(found):
        return {"furthest": found[0].tolist(), "tension": found[1].tolist(), "length": found[2].tolist()}

    return solve, answer


def margins(job, make):
    """Capacity margins of a few cells: Qhull's hull of the wrenches of all corners of the limits."""
    from scipy.spatial import ConvexHull

    corners = np.array(np.meshgrid(*cables.LIMITS)).reshape(M, -1)

    def solve():
        points = job.points[job.hulls]
        w = cables.structure(np.tile(np.eye(3), (len(points), 1, 1)), points)
        hulls = [ConvexHull((one @ corners).T).equations for one in w]
        return [-(e[:, :-1] @ -load + e[:, -1]).max() for e, load in zip(hulls, cables.weight(len(w)), strict=True)]

    return solve, lambda found: {"margin": [float(x) for x in found]}


def place(job, make):
    """scipy.optimize.least_squares, Levenberg-Marquardt of MINPACK, on a shift and a rotation vector beside the start."""
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    def one(length, position, rotation):
        def at(x):
            lever = (Rotation.from_rotvec(x[3:]).as_matrix() @ rotation @ cables.B.T).T
            away = position + x[:3] + lever - cables.A
            far = np.linalg.norm(away, axis=1)
            return lever, away / far[:, None], far

        def jacobian(x):
            lever, u, _ = at(x)
            # A turn beside the rotation vector x: its left Jacobian.
            angle = np.linalg.norm(x[3:])
            k = np.array([[0, -x[5], x[4]], [x[5], 0, -x[3]], [-x[4], x[3], 0]])
            small = angle < 1e-8
            first = 0.5 if small else (1 - np.cos(angle)) / angle**2
            second = 1 / 6 if small else (angle - np.sin(angle)) / angle**3
            return np.hstack([u, np.cross(lever, u) @ (np.eye(3) + first * k + second * k @ k)])

        found = least_squares(
            lambda x: at(x)[2] - length, np.zeros(6), jacobian, method="lm", xtol=1e-13, ftol=1e-15, gtol=1e-15
        )
        return position + found.x[:3]

    def solve():
        return [one(*row) for row in zip(job.length, job.begin_position, job.begin_rotation, strict=True)]

    return solve, lambda found: {"place": [p.tolist() for p in found]}


TASKS = {"place": place, "tension": tension, "grid": grid, "poses": poses, "margins": margins}

if __name__ == "__main__":
    task, name = sys.argv[1:]
    make, packages = SOLVERS.get(name, (None, ("scipy",)))
    alone = {"margins": "ConvexHull of all corners of the limits", "place": "least_squares, lm, with its Jacobian"}
    how = alone[task] if make is None else " ".join(make.__doc__.split())
    serve(lambda job: TASKS[task](job, make), how, (*packages, "numpy"))

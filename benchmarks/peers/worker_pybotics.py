"""pybotics as its calibration example does it: OptimizationHandler, optimize_accuracy and scipy's least_squares with
its defaults.

Argument: documented, or xyz. The residual of the documented `optimize_accuracy` is the *length* of each position
error, one per pose: not smooth near zero, so the solver stops early. xyz is what a user who noticed would write: the
same handler and robot, but the three coordinates as residuals. Derivatives are finite differences in both.
Millimetres and radians, as in pybotics' predefined robots. The masks free the job's 19 parameters and nothing else.
"""

import sys

import numpy as np
from protocol import serve
from pybotics.optimization import OptimizationHandler, optimize_accuracy
from pybotics.robot import Robot
from scipy.optimize import least_squares

MM = 1e3
WAY = sys.argv[1]
HOW = {
    "documented": "OptimizationHandler + optimize_accuracy + least_squares with its defaults, as in its example",
    "xyz": "the same with the three coordinates of each error as residuals instead of its length",
}


def coordinates(vector, handler, qs, positions):
    """The residual that `optimize_accuracy` could return: all coordinates of all position errors."""
    handler.apply_optimization_vector(vector)
    return np.concatenate([handler.robot.fk(q)[:3, 3] - y for q, y in zip(qs, positions, strict=True)])


FUNCTION = {"documented": optimize_accuracy, "xyz": coordinates}[WAY]


def prepare(job):
    table = job.nominal[:-3].reshape(-1, 4) * [1, MM, 1, MM]
    robot = Robot.from_parameters(table)
    robot.tool.position = MM * job.nominal[-3:]
    free = np.isin(np.arange(len(job.nominal)), job.free)
    positions = MM * job.positions

    def solve():
        # the handler copies the robot, so each solve starts from the nominal one
        handler = OptimizationHandler(
            robot, kinematic_chain_mask=free[:-3].tolist(), tool_mask=[*free[-3:].tolist(), False, False, False]
        )
        result = least_squares(
            fun=FUNCTION, x0=handler.generate_optimization_vector(), args=(handler, job.q, positions)
        )
        handler.apply_optimization_vector(result.x)
        return handler, result

    def answer(solved):
        handler, result = solved
        table = handler.robot.kinematic_chain.matrix / [1, MM, 1, MM]
        tool = handler.robot.tool.position / MM
        return {"parameters": [*table.ravel().tolist(), *tool.tolist()], "iterations": int(result.njev)}

    return solve, answer


serve(prepare, HOW[WAY], ("pybotics", "numpy", "scipy"))

"""FIGAROH as its examples do it: URDF and YAML in, a BaseCalibration subclass, `initialize()`, then `solve()`.

Argument: own (FIGAROH chooses the parameters itself from all six per joint, its documented route) or same (afterwards
the list is replaced by the job's 19, which in FIGAROH's joint frames have the names below). `initialize()` (CSV,
choice of parameters) is not timed; `solve()` is: a Levenberg-Marquardt fit with finite differences over pinocchio,
the statistics and the printed quality report.

Two more for cross-validation: folds times five folds of the job's 19 parameters and nothing else; map_cv its
cross-validated route, `estimation.method: map_cv` with its defaults (25 fits to choose the size of the priors), then
`solve()`.
"""

import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import yaml
from figaroh.calibration import BaseCalibration, estimation
from figaroh.calibration.calibration_tools import calc_updated_fkm
from figaroh.tools.robot import Robot
from protocol import serve

WHICH = sys.argv[1]
HOW = {
    "own": "BaseCalibration(full_params, known base), its own choice of parameters, solve() with its defaults",
    "folds": "BaseCalibration, the job's 19 parameters, estimation._cv_error over five folds",
    "map_cv": "BaseCalibration, create_param_list() with estimation.method map_cv, then solve(), defaults",
    "same": "BaseCalibration(full_params, known base), the job's 19 parameters, solve() with its defaults",
}
# alpha, a, theta of a joint are phix, px, phiz of its placement; d of joint i - 1 is a shift in the placement of
# joint i, along y for i = 2 (alpha2 = -90 deg) and along z for i = 3
SAME = [
    *("d_phix_j1", "d_px_j1", "d_phiz_j1"),
    *("d_py_j2", "d_phix_j2", "d_px_j2", "d_phiz_j2"),
    *("d_pz_j3", "d_phix_j3", "d_px_j3", "d_phiz_j3"),
    *("d_phix_j4", "d_px_j4", "d_phiz_j4"),
    *("d_phix_j5", "d_px_j5"),
    *("pEEx_1", "pEEy_1", "pEEz_1"),
]


class Calibration(BaseCalibration):
    """The subclass that FIGAROH asks its users for, with the cost function of its UR10 example."""

    def cost_function(self, var):
        estimated = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
        residuals = self._compute_logmap_residuals(self.PEE_measured, estimated)
        return self.apply_measurement_weighting(residuals, pos_weight=1.0, orient_weight=0.5)


def urdf(job) -> str:
    """The nominal arm: joint i sits at `Tz(d of i - 1) Rx(alpha) Tx(a)`; theta offsets go into the joint values."""
    inertial = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    table, tool = job.nominal[:-3].reshape(-1, 4), job.nominal[-3:]
    lines = ['<robot name="arm">', '<link name="base"/>']
    parent, lift = "base", 0.0
    for i, (alpha, a, theta, d) in enumerate(table.tolist(), start=1):
        low, high = (job.limits[i - 1] + theta).tolist()
        lines += [
            f'<link name="l{i}">{inertial}</link><joint name="j{i}" type="revolute">',
            f'<parent link="{parent}"/><child link="l{i}"/><axis xyz="0 0 1"/>',
            f'<origin xyz="{a!r} 0 {lift!r}" rpy="{alpha!r} 0 0"/>',
            f'<limit lower="{low!r}" upper="{high!r}" effort="1" velocity="1"/></joint>',
        ]
        parent, lift = f"l{i}", d
    x, y, z = tool.tolist()
    lines += [
        '<link name="tool"/><joint name="tool_mount" type="fixed">',
        f'<parent link="{parent}"/><child link="tool"/><origin xyz="{x!r} {y!r} {z + lift!r}" rpy="0 0 0"/></joint>',
        "</robot>",
    ]
    return "\n".join(lines)


def config(names, data_file) -> dict:
    """A unified configuration like that of FIGAROH's UR10 example, for a position sensor."""
    return {
        "robot": {"name": "arm", "properties": {"joints": {"active_joints": names}}},
        "tasks": {
            "calibration": {
                "enabled": True,
                "parameters": {"calibration_level": "full_params", "outlier_threshold": 0.05},
                "kinematics": {"base_frame": "universe", "tool_frame": "tool"},
                "measurements": {
                    "markers": [
                        {
                            "name": "point",
                            "reference_joint": names[-1],
                            "measurable_dof": [True, True, True, False, False, False],
                        }
                    ],
                    "poses": {"base_pose": [0.0] * 6, "tool_pose": [0.0] * 6},
                },
                "data": {"source_file": str(data_file), "validation_data_file": "", "number_of_samples": 56},
            }
        },
    }


def cross_validated(calibration):
    """The choice of the prior scale by k-fold, and the fit with it."""
    calibration.calib_config["estimation"] = {"method": "map_cv"}

    def solve():
        calibration.create_param_list()
        calibration.solve(enable_logging=False)
        return calibration.estimation_report

    return solve, lambda report: {"k_fold_rms_mm": 1e3 * min(point["rms"] for point in report["cv_curve"])}


def prepare(job):
    offsets = job.nominal[2:-3:4]
    names = [f"j{i}" for i in range(1, len(offsets) + 1)]
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "arm.urdf").write_text(urdf(job))
        rows = np.column_stack([job.positions, job.q + offsets])
        header = ",".join(["x1", "y1", "z1", *names])
        np.savetxt(folder / "data.csv", rows, delimiter=",", header=header, comments="", fmt="%.17g")
        (folder / "arm.yaml").write_text(yaml.safe_dump(config(names, folder / "data.csv")))
        robot = Robot(str(folder / "arm.urdf"), str(folder))
        calibration = Calibration(robot, str(folder / "arm.yaml"))
        # the YAML cannot say these two; FIGAROH's examples set them by hand
        calibration.calib_config["known_baseframe"] = True
        calibration.calib_config["known_tipframe"] = False
        calibration.initialize()
    if WHICH in ("same", "folds"):
        calibration.calib_config["param_name"] = list(SAME)

    def solve():
        return calibration.solve(enable_logging=False)

    if WHICH == "folds":
        folds = estimation._folds(len(job.q), 5, 0)
        return (
            lambda: estimation._cv_error(calibration, list(SAME), None, folds),
            lambda found: {"k_fold_rms_mm": 1e3 * float(found.mean())},
        )
    if WHICH == "map_cv":
        return cross_validated(calibration)

    def answer(result):
        held_out = job.held_out_q + offsets
        cfg = dict(calibration.calib_config, NbSample=len(held_out))
        points = calc_updated_fkm(calibration.model, calibration.data, result.x, held_out, cfg).reshape(3, -1).T
        return {"held_out": points.tolist(), "iterations": int(result.nfev), "parameter_count": len(result.x)}

    return solve, answer


warnings.simplefilter("ignore")
serve(prepare, HOW[WHICH], ("figaroh", "pin", "numpy", "scipy"))

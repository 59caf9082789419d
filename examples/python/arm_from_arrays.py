"""An arm from arrays with full poses: ten lines to covariance and a figure."""

import laboratory

import robocal as rc

joints, poses = laboratory.arm()
arm = rc.robot(laboratory.DH, convention="dh-hayati", columns=laboratory.COLUMNS)
data = rc.measurements(joints, pose=poses, sigma=5e-5, turn_sigma=1e-4)  # rad and m, unless units= says otherwise
found = rc.identify(arm, data)
print(found)
print(found.verdict, found.covariance.names, found.covariance.matrix.shape)
print(found.parameters["identified"], found.residuals["after_mm"])  # columns that any data frame takes
print(found.plot("errors").save(laboratory.OUT / "errors.svg"), found.report(laboratory.OUT / "arm.html"))

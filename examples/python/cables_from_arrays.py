"""A cable robot from arrays of anchors, lengths and poses: the same ten lines."""

import laboratory

import robocal as rc

lengths, position, quaternion = laboratory.cables()
robot = rc.cable.robot(frame_anchors=laboratory.FRAME, platform_anchors=laboratory.PLATFORM)
data = rc.measurements(
    lengths=lengths, position=position, quaternion=quaternion, quaternion_order="xyzw",
    length_sigma=5e-4, sigma=2e-4, turn_sigma=2e-4,
)  # fmt: skip
found = rc.identify(robot, data, fix="measurements")  # the tracker stands at the base; without fix= anywhere
print(found)
print(found.verdict, found.covariance.of("c1.ax", "c1.ay", "c1.az"))
print(found.plot("errors").save(laboratory.OUT / "cables.svg"), found.save(laboratory.OUT / "run")[0])

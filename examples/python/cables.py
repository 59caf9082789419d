"""A cable robot from arrays of anchors, lengths and poses: the same ten lines."""

import laboratory

import robocal as rc

lengths, position, quaternion = laboratory.cables()
robot = rc.cable.robot(frame_anchors=laboratory.FRAME, platform_anchors=laboratory.PLATFORM)
data = rc.measurements(
    lengths=lengths,
    length_sigma=5e-4,
    position=position,
    sigma=2e-4,
    quaternion=quaternion,
    quaternion_order="xyzw",
    turn_sigma=2e-4,
)
found = rc.identify(
    robot, data, fix="measurements"
)  # the tracker's frame is that of the base; without fix= it stands anywhere
print(found)
print(found.verdict, found.covariance.of("c1.ax", "c1.ay", "c1.az"))
found.plot("errors").save("cables.svg")
found.save("cables-run")

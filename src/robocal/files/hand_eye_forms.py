"""A frame in the forms that other programs take: a joint of a URDF, a static transform of ROS, a calibration of easy_handeye2.

All of them say T_parent_child with metres: the place of `child` in the axes of `parent`. The axes of a camera are those of OpenCV: x to
the right, y down, z forward, what ROS calls an optical frame.
"""

from __future__ import annotations

from robocal._record import record
from robocal._types import Array
from robocal.files.units import number
from robocal.geometry import so3

__all__ = ["LINKS", "ExportedFrame", "easy_handeye_text", "static_transform_text", "urdf_joint_text"]

LINKS = {
    "flange": "tool0",
    "tool": "tool0",
    "base": "base_link",
    "camera": "camera_optical_frame",
}  # what ROS calls them


@record(eq=False)
class ExportedFrame:
    """T_parent_child in m: place (3,), R (3, 3), quaternion (x, y, z, w)."""

    parent: str
    child: str
    place: Array
    rotation: Array
    quaternion: tuple[float, float, float, float]

    @property
    def links(self) -> tuple[str, str]:
        """Parent and child as ROS calls them."""
        return LINKS.get(self.parent, self.parent), LINKS.get(self.child, self.child)


def urdf_joint_text(frame: ExportedFrame) -> str:
    """A fixed joint, to be copied into the robot's URDF; roll, pitch, yaw in rad."""
    parent, child = frame.links
    xyz = " ".join(number(float(v)) for v in frame.place)
    rpy = " ".join(number(float(v)) for v in so3.roll_pitch_yaw(frame.rotation))
    return (
        '<?xml version="1.0"?>\n'
        f"<!-- {frame.child} in {frame.parent}: copy link and joint into the URDF of the robot -->\n"
        f'<robot name="hand_eye">\n  <link name="{child}"/>\n  <joint name="{child}_joint" type="fixed">\n'
        f'    <parent link="{parent}"/>\n    <child link="{child}"/>\n    <origin xyz="{xyz}" rpy="{rpy}"/>\n'
        "  </joint>\n</robot>\n"
    )


def static_transform_text(frame: ExportedFrame) -> str:
    """The command that publishes it in ROS 2."""
    parent, child = frame.links
    words = [f"--{n} {number(float(v))}" for n, v in zip(("x", "y", "z"), frame.place, strict=True)]
    words += [f"--q{n} {number(float(v))}" for n, v in zip("xyzw", frame.quaternion, strict=True)]
    head = f"# {frame.child} in {frame.parent}; other names of frames: change the last two words\n"
    return f"{head}ros2 run tf2_ros static_transform_publisher {' '.join(words)} --frame-id {parent} --child-frame-id {child}\n"


def easy_handeye_text(frame: ExportedFrame, inhand: bool) -> str:
    """A calibration of easy_handeye2: the camera in the effector's frame, or in the base."""
    kind = "eye_in_hand" if inhand else "eye_on_base"
    x, y, z = (number(float(v)) for v in frame.place)
    qx, qy, qz, qw = (number(v) for v in frame.quaternion)
    return (
        f"# {frame.child} in {frame.parent}; change the names of frames to your own\n"
        f"parameters:\n  name: hand_eye\n  calibration_type: {kind}\n  robot_base_frame: {LINKS['base']}\n"
        f"  robot_effector_frame: {LINKS['flange']}\n  tracking_base_frame: {LINKS['camera']}\n  tracking_marker_frame: board\n"
        "  freehand_robot_movement: true\n"
        f"transform:\n  translation: {{x: {x}, y: {y}, z: {z}}}\n  rotation: {{x: {qx}, y: {qy}, z: {qz}, w: {qw}}}\n"
    )

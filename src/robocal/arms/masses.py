"""Masses of published arms: what gravity compliance needs, with the source of every number.

Each row is mass (kg) and centre of mass (m) in the frame in which the link's row of the published DH table ends.
"""

from __future__ import annotations

from robocal.arms.chain import Chain
from robocal.arms.gravity import Load

__all__ = ["published_loads"]

Row = tuple[float, tuple[float, float, float]]
# Universal Robots, DH parameters for calculations of kinematics and dynamics (CB3 UR10); frames of the classic DH table.
UR10: tuple[Row, ...] = (
    (7.1, (0.021, 0.0, 0.027)),
    (12.7, (0.38, 0.0, 0.158)),
    (4.27, (0.24, 0.0, 0.068)),
    (2.0, (0.0, 0.007, 0.018)),
    (2.0, (0.0, 0.007, 0.018)),
    (0.365, (0.0, 0.0, -0.026)),
)
# Gaz, Cognetti, Oliva, Robuffo Giordano and De Luca, Dynamic identification of the Franka Emika Panda robot with
# retrieval of feasible parameters using penalty-based optimization (2019), as in franka_ros; frames of modified DH.
PANDA: tuple[Row, ...] = (
    (4.970684, (3.875e-3, 2.081e-3, -4.762e-2)),
    (0.646926, (-3.141e-3, -2.872e-2, 3.495e-3)),
    (3.228604, (2.7518e-2, 3.9252e-2, -6.6502e-2)),
    (3.587895, (-5.317e-2, 1.04419e-1, 2.7454e-2)),
    (1.225946, (-1.1953e-2, 4.1065e-2, -3.8437e-2)),
    (1.666555, (6.0149e-2, -1.4117e-2, -1.0517e-2)),
    (0.735522, (1.0517e-2, -4.252e-3, 6.1597e-2)),
)
PUBLISHED = {
    ("Universal Robots UR10", ("dh", "dh-hayati")): UR10,
    ("Franka Emika Panda", ("mdh", "mdh-hayati")): PANDA,
}


def published_loads(chain: Chain) -> tuple[Load, ...]:
    """The published masses of an arm of this name in this convention, link by link; none where nobody published any."""
    for (name, conventions), rows in PUBLISHED.items():
        if chain.name == name and chain.convention in conventions and len(rows) == len(chain.joints):
            return tuple(Load(j, m, at) for j, (m, at) in zip(chain.joint_names, rows, strict=True))
    return ()

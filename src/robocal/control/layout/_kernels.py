"""Places in the arrays of a platform's controller: its law, its bounds, its memory, and why it stopped."""

from __future__ import annotations

# law (LAW,)
PERIOD, SPEED, ACCELERATION, TURN_SPEED, TURN_ACCELERATION, LOOP = 0, 1, 2, 3, 4, 5
STOP, GO, TURN_STOP, TURN_GO, ROTATION, SPACE, PATH = 6, 7, 8, 9, 10, 11, 12
KP, KI, KD, FILTER, EFFORT, SPEED_FILTER = 13, 14, 15, 16, 17, 18
METHOD, POWER, SHIFT, RESIDUAL, FOLLOW, TENSION_TIME = 19, 20, 21, 22, 23, 24
PATIENCE, STRETCH, BLEND = 25, 26, 27
LAW = 28
POSE, JOINTS = 0, 1  # SPACE
LINE, AXES = 0, 1  # PATH

# bounds (BOUNDS, m) in N: planned tensions, and those of sensors at which it stops
LEAST, MOST, REFERENCE, SLACK, OVERLOAD = 0, 1, 2, 3, 4
BOUNDS = 5

# memory: pose (16,), twist (6,), and so on
TWIST = 16
MOVING, TURNING = 22, 23
CODE, WHICH, VALUE = 24, 25, 26
DOUBT, SILENCE = 27, 28
LEFT, LEFT_TURN, RMS = 29, 30, 31
MEMORY = 32
# and then for each cable
INTEGRAL, ERROR, RATE, ANGLE, MOTOR_SPEED, PUSH = 0, 1, 2, 3, 4, 5
TENSION, STRAIN, JOINT_SPEED, LATE, FIRST, MEND = 6, 7, 8, 9, 10, 11
TRIM, HEARD = 12, 13
EACH = 14

# why it stopped
RUNNING, UNHELD, LOST, UNMATCHED, UNFOLLOWED, LOW, HIGH, NO_TARGET, MUTE = 0, 1, 2, 3, 4, 5, 6, 7, 8

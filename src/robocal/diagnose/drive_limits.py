"""The limits of drives: sweeps, orders, and what a table explains; `diagnose.limits` has the others, and lists all."""

from __future__ import annotations

import math

from robocal.fit.limits import limit, topic

# fmt: off

topic("Drives")
TABLE_EXPLAINS = limit(0.5, "of the variance",
    "A table that leaves more than it explains adds more to an effort than it takes from it, once it is a little wrong.")
READING_EXPLAINS = limit(0.7, "of the variance",
    "Orders of a wrong reading explain a few percent; another reading that explains this is no chance.", "tests/session/test_drive_logs.py")
SLOTS_NAME = limit(0.5, "of the variance", "Slots and poles that name less than half of what was found are not those of this motor.")
SAME_PACE = limit(1.5, "times the slowest", "Sweeps at one speed differ by less; the next speed that people try is twice as fast.")
LEAST_PACE = limit(math.radians(0.1), "rad/s", "A turn would take an hour; milliseconds that are read as seconds make such a pace.")
MOST_PACE = limit(math.radians(1000.0), "rad/s",
    "Three turns a second: no position loop follows cogging there; seconds that are read as milliseconds make such a pace.")
SWEEP_EFFORT = limit({"A least": 1e-3, "A most": 100.0, "N m least": 1e-6, "N m most": 100.0}, "A, N m",
    "Free motors, from those of watches to those rated at ten thousand N m, lie between; a thousandfold is often beyond.")
AT_LIMIT = limit(0.01, "of the rows", "Noise lets an effort touch its largest value once; a limit of the drive holds many rows there.")
QUICK_RIPPLE = limit(0.3, "rad/s (standard deviation)",
    "A led rotor slips by less; a rotor that runs through its cogging changes its speed by more.", "shared/data/cogging-motor")
PREFER_SIDE = limit(0.95, "chance", "Phases per direction double the numbers of a table: they are taken where arcs prefer them surely.")
CELLS_LOSE = limit(0.1, "of the variance", "Lines between so few cells leave a third of the cogging: a table of more costs only memory.")
OTHER_GAIN = limit(2 / 3, "of the curve",
    "A log of the same motor shows the curve whole, 0.9 to 1.3 times; a torque constant of 0.56 N m/A makes 1.8 of it.",
    "shared/data/cogging-motor")
FLAG_TURNS = limit(2, "turns", "A change within a turn makes one turn that is neither; two are none.")
SHIFT_BETTER = limit(0.9, "of the best share", "Motors are alike after a part of a turn: at other zeros tables fit nearly as well.")
SHIFT_LEAST = limit(math.radians(3.0), "rad", "So far directions lie apart by lag; more is another zero.", "seed document, 1.4.2")
LONE_ROWS = limit(12.0, "robust sigma", "Noise of no drive throws a row so far from its neighbours; a lost sample does.",
    "tests/session/test_drive_logs.py")
FLOOR_CHANCE = limit(1e-3, "chance", "White noise is called a floor once in a thousand orders; a real one is many times as high.")
OUTLIER_CHANCE = limit(0.05, "chance", "Among motors that are alike one call in twenty names one as unlike the others.")
OUTLIER_RATIO = limit(1.1 / 0.9, "times the others", "Data sheets allow torque constants 10 % each way: motors of one type differ by this.",
    "seed document, annex A")
WEIGHT_SEEN = limit(0.05, "of the variance", "A twentieth of the variance is a fifth of the amplitude: whose it is, is worth a question.")
WEIGHT_MOST = limit(0.5, "of the variance", "Cogging comes as often as slots and poles: what is mostly once per turn is something else.")
ELECTRICAL_LEAVES = limit(0.5, "of what is left",
    "Another angle that halves what a turn leaves is told by the log; noise lets no angle do so.")
NOISE_TIMES = limit(2.0, "times the noise's share", "Where noise is half of what is left, no other angle can halve it.")
WINDOW_LOSES = limit(0.01, "of the variance",
    "A table follows its own rows' noise and can only be nearer them than harmonics are: less is flattened.")

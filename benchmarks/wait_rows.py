"""What a user waits for, row by row: the commands, the data that they read, and what makes these.

RUN is a run folder of the state that is measured, OUT a new folder, ROUND the number of the round. What is asked of the rows stands in
`wait_asked.py`.
"""

from pathlib import Path

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parent / "examples"
CABLES = EXAMPLES / "cable-laval" / "robot.yaml"
TRACKER = EXAMPLES / "ur10-tracker"
# What the example of the UR10 calibrates is no part of the project: it lies beside it.
SERIES = HERE.parents[1] / "shared" / "data" / "ur10-laser-tracker" / "Series_C" / "measurements_random_poses.csv"

SEEN = "--free ax,ay,az,l0"  # without anything free of the robot there would be nothing to compare
PARTS = 5  # of a study of 10^4 trials, one a round

# What makes the folders of data, and a run folder beside the data.
MADE = {
    "few": "simulate irb-120 -n 80",
    "rows": "simulate irb-120 -n 10000",
    "many": "simulate irb-120 -n 100000",
    "seen": "simulate irb-120 -n 100000 --kind pose --noise 0.05",
    "seen-again": "simulate irb-120 -n 100000 --kind pose --noise 0.1",
    "cables-few": f"simulate {CABLES} -n 80",
    "cables-few-later": f"simulate {CABLES} -n 80 --seed 1",
    "cables": f"simulate {CABLES} -n 10000",
    "cables-later": f"simulate {CABLES} -n 10000 --seed 1",
}
# What `corner_data.py` makes of the same name.
CORNERS = ("cable", "cable-map", "arm-map", "cameras")
RUNS = {"few": "few/robot.yaml few/data.yaml"} | {
    name: f"{name}/robot.yaml {name}/lengths.yaml {name}/pose.yaml {SEEN}"
    for name in ("cables-few", "cables-few-later", "cables", "cables-later")
}
# Columns of a folder's table that a file of its own has.
CUT = {
    "few/program.csv": ("few/data.csv", ("configuration", "j")),
    "rows/program.csv": ("rows/data.csv", ("configuration", "j")),
    "seen/poses.csv": ("seen/data.csv", ("configuration", "x", "y", "z", "r")),
    "seen-again/poses.csv": ("seen-again/data.csv", ("configuration", "x", "y", "z", "r")),
}
# Files that are written as they stand here.
TEXTS = {
    f"study/part{k}.yaml": "robocal: 1\nkind: study\nof: identification\nrobot: irb-120\ntrials: 2000\n"
    f"seed: {k}\nposes: {{count: 56}}\nerrors: {{length: 0.3 mm, angle: 1 mrad}}\nnoise: {{position: 0.05 mm}}\n"
    for k in range(PARTS + 1)
}
GROUPS = "eccentricity,ripple,compliance,bending,expansion,gain"
WAITS = {
    "version": "--version",
    "identify -o, 80 poses": "identify few/robot.yaml few/data.yaml -o OUT",
    "identify -o, 10 000 rows": "identify rows/robot.yaml rows/data.yaml -o OUT",
    "identify -o, 100 000 rows": "identify many/robot.yaml many/data.yaml -o OUT",
    "identify --groups, example of the UR10": f"identify ur10/robot.yaml ur10/data.yaml --groups {GROUPS} -o OUT",
    "identify, 9 500 corners of four cameras": "identify irb-120 "
    + " ".join(f"cameras/camera{k}.yaml" for k in range(4)),
    "check, 1 000 corners of a cable robot": "check cable/robot.yaml cable/lengths.yaml cable/camera.yaml",
    "check, 100 000 rows": "check many/robot.yaml many/data.yaml",
    "verify -o, 100 000 poses": "verify seen/poses.csv seen-again/poses.csv -o OUT",
    "validate, 80 rows": "validate few/RUN few/data.yaml",
    "validate, 10 000 rows": "validate few/RUN rows/data.yaml",
    "compensate, 80 rows": "compensate few/RUN few/program.csv -o OUT",
    "compensate, 10 000 rows": "compensate few/RUN rows/program.csv -o OUT",
    "cable drift, two runs of 80 rows": "cable drift cables-few/RUN cables-few-later/RUN",
    "cable drift, two runs of 10 000 rows": "cable drift cables/RUN cables-later/RUN",
    "study, 2 000 identifications of an arm": "study study/partROUND.yaml --workers 1 -o OUT.csv",
    "check, 10 000 corners of a cable robot": "check cable-map/robot.yaml cable-map/lengths.yaml cable-map/camera.yaml",
    "identify, 10 000 corners, arm and map": "identify irb-120 arm-map/camera.yaml",
    "identify, 10 000 corners, cables and map": "identify cable-map/robot.yaml cable-map/lengths.yaml cable-map/camera.yaml",
}
# The same with an empty cache: what is compiled counts.
FIRST = {
    "first identify of an arm": "identify few/robot.yaml few/data.yaml -o OUT",
    "first cable poses": f"cable poses {CABLES} -n 100 -o OUT",
    "first identify of a cable robot": f"identify cables-few/robot.yaml cables-few/lengths.yaml cables-few/pose.yaml {SEEN} -o OUT",
}
# Of these only what goes into imports is counted.
IMPORTS = {"imports of identify -o, 80 poses": "identify few/robot.yaml few/data.yaml -o OUT"}
# Only this state: nothing asks what the other one takes, which is minutes.
ALONE = (
    "identify -o, 100 000 rows",
    "check, 10 000 corners of a cable robot",
    "identify, 10 000 corners, arm and map",
    "identify, 10 000 corners, cables and map",
)

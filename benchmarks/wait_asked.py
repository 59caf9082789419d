"""What is asked of the rows of "what a user waits for", and what was measured: one line for each bound.

A line names its rows, how a number is made of them, and the bound. A line whose rows were not measured says so, and is not met.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

Rows = Mapping[str, Mapping[str, float | None]]


@dataclass(frozen=True)
class Line:
    """A bound: what it is of, the greatest number that meets it, its unit, and how it is made of the rows."""

    what: str
    most: float
    unit: str
    of: Callable[[Rows], float]

    def measured(self, rows: Rows) -> float | None:
        """The number; None where a row is missing, or a state has no number in it."""
        try:
            return self.of(rows)
        except (KeyError, TypeError):
            return None


def ratio(row: str, key: str = "cpu_s", what: str = "", most: float = 1.0) -> Line:
    """This state over the other one."""
    kind = "by the clock, " if key == "wall_s" else ""
    return Line(
        f"{what or row}: {kind}new over old", most, "", lambda rows: rows[row][key] / rows[row][f"before_{key}"]
    )


def memory(row: str, most: float) -> Line:
    return Line(f"{row}: memory", most, "MB", lambda rows: rows[row]["peak_MB"])


def seconds(row: str, most: float) -> Line:
    return Line(f"{row}: CPU time", most, "s", lambda rows: rows[row]["cpu_s"])


def over(row: str, base: str, most: float) -> Line:
    """One row over another one of this state."""
    return Line(f"{row}, over: {base}", most, "", lambda rows: rows[row]["cpu_s"] / rows[base]["cpu_s"])


FEW, IMPORTED = "identify -o, 80 poses", "imports of identify -o, 80 poses"
TEN, HUNDRED = "identify -o, 10 000 rows", "identify -o, 100 000 rows"


def rest(rows: Rows) -> float:
    """What an identification takes beyond its imports, of this state over the other one."""
    new, old = (rows[FEW][key] - rows[IMPORTED][key] for key in ("cpu_s", "before_cpu_s"))
    return new / old


LINES = (
    ratio(IMPORTED, most=0.65),
    Line(f"{FEW}, beyond imports: new over old", 0.5, "", rest),
    ratio(FEW, what=f"{FEW}, together", most=0.6),
    ratio(TEN, most=0.5),
    memory(TEN, 250.0),
    over(HUNDRED, TEN, 8.0),
    ratio("identify --groups, example of the UR10", most=0.6),
    ratio("identify, 9 500 corners of four cameras", most=0.12),
    ratio("check, 1 000 corners of a cable robot", most=0.15),
    seconds("identify, 10 000 corners, arm and map", 10.0),
    seconds("identify, 10 000 corners, cables and map", 10.0),
    ratio("check, 100 000 rows", most=0.1),
    memory("check, 100 000 rows", 1500.0),
    memory("verify -o, 100 000 poses", 200.0),
    over("cable drift, two runs of 10 000 rows", "cable drift, two runs of 80 rows", 2.0),
    over("validate, 10 000 rows", "validate, 80 rows", 2.0),
    over("compensate, 10 000 rows", "compensate, 80 rows", 2.0),
    ratio("first identify of an arm", "wall_s", most=0.7),
    ratio("first cable poses", "wall_s", most=0.6),
    ratio("first identify of a cable robot", "wall_s", most=0.6),
    Line("56-pose job, over the best form of pyceres", 0.6, "", lambda rows: rows["56-pose job"]["over_pyceres"]),
    ratio("batch of 10 000 calibrations"),
    ratio("leave-one-out, 150 poses of eleven axes"),
    ratio("cross-validation of 56 poses, five folds"),
    ratio("cross-validation of 56 poses, identify --folds 5"),
    ratio("joint estimate, 100 views of 85 markers"),
    ratio("joint estimate, 1000 views of 108 markers"),
    over("forward kinematics, 500 poses in a batch", "forward kinematics, 500 poses one by one", 0.8),
    ratio("study, 2 000 identifications of an arm", what="study, 10 000 identifications of an arm in five parts", most=0.7),
    ratio("cable calibrations, 100 000"),
    Line("parity: commands that differ from the reference", 0.0, "", lambda rows: rows["parity"]["differ"]),
    Line("make test from nothing", 6.0, "min", lambda rows: rows["make test"]["minutes"]),
)  # fmt: skip


def judged(rows: list[dict]) -> list[dict]:
    """Asked and measured, line by line; where a row says why it has no number, so does the line."""
    by_name = {row["what"]: row for row in rows}
    out = []
    for line in LINES:
        found = line.measured(by_name)
        said = [row["said"] for name, row in by_name.items() if name in line.what and row.get("said")]
        met = "" if found is None else "met" if found <= line.most else "NOT met"
        asked = f"<= {line.most:g} {line.unit}".strip()
        out.append({"asked of": line.what, "asked": asked, "measured": found, "": met or (said or ["not measured"])[0]})
    return out

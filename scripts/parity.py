"""Does every verb still say the same? Reference values of commands over all verbs, and their comparison.

    python scripts/parity.py            compare with the reference; exit status 1 where anything differs
    python scripts/parity.py --write    make this the reference
    python scripts/parity.py --only identify    those whose words contain this

Compared are exit statuses, verdicts and codes exactly; numbers of --json documents, JSON, CSV and YAML files within 1e-9 relative, or
1e-6 of the sigma that stands beside them, rows of a covariance within 1e-6 of their norm. Sentences, times, versions and paths are
not. Documents are compared as schema 1 said them (`schema_1.py`). Long lists of numbers are kept as their length, norm and one
projection. What is meant to differ stands in INTENDED, with why.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import gzip
import io
import json
import math
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from schema_1 import schema_1

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"  # sums in one order, before numpy is there
HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
REFERENCE = HERE / "parity.json.gz"
RELATIVE, OF_SIGMA, TINY = 1e-9, 1e-6, 1e-12
LONG = 24  # numbers in a row; longer lists are condensed
# A pattern of COMMAND: PATH, and why it differs on purpose.
INTENDED: dict[str, str] = {
    r": \S*\bframes\[": "New: frames of instruments and targets in both directions.",
    r": \S*\brobot\.shape": "New: what a picture shows of the machine.",
    r": \S*\bfit\.(passes|filter)": "New: where a fit stood on its way.",
    r"^validate .*: \S*torque": "New: torques of joints.",
    r": \S*\bfit\.agreement": "New: what sensors say of each other.",
    r"camera/run/covariance\.json\.noise\[([0-6]|25)\]": "Rows that noise does not touch: rounding of 1e-17, as a sum is taken.",
    r": \S*residuals\.csv\.(|d)[xyz]_": "Positions and errors are told in base coordinates.",
    r"^compensate .*compensation\.html": "New: a page.",
    r"^(validate|verify) .*: \S*(poses\[|places|lists|between|means)": "New: where errors are, and of which list.",
    r": \S*pose_from_lengths": "New: the first figure of a cable robot, none for arms.",
    r"^identify pixels/": "How far a marker's scale may be off enters sigmas.",
    r"^identify perfect/": "Folds are the default where a held-out fifth is likely to lose a gain.",
    r"^validate run again/": "Both robots are judged alike: what is free of the tool is fitted to both.",
    r": \S*remarks\[\d+\]\.numbers\.left\.value$": "What is above the stated noise is told as the noise in use.",
    r"^identify arm/robot.yaml arm/data.yaml -o run.*(nominal_error|before)": "The baseline ends where another one leaves less, 1e-8 away.",
}
LEFT_OUT = re.compile(
    r"provenance|written|command$|sentence|advice|reasons|warnings|note$|\.text$|seconds|version|sha256|inputs|\bfiles\b|"
    r"reason$|how$|history|iterations|source|file$|left_out"
)
COVARIANCE = re.compile(r"covariance\.json\.(covariance|noise|response)|correlation\.matrix")
STATES = re.compile(r"(status|code|region|name|convention|method|kind)$")  # the words that are compared
COMMANDS = """
simulate irb-120 -n 60 --seed 1 -o arm
simulate irb-120 -n 60 --seed 2 -o again --json
simulate ur10 -n 50 --kind pose --seed 3 -o pose --json
simulate irb-120 -n 60 --kind spherical --seed 4 -o spherical --json
simulate irb-120 -n 80 --kind bearing --seed 5 -o bearing --json
simulate irb-120 -n 40 --kind pixels --seed 6 -o pixels --json
simulate panda -n 60 --kind distance --seed 7 -o distance --json
simulate rv-2aj -n 40 --length-error 0 --angle-error 0 --seed 8 -o perfect --json
check arm/robot.yaml arm/data.yaml --json
check ur10 --json
check pose/robot.yaml pose/data.yaml --json
identify arm/robot.yaml arm/data.yaml -o run --json
identify again/robot.yaml again/data.yaml -o run-again --json
identify pose/robot.yaml pose/data.yaml -o run-pose --json
identify spherical/robot.yaml spherical/data.yaml -o run-spherical --json
identify bearing/robot.yaml bearing/data.yaml --json
identify pixels/robot.yaml pixels/data.yaml --json
identify distance/robot.yaml distance/data.yaml --json
identify perfect/robot.yaml perfect/data.yaml --json
identify arm/robot.yaml arm/data.yaml again/data.yaml --json
identify arm/robot.yaml arm/data.yaml --loss huber --json
identify arm/robot.yaml arm/data.yaml --loss tukey --seed 3 --json
identify arm/robot.yaml arm/data.yaml --method pinv --json
identify arm/robot.yaml arm/data.yaml --method ekf --json
identify arm/robot.yaml arm/data.yaml --compare --json
identify arm/robot.yaml arm/data.yaml --folds 5 --json
identify arm/robot.yaml arm/data.yaml --hold-out blocks --json
identify arm/robot.yaml arm/data.yaml --bootstrap 100 --json
identify arm/robot.yaml arm/data.yaml --keep-all --prior length=1 --prior angle=0.1 --json
identify arm/robot.yaml arm/data.yaml --fix tool --free theta,d --json
identify arm/robot.yaml arm/data.yaml --groups eccentricity,ripple --json
identify EXAMPLES/rv-2aj/robot.yaml EXAMPLES/rv-2aj/data.yaml -o rv --json
identify EXAMPLES/rx-90/robot.yaml EXAMPLES/rx-90/data.yaml --json
identify EXAMPLES/instruments/sphere/robot.yaml EXAMPLES/instruments/sphere/data.yaml --json
identify EXAMPLES/instruments/plane/robot.yaml EXAMPLES/instruments/plane/data.yaml --json
identify EXAMPLES/instruments/range/robot.yaml EXAMPLES/instruments/range/data.yaml --json
validate run again/data.yaml --against arm/robot.yaml -o judged --json
validate run arm/data.yaml --json
predict run arm/q.csv --json
predict run arm/q.csv --absolute --json
drift run run-again --json
drift run run --json
compensate run arm/q.csv -o program --json
compensate run arm/q.csv --tool own --json
export run --format yaml -o out.yaml
export run --format urdf -o out.urdf
export run --format dh -o dh.yaml
export run --format csv -o out.csv
export run --format offsets -o offsets.csv
plan irb-120 -n 14 --draw 80 --json
plan arm/robot.yaml -n 10 --after arm/data.yaml --draw 60 --json
report run -o page.html
new ur10 -o cell --json
new cable -o rig --json
cable inverse EXAMPLES/cable-laval/robot.yaml p.csv --json
cable inverse EXAMPLES/cable-laval/robot.yaml p.csv --tension 60 --sag --json
cable forward EXAMPLES/cable-laval/robot.yaml l.csv --json
cable tension EXAMPLES/cable-planar/robot.yaml EXAMPLES/cable-planar/poses.csv -o planar --json
cable tension EXAMPLES/cable-laval/robot.yaml p.csv --method barycentre --json
cable workspace EXAMPLES/cable-planar/robot.yaml --cells 9 --rays 200 -o held --json
cable poses EXAMPLES/cable-laval/robot.yaml -n 30 --choose 8 -o list --json
demo camera --json
""".strip().splitlines()


def run(words: str) -> dict[str, Any]:
    """What one command leaves: its exit status, and every number and code, by path."""
    from robocal.cli.main import main

    before = {p: p.stat().st_mtime_ns for p in Path().rglob("*") if p.is_file()}
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        status = main(shlex.split(words.replace("EXAMPLES", str(EXAMPLES))))
    found: dict[str, Any] = {"status": status}
    if "--json" in words:
        found |= dict(flat("printed", schema_1(json.loads(out.getvalue()))))
    for place in sorted(p for p in Path().rglob("*") if p.is_file() and before.get(p) != p.stat().st_mtime_ns):
        found |= dict(flat(str(place), content(place)))
    return found


def content(place: Path) -> Any:
    """A file as plain values; nothing of one that holds text."""
    text = place.read_text(encoding="utf-8")
    if place.suffix == ".json":
        return schema_1(json.loads(text))
    if place.suffix == ".csv":
        rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
        return {h: [number(r[i]) for r in rows[1:] if i < len(r)] for i, h in enumerate(rows[0])} if rows else None
    if place.suffix in (".yaml", ".urdf"):
        return [float(m) for m in re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])", text)]
    return None


def number(cell: str) -> Any:
    """A cell as a number, where it is one."""
    try:
        return float(cell)
    except ValueError:
        return cell


def flat(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Numbers, states and codes by path; long lists condensed."""
    if LEFT_OUT.search(path):
        return
    if isinstance(value, dict):
        for key, part in value.items():
            yield from flat(f"{path}.{key}", part)
    elif isinstance(value, list) and len(value) > LONG and all(isinstance(v, int | float) for v in value):
        norm = math.sqrt(sum(v * v for v in value))
        yield path, [len(value), norm, sum(v * math.cos(1.0 + i) for i, v in enumerate(value))]
    elif isinstance(value, list):
        for i, part in enumerate(value):
            yield from flat(f"{path}[{i}]", part)
    elif isinstance(value, bool | int | float) or value is None or (isinstance(value, str) and STATES.search(path)):
        yield path, value


def differences(words: str, old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """What differs, one line each."""
    out = []
    for path in [*old, *(p for p in new if p not in old)]:
        a, b = old.get(path, "nothing"), new.get(path, "nothing")
        sigma = old.get(re.sub(r"\.(identified|delta|nominal)$", ".sigma", path))
        sigma = sigma if isinstance(sigma, int | float) and not path.endswith("sigma") else None
        relative = OF_SIGMA if COVARIANCE.search(path) else RELATIVE
        if not same(a, b, sigma, relative) and not any(re.search(p, f"{words}: {path}") for p in INTENDED):
            out.append(f"{path}: {a} -> {b}")
    return out


def same(a: Any, b: Any, sigma: float | None = None, relative: float = RELATIVE) -> bool:
    """Equal within rounding; of a condensed list, relative to its norm."""
    if isinstance(a, list) and isinstance(b, list):
        return a[0] == b[0] and all(abs(x - y) <= relative * max(a[1], TINY) for x, y in zip(a[1:], b[1:], strict=True))
    plain = (int, float)
    if isinstance(a, plain) and isinstance(b, plain) and not isinstance(a, bool) and not isinstance(b, bool):
        return abs(a - b) <= max(RELATIVE * max(abs(a), abs(b)), OF_SIGMA * (sigma or 0.0), TINY)
    return bool(a == b)


def prepare() -> None:
    """Lists of poses and lengths that commands read."""
    Path("arm").mkdir(exist_ok=True)
    head = ",".join(f"j{i} [deg]" for i in range(1, 7))
    Path("arm/q.csv").write_text(f"{head}\n10,20,30,0,5,6\n-40,10,-20,30,40,-10\n60,-20,15,80,-30,5\n")
    Path("p.csv").write_text("x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\n0,0,0.1,0,0,0\n0.1,-0.1,0,2,-3,4\n")
    from robocal.cli.main import main

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        assert main(["cable", "inverse", str(EXAMPLES / "cable-laval" / "robot.yaml"), "p.csv", "-o", "l.csv"]) == 0


def main_(arguments: list[str]) -> int:
    """Compares, or writes the reference."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--only", default="")
    given = parser.parse_args(arguments)
    known = {} if given.write else json.loads(gzip.decompress(REFERENCE.read_bytes()))
    made: dict[str, Any] = {}
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        prepare()
        for words in COMMANDS:
            made[words] = run(words)  # all of them: later ones read what earlier ones wrote
            if given.write:
                print(f"{made[words]['status']} {len(made[words]):6d} values  {words}")
            elif given.only in words:
                found = differences(words, known.get(words, {}), made[words])
                bad += bool(found)
                print(f"{'differs' if found else 'same   '}  {words}" + "".join(f"\n    {line}" for line in found[:8]))
        os.chdir(HERE)
    if given.write:
        text = json.dumps(made, separators=(",", ":")).encode()
        REFERENCE.write_bytes(gzip.compress(text, 9, mtime=0))
        print(f"{len(made)} commands, {sum(map(len, made.values()))} values, {REFERENCE.stat().st_size} bytes")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main_(sys.argv[1:]))

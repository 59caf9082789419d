"""`validate`: how wrong a robot model is on data that it was not fitted to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocal._record import record
from robocal.report import sections as blocks
from robocal.report.sections import OWN_FITTED, SPREAD, Block, Section, Text, ends, figure, quiet, spread, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.verbs.validate.result import Validation

__all__ = ["Options", "run", "sections"]

FIGURES = {
    "AP": ("pose accuracy", "from the commanded position to the barycentre"),
    "RP": ("pose repeatability", "mean distance to the barycentre plus three standard deviations"),
    "vAP": ("multi-directional variation", "largest distance between barycentres"),
    "AD": ("distance accuracy", "mean measured distance minus the commanded one"),
    "RD": ("distance repeatability", "three standard deviations"),
}

FILES = ("validation.json", "validation.html")
TOOL = ("tool.x", "tool.y", "tool.z")


@record
class Options(BaseOptions):
    """Measure the error of a robot model on data that it was not fitted to.

    With repeated visits, the result also has pose accuracy and repeatability, and distance accuracy, as defined in ISO 9283.

    The robot is not changed. Free frames of instruments are fitted again; the errors are then labelled "own frames fitted".

    \b
    robocal validate run other.yaml --against robot.yaml
    robocal validate robot.yaml other.yaml --offsets offsets.csv
    """

    robot: w.Robot
    data: w.Data
    against: str | None = option(None, "Compare with this robot, for example the nominal one", "ROBOT")
    offsets: str | None = option(None, "Validate these joint offsets (CSV, ROS, xacro) on the nominal robot", "FILE")
    distances: str = option(
        "consecutive", "Pairs of places: consecutive, all, group, or a column of the configurations", "PAIRS"
    )
    exclude: w.Exclude = ()
    output: Path | None = option(None, f"Write {FILES[0]} and {FILES[1]} here", "DIR", short="-o")
    force: w.Force = False
    seed: w.Seed = 0
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Validation]:
    """Validates a robot on data files; a folder gets validation.json and validation.html. Raises InputError."""
    from robocal.verbs.validate.result import validate_robot

    return run_verb(o, FILES, lambda: validate_robot(o, command, watch), sections)


def sections(made: Outcome[Validation]) -> Iterator[Section]:
    """The errors of a model, and of another one."""
    from robocal.report.validation import standing

    found: Validation = made.result
    head: list[Block] = [Text.of((found.robot.name, "strong"), f"   {len(found.poses)} measured positions")]
    if found.offsets is not None:
        head += quiet(f"judged: the nominal robot with the joint offsets of {found.offsets}")
    if found.reasons:
        advice = tuple(dict.fromkeys(r.advice for r in found.reasons if r.advice))
        head.append(blocks.VerdictBlock("not to be trusted", "bad", tuple(r.sentence for r in found.reasons), advice))
    yield Section.of("", *head)
    yield Section.of("", *_errors(found), title="Errors of single measurements", key="errors")
    if found.iso:
        more = blocks.Detail(lambda: standing(found.iso, found.against is not None))
        yield Section.of("", *_standard(found.iso), more, title=str(found.iso.get("standard")), key="standard")
    told = list(_frame_blocks(found))
    worst = sorted(found.poses.rows, key=lambda p: -p["error"])[:3]
    if len(found.poses) > 3:
        told += quiet("worst: " + ", ".join(f"{p['configuration']} {figure(p['error'], 3)} mm" for p in worst))
    if told:
        yield Section.of("", *told)
    yield from ends(made.remarks, key="warnings")
    yield from ends(written=made.written)


def _errors(found: Validation) -> Iterator[Block]:
    """A table of lengths and one of angles."""
    for part in (found.errors, found.angle):
        if part is None or part.this is None:
            continue
        both = {"this robot": part.this, "against": part.against}
        rows = [(label, *spread(s), OWN_FITTED if s.profiled else "") for label, s in both.items() if s is not None]
        if found.constant is not None and part is found.errors:
            rows.append(("predicting the mean", figure(found.constant), "", "", "", "", ""))
        yield table(f"error [{part.unit}]", *SPREAD, "", right=(1, 2, 3, 4, 5), rows=rows)


def _frame_blocks(found: Validation) -> Iterator[Block]:
    """What was fitted to these data, and by how much one robot is better."""
    if found.frames:
        fitted = f"{len(found.frames)} parameters of frames were fitted to these data"
        yield from quiet(f"{OWN_FITTED}: {fitted}; the errors are enlarged by what that took away")
    own = found.robot.machine.table
    if found.against is None and all(n in own.free and own[n].value == 0 and n not in found.frames for n in TOOL):
        # A file that says nothing of the tool: its whole length stands in the errors, and nothing else would say so.
        yield from quiet(
            f"{', '.join(TOOL)} of this robot are 0 and were not fitted: a target that sits elsewhere on the tool is part of these errors"
        )
    if tool := [n for n in dict.fromkeys((*found.frames, *found.frames_against)) if n.startswith("tool.")]:
        yield from quiet(f"{', '.join(tool)} were fitted to these data for both robots")
    if found.gain is not None and found.gain.low == found.gain.high == 0:
        yield Text.of("no difference between the two robots")
    elif found.gain is not None:
        gain = found.gain
        word, low, high = ("smaller", gain.low, gain.high) if gain.mean >= 0 else ("larger", -gain.high, -gain.low)
        span = f"{figure(low)} to {figure(high)} mm"
        yield Text.of(f"mean error {word} by {figure(abs(gain.mean))} mm, 95 % interval {span}")


def _standard(iso: Mapping[str, Any]) -> Iterator[Block]:
    """AP, RP, vAP, AD, RD: mean and largest over the places or pairs; what cannot be computed, and why."""
    compared = any("against" in (iso.get(part) or {}).get("summary", {}) for part in ("pose", "distance"))
    columns = ("ISO 9283", "mean", "max", *(("against: mean", "max") if compared else ()), "n", "")
    rows = []
    for found in filter(None, (iso.get("pose"), iso.get("distance"))):
        for name, s in found["summary"]["this"].items():
            other = found["summary"].get("against", {}).get(name, {})
            unit = found.get("angle_unit", "") if "_" in name else found["unit"]
            # Of repeatability there is only one: no model enters.
            there = (figure(other.get("mean")), figure(other.get("max"))) if name.startswith("A") else ("", "")
            what, how = FIGURES.get(name, ("", ""))
            note = what + (f", {found['pairs']}" if name == "AD" else "")
            cells = (figure(s["mean"]), figure(s["max"]), *(there if compared else ()), str(s["n"]))
            rows.append((blocks.Noted(f"{name} [{unit}]", how), *cells, (note, "quiet")))
    yield table(*columns, right=tuple(range(1, len(columns) - 1)), rows=rows)
    yield from quiet(*(f"{name}: not computable: {why}" for name, why in iso.get("not_computable", {}).items()))
    yield from quiet(*iso.get("notes", ()))

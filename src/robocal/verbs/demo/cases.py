"""The cases of the demo: arms that a stranger can watch being calibrated, two simulated and one really measured.

Every case is a function that yields what it finds, so that the story can be told while it happens, each with whether
it came out as it should.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from robocal._record import field, record
from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.errors import FileError, ModelError, nearest
from robocal.files.text import read_bytes
from robocal.files.writing import write_files
from robocal.geometry import fits
from robocal.measure.machine import Model
from robocal.session.identify_outcome import IdentifyOutcome
from robocal.session.simulated_robot import sample_joints
from robocal.session.watching import Watch
from robocal.verbs import identify, simulate

__all__ = ["CASES", "Case", "CaseStep", "cases", "demo", "example_folder"]

# Table 1 of the paper on the RV-2AJ, real minus nominal, rad and mm: how examples/rv-2aj was made.
TABLE_1 = {
    "j1.beta": 0.009, "j3.beta": -0.0001, "j4.beta": 0.004, "j1.alpha": 0.005, "j2.alpha": 0.0001, "j3.alpha": 0.0009,
    "j2.d": -0.1, "j3.d": -1.0, "j4.d": 0.1, "j1.r": 0.1, "j2.r": 1.0, "j3.r": -0.1, "j4.r": 0.1, "j5.r": 0.1,
}  # fmt: skip
FILES = ("robot.yaml", "data.yaml")
VERIFY = 3600  # configurations that nobody measured


@record
class CaseStep:
    """One step of a case: what was done in words, its outcome, the command that does it again, facts worth telling, and whether it is
    as expected."""

    title: str
    outcome: IdentifyOutcome
    repeat: str
    facts: tuple[str, ...]
    expected: str
    ok: bool


@record
class Case:
    """A case by name: its title, the story before it starts, where the numbers come from, and the function that does
    it."""

    name: str
    title: str
    story: str
    simulated: bool
    run: Callable[[Path, int, Watch | None], Iterator[CaseStep]] = field(repr=False)


def example_folder(name: str) -> Path:
    """The folder of one example. Raises FileError when this installation has none."""
    package = Path(__file__).resolve().parents[2]
    for root in (package / "_examples", package.parent.parent / "examples"):
        if (root / name).is_dir():
            return root / name
    expected = "a package with its examples, or a clone of the project"
    raise FileError("this installation has no such example", file=name, expected=expected)


def copy_example(name: str, folder: Path) -> None:
    """Copies the files of an example that a person would edit (YAML, CSV, Markdown) into a folder, all or none. Raises
    FileError."""
    chosen = [p for p in sorted(example_folder(name).iterdir()) if p.is_file() and p.suffix in (".yaml", ".csv", ".md")]
    write_files(folder, {p.name: read_bytes(p) for p in chosen})


def identify_example(
    folder: Path, seed: int, watch: Watch | None, *, run: str = "run", files: Sequence[str] = FILES, method: str = ""
) -> tuple[IdentifyOutcome, str]:
    """Identifies a robot of a folder as anybody would; what came of it, and the command that does the same."""
    robot, data = (str(folder / file) for file in files)
    estimator = method or identify.USUAL.method
    asked = identify.Options(robot, (data,), output=folder / run, force=True, method=estimator, seed=seed)
    command = f"robocal identify {robot} {data}" + (f" --method {method}" if method else "")
    return identify.run(asked, watch, command).result, command


def chain_of(model: Model) -> Chain:
    """The arm of a demo."""
    chain = model.part(Chain)
    assert chain is not None
    return chain


# --- RV-2AJ: 56 points in one plane, and what one plane cannot tell -----------------------------------------------------


def paper_and_default(folder: Path, seed: int, watch: Watch | None = None) -> Iterator[CaseStep]:
    """The paper's way without noise, then the default way with 0.02 mm of noise."""
    copy_example("rv-2aj", folder)
    files = ("robot-paper.yaml", "exact.yaml")
    yield _paper(*identify_example(folder, seed, watch, run="paper", files=files, method="pinv"))
    yield _default(*identify_example(folder, seed, watch))


def errors_elsewhere(outcome: IdentifyOutcome) -> Array:
    """Position errors of a corrected model anywhere within the joint limits, in mm, where table 1 is the truth."""
    nominal, corrected = chain_of(outcome.identification.nominal), chain_of(outcome.identification.corrected)
    moved = {n: v * (1e-3 if nominal.table[n].unit == "m" else 1.0) for n, v in TABLE_1.items()}
    truth = nominal.with_values({n: nominal.table[n].value + v for n, v in moved.items()})
    low, high = truth.limits.T
    q = np.random.default_rng(2).uniform(low, high, (VERIFY, len(low)))
    return np.asarray(np.linalg.norm(corrected.pose(q)[:, :3, 3] - truth.pose(q)[:, :3, 3], axis=1) * 1e3)


def _paper(outcome: IdentifyOutcome, command: str) -> CaseStep:
    before = [v for v in outcome.residuals["before_mm"] if v is not None]
    after = max(v for v in outcome.residuals["after_mm"] if v is not None)
    elsewhere = float(errors_elsewhere(outcome).max())
    found = outcome.identification
    d4 = (found.corrected.table["j4.d"].value - found.nominal.table["j4.d"].value) * 1e3
    facts = (
        f"error before {min(before):.2f} to {max(before):.2f} mm (the paper says 2 to 4), after {after:.0e} mm",
        f"on {VERIFY} other configurations anywhere within the limits: at most {elsewhere:.0e} mm",
        f"the paper's table comes back: j4.d moves by {d4:.4f} mm, printed as 0.1",
        "without noise machine precision alone decides what is seen; the next step adds a little",
    )
    errs_as_printed = 2.1 < min(before) < 2.12 and 4.18 < max(before) < 4.2
    good = errs_as_printed and after < 1e-11 and elsewhere < 1e-6 and abs(d4 - 0.1004) < 1e-4
    title = "the paper's way: 17 columns, iterated pseudo-inverse, no noise"
    return CaseStep(title, outcome, command, facts, "table 1 recovered", good)


def _default(outcome: IdentifyOutcome, command: str) -> CaseStep:
    seen, band = outcome.result.identifiability, outcome.identification.band
    true_error = float(errors_elsewhere(outcome).mean())
    predicted = math.nan if band is None else band.mean * 1e3
    facts = (
        f"of {seen.n_free} free parameters one plane shows {seen.rank} combinations; the others stay nominal, each with its reason",
        f"elsewhere within the limits it errs by {true_error:.2f} mm on average; {predicted:.2f} mm was predicted, the truth unknown",
    )
    claimed = {p.name for p in outcome.result.parameters if p.status == "identified"}
    good = outcome.improved and not claimed & {"j2.r", "j2.alpha", "j4.beta"} and seen.rank <= 16
    return CaseStep("the same points with 0.02 mm of noise, the default way", outcome, command, facts, "improved", good)


# --- ten real readings of a camera on the hand of a small arm: they support no calibration, and it is refused --------------


def refuse_camera(folder: Path, seed: int, watch: Watch | None = None) -> Iterator[CaseStep]:
    """Copies the example and identifies it as anybody would."""
    copy_example("arm-with-camera", folder)
    outcome, command = identify_example(folder, seed, watch)
    left = outcome.result.residuals
    facts: tuple[str, ...] = ()
    if left.after and left.leave_one_out and left.after.mean is not None and left.leave_one_out.mean is not None:
        facts = (
            f"the model bends to the ten poses until {left.after.mean:.0f} mm are left",
            f"a pose that it has not seen is missed by {left.leave_one_out.mean:.0f} mm, so nothing is claimed",
        )
    refused = outcome.result.verdict.status == "refused"
    yield CaseStep("ten poses, read by a camera on the hand", outcome, command, facts, "refused", refused)


# --- a six-axis arm with typical factory errors, measured with a laser tracker ------------------------------------------------


def track_factory_errors(folder: Path, seed: int, watch: Watch | None = None) -> Iterator[CaseStep]:
    """80 poses, 0.05 mm of noise, 0.3 mm and 1 mrad of geometric errors; nobody says where the tracker stands."""
    noise = simulate.Options("irb-120", folder, noise=0.05, length_error=0.3, angle_error=0.0573, seed=seed, force=True)
    made: simulate.Simulated = simulate.run(noise, watch).result
    outcome, command = identify_example(folder, seed, watch)
    before, held = outcome.result.residuals.held_out_before, outcome.result.residuals.held_out
    facts = []
    if before and held and before.mean and held.mean:
        fall = f"{before.mean:.2f} to {held.mean:.3f} mm"
        facts.append(f"on 16 poses that were not used for fitting the error falls from {fall}")
    corrected, truth = chain_of(outcome.identification.corrected), chain_of(made.truth)
    q = sample_joints(truth, 1000, np.random.default_rng(3))
    # Seen from the tracker, as everything is: a shift of the whole robot is nobody's error.
    gap = _distances_after_fit(corrected.pose(q)[:, :3, 3], truth.pose(q)[:, :3, 3])
    there = f"{gap.mean() * 1e3:.3f} mm from the truth (1000 configurations that nobody measured)"
    facts.append(f"all over the workspace the corrected model is {there}")
    facts.append("where the tracker stands was found from the data alone")
    yield CaseStep("80 poses, 0.05 mm of tracker noise", outcome, command, tuple(facts), "improved", outcome.improved)


def _distances_after_fit(a: Array, b: Array) -> Array:
    """Distances after the best rigid fit of a on b."""
    t = fits.rigid(a, b)
    return np.asarray(np.linalg.norm(a @ t[:3, :3].T + t[:3, 3] - b, axis=1))


# --- all cases --------------------------------------------------------------------------------------------------------


CASES = {
    case.name: case
    for case in (
        Case(
            "rv-2aj",
            "Mitsubishi RV-2AJ, five axes, as published",
            "The arm carries the errors of the paper's table 1; 56 points of one plane are measured.",
            True,
            paper_and_default,
        ),
        Case(
            "camera",
            "a small arm with a camera on its hand, really measured",
            "Ten readings from a thesis: real numbers, printed as they are, and too few.",
            False,
            refuse_camera,
        ),
        Case(
            "tracker",
            "ABB IRB 120, six axes, typical factory errors",
            "Every length is off by about 0.3 mm and every angle by about 1 mrad; a laser tracker reads 80 poses.",
            True,
            track_factory_errors,
        ),
    )
}


def cases(name: str | None = None) -> tuple[Case, ...]:
    """The case of this name, or all. Raises ModelError with the nearest name."""
    if name is None:
        return tuple(CASES.values())
    if name not in CASES:
        raise ModelError("unknown demo", found=name, expected=", ".join(CASES), suggestion=nearest(name, CASES))
    return (CASES[name],)


def demo(name: str | None, output: Path, seed: int, watch: Watch | None = None) -> Iterator[tuple[Case, CaseStep]]:
    """Runs cases one after the other, each into its own folder, and yields every finding."""
    for case in cases(name):
        for finding in case.run(output / case.name, seed, watch):
            yield case, finding

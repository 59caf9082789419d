"""`predict`: where the tool of an identified robot is at given joint values, and how far that may be off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from robocal.quantities import Listing
from robocal.report.sections import Section, Text, ends, figure, listed, quiet
from robocal.verbs import words as w
from robocal.verbs.option import Told, arg, opt
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.session.predict import Prediction

__all__ = ["Options", "run", "sections"]

MOST = 40
BLIND = 30.0  # deg: from here on nothing was known of a turn


@dataclass(frozen=True)
class Options(Told):
    """Predict the pose of the tool at given joint values, with 95 % bands.

    There are two bands: of the model's prediction, and of a new measurement there. The second adds the noise and the
    residual of the fit. Bands are those of the arm's shape; --absolute adds the uncertainty of the base's place.

    \b
    robocal predict run poses.csv
    robocal predict run poses.csv -o predicted.csv
    """

    folder: Path = arg(..., "RUN", "A run folder, as identify -o writes it.")
    poses: Path = arg(..., "POSES", "A CSV of joint values with units in its headers: q1 [deg], ...")
    absolute: bool = opt(False, "Include the uncertainty of the base's place")
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Prediction]:
    """Predicts the tool's pose at the joint values of a CSV; `output` gets the same as a CSV. Raises InputError."""
    from robocal.files.listing import listing_text
    from robocal.files.writing import refuse_existing, write_text
    from robocal.session.predict import predicted

    refuse_existing(o.output, (), o.force)
    found = predicted(o.folder, o.poses, o.absolute, watch)
    if o.output is not None:
        found = replace(found, written=(write_text(o.output, listing_text(found.poses)),))
    return Outcome(found, lambda: found.document, remarks=found.warnings, written=found.written)


def sections(made: Outcome[Prediction]) -> Iterator[Section]:
    """One line per pose: where, and how far that may be off."""
    found = made.result
    yield Section.of(
        "", Text.of((found.robot.name, "strong"), f"   {len(found.poses)} poses of the tool, in base coordinates")
    )
    shown = found.poses.only("configuration", *"xyz", "rx", "ry", "rz", "band", "band_new", "turn_band")
    turn = shown.columns[9]
    blind = replace(turn, values=["not seen" if v > BLIND else figure(v, turn.figures) for v in turn.plain])
    shown = Listing((*shown.columns[:9], blind))
    lines = [f"... and {len(found.poses) - MOST} more; -o FILE writes all"] if len(found.poses) > MOST else []
    shape = f"of the arm's shape: the base placed best over the {found.region}"
    words = "where the base stands included" if found.absolute else shape
    lines.append(f"± are 95 % radii: of the model [mm], of a new measurement [mm], of the model's turn [deg]; {words}")
    yield Section.of("", replace(listed(shown, most=MOST), right=tuple(range(1, 10))), *quiet(*lines))
    yield from ends(made.remarks)
    if made.written:
        yield Section.of("", Text.of(f"Written: {made.written[0]}"))

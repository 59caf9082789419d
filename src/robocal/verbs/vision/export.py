"""`vision export`: a map of markers or a lens in the format of another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record, replace
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, path_sections, run_verb

if TYPE_CHECKING:
    from robocal.session.vision.other_formats import ExportedText

__all__ = ["Options", "run", "sections"]

sections = path_sections


@record
class Options(BaseOptions):
    """Write a map of markers, or a lens, in the format of another program; or read one of theirs.

    Formats of maps: robocal, json, tagslam, markermapper (ArUco), ply. Formats of lenses: robocal, opencv, ros, kalibr.

    \b
    robocal vision export map.yaml -o map.ply
    robocal vision export map.yaml --form tagslam -o tagslam.yaml
    robocal vision export markermap.yml -o map.yaml
    robocal vision export lens.yaml --form ros -o camera_info.yaml

    A remark says what a format cannot hold.
    """

    file: Path = arg(..., "FILE", "A map or a lens in any of these formats.")
    form: str | None = option(None, "The format to write", "FORMAT", otherwise="by the suffix: .yaml, .json, .ply")
    camera: str | None = option(
        None, "Of a file with several cameras the one to read, and its name in the output", "NAME"
    )
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[ExportedText]:
    """The text of the format, on stdout or in a file; a map in robocal's own format has its covariance beside it. Raises InputError."""
    from robocal.session.vision.other_formats import export_text, files_of

    files = files_of(o)
    if o.output is None:
        return run_verb(o, (), lambda: export_text(o, command))
    return run_verb(replace(o, output=o.output.parent), files, lambda: export_text(o, command, files))

"""A study as a file describes it: what is simulated, how often, and what is varied; every point of its sweep as settings in SI."""

from __future__ import annotations

import copy
import itertools
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from robocal._record import record
from robocal._version import __version__
from robocal.errors import InputError, nearest
from robocal.estimate.criteria import CRITERIA
from robocal.estimate.losses import LOSSES
from robocal.files.cable.caspr import CABLES, bodies_of
from robocal.files.plain import json_text
from robocal.files.schema import FileModel, Version, validate
from robocal.files.text import read_text
from robocal.files.units import parse_quantity
from robocal.files.yamlio import YamlDocument, parse

__all__ = ["Point", "Study", "read_study"]

METHODS = ("lm", "gauss-newton", "ekf")
POINTS, TRIALS = 10_000, 10_000_000
MOST = 500  # poses that are planned
HELD_OUT = 0.5  # share of the configurations that `identify` holds out at most


class PosesModel(FileModel):
    """Poses of one calibration: a list, or so many at random about the middle, up to `shift` and `turn` in every component.

    Those of an arm lie within its joint limits, and may be chosen as `plan` does; `tests` lists where it has to be accurate.
    """

    file: str | None = None
    count: int | None = None
    shift: str | None = None
    turn: str | None = None
    choose: Literal["random", "planned"] = "random"
    criterion: str = "I"
    tests: str | None = None


class NoiseModel(FileModel):
    """Standard deviations, and whether the data file of an arm states them."""

    length: str | None = None
    position: str | None = None
    orientation: str | None = None
    stated: bool = True


class BiasModel(FileModel):
    """Constant errors: of every length, and of the position and the orientation (a small rotation in front) `along` a direction in base
    axes."""

    length: str | None = None
    position: str | None = None
    orientation: str | None = None
    along: list[float] = [1.0, 1.0, 1.0]  # noqa: RUF012


class ErrorsModel(FileModel):
    """How far true robots are from the nominal one: standard deviations of lengths and angles, of the joints or of the tool too."""

    length: str = "0.3 mm"
    angle: str = "1 mrad"
    tool: bool = False


class OptionsModel(FileModel):
    """Options of `identify`."""

    loss: str = "none"
    method: str = "lm"
    hold_out: float | None = None


class GrossModel(FileModel):
    """So large a share of the configurations has an error of this size in a random direction."""

    share: float = 0.0
    size: str = "5 mm"


class StudyModel(FileModel):
    """study.yaml."""

    robocal: Version
    kind: Literal["study"]
    of: Literal["cable-calibration", "identification"]
    robot: str
    trials: int
    seed: int = 0
    chunk: int | None = None
    poses: PosesModel
    noise: NoiseModel = NoiseModel.model_construct()
    bias: BiasModel = BiasModel.model_construct()
    residual: Literal["length", "squared"] = "length"
    errors: ErrorsModel = ErrorsModel.model_construct()
    options: OptionsModel = OptionsModel.model_construct()
    gross: GrossModel = GrossModel.model_construct()
    outputs: list[str] | None = None
    sweep: dict[str, list[Any]] = {}  # noqa: RUF012


@record
class Point:
    """One point of a sweep: what was varied, as it was written, and the settings in SI."""

    varied: tuple[tuple[str, str], ...]
    settings: tuple[tuple[str, Any], ...]

    def __getitem__(self, name: str) -> Any:
        return dict(self.settings)[name]

    @property
    def files(self) -> tuple[str, ...]:
        """The robot, with the bodies of one of CASPR's, and lists of poses, by name."""
        robot = Path(self["robot"])
        more = (str(bodies_of(robot)),) if robot.name.endswith(CABLES) else ()
        return (self["robot"], *more, *(self[key] for key in ("poses.file", "poses.tests") if self[key] is not None))


@record
class Study:
    """A study: what of, its points, trials of each, in chunks, and the seed of all of them; `read` are the files that it reads, with
    their SHA-256, and `text` is all that decides its numbers."""

    path: Path
    of: str
    points: tuple[Point, ...]
    trials: int
    chunk: int
    seed: int
    text: str
    sha256: str
    read: tuple[tuple[str, str], ...]


# What one kind of study does not know: nothing that is written is passed over.
FOREIGN = {
    "cable-calibration": ("errors", "options", "gross", "noise.stated", "poses.criterion"),
    "identification": ("residual", "bias", "noise.length", "poses.shift", "poses.turn"),
}
# What a trial says, and what it says where the file names it under `outputs`.
OUTPUTS = {
    "cable-calibration": (("anchors", "zeros"), ()),
    "identification": (("improved", "before", "after"), ("elsewhere", "coverage")),
}
CONSTANT = ("sweep", "outputs", "seed", "trials", "chunk", "robocal", "kind", "of")  # keys that no sweep varies
CHUNKS = {"cable-calibration": 500, "identification": 20}
# key of a setting -> SI unit
QUANTITIES = {
    "poses.shift": "m", "poses.turn": "rad", "noise.length": "m", "noise.position": "m", "noise.orientation": "rad",
    "bias.length": "m", "bias.position": "m", "bias.orientation": "rad", "errors.length": "m", "errors.angle": "rad", "gross.size": "m",
}  # fmt: skip


def read_study(path: str | os.PathLike[str]) -> Study:
    """Reads study.yaml. Raises FileError or FormatError naming the key of whatever is wrong, in the file or at a point of its sweep."""
    source = read_text(path)
    document = parse(source)
    plain = validate(StudyModel, document)
    names, values = list(plain.sweep), list(plain.sweep.values())
    for name, some in zip(names, values, strict=True):
        at, words = ("sweep", name), [_words(v) for v in some]
        document.insist(some, "nothing to vary", at, found=some, expected="a list of values")
        once = len(set(words)) == len(words)
        document.insist(once, "a value is given twice", at, found=", ".join(words), expected="each once")
    many = math.prod(map(len, values))
    for word, found, most in (("sweep", many, POINTS), ("trials", plain.trials, TRIALS)):
        document.insist(1 <= found <= most, "too many or none", (word,), found=found, expected=f"1 to {most}")
    usable = plain.chunk is None or plain.chunk >= 1
    document.insist(usable, "not a number of trials", ("chunk",), found=plain.chunk, expected="1 or more")
    points = []
    # What is within comes after what holds it, in whichever order they are written.
    inward = sorted(range(len(names)), key=lambda i: names[i].count("."))
    for chosen in itertools.product(*values):
        raw = copy.deepcopy(dict(document.data))
        raw.pop("sweep", None)
        for i in inward:
            _apart(names, dict(zip(names, chosen, strict=True)), names[i], document)
            _put(raw, names[i], chosen[i], document)
        points.append(Point(tuple(zip(names, map(_words, chosen), strict=True)), _settings(raw, document, source.path)))
    document.insist(plain.seed >= 0, "a seed must not be negative", ("seed",), found=plain.seed, expected="0 or more")
    chunk = plain.chunk or CHUNKS[plain.of]
    # What decides the numbers: the robots and lists as they are now, not only what they are called.
    named = [name for p in points for name in p.files]
    read = {r: read_text(r).sha256 for r in dict.fromkeys(named) if os.path.isfile(r)}
    told = {
        "version": __version__, "of": plain.of, "trials": plain.trials, "seed": plain.seed, "chunk": chunk,
        "robots": [read.get(r, r) for r in dict.fromkeys(named)],
    }  # fmt: skip
    text = json_text({**told, "points": [{k: v for k, v in p.settings if k != "robot"} for p in points]})
    decided = (plain.of, tuple(points), plain.trials, chunk, plain.seed, text)
    return Study(source.path, *decided, source.sha256, tuple(read.items()))


def _words(value: Any) -> str:
    """A value of a sweep as it is shown."""
    return ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else str(value)


def _apart(names: list[str], chosen: dict[str, Any], name: str, document: YamlDocument) -> None:
    """Raises FormatError where a value of the sweep already says what another key of it varies."""
    *way, last = name.split(".")
    for i in range(1, len(way) + 1):
        value = chosen.get(".".join(way[:i]))
        for key in (*way[i:], last):
            value = value.get(key) if isinstance(value, dict) else None
        found = ".".join(way[:i])
        document.insist(value is None, "a value is given twice", ("sweep", name), found=found, expected="each once")


def _put(raw: dict[str, Any], name: str, value: Any, document: YamlDocument) -> None:
    """Sets the value at a key path such as `poses.count`."""
    at, place = raw, ("sweep", name)
    *way, last = name.split(".")
    expected = "robot, poses.count, noise.length, residual, ..."
    document.insist(name not in CONSTANT, "this key cannot be varied", place, expected=expected)
    for key in way:
        at = at.setdefault(key, {})
        known = isinstance(at, dict)
        document.insist(known, "no such key to vary", place, found=name, expected="a key of this file")
    at[last] = copy.deepcopy(value)  # another key of the sweep may vary what is within


def _settings(raw: dict[str, Any], document: YamlDocument, path: Path) -> tuple[tuple[str, Any], ...]:
    model = validate(StudyModel, document, raw)
    for key in FOREIGN[model.of]:
        part, _, name = key.partition(".")
        if part in raw and (not name or name in (raw[part] or {})):
            expected = f"what `of: {model.of}` knows"
            document.fail("not a key of this kind of study", tuple(key.split(".")), found=key, expected=expected)
    beside = path.parent / model.robot
    out: dict[str, Any] = {"robot": str(beside) if os.path.isfile(beside) else model.robot, "residual": model.residual}
    for part in ("poses", "noise", "bias", "errors", "options", "gross"):
        for name, value in vars(getattr(model, part)).items():
            key = f"{part}.{name}"
            if key in QUANTITIES and value is not None:
                try:
                    value = parse_quantity(str(value), QUANTITIES[key], key=key)
                except InputError as error:
                    document.fail(error.message, (part, name), found=error.found, expected=error.expected)
            out[key] = value
    _check(out, model.of, document)
    for key in ("poses.file", "poses.tests"):
        if out[key] is not None:
            out[key] = str(path.parent / out[key])
    out["outputs"] = _outputs(model, document)
    along = out["bias.along"]
    out["bias.along"] = tuple(v / math.hypot(*along) for v in along)
    if model.of == "cable-calibration":
        for key in (f"{of}.{what}" for of in ("noise", "bias") for what in ("length", "position", "orientation")):
            out[key] = out[key] or 0.0
    return tuple(out.items())


def _check(out: Mapping[str, Any], of: str, document: YamlDocument) -> None:
    """Raises FormatError for settings of which no study can be made."""

    def insist(good: object, message: str, key: str, expected: str) -> None:
        document.insist(good, message, tuple(key.split(".")), found=out.get(key), expected=expected)

    file, count, arm = out["poses.file"], out["poses.count"], of == "identification"
    one = (file is None) != (count is None)
    insist(one, "poses are a list, or a number of random poses", "poses", "file, or count")
    insist(count is None or 1 <= count <= 1_000_000, "no such number of poses", "poses.count", "1 or more")
    for key, usual in (("poses.choose", "random"), ("poses.tests", None)):
        insist(arm or out[key] == usual, "only poses of arms are planned", key, "of: identification")
    document.insist_known(out["poses.criterion"], CRITERIA, "unknown criterion", ("poses", "criterion"))
    if out["poses.choose"] == "planned" and (count is None or count > MOST):
        at, found = ("poses", "count"), file if count is None else count
        document.fail("no such number of planned poses", at, found=found, expected=f"count, 1 to {MOST}")
    along, share, held_out = out["bias.along"], out["gross.share"], out["options.hold_out"]
    good = len(along) == 3 and 0 < math.hypot(*along) < math.inf
    insist(good, "not a direction", "bias.along", "three numbers, such as [0, 0, 1]")
    insist(0 <= share <= 1, "a share", "gross.share", "0 to 1")
    if not arm and count is not None:
        ranged = None not in (out["poses.shift"], out["poses.turn"])
        insist(ranged, "random poses need their range", "poses", "shift: 0.7 m, turn: 15 deg")
    for name, known in (("method", METHODS), ("loss", LOSSES)):
        document.insist_known(out[f"options.{name}"], known, f"no such {name} in a study", ("options", name))
    insist(held_out is None or 0 <= held_out <= HELD_OUT, "a share", "options.hold_out", f"0 to {HELD_OUT}")


def _outputs(model: StudyModel, document: YamlDocument) -> tuple[str, ...]:
    """Raises FormatError for outputs that no trial has."""
    usual, more = OUTPUTS[model.of]
    chosen, known = usual if model.outputs is None else tuple(model.outputs), (*usual, *more)
    wrong = next((name for name in chosen if name not in known), None)
    if wrong is not None or not chosen or len(set(chosen)) < len(chosen):
        facts = {"found": wrong or list(chosen), "expected": f"some of {', '.join(known)}"}
        suggestion = nearest(wrong, known) if wrong else None
        document.fail("no such outputs", ("outputs",), **facts, suggestion=suggestion)
    return chosen

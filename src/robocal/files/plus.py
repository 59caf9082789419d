"""Results of PLUS (plustoolkit.org), calibration of an ultrasound probe, as data of robocal.

The result file of fCal has the segmented points of every frame with the poses of probe and reference in the tracker; its configuration has
the wires of the phantom and where the phantom is on the reference. Lengths are mm, poses T_tracker_probe and T_tracker_reference.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import FormatError
from robocal.files.csvtext import csv_text
from robocal.files.text import FILE_LIMIT, InputFile, read_text
from robocal.files.units import number
from robocal.files.urdftree import Node, walk
from robocal.files.yamlio import quote
from robocal.geometry import se3

__all__ = ["ProbeFiles", "read_plus"]

PARTS = {"CalibrationData": "calibration", "ValidationData": "validation"}
RIGHT = 1e-2  # tolerance: matrices are written with six digits
GOOD = "OK"
HEADER = ("frame", "wire", "u", "v", "x", "y", "z", "rx", "ry", "rz")
PHANTOM = (0.3, 0.2)  # mm, deg: how well a tracked stylus finds a phantom where the file does not say
FEWEST = 3  # landmarks that place a phantom


@record
class ProbeFrame:
    """One image: its name, the points of wires by name (k, 2) in px, and T_reference_probe (4, 4) in mm."""

    name: str
    points: dict[str, tuple[float, float]]
    pose: Array


@record
class ProbeFiles:
    """A rig and data files as texts by name, `images` and `left_out` by part, and the files that were read."""

    texts: dict[str, str]
    images: dict[str, int]
    left_out: dict[str, int]
    points: int
    wires: tuple[str, ...]
    pixel: tuple[float, float]
    files: tuple[InputFile, ...]


def read_plus(results: str | os.PathLike[str], configuration: str | os.PathLike[str]) -> ProbeFiles:
    """What robocal reads of the result and the configuration of fCal. Raises FileError or FormatError."""
    top, about = (
        _open(name, tag) for name, tag in ((results, "ProbeCalibrationResult"), (configuration, "PlusConfiguration"))
    )
    wires = dict(_wires(about[0]))
    if not wires:
        raise FormatError(
            "the configuration has no wires", file=about[1].file, expected="<Wire Name, EndPointFront, EndPointBack>"
        )
    placed = _transform(about[0], "Phantom", "Reference")
    phantom, known = _rigid(placed, "Matrix"), _phantom_prior(placed, about[0])
    seen = _transform(top[0], "Image", "Probe")
    image = _matrix(seen, "Matrix")
    if np.linalg.det(image[:3, :3]) <= 0:
        seen.fail(
            "the image plane is left-handed",
            key="Transform From=Image",
            found="a reflection",
            expected="u, v and the third column right-handed",
        )
    pixel = tuple(float(v) for v in np.linalg.norm(image[:3, :2], axis=0))
    texts, images, left, points = {"robot.yaml": _rig(about[1].file)}, {}, {}, 0
    for tag, part in PARTS.items():
        every = [f for node in _all(top[0], tag) for f in _all(node, "Frame")]
        frames = [f for node in every if (f := _frame(node, part[0], wires)) is not None]
        if not frames:
            continue
        images[part], left[part] = len(frames), len(every) - len(frames)
        points += sum(len(f.points) for f in frames)
        texts[f"{part}.csv"] = csv_text(HEADER, _rows(frames))
        texts[f"{part}.yaml"] = _data(part, wires, phantom, known, pixel, Path(results).name)
    if not images:
        raise FormatError(
            "no image with segmented points and tracked poses",
            file=top[1].file,
            expected="<CalibrationData> with <Frame>",
        )
    return ProbeFiles(texts, images, left, points, tuple(wires), (pixel[0], pixel[1]), (top[1], about[1]))


def _open(name: str | os.PathLike[str], tag: str) -> tuple[Node, InputFile]:
    source = read_text(name, limit=FILE_LIMIT)
    if not source.text.lstrip("\ufeff \t\r\n").startswith("<"):
        raise FormatError("this is not XML, but files of PLUS are", file=source.path, expected=f"<{tag}>")
    node = Node.parse(source.text, source.path)
    if node.tag != tag:
        other = (
            "the result comes first, then the configuration"
            if node.tag in ("PlusConfiguration", "ProbeCalibrationResult")
            else f"<{tag}>"
        )
        raise FormatError(
            "another file of PLUS, or none", file=source.path, row=node.row, found=f"<{node.tag}>", expected=other
        )
    return node, InputFile(source.path, source.sha256)


def _all(node: Node, tag: str) -> list[Node]:
    return [n for n in walk(node) if n.tag == tag]


def _numbers(node: Node, name: str, count: int) -> Array:
    """The numbers of an attribute. Raises FormatError."""
    text = node.attributes.get(name, "")
    try:
        out = np.array([float(w) for w in text.split()])
    except ValueError:
        out = np.zeros(0)
    if len(out) != count or not np.isfinite(out).all():
        node.fail("not numbers", key=f"{node.tag} {name}", found=text[:60], expected=f"{count} finite numbers")
    return out


def _matrix(node: Node, name: str) -> Array:
    return _numbers(node, name, 16).reshape(4, 4)


def _transform(top: Node, start: str, end: str) -> Node:
    for node in _all(top, "Transform"):
        if (node.attributes.get("From"), node.attributes.get("To")) == (start, end):
            return node
    top.fail("a transform is missing", key=f"Transform From={start} To={end}", expected="one with a Matrix")


def _phantom_prior(placed: Node, top: Node) -> tuple[float, float]:
    """How well a stylus found the phantom, mm and deg: the error of n landmarks / sqrt(n), at their distance from their middle."""
    marks = np.array([_numbers(n, "Position", 3) for n in _all(top, "Landmark")])
    if "Error" not in placed.attributes or len(marks) < FEWEST:
        return PHANTOM
    (error,) = _numbers(placed, "Error", 1)
    spread = float(np.sqrt(((marks - marks.mean(axis=0)) ** 2).sum(axis=1).mean()))
    if error <= 0 or spread <= 0:
        return PHANTOM
    length = float(error) / len(marks) ** 0.5
    return round(length, 3), round(float(np.degrees(length / spread)), 3)


def _rigid(node: Node, name: str) -> Array:
    """A pose. Raises FormatError for a matrix that is none."""
    t = _matrix(node, name)
    r = t[:3, :3]
    if np.abs(r @ r.T - np.eye(3)).max() > RIGHT or np.linalg.det(r) < 0:
        node.fail(
            "not a pose",
            key=node.attributes.get("Name", f"{node.tag} {name}"),
            found=node.attributes[name][:60],
            expected="a rotation and a translation",
        )
    return t


def _wires(top: Node) -> Iterator[tuple[str, tuple[Array, Array]]]:
    seen: set[str] = set()
    for node in _all(top, "Wire"):
        name = _plain(node.attributes.get("Name", ""))
        if not name or name in seen:
            node.fail("a wire has no name, or that of another", found=name, expected="a name of its own")
        seen.add(name)
        yield name, (_numbers(node, "EndPointFront", 3), _numbers(node, "EndPointBack", 3))


def _plain(name: str) -> str:
    """The name of a wire without what a data.yaml cannot have in one."""
    return "".join("_" if c in ".,;:\"'" else c for c in name.strip())


def _frame(node: Node, prefix: str, wires: dict[str, tuple[Array, Array]]) -> ProbeFrame | None:
    """An image; None for one without points or without a tracked pose."""
    own = next((c for c in node.children if c.tag == "SegmentedPoints"), None)
    fields = {f.attributes.get("Name"): f for f in _all(node, "CustomFrameField")}
    needed = ("ProbeToTrackerTransform", "ReferenceToTrackerTransform")
    if node.attributes.get("SegmentationStatus") != GOOD or own is None or any(n not in fields for n in needed):
        return None
    if any(n in fields and fields[n].attributes.get("Value") != GOOD for n in (f"{m}Status" for m in needed)):
        return None
    points = {}
    for point in _all(own, "Point"):
        name = _plain(point.attributes.get("WireName", ""))
        if name not in wires:
            point.fail(
                "no wire of the configuration has this name",
                key="Point WireName",
                found=name,
                expected=", ".join(wires),
            )
        u, v, _ = _numbers(point, "Position", 3)
        points[name] = (float(u), float(v))
    probe, reference = (_rigid(fields[n], "Value") for n in needed)
    return ProbeFrame(f"{prefix}{node.attributes.get('Index', node.row)}", points, np.linalg.inv(reference) @ probe)


def _rows(frames: Sequence[ProbeFrame]) -> Iterator[Sequence[object]]:
    for frame in frames:
        vector = se3.to_vector(frame.pose[None])[0]
        pose = [number(round(float(v), 5)) for v in (*vector[:3], *np.degrees(vector[3:]))]
        for name, (u, v) in frame.points.items():
            yield frame.name, name, number(u), number(v), *pose


def _rig(file: object) -> str:
    source = quote(f"{Path(str(file)).name} of PLUS")
    head = "robocal: 1\nkind: rig\nname: ultrasound probe\nposes: known    # a tracker states them\n"
    return f"{head}units: {{length: mm, angle: deg}}\nsource: {source}\n"


def _data(
    part: str,
    wires: dict[str, tuple[Array, Array]],
    phantom: Array,
    known: Sequence[float],
    pixel: Sequence[float],
    name: str,
) -> str:
    def triple(values: Array) -> str:
        return f"[{', '.join(number(round(float(v), 6)) for v in values)}]"

    vector = se3.to_vector(phantom[None])[0]
    phantom_keys = f"mount: base, xyz: {triple(vector[:3])}, rotation_vector: {triple(np.degrees(vector[3:]))}, "
    phantom_keys += f"prior: {{length: {number(known[0])}, angle: {number(known[1])}}}"
    each = "\n".join(f"  {quote(n)}: {{front: {triple(a)}, back: {triple(b)}}}" for n, (a, b) in wires.items())
    return f"""robocal: 1
kind: plane_points
file: {part}.csv
units: {{length: mm, angle: deg}}
position: {{columns: [x, y, z], unit: mm}}    # the probe on the reference of the phantom, by the tracker
orientation: {{columns: [rx, ry, rz], form: rotation_vector, unit: deg}}
image: {{columns: [u, v], pixel: [{number(round(pixel[0], 6))}, {number(round(pixel[1], 6))}]}}    # mm; both are found
# distance: {{sigma: 0.2}}    # how far a point is from its wire in each direction; else it is estimated
wire: wire
wires:
{each}
frame: {{name: image, mount: tool}}    # T_probe_image is found
targets:
  # how well a stylus found the phantom: the error of the landmarks by the root of their number
  phantom: {{{phantom_keys}}}
configuration: {{id: frame}}
source: {quote(f"{name} of PLUS")}
"""

"""Maps of TagSLAM: bodies with tags and boards; an output of TagSLAM has the same form as its input.

A tag has x to the right, y up and z out of its printed side, as here; rotations are rotation vectors in rad, lengths m. A tag is placed on
its body, a body in the world. Tags of a board count from its bottom left along x, then up along y, (1 + tag_spacing) tag_size apart.
Noise is a standard deviation about the axes of the tag, or of the body: p <- p + R v, R <- R exp(w). A body without a pose is a map of
its own, and so is a tag without one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.units import number
from robocal.files.yamlio import Path_, YamlDocument
from robocal.geometry import se3
from robocal.quantities import LARGEST
from robocal.vision.map_gauge import project_covariance, rigid_motions
from robocal.vision.maps import MarkerMap

__all__ = ["marker_numbers", "read_tagslam", "tagslam_text", "whole"]

BITS = {4: "16h5", 5: "25h9", 6: "36h11"}  # TagSLAM's bits of a code along a side
MOST_TAGS = 10_000  # of a board


@record(eq=False)
class _Placed:
    """A pose T (4, 4), its covariance (6, 6) of (v, w) in the axes of what is placed (None where nothing is stated), and the body that
    carries it, whose noise all its tags share."""

    pose: Array
    covariance: Array | None
    body: _Placed | None = None


@record(eq=False)
class _Tag:
    """A tag: number, edge in m, bits, its place on the body or None."""

    id: int
    size: float
    bits: int
    place: _Placed | None


def read_tagslam(document: YamlDocument) -> tuple[MarkerMap, ...]:
    """Tags that have a place in the world as one map, and a map for each body that has none."""
    bodies = document.data["bodies"]
    document.insist(isinstance(bodies, list) and bodies, "not a list of bodies", ("bodies",), found=bodies)
    at_home: list[tuple[_Tag, _Placed]] = []
    parts: list[tuple[str, list[tuple[_Tag, _Placed]]]] = []
    known: dict[int, str] = {}
    for i, entry in enumerate(bodies):
        one = isinstance(entry, dict) and len(entry) == 1 and isinstance(next(iter(entry.values())), dict)
        document.insist(one, "not a body", ("bodies", i), found=entry, expected="- name: {type, tags or board, ...}")
        ((name, body),) = entry.items()
        at: Path_ = ("bodies", i, name)
        place = _place(document, body.get("pose"), (*at, "pose"))
        tags = _tags(document, body, at)
        for tag in tags:
            other = known.setdefault(tag.id, name)
            document.insist(other == name, "a tag is on two bodies", at, found=f"{tag.id} on {other} and {name}")
        if len({t.id for t in tags}) < len(tags):
            twice = next(t.id for t in tags if sum(o.id == t.id for o in tags) > 1)
            document.fail("a tag is twice on a body", at, found=twice)
        loose = [t for t in tags if t.place is None]
        rest = [(t, t.place) for t in tags if t.place is not None]
        if place is None:
            parts += [(name, rest)] if rest else []
        else:
            at_home += [(t, replace(p, pose=place.pose @ p.pose, body=place)) for t, p in rest]
        parts += [(name, [(t, _Placed(np.eye(4), None))]) for t in loose]
    groups = [("", at_home), *parts] if at_home else parts
    document.insist(groups, "no body has tags", ("bodies",), expected="tags, or a board")
    bits = {t.bits for _, group in groups for t, _ in group}
    document.insist(len(bits) == 1, "tags of several dictionaries", ("bodies",), found=sorted(bits), expected="one")
    family = BITS.get(bits.pop())
    source = document.path.name
    return tuple(_map_of(g, family, f"{source}, {name}" if name else source) for name, g in groups)


def _tags(document: YamlDocument, body: Mapping[str, Any], at: Path_) -> list[_Tag]:
    """The tags of a body: listed, or of its board."""
    out: list[_Tag] = []
    if body.get("type") == "board" and "board" in body:
        out += _board(document, body["board"], (*at, "board"))
    listed = body.get("tags")
    if listed is None:
        return out
    document.insist(isinstance(listed, list), "not a list of tags", (*at, "tags"), found=listed)
    stated = [] if not out else [t.id for t in out]
    for i, tag in enumerate(listed):
        where: Path_ = (*at, "tags", i)
        document.insist(isinstance(tag, dict), "not a tag", where, found=tag, expected="id, size, pose")
        id_ = whole(document, tag, "id", where)
        if id_ in stated:
            continue  # an output of TagSLAM lists the tags of its boards once more, as they were found
        size = _size(document, tag.get("size", body.get("default_tag_size")), id_, (*where, "size"))
        place = _place(document, tag.get("pose"), (*where, "pose"))
        out.append(_Tag(id_, size, whole(document, tag, "bits", where, 6), place))
    return out


def whole(document: YamlDocument, part: Mapping[str, Any], key: str, at: Path_, default: int | None = None) -> int:
    value = part.get(key, default)
    good = isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 20
    document.insist(good, "a key is missing" if value is None else "not a whole number", (*at, key), found=value)
    assert isinstance(value, int)
    return value


def _size(document: YamlDocument, value: object, id_: int, at: Path_) -> float:
    good = isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < LARGEST
    document.insist(good, f"tag {id_}: not a size", at, found=value, expected="the edge of the black square, in m")
    assert isinstance(value, int | float)
    return float(value)


def _board(document: YamlDocument, board: object, at: Path_) -> list[_Tag]:
    if not isinstance(board, dict):
        document.fail(
            "not a board", at, found=board, expected="tag_start_id, tag_size, tag_spacing, tag_rows, tag_columns"
        )
    first, rows, columns = (whole(document, board, k, at) for k in ("tag_start_id", "tag_rows", "tag_columns"))
    few = 0 < rows * columns <= MOST_TAGS
    document.insist(
        few, "not the rows and columns of a board", at, found=f"{rows} x {columns}", expected=f"1 to {MOST_TAGS} tags"
    )
    size = _size(document, board.get("tag_size"), first, (*at, "tag_size"))
    spacing = board.get("tag_spacing")
    good = isinstance(spacing, int | float) and not isinstance(spacing, bool) and 0 <= spacing < 100
    document.insist(
        good, "not a spacing", (*at, "tag_spacing"), found=spacing, expected="the gap over the size of a tag"
    )
    assert isinstance(spacing, int | float)
    noise = [board.get(f"tag_{w}_noise", 0.0) for w in ("position", "rotation")]
    for key, value in zip(("tag_position_noise", "tag_rotation_noise"), noise, strict=True):
        good = isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < LARGEST
        document.insist(good, "not a standard deviation", (*at, key), found=value, expected="a number from 0 on")
    origin = _place(document, board.get("pose"), (*at, "pose"))
    back = np.eye(4) if origin is None else se3.inverse(origin.pose)
    covariance = np.diag(np.repeat(np.square(np.array(noise, dtype=float)), 3)) if any(noise) else None
    bits = whole(document, board, "tag_bits", at, 6)
    out, pitch = [], size * (1 + spacing)
    for row in range(rows):
        for column in range(columns):
            t = se3.compose(np.eye(3), np.array([column * pitch, row * pitch, 0.0]))
            out.append(_Tag(first + row * columns + column, size, bits, _Placed(back @ t, covariance)))
    return out


def _place(document: YamlDocument, pose: object, at: Path_) -> _Placed | None:
    """A pose with its noise; None where none is stated."""
    if pose is None:
        return None
    if not isinstance(pose, dict):
        document.fail("not a pose", at, found=pose, expected="position, rotation")
    p, w = (_three(document, pose.get(k), (*at, k)) for k in ("position", "rotation"))
    if np.linalg.norm(w) > 2 * np.pi + 1e-6:
        document.fail("more than a turn: rotations are in rad", (*at, "rotation"), found=float(np.linalg.norm(w)))
    covariance = None
    if "R" in pose:
        covariance = _from_root(document, pose["R"], (*at, "R"))
    elif "position_noise" in pose or "rotation_noise" in pose:
        sigma = np.concatenate([_three(document, pose.get(k), (*at, k)) for k in ("position_noise", "rotation_noise")])
        document.insist(sigma.min() >= 0, "a standard deviation below 0", at, found=float(sigma.min()))
        covariance = np.diag(sigma**2)
    return _Placed(se3.from_vector(np.concatenate([p, w])), covariance)


def _from_root(document: YamlDocument, given: object, at: Path_) -> Array:
    """The covariance of (v, w) of TagSLAM's R (6, 6) with R^T R the information of (w, v)."""
    good = isinstance(given, list) and len(given) == 36 and all(isinstance(v, int | float) for v in given)
    document.insist(good, "not a root of information", at, expected="36 numbers, row by row")
    root = np.array(given, dtype=float).reshape(6, 6)
    if (
        not np.isfinite(root).all() or np.linalg.cond(root) > 1e12
    ):  # tolerance: twelve digits say nothing of the inverse
        document.fail("not a root of information", at, expected="one that can be inverted")
    inverse = np.linalg.inv(root)
    order = [3, 4, 5, 0, 1, 2]
    return np.asarray((inverse @ inverse.T)[np.ix_(order, order)])


def _map_of(group: Sequence[tuple[_Tag, _Placed]], family: str | None, source: str) -> MarkerMap:
    """A map of tags at their places."""
    poses = np.stack([p.pose for _, p in group])
    made = MarkerMap(
        tuple(str(t.id) for t, _ in group),
        np.array([t.size for t, _ in group]),
        se3.to_vector(poses),
        None,
        family,
        source,
    )
    bodies = {id(p.body): p.body for _, p in group if p.body is not None}
    stated = [p.covariance for _, p in group] + [b.covariance for b in bodies.values()]
    if all(c is None for c in stated):
        return made
    count = len(group)
    covariance = np.zeros((6 * count, 6 * count))
    for i, (_, p) in enumerate(group):
        own, r = slice(6 * i, 6 * i + 6), np.kron(np.eye(2), p.pose[:3, :3])
        if p.covariance is not None:
            covariance[own, own] += r @ p.covariance @ r.T
    for body in bodies.values():
        if body.covariance is None:
            continue
        on = [i for i, (_, p) in enumerate(group) if p.body is body]
        move = rigid_motions(poses[on, :3, 3] - body.pose[:3, 3]) @ np.kron(np.eye(2), body.pose[:3, :3])
        rows = np.concatenate([np.arange(6 * i, 6 * i + 6) for i in on])
        covariance[np.ix_(rows, rows)] += move @ body.covariance @ move.T
    return MarkerMap(made.names, made.size, made.vector, project_covariance(made, covariance), family, source)


def tagslam_text(known: MarkerMap, beside: str = "") -> str:
    """One static body `map` at the origin of the world, with all tags; TagSLAM takes no tag without its noise."""
    ids = marker_numbers(known, "tagslam")
    bits = {f: b for b, f in BITS.items()}
    if known.family not in (*bits, None):
        raise ModelError("TagSLAM has no such dictionary", key="tagslam", found=known.family, expected=", ".join(bits))
    if known.covariance is None:
        expected = "a map with sigma: TagSLAM takes no tag without its noise"
        raise ModelError("this map states no covariance", key="tagslam", expected=expected)
    poses = known.poses
    lines = ["bodies:", " - map:", "     is_static: true", "     type: simple", "     pose:"]
    zero = np.zeros(3)
    lines += _pose_lines(zero, zero, zero, zero, "       ")
    lines.append("     tags:")
    for i, id_ in enumerate(ids):
        own = slice(6 * i, 6 * i + 6)
        r = np.kron(np.eye(2), poses[i, :3, :3])
        sigma = np.sqrt(np.diag(r.T @ known.covariance[own, own] @ r).clip(0.0))
        lines += [f"     - id: {id_}", f"       bits: {bits.get(known.family or '36h11', 6)}"]
        lines += [f"       size: {number(float(known.size[i]))}", "       pose:"]
        lines += _pose_lines(known.vector[i, :3], known.vector[i, 3:], sigma[:3], sigma[3:], "         ")
    return "\n".join(lines) + "\n"


def _pose_lines(p: Array, w: Array, position: Array, rotation: Array, indent: str) -> Iterator[str]:
    for key, values in (("position", p), ("rotation", w), ("position_noise", position), ("rotation_noise", rotation)):
        axes = ", ".join(f"{a}: {number(float(v))}" for a, v in zip("xyz", values, strict=True))
        yield f"{indent}{key}: {{{axes}}}"


def _three(document: YamlDocument, given: object, at: Path_) -> Array:
    """Three numbers under x, y, z."""
    if not isinstance(given, dict):
        document.fail("a key is missing" if given is None else "not x, y, z", at, found=given, expected="x, y, z")
    for axis in "xyz":
        value = given.get(axis)
        good = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST
        document.insist(good, "a key is missing" if value is None else "not a number", (*at, axis), found=value)
    return np.array([float(given[axis]) for axis in "xyz"])


def _numbered(known: MarkerMap, form: str) -> list[int]:
    """The numbers of the markers. Raises ModelError for a name that is none."""
    for name in known.names:
        if not (name.isascii() and name.isdigit()):
            raise ModelError("this format calls markers by numbers", key=form, found=name, expected="robocal or json")
    return [int(n) for n in known.names]


def marker_numbers(known: MarkerMap, form: str) -> list[int]:
    """The numbers of the markers. Raises ModelError for a name that is none."""
    for name in known.names:
        if not (name.isascii() and name.isdigit()):
            raise ModelError("this format calls markers by numbers", key=form, found=name, expected="robocal or json")
    return [int(n) for n in known.names]

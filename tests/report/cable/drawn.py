"""Reads pictures back: where every mark and word lies."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator

SVG = "{http://www.w3.org/2000/svg}"
STEPS = {"M": 2, "L": 2, "H": 1, "V": 1, "Z": 0, "A": 7}


def parsed(text: str) -> ET.Element:
    """The picture, which must be well-formed XML."""
    root = ET.fromstring(text)
    assert root.tag == f"{SVG}svg" and root.findtext(f"{SVG}title") and root.findtext(f"{SVG}desc")
    return root


def of_class(root: ET.Element, name: str) -> list[ET.Element]:
    return [e for e in root.iter() if name in e.attrib.get("class", "").split()]


def ends(d: str) -> list[tuple[float, float]]:
    """Where the pen stops along a path; coordinates may be absolute or relative."""
    x = y = 0.0
    start, out = (0.0, 0.0), []
    for letter, numbers in re.findall(r"([MLHVZAmlhvza])([^MLHVZAmlhvza]*)", d):
        values = [float(v) for v in re.findall(r"-?\d*\.?\d+", numbers)]
        kind, relative = letter.upper(), letter.islower()
        size = STEPS[kind]
        for k in range(0, max(len(values), 1), max(size, 1)):
            step = values[k : k + size]
            if kind == "Z":
                x, y = start
            elif kind == "H":
                x = step[0] + (x if relative else 0.0)
            elif kind == "V":
                y = step[0] + (y if relative else 0.0)
            else:
                x, y = step[-2] + (x if relative else 0.0), step[-1] + (y if relative else 0.0)
            if kind == "M":
                start = (x, y)
            out.append((x, y))
    return out


def points(root: ET.Element) -> Iterator[tuple[float, float]]:
    """Every place of a mark, and both ends of every word (7 px a letter, at most)."""
    for e in root.iter():
        tag = e.tag.removeprefix(SVG)
        if tag == "path":
            yield from ends(e.attrib["d"])
        elif tag == "circle":
            yield float(e.attrib["cx"]), float(e.attrib["cy"])
        elif tag == "rect":
            x, y = float(e.attrib["x"]), float(e.attrib["y"])
            yield from ((x, y), (x + float(e.attrib["width"]), y + float(e.attrib["height"])))
        elif tag == "text" and e.attrib.get("visibility") != "hidden":
            wide = 7.0 * len("".join(e.itertext()))
            share = {"end": -1.0, "middle": -0.5}.get(e.attrib.get("text-anchor", "start"), 0.0)
            x, y = float(e.attrib["x"]), float(e.attrib["y"])
            yield from ((x + share * wide, y), (x + (1.0 + share) * wide, y - 10.0))


def inside(root: ET.Element) -> bool:
    width, height = (float(v) for v in root.attrib["viewBox"].split()[2:])
    return all(-1.0 <= x <= width + 1.0 and -1.0 <= y <= height + 1.0 for x, y in points(root))

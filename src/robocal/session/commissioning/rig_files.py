"""What a virtual rig records, as the files that `identify` reads: lengths, pixels, and poses of an external instrument."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Array
from robocal.files.cable.pose_lists import pose_columns
from robocal.files.display import listing_text
from robocal.geometry import se3
from robocal.quantities import Column, Listing
from robocal.session.commissioning.rig_world import RigWorld

__all__ = ["LABEL", "LENS", "Corners", "Recording", "lengths_files", "pixels_files", "poses_file"]

Corners: TypeAlias = tuple[tuple[int, int, Array], ...]
LABEL = "# SIMULATED by robocal cable rig, not measured\n"
LENS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


@record(eq=False)
class Recording:
    """What a list of k poses left: ids; poses (k, 4, 4) asked for and true; tensions (k, m) in N of the plant and as drives tell them; what
    sensors show (k, m) in m; corners as (view, marker, (4, 2) px); the poses (k, 4, 4) of the external instrument its clock (k,) in s, and
    the images where they were drawn."""

    ids: tuple[str, ...]
    asked: Array
    true: Array
    tension: Array
    stated: Array
    readings: Array
    corners: Corners
    reference: Array
    clock: Array
    images: tuple[NDArray[np.uint8], ...] = ()


def lengths_files(world: RigWorld, made: Recording, stem: str = "lengths") -> Mapping[str, str]:
    """Lengths and tensions, with their data.yaml."""
    names = world.spec.cables
    pulls = [f"t{i + 1}" for i in range(len(names))]
    table = Listing((
        Column("id", "", made.ids),
        *(Column(n, "m", v, decimals=6) for n, v in zip(names, made.readings.T, strict=True)),
        *(Column(n, "N", v, decimals=3) for n, v in zip(pulls, made.stated.T, strict=True)),
    ))  # fmt: skip
    sigma = world.spec.model.cable.length_noise
    return {
        f"{stem}.csv": LABEL + listing_text(table),
        f"{stem}.yaml": (
            f"{LABEL}robocal: 1\nkind: lengths\nfile: {stem}.csv\nlengths: {{columns: [{', '.join(names)}], sigma: {sigma!r}}}\n"
            f"tension: {{columns: [{', '.join(pulls)}]}}\nconfiguration: {{id: id}}\n"
        ),
    }


def pixels_files(world: RigWorld, made: Recording, sigma: float) -> Mapping[str, str]:
    """Corners of markers, with the lens as calibrated, the camera as mounted, and marker 0 as the frame where a tape told the anchors."""
    said, size = world.spec.model, world.spec.model.markers.size
    rows = [(made.ids[p], f"m{m}", k, *uv) for p, m, corners in made.corners for k, uv in enumerate(corners.tolist())]
    table = Listing((
        Column("id", "", [r[0] for r in rows]), Column("marker", "", [r[1] for r in rows]), Column("corner", "", [r[2] for r in rows]),
        Column("u", "", [r[3] for r in rows], decimals=4), Column("v", "", [r[4] for r in rows], decimals=4),
    ))  # fmt: skip
    wide = said.prior_used
    words = ", ".join(f"{s}: {v:.9g}" for s, v in zip(LENS, world.stated_lens, strict=True))
    spread = ", ".join(f"{s}: {wide.focal_and_centre_px if i < 4 else wide.distortion}" for i, s in enumerate(LENS[:8]))
    seen = sorted({m for _, m, _ in made.corners})
    told = pose_text(world.markers[0])
    frame = [] if world.beacons else [f"  m0: {{mount: base, free: false, {told}}}"]
    targets = "\n".join(frame + [f"  m{m}: {{mount: base, free: true}}" for m in seen if m or world.beacons])
    mount = said.camera_in_platform_nominal
    return {
        "pixels.csv": LABEL + listing_text(table),
        "pixels.yaml": (
            f"{LABEL}robocal: 1\nkind: pixels\nfile: pixels.csv\nunits: {{length: m, angle: deg}}\n"
            f"pixels: {{columns: [u, v], sigma: {sigma!r}}}\ncorners: {{column: corner, size: {size!r}}}\n"
            f"image: {list(said.camera.resolution)}\n"
            f"camera: {{name: lens, {words}, sigma: {{{spread}}}}}\n"
            f"frame: {{name: eye, mount: tool, free: true, {pose_text(world.spec.eye)}, "
            f"prior: {{length: {mount.translation_sigma!r}, angle: {mount.rotation_sigma!r}}}}}\n"
            f"{print_text(said.markers.print_scale_error)}target: {{column: marker}}\ntargets:\n{targets}\nconfiguration: {{id: id}}\n"
        ),
    }


def print_text(error: float) -> str:
    """How far the size of the print may be off."""
    return f"scale: {{sigma: {100 * error:g} %, free: true}}\n" if error > 0 else "scale: known\n"


def pose_text(t: Array) -> str:
    """A pose (4, 4) as a file has it, m and deg."""
    v = se3.to_vector(t)
    place, turn = (", ".join(f"{x:.9f}" for x in part) for part in (v[:3], np.degrees(v[3:])))
    return f"xyz: [{place}], rotation_vector: [{turn}]"


def poses_file(ids: Sequence[str], poses: Array, clock: Array | None = None) -> str:
    """A list of poses in m and deg, with the time of an instrument's own clock where it has one."""
    name, *place = pose_columns(tuple(ids), poses)
    more = () if clock is None else (Column("time", "s", clock, decimals=3),)
    turned = [c if c.unit != "rad" else Column(c.name, "deg", np.degrees(np.asarray(c.values, float))) for c in place]
    return LABEL + listing_text(Listing((name, *more, *turned)))

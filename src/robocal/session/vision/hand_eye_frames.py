"""X and Y of a hand-eye calibration with their covariance: the camera in the flange or in the base, the target in the other."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.files.hand_eye_forms import ExportedFrame
from robocal.geometry import se3, so3
from robocal.measure.builder import offsets_of
from robocal.measure.machine import Rig
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.decision import Decision
from robocal.quantities import Column, Listing
from robocal.session.vision.hand_eye_errors import frame_of
from robocal.session.vision.hand_eye_unknowns import SHRINK

__all__ = ["PlacedFrame", "frames_listing", "place_frames"]


@record(eq=False)
class PlacedFrame:
    """T_parent_child (4, 4), and the covariance (6, 6) of its place (m) and of small turns (rad), both about the axes of the parent."""

    parent: str
    child: str
    pose: Array
    covariance: Array

    @property
    def title(self) -> str:
        """What it is: "camera in flange"."""
        return f"{self.child} in {self.parent}"

    @property
    def sigma(self) -> Array:
        """Standard deviations (6,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """x, y, z, w, the last not negative."""
        w = so3.log(self.pose[:3, :3])
        half = float(np.linalg.norm(w)) / 2
        x, y, z = (0.5 * np.sinc(half / np.pi) * w).tolist()
        return x, y, z, float(np.cos(half))

    @property
    def exported(self) -> ExportedFrame:
        """The same for other programs."""
        return ExportedFrame(self.parent, self.child, self.pose[:3, 3], self.pose[:3, :3], self.quaternion)

    @property
    def inverse(self) -> PlacedFrame:
        """T_child_parent."""
        r, t = self.pose[:3, :3], self.pose[:3, 3]
        back = np.zeros((6, 6))
        back[:3, :3] = back[3:, 3:] = -r.T
        back[:3, 3:] = -r.T @ so3.skew(t)
        return PlacedFrame(self.child, self.parent, se3.inverse(self.pose), back @ self.covariance @ back.T)


def place_frames(made: Decision[Rig], inhand: bool, hand: str) -> tuple[PlacedFrame, ...]:
    """The camera first, then the targets, then cameras on the first; `hand`: what the robot carries them on."""
    obs = made.need_data.observations[0]
    names, covariance = made.spread
    out = []
    assert obs.frame is not None
    further = [f for o in made.need_data.observations for f in offsets_of(o)]
    targets = {t.name: t for o in made.need_data.observations for t in o.targets}
    for frame in (obs.frame, *targets.values(), *further):
        c = np.zeros((6, 6))
        own = [f"{frame.name}.{s}" for s in FRAME_SYMBOLS]
        at = [i for i, n in enumerate(own) if n in names]
        c[np.ix_(at, at)] = covariance[np.ix_(*[[names.index(own[i]) for i in at]] * 2)]
        place = frame_of(made, frame.name)
        if SHRINK in names:  # lengths of the fit are those of a target as it is stated: t = t' / (1 + e)
            k = names.index(SHRINK)
            chain = np.hstack([np.eye(6), -np.append(place[:3, 3], np.zeros(3))[:, None]])
            beside = np.zeros((7, 7))
            beside[:6, :6], beside[6, 6] = c, covariance[k, k]
            beside[at, 6] = beside[6, at] = covariance[[names.index(own[i]) for i in at], k]
            c = chain @ beside @ chain.T
            place[:3, 3] /= 1 + made.values[SHRINK]
        on = hand if frame.mount == "tool" else "base"
        on = obs.frame.name if frame in further else on
        if frame is obs.frame and not inhand:  # stored the other way round
            out.append(PlacedFrame(frame.name, on, place, c).inverse)
        else:
            out.append(PlacedFrame(on, frame.name, place, c))
    return tuple(out)


def frames_listing(frames: tuple[PlacedFrame, ...]) -> tuple[Listing, Listing]:
    """A row for each frame: where it is, mm, and how it is turned, as a quaternion; with one standard deviation, mm and deg."""
    place = 1e3 * np.array([f.pose[:3, 3] for f in frames])
    q, sigma = np.array([f.quaternion for f in frames]), np.array([f.sigma for f in frames])
    names = Column("frame", "", [f.title for f in frames])
    spread = [Column(f"s{n}", "mm", 1e3 * sigma[:, i], figures=2, label=f"σ{n} [mm]") for i, n in enumerate("xyz")]
    turns = [
        Column(f"sr{n}", "deg", np.degrees(sigma[:, 3 + i]), figures=2, label=f"σr{n} [deg]")
        for i, n in enumerate("xyz")
    ]
    return (
        Listing((names, *(Column(n, "mm", place[:, i], figures=6) for i, n in enumerate("xyz")), *spread)),
        Listing((names, *(Column(f"q{n}", "", q[:, i], spec=".6f") for i, n in enumerate("xyzw")), *turns)),
    )

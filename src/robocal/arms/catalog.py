"""A small catalogue of arms with the source of every number; lengths in m, angles in rad once they have left this file.

`get(name)` gives a nominal chain. Where limits are absent, none are published for the model's joint angles. The
seeds' machines keep in `meta["order"]` the column order of the printed Jacobians.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from robocal.arms.chain import Chain
from robocal.arms.conventions import chain
from robocal.errors import look_up

__all__ = ["LIMITS", "get", "names"]

Rows = list[dict[str, object]]
DEG = math.pi / 180.0
CM = 0.01
MM = 0.001
FRANKA = "Franka control interface documentation, Denavit-Hartenberg parameters; tool at the flange, 0.107 m"
MITSUBISHI = (
    "lengths 300, 250, 160 mm and limits: Mitsubishi RV-1A/2AJ manual; frames inferred from a published calibration. "
    "Ends at the wrist centre (r5 = 0); the flange is at tool.z = 0.072 m"
)
KLEINFINGER = (
    "frames: Khalil and Kleinfinger (1986); D3 = RL4 = 1 cm as in a thesis on calibration (the real links are 45 cm)"
)
UNIVERSAL = "Universal Robots, DH parameters for calculations of kinematics and dynamics; beta because axes 2, 3, 4 are parallel"
KUKA = "KUKA LBR iiwa 14 R820 specification: 360, 420, 400, 126 mm to the media flange, and axis ranges"
ABB = "ABB IRB 120 product specification: 290, 270, 70, 302, 72 mm and working range; beta because axes 2 and 3 are parallel"


def _turns(*degrees: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    return tuple((low * DEG, high * DEG) for low, high in degrees)


_WIDE = (-2.8973, 2.8973)
# The makers' joint limits in rad, of the arms for which they are published.
LIMITS: dict[str, tuple[tuple[float, float], ...]] = {
    "rv-2aj": _turns((-150, 150), (-60, 120), (-110, 120), (-90, 90), (-200, 200)),
    "ur10": _turns(*[(-360.0, 360.0)] * 6),
    "panda": (_WIDE, (-1.7628, 1.7628), _WIDE, (-3.0718, -0.0698), _WIDE, (-0.0175, 3.7525), _WIDE),
    "fr3": (
        (-2.7437, 2.7437), (-1.7837, 1.7837), (-2.9007, 2.9007), (-3.0421, -0.1518),
        (-2.8065, 2.8065), (0.5445, 4.5169), (-3.0159, 3.0159),
    ),
    "iiwa-14": _turns((-170, 170), (-120, 120), (-170, 170), (-120, 120), (-170, 170), (-120, 120), (-175, 175)),
    "irb-120": _turns((-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400)),
}  # fmt: skip


def names() -> tuple[str, ...]:
    """The names that `get` knows."""
    return tuple(_ARMS)


def get(name: str) -> Chain:
    """The nominal arm with this name. Raises ModelError with the nearest name."""
    return look_up(_ARMS, name, "unknown robot")()


def _rows(
    symbols: str, unit: float, table: Sequence[Sequence[float]], limits: Sequence[tuple[float, float]] = ()
) -> Rows:
    """Rows from a printed table: lengths in `unit` m, angles in degrees; limits in rad."""
    words = symbols.split()
    angle = {"theta", "alpha", "beta"}
    out: Rows = []
    for i, line in enumerate(table):
        row: dict[str, object] = {"name": f"j{i + 1}"}
        row.update({w: v * (DEG if w in angle else unit) for w, v in zip(words, line, strict=True)})
        if limits:
            row["limits"] = limits[i]
        out.append(row)
    return out


def _rv_2aj() -> Chain:
    table = [(0, 0, 0, 300), (-90, 0, -90, 0), (0, 250, 0, 0), (0, 160, 90, 0), (90, 0, 0, 0)]
    rows, meta = _rows("alpha d theta r", MM, table, LIMITS["rv-2aj"]), {"flange": (0.0, 0.0, 0.072, 0.0, 0.0, 0.0)}
    return chain("Mitsubishi RV-2AJ", "khalil-hayati", rows, source=MITSUBISHI, meta=meta)


def _rx_90(a4: float) -> Chain:
    table = [(0, 0, 0, 0), (90, 0, 0, 0), (0, 1, 0, 0), (-90, a4, 0, 1), (90, 0, 0, 0), (-90, 0, 0, 0)]
    title = "Staubli RX-90, unit links" + (f", a4 = {a4} cm" if a4 else "")
    meta = {"order": _order("", range(1, 7))}
    return chain(title, "mdh", _rows("alpha a theta d", CM, table), source=KLEINFINGER, meta=meta)


_SMALL = {
    1: ((0, 0, 0, 5.0), None),
    2: ((-90, 1.4, 0, 3.6), None),
    3: ((0, 10.5, 0, 0), None),
    4: ((90, 2.9, 0, 4.7), None),
    5: ((-90, 0, 0, 2.7), ("tz", 5.1)),
    6: ((90, 2.5, 0, 5.2), None),
}
_CARRIED = {**_SMALL, 1: ((0, 0, 0, 8.0), None), 2: ((-90, 1.2, 0, 3.5), ("tz", 1.2))}
_CAMERA = {0: ((0, 39.7, 0, 0), None), **_CARRIED, 7: ((0, 2.7, 0, 7.2), ("ty", 2.3))}
_PROBE = {0: ((90, 0, 0, 33.1), ("tz", 73.5)), **_CARRIED, 7: ((90, 0, 0, 12.0), ("tz", 3.0))}


def _order(shifted: str, joints: Sequence[int]) -> tuple[str, ...]:
    """Names in the seeds' order: every l, then every a, every theta, every d."""
    return (*(f"j{i}.l" for i in shifted), *(f"j{i}.{s}" for s in ("a", "theta", "d") for i in joints))


def _small(title: str, table: Mapping[int, tuple[tuple[float, ...], tuple[str, float] | None]]) -> Chain:
    """[T(l)] Rx(alpha) Tx(a) Rz(theta) Tz(d) per row; rows 0 and 7 hold no joint."""
    rows: Rows = []
    for i, ((alpha, a, theta, d), shift) in sorted(table.items()):
        fixed = i in (0, 7)
        steps: Rows = [] if shift is None else [{"axis": shift[0], "symbol": "l", "value": shift[1] * CM}]
        steps += [
            {"axis": "rx", "symbol": "alpha", "value": alpha * DEG},
            {"axis": "tx", "symbol": "a", "value": a * CM},
            {"axis": "rz", "symbol": "theta", "value": theta * DEG, "driven": int(not fixed)},
            {"axis": "tz", "symbol": "d", "value": d * CM},
        ]
        rows.append({"name": f"j{i}", "type": "fixed" if fixed else "revolute", "elements": steps})
    shifted = "".join(str(i) for i, (_, shift) in sorted(table.items()) if shift)
    return chain(
        title, "elements", rows, source="a thesis on calibration by least squares and Kalman filter",
        meta={"order": _order(shifted, sorted(table))},
    )  # fmt: skip


def _ur10() -> Chain:
    table = [
        (0, 0.1273, 0, 90), (0, 0, -0.612, 0), (0, 0, -0.5723, 0),
        (0, 0.163941, 0, 90), (0, 0.1157, 0, -90), (0, 0.0922, 0, 0),
    ]  # fmt: skip
    rows = _rows("theta d a alpha", 1.0, table, LIMITS["ur10"])
    return chain("Universal Robots UR10", "dh-hayati", rows, source=UNIVERSAL)


def _franka(name: str, limits: Sequence[tuple[float, float]]) -> Chain:
    table = [
        (0, 0, 0, 0.333), (-90, 0, 0, 0), (90, 0, 0, 0.316), (90, 0.0825, 0, 0),
        (-90, -0.0825, 0, 0.384), (90, 0, 0, 0), (90, 0.088, 0, 0),
    ]  # fmt: skip
    rows = _rows("alpha a theta d", 1.0, table, limits)
    return chain(name, "mdh", rows, tool=(0, 0, 0.107, 0, 0, 0), source=FRANKA)


def _iiwa_14() -> Chain:
    table = [
        (0, 0, 0, 360), (-90, 0, 0, 0), (90, 0, 0, 420), (90, 0, 0, 0),
        (-90, 0, 0, 400), (-90, 0, 0, 0), (90, 0, 0, 126),
    ]  # fmt: skip
    return chain("KUKA LBR iiwa 14 R820", "mdh", _rows("alpha a theta d", MM, table, LIMITS["iiwa-14"]), source=KUKA)


def _irb_120() -> Chain:
    table = [
        (0, 290, 0, -90), (-90, 0, 270, 0), (0, 0, 70, -90),
        (0, 302, 0, 90), (0, 0, 0, -90), (180, 72, 0, 0),
    ]  # fmt: skip
    return chain("ABB IRB 120", "dh-hayati", _rows("theta d a alpha", MM, table, LIMITS["irb-120"]), source=ABB)


_ARMS: dict[str, Callable[[], Chain]] = {
    "rv-2aj": _rv_2aj,
    "rx-90": lambda: _rx_90(0.0),
    "rx-90-offset": lambda: _rx_90(0.2),
    "small-arm": lambda: _small("small arm", _SMALL),
    "small-arm-camera": lambda: _small("small arm with a camera, seen from the marker", _CAMERA),
    "small-arm-probe": lambda: _small("small arm with an ultrasound probe, seen from the camera", _PROBE),
    "ur10": _ur10,
    "panda": lambda: _franka("Franka Emika Panda", LIMITS["panda"]),
    "fr3": lambda: _franka("Franka Research 3", LIMITS["fr3"]),
    "iiwa-14": _iiwa_14,
    "irb-120": _irb_120,
}

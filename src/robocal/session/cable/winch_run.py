"""Winches that a run has identified, and the tensions that currents of them tell.

t_i = (n / R) (k i_i + c_i sgn(v_i) + b_i n v_i / R)        as `measure/winches.py`
"""

from __future__ import annotations

from typing import Self

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError
from robocal.files.cable.pose_lists import CableList
from robocal.files.runfolder import Run
from robocal.files.units import parse_unit
from robocal.measure.cable.winch_tensions import FRICTION, KT, RATIO
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["RunWinches", "with_tensions"]


@record(eq=False)
class RunWinches:
    """The torque constant of all motors (N m/A), the gear's ratio by the drum's radius (1/m), and Coulomb (m,) and viscous (m,) friction
    of each."""

    kt: float
    ratio: float
    coulomb: Array
    viscous: Array

    @classmethod
    def of(cls, run: Run | None, robot: CableRobot) -> Self | None:
        """Those of a run; None where it has none, or those of several files."""
        told = {} if run is None else {p.name: p for p in run.result.parameters}
        value = {
            n: parse_unit(p.unit, key=n).to_si(float(v))
            for n, p in told.items()
            if (v := p.nominal if p.identified is None else p.identified) is not None
        }
        owners = [n.removesuffix(f".{RATIO}") for n in value if n.endswith(f".{RATIO}")]
        if len(owners) != 1:
            return None
        own = owners[0]
        friction = [np.array([value[f"{own}.{c}.{s}"] for c in robot.cables]) for s in FRICTION]
        return cls(value[f"{own}.{KT}"], value[f"{own}.{RATIO}"], *friction)

    @property
    def rubs(self) -> bool:
        """Whether friction has to be known the direction of."""
        return bool(self.coulomb.any() or self.viscous.any())

    def tension(self, current: Array, speed: Array) -> Array:
        """Tensions (k, m) in N."""
        torque = self.kt * current + self.coulomb * np.sign(speed) + self.viscous * self.ratio * speed
        return np.asarray(self.ratio * torque)


def with_tensions(
    rows: CableList, robot: CableRobot, run: Run | None, path: object
) -> tuple[CableList, tuple[Remark, ...]]:
    """A list whose tensions follow from its currents, where it has some, and what is said of it. Raises FormatError where no run knows
    the winches, friction has no direction, or a motor does not pull."""
    from robocal._record import replace

    if rows.current is None:
        return rows, ()
    place, first = str(path), robot.cables[0]
    winches = RunWinches.of(run, robot)
    if winches is None:
        expected = "the run folder of an identification with kind: winches as ROBOT, or columns of tensions"
        raise FormatError(
            "currents of winches that nobody knows", file=place, key=f"{first}.current", expected=expected
        )
    if rows.speed is None and winches.rubs:
        expected = f"{first}.speed [mm/s], ...: how fast each cable runs out, or ran out last"
        raise FormatError("friction without a direction", file=place, key=f"{first}.speed", expected=expected)
    speed = np.zeros_like(rows.current) if rows.speed is None else rows.speed
    found = winches.tension(rows.current, speed)
    if (found < 0).any():
        row, cable = (int(v[0]) for v in np.nonzero(found < 0))
        told, name = (
            f"{found[row, cable]:.4g} N from {rows.current[row, cable]:.4g} A",
            f"{robot.cables[cable]}.current",
        )
        expected = "a current above 0 where the motor pulls"
        raise FormatError(
            "a cable cannot push", file=place, row=rows.lines[row], column=name, found=told, expected=expected
        )
    share = winches.ratio * np.abs(winches.coulomb * np.sign(speed) + winches.viscous * winches.ratio * speed)
    least, most = Quantity(float(found.min()), "N"), Quantity(float(found.max()), "N")
    said = Remark.of(Code.TENSIONS_FROM_CURRENTS, low=least, high=most, friction=Quantity(float(share.max()), "N"))
    return replace(rows, tension=found), (said,)

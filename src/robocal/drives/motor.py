"""A motor as a model: the harmonics of its cogging, its lag and its encoder's eccentricity as named parameters.

`order72.cos` and `order72.sin` are the parts of an order, in the unit in which its effort was logged (N m or A); `order72.cos_change` and
`order72.sin_change` what each direction adds to them; `cogging.lag` is the lag, `encoder.cos` and `encoder.sin` are the eccentricity
(rad). `cogging.gain` is how much of the curve a log shows, 1. Friction and the sensor's zero belong to a log (`measure/effort.py`): a
motor has others when it is loaded. Its maker says slots and poles, where these are known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robocal._record import record
from robocal.drives.cogging import Cogging
from robocal.geometry.path.placeless import Placeless
from robocal.parameters import Parameter, ParameterTable

__all__ = ["ECCENTRIC", "GAIN", "LAG", "Motor", "motor_of", "order_names"]

LAG, GAIN, ECCENTRIC = "cogging.lag", "cogging.gain", ("encoder.cos", "encoder.sin")
LAG_EXPECTED, ECCENTRIC_EXPECTED = (
    0.01,
    0.01,
)  # rad: half a degree, which is what hysteresis and a disc's centring leave


def order_names(order: int, changes: bool = False) -> tuple[str, str]:
    """The names of the two parts of an order, or of what each direction adds to them."""
    end = "_change" if changes else ""
    return f"order{order}.cos{end}", f"order{order}.sin{end}"


@record
class Motor(Placeless):
    """One motor; `by_direction`: whether the directions have phases of their own; `eccentric`: whether its encoder may be."""

    name: str
    table: ParameterTable
    orders: tuple[int, ...]
    by_direction: bool = False
    slots: int | None = None
    poles: int | None = None

    @property
    def parts(self) -> Mapping[str, tuple[str, ...]]:
        """Its orders."""
        return {"order": tuple(f"order{n}" for n in self.orders)}

    @property
    def cogging(self) -> Cogging:
        """The curve that its parameters say."""
        value = {p.name: p.value for p in self.table.rows}

        def parts(which: int, changes: bool = False) -> tuple[float, ...]:
            return tuple(value[order_names(n, changes)[which]] for n in self.orders)

        change = (parts(0, True), parts(1, True)) if self.by_direction else ((), ())
        eccentric = (value[ECCENTRIC[0]], value[ECCENTRIC[1]])
        return Cogging(self.orders, parts(0), parts(1), value[LAG], *change, eccentric)


def motor_of(
    name: str,
    orders: Sequence[int],
    unit: str,
    size: float,
    *,
    by_direction: bool = False,
    eccentric: bool = False,
    lag: bool = True,
    slots: int | None = None,
    poles: int | None = None,
) -> Motor:
    """A motor without cogging, whose orders are to be found: `size` is how far any part may be from zero, in `unit` (N m or A)."""
    rows: list[Parameter] = []
    for n in orders:
        for changes in (False, True) if by_direction else (False,):
            rows += [Parameter(part, 0.0, unit, True, expected=size) for part in order_names(n, changes)]
    # Phases per direction say what a lag says: both together cannot be told apart.
    rows.append(Parameter(LAG, 0.0, "rad", lag and not by_direction and bool(orders), expected=LAG_EXPECTED))
    rows.append(Parameter(GAIN, 1.0, "1", False, expected=1.0))
    rows += [Parameter(part, 0.0, "rad", eccentric, expected=ECCENTRIC_EXPECTED) for part in ECCENTRIC]
    return Motor(name, ParameterTable(tuple(rows)), tuple(orders), by_direction, slots, poles)

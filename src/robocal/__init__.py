"""robocal finds out what a robot really is: true parameters from measurements, with honest uncertainty.

    import robocal as rc
    found = rc.identify("ur10", rc.measurements(q, position=p, units=("rad", "mm")))
    print(found)

Importing this package is cheap on purpose: what a name stands for is loaded when it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robocal.jobs.front import Arm, Identified, Measurements, identify, measurements, robot

__all__ = ["Arm", "Identified", "Measurements", "__version__", "identify", "measurements", "robot"]

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from robocal.jobs import front

    found: object = getattr(front, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)

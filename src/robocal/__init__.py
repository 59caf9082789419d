"""robocal finds out what a robot really is: true parameters from measurements, with honest uncertainty.

    import robocal as rc
    found = rc.identify("ur10", rc.measurements(q, position=p, units=("rad", "mm")))
    print(found)

Importing this package is cheap on purpose: what a name stands for is loaded when it is asked for. Types are in `__init__.pyi`.
"""

from __future__ import annotations

from importlib import import_module

from robocal._version import __version__

__all__ = ["Arm", "Identified", "Measurements", "__version__", "identify", "measurements", "robot"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(import_module("robocal.front"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)

"""robocal finds out what a robot really is: true parameters from measurements, with honest uncertainty.

    import robocal as rc
    found = rc.identify("ur10", rc.measurements(q, position=p, units=("rad", "mm")))
    print(found)

Importing this package is cheap on purpose: what a name stands for is loaded when it is asked for. Types are in `__init__.pyi`.
"""

from __future__ import annotations

from importlib import import_module

from robocal._version import __version__

ARRAYS = ("Arm", "Measurements", "measurements", "robot", "table")
FOUND = ("Found", "Identified")
ERRORS = ("Cancelled", "InputError")
CALLS = (
    "check", "compensate", "drift", "export", "identify", "import_model", "new", "plan", "predict", "simulate", "study", "validate",
    "verify",
)  # fmt: skip
__all__ = [
    "Arm", "Cancelled", "Found", "Identified", "InputError", "Measurements", "__version__", "cable", "check", "compensate",
    "drift", "export", "identify", "import_model", "measurements", "new", "plan", "predict", "robot", "simulate", "study", "table",
    "validate", "verify",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name in CALLS:
        found: object = import_module("robocal.front.calls").call(name)
    elif name == "cable":
        found = import_module("robocal.front.cable")
    elif name in (*ARRAYS, *FOUND, *ERRORS):
        room = "front.arrays" if name in ARRAYS else "front.verb_result" if name in FOUND else "errors"
        found = getattr(import_module(f"robocal.{room}"), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)

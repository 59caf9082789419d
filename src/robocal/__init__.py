"""robocal finds out what a robot really is: true parameters from measurements, with honest uncertainty.

    import robocal as rc
    found = rc.identify("ur10", rc.measurements(q, pose=T, units=("rad", "mm")))
    print(found, found.covariance)

Importing this package is cheap on purpose: what a name stands for is loaded when it is asked for. Types are in `__init__.pyi`.
"""

from __future__ import annotations

from importlib import import_module

from robocal._version import __version__ as __version__

# Names that are no verbs, and the modules that have them.
ARRAYS = {
    "Arm": "robots", "Measurements": "measurements", "measurements": "measurements", "robot": "robots", "table": "measurements",
}  # fmt: skip
FOUND = {"Found": "verb_result", "Identified": "verb_result", "Plot": "plots"}
ERRORS = ("Cancelled", "InputError")
GROUPS = {"cable": "cable", "drive": "drive", "camera": "vision"}  # verbs under one word, and that of the command line
TERMINAL = ("demo", "report")  # verbs that are no functions: they only write files for people


def _calls() -> tuple[str, ...]:
    """The verbs that are functions; read when somebody asks, so that importing this package stays cheap."""
    from robocal.verbs.registry import VERBS

    return tuple(sorted(verb for verb in VERBS if verb not in TERMINAL))


def __getattr__(name: str) -> object:
    if name in GROUPS:
        found: object = import_module(f"robocal.front.{GROUPS[name]}")
    elif name in (*ARRAYS, *FOUND, *ERRORS):
        module = (ARRAYS | FOUND).get(name)
        room = "errors" if module is None else f"front.{module}"
        found = getattr(import_module(f"robocal.{room}"), name)
    elif name == "CALLS":
        found = _calls()
    elif name == "__all__":
        found = __dir__()
    elif name in _calls():
        found = import_module("robocal.front.calls").call(name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted([*ARRAYS, *FOUND, *ERRORS, *_calls(), *GROUPS, "__version__"])

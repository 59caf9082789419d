"""The checks, by the time at which they run. A check is a function with a line above it; no list names it:

    @check("encoder-slip", When.FIT, order=500, needs=("fit",))
    def encoder_slip(context: Context[Model]) -> Iterator[Finding]: ...

The modules of a package are looked through when its checks run for the first time. `order` says where the findings of a check
stand among those of the same time.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from robocal.diagnose.context import Context
from robocal.diagnose.finding import Finding, Level
from robocal.measure.machine import Model, freedom_of, joints_of

__all__ = [
    "ALL",
    "CABLES",
    "DIAGNOSE",
    "HYPOTHESES",
    "PROVE",
    "ROWS",
    "Check",
    "Given",
    "Machines",
    "When",
    "check",
    "checks",
    "run",
]

DIAGNOSE = "robocal.diagnose"  # the package of the checks that every verb asks
PROVE = "robocal.prove"  # of those that need a proof
CABLES = "robocal.diagnose.cables"  # of those of lists of cable robots
ROWS = "robocal.diagnose.rows"  # of those of rows as files have them
HYPOTHESES = "robocal.diagnose.hypotheses"  # of mistakes that explain what the nominal machine does not
ALL = (ROWS, HYPOTHESES, CABLES, DIAGNOSE, PROVE)


class When(IntEnum):
    """When a check runs, in the order of time."""

    FILE = 0  # the rows of one file, while it is read
    READ = 1  # what all files said, before it is used: a finding that refuses is wrong input
    DATA = 2  # model and data, before a fit
    FIT = 3  # after the fit, beside the verdict
    UNSEEN = 4  # whether unseen measurements can be judged at all; the first finding ends it, and no gain is computed
    PROOF = 5  # what a gain is worth


class Given(StrEnum):
    """What must hold before a check runs."""

    ALWAYS = "always"
    NOTHING = "nothing"  # no finding yet in this run
    ACCEPTED = "accepted"  # no finding yet refuses
    GAIN = "gain"  # a gain is proven, and nothing found yet speaks against it


class Machines(StrEnum):
    """For which machines a check means something today."""

    ANY = "any"
    JOINTED = "jointed"  # whose configurations are joint values
    POSED = "posed"  # whose configurations have a pose of their own

    def include(self, machine: Model | None) -> bool:
        """Whether a machine is one of them."""
        if self is Machines.ANY or machine is None:
            return True
        return bool(joints_of(machine)) if self is Machines.JOINTED else bool(freedom_of(machine))


@dataclass(frozen=True)
class Check:
    """A check: its function, when it runs and where its findings stand, and what it needs of machine and context."""

    name: str
    when: When
    order: int
    run: Callable[[Any], Iterable[Finding]]
    machines: Machines = Machines.ANY
    given: Given = Given.ALWAYS
    needs: tuple[str, ...] = ()

    def applies(self, context: Context[Model], found: Iterable[Finding]) -> bool:
        """Whether it runs in a context after what was found already."""
        if self.given is Given.NOTHING and any(True for _ in found):
            return False
        if self.given is Given.ACCEPTED and any(f.level is Level.REFUSE for f in found):
            return False
        if self.given is Given.GAIN and (
            any(f.level in (Level.REFUSE, Level.QUALIFY) for f in found) or not context.improvement
        ):
            return False
        return self.machines.include(context.model) and all(getattr(context, n, None) is not None for n in self.needs)


_KNOWN: dict[str, Check] = {}


def check(
    name: str,
    when: When,
    *,
    order: int,
    machines: Machines = Machines.ANY,
    given: Given = Given.ALWAYS,
    needs: tuple[str, ...] = (),
) -> Callable[[Callable[[Any], Iterable[Finding]]], Check]:
    """Registers a function of a context as a check."""

    def register(function: Callable[[Any], Iterable[Finding]]) -> Check:
        one = Check(name, when, order, function, machines, given, needs)
        if _KNOWN.setdefault(f"{function.__module__}.{function.__qualname__}", one) is not one:
            raise ValueError(f"the check {name} is registered twice")
        return one

    return register


@cache
def checks(package: str) -> tuple[Check, ...]:
    """All checks of the modules of a package, in the order of time."""
    for module in iter_modules(import_module(package).__path__, f"{package}."):
        if not module.ispkg:
            import_module(module.name)
    mine = (
        c for place, c in _KNOWN.items() if place.startswith(f"{package}.") and _depth(place) == _depth(package) + 2
    )
    return tuple(sorted(mine, key=lambda c: (c.when, c.order)))


def _depth(name: str) -> int:
    return name.count(".")


def run(
    when: When, context: Context[Model], *packages: str, found: Iterable[Finding] = (), skip: Container[str] = ()
) -> list[Finding]:
    """The findings of all checks of one time but those to `skip`, in their order, given what was `found` before.

    A watcher of the context hears of every check before it runs and may stop the run by raising Cancelled, and of every finding.
    """
    known = list(found)
    before = len(known)
    chosen = [c for package in packages or (DIAGNOSE,) for c in checks(package) if c.when is when]
    for one in sorted(chosen, key=lambda c: c.order):
        if one.name in skip or not one.applies(context, known):
            continue
        if context.watch:
            context.watch({"stage": "check", "check": one.name})
        for finding in one.run(context):
            known.append(replace(finding, check=one.name))
            if context.watch:
                words = {"code": str(finding.code), "level": str(finding.level), "sentence": finding.remark.sentence}
                context.watch({"stage": "finding", "check": one.name, **words})
    return known[before:]

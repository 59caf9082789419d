"""The checks, by the time at which they run, what they look at, and what they find.

A check is a function with a line above it; no list names it:

    @check("encoder-slip", When.FIT, order=500, needs=("fit",))
    def encoder_slip(context: Context[Model]) -> Iterator[Finding]: ...

`order` says where the findings of a check stand among those of the same time. A context is a machine, its data and a fit to them, with
everything that several checks ask, computed once. A finding is a code with its numbers, and what it means for the verdict:

refuse     data or model are wrong: no number of the fit may be used
qualify    a gain is not proven, or only near what was measured
doubt      something that the user should look at; the verdict stands
note       a fact that the user should know
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping
from enum import IntEnum, StrEnum
from functools import cache, cached_property, wraps
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal._record import field, record, replace
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, freedom_of, joints_of
from robocal.progress import Watch
from robocal.remarks.remark import Number, Remark

if TYPE_CHECKING:
    from robocal.diagnose.studentised import StudentisedResiduals
    from robocal.estimate.terms import Linear, Residuals
    from robocal.fit.baseline import Baseline
    from robocal.fit.fit import Fit
    from robocal.fit.options import Options

__all__ = [
    "ALL", "CABLES", "DIAGNOSE", "HYPOTHESES", "PROVE", "ROWS", "Check", "Context", "Finding", "Given", "Level", "M_co", "Machines",
    "When", "check", "check_fit_twice", "checks", "doubt", "note", "of_remarks", "once", "qualify", "refuse", "run",
]  # fmt: skip

DIAGNOSE = "robocal.diagnose"  # the package of the checks that every verb asks
PROVE = "robocal.prove"  # of those that need a proof
CABLES = "robocal.diagnose.cables"  # of those of lists of cable robots
ROWS = "robocal.diagnose.rows"  # of those of rows as files have them
HYPOTHESES = "robocal.diagnose.hypotheses"  # of mistakes that explain what the nominal machine does not
ALL = (ROWS, HYPOTHESES, CABLES, DIAGNOSE, PROVE)

M_co = TypeVar("M_co", bound=Model, covariant=True)
C = TypeVar("C", bound="Context[Model]")
T = TypeVar("T")


class Level(StrEnum):
    """What a finding means for the verdict."""

    REFUSE = "refuse"
    QUALIFY = "qualify"
    DOUBT = "doubt"
    NOTE = "note"


@record
class Finding:
    """One result of a check: `code` and `items` as a remark has them, its level, and the name of the check."""

    code: str
    items: tuple[tuple[str, Number], ...]
    level: Level
    check: str = ""

    @property
    def numbers(self) -> Mapping[str, Number]:
        """The numbers by name."""
        return dict(self.items)

    @property
    def remark(self) -> Remark:
        """The same for people."""
        return Remark(self.code, self.items)


def refuse(code: str, **numbers: Number) -> Finding:
    """A finding after which no number may be used."""
    return Finding(code, tuple(numbers.items()), Level.REFUSE)


def qualify(code: str, **numbers: Number) -> Finding:
    """A finding that takes from a gain."""
    return Finding(code, tuple(numbers.items()), Level.QUALIFY)


def doubt(code: str, **numbers: Number) -> Finding:
    """A finding that the user should look at."""
    return Finding(code, tuple(numbers.items()), Level.DOUBT)


def note(code: str, **numbers: Number) -> Finding:
    """A finding that the user should know."""
    return Finding(code, tuple(numbers.items()), Level.NOTE)


def of_remarks(remarks: Iterable[Remark], level: Level) -> list[Finding]:
    """Findings of one level from remarks that were written elsewhere."""
    return [Finding(r.code, r.items, level) for r in remarks]


def once(make: Callable[[C], T]) -> Callable[[C], T]:
    """A function of a context that is computed once for each context."""
    key = f"{make.__module__}.{make.__qualname__}"

    @wraps(make)
    def recall(context: C) -> T:
        if key not in context.memo:
            context.memo[key] = make(context)
        known: T = context.memo[key]
        return known

    return recall


@record
class Context(Generic[M_co]):
    """A machine, and what there is beside it: measurements, the baseline, a fit to all of them with its options; `soft` is where a fit of
    everything free ended that serves no more than to look at rows."""

    model: M_co
    data: DataSet | None = None
    base: Baseline | None = None
    fit: Fit | None = None
    options: Options | None = None
    watch: Watch | None = field(default=None, compare=False)
    soft: Baseline | None = None
    memo: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)  # what `once` has computed

    @property
    def improvement(self) -> bool:
        """Whether unseen measurements prove a gain: not known before there is a proof."""
        return False

    @property
    def silent(self) -> tuple[str, ...]:
        """Checks that mean nothing here."""
        return ()

    @property
    def need_data(self) -> DataSet:
        """The data, where there must be some."""
        assert self.data is not None
        return self.data

    @property
    def need_baseline(self) -> Baseline:
        """The baseline, where there must be one."""
        assert self.base is not None
        return self.base

    @property
    def chosen(self) -> Options:
        """The options that were used, where there must be some."""
        assert self.options is not None
        return self.options

    @property
    def need_fit(self) -> Fit:
        """The fit, where there must be one."""
        assert self.fit is not None
        return self.fit

    @cached_property
    def residuals(self) -> list[Residuals]:
        """What the fit leaves of every term, (m, d)."""
        return self.need_fit.problem.residuals(self.need_fit.solution.x)

    @property
    @once
    def jacobian(self) -> Linear:
        """The whitened rows of the fit at its solution, and their Jacobian."""
        return self.need_fit.problem.linearize(self.need_fit.solution.x)

    @cached_property
    def leverage(self) -> StudentisedResiduals:
        """How far every row is from the fit without it, and its leverage."""
        from robocal.diagnose.studentised import far_from

        data = self.need_data
        return far_from(data, self.need_fit.problem, self.need_fit.solution.x, np.arange(len(data.configurations)))

    @cached_property
    def places(self) -> NDArray[np.int64]:
        """A number for every configuration, equal where the machine stood at the same place."""
        from robocal.fit.repeats import places

        return places(self.need_data.configurations)

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters: of the fit, else of the baseline."""
        if self.fit is not None:
            names, x = self.fit.problem.table.names, self.fit.solution.x
        else:
            names, x = self.need_baseline.problem.table.names, self.need_baseline.x
        return dict(zip(names, map(float, x[0]), strict=False))

    @property
    def numbers(self) -> tuple[int, int]:
        """How many numbers were measured, and how many parameters are looked for."""
        if self.fit is not None:
            return int(self.fit.problem.numbers.sum()), self.fit.problem.n
        free = 0 if self.base is None else len(self.base.problem.table.free)
        return sum(o.value.size for o in self.need_data.observations), free


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


@record
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


_KNOWN: dict[tuple[str, str], Check] = {}  # by module and name


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
        if _KNOWN.setdefault((function.__module__, name), one) is not one:
            raise ValueError(f"the check {name} is registered twice")
        return one

    return register


def check_fit_twice(
    doubt: tuple[str, int], refuse: tuple[str, int], machines: Machines = Machines.ANY
) -> Callable[[Callable[[C], list[Finding]]], Callable[[C], list[Finding]]]:
    """Registers a function that looks at a fit as two checks, each with a name and an order, and hands it back.

    Its doubts stand beside the verdict. What it refuses belongs to the proof: no gain counts before that is put right.
    """

    def register(find: Callable[[C], list[Finding]]) -> Callable[[C], list[Finding]]:
        def of_level(level: Level) -> Callable[[C], list[Finding]]:
            return wraps(find)(lambda context: [f for f in find(context) if f.level is level])

        for level, when, (name, order) in ((Level.DOUBT, When.FIT, doubt), (Level.REFUSE, When.PROOF, refuse)):
            check(name, when, order=order, machines=machines, needs=("fit",))(of_level(level))
        return find

    return register


@cache
def checks(package: str) -> tuple[Check, ...]:
    """All checks of the modules of a package, in the order of time."""
    for module in iter_modules(import_module(package).__path__, f"{package}."):
        if not module.ispkg:
            import_module(module.name)
    mine = (c for (module, _), c in _KNOWN.items() if module.rpartition(".")[0] == package)
    return tuple(sorted(mine, key=lambda c: (c.when, c.order)))


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

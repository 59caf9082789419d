"""CPU time of tests by file, with that of the commands they start: `python scripts/suite_cpu.py [-n auto] [-m "not slow"] [tests/...]`.

What stands behind is handed to pytest. A file's time is that of setting up, calling and taking down its tests, in all workers; what
remains of a run is imports, collection and compilation before the first test. SUITE_CPU_MOST=60 prints more than 40 of each.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterator

import pytest

NAME = "cpu"


def spent() -> float:
    """Of this process and of its children that have ended, s."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Measures what fixtures cost."""
    return (yield from measured(item))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Measures the test."""
    return (yield from measured(item))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Measures what comes after it."""
    return (yield from measured(item))


def measured(item: pytest.Item) -> Iterator[None]:
    """Notes the time of a step in the test's report, which workers send."""
    began = spent()
    try:
        return (yield)
    finally:
        item.user_properties.append((NAME, spent() - began))


FILES: Counter[str] = Counter()
TESTS: Counter[str] = Counter()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """The last of three reports of a test has the time of all."""
    if report.when == "teardown":
        cpu = sum(float(v) for n, v in report.user_properties if n == NAME)
        FILES[report.nodeid.partition("::")[0]] += cpu
        TESTS[report.nodeid] += cpu


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """The dearest, and the sum."""
    most = int(os.environ.get("SUITE_CPU_MOST", "40"))
    for title, every in (("files", FILES), ("tests", TESTS)):
        terminalreporter.section(f"CPU of {title}: {every.total():.1f} s")
        for name, seconds in every.most_common(most):
            terminalreporter.write_line(f"{seconds:8.2f} s  {name}")


if __name__ == "__main__":
    sys.exit(pytest.main(["-q", "-p", "suite_cpu", *sys.argv[1:]]))

"""What every test may use: a seeded generator, the shared measurement data, and how hypothesis searches."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import numpy as np
import pytest

# A kernel that compiles at its first call would break any deadline. "explore" looks further, and elsewhere each time.
hypothesis.settings.register_profile("ci", derandomize=True, deadline=None)
hypothesis.settings.register_profile("explore", deadline=None, max_examples=1000)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))

# A suite that was started in the background of a script has Ctrl-C ignored, and so has every child: tests of stopping would
# test nothing. With a handler here, children start as from a terminal.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Ten thousand tests live to the end: the search for garbage leaves them out, and comes seldom after that."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test that is `sampled(k)`, k cases spread over all of them are quick; the others are slow."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("sampled"):
            cases.setdefault(item.nodeid.split("[")[0], []).append(item)
    for own in cases.values():
        count = own[0].get_closest_marker("sampled").args[0]  # type: ignore[union-attr]
        quick = {round((i + 0.5) * len(own) / count - 0.5) for i in range(count)}
        for i, item in enumerate(own):
            if i not in quick:
                item.add_marker(pytest.mark.slow)


PROJECT = Path(__file__).resolve().parent.parent


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240229)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real measurements that lies beside the project and is not part of it."""
    folder = PROJECT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("needs the measurement data in ../shared/data beside the project, which is not there")
    return folder

"""Shared by all tests."""

from __future__ import annotations

import gc
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Two test workers on two cores: more threads than one each only get in each other's way. Said before torch is imported,
# which reads it then: in one process without workers the tests had as many threads as cores.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from tiny_dataset import change, dataset
from warm_start import WarmStart

__all__ = ["change", "dataset"]

# Time is no proof: on a slow or busy processor examples take longer than Hypothesis allows them by default.
settings.register_profile("any_processor", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any_processor")

pytest_plugins = ["cpu_times"]

TESTS = Path(__file__).resolve().parent

#: In memory what tests write is brought to the disk at once: of `tests/store`, half of the time was waiting for that.
#: What a run leaves is there until the next one begins; the 64 MB that containers have there are too few.
MEMORY, ENOUGH = Path("/dev/shm"), 2 << 30
if os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > ENOUGH:
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))


@pytest.fixture(scope="session")
def child_environment() -> dict[str, str]:
    """Environment of a process that imports rgspipe and the helpers beside the tests, from any folder."""
    paths = [str(TESTS.parent / "src"), str(TESTS)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


@pytest.fixture(scope="session")
def warm_start(child_environment: dict[str, str]) -> Iterator[WarmStart]:
    """Starts commands that need not import anything any more, one at a time."""
    with WarmStart(child_environment) as place:
        yield place


def pytest_collection_finish() -> None:
    """What was imported and collected stays: each collection of garbage would look at all of it."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests first, so that no worker is left with one of minutes when the others are done.

    Tests of a file stay together: what they share is made once (`make test` gives workers whole files).
    """
    slow = {item.path for item in items if item.get_closest_marker("slow") is not None}
    items.sort(key=lambda item: item.path not in slow)

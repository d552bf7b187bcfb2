"""Shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tiny_dataset import change, dataset

__all__ = ["change", "dataset"]

# Two test workers on two cores: more threads than one each only get in each other's way.
os.environ.setdefault("OMP_NUM_THREADS", "1")

TESTS = Path(__file__).resolve().parent


@pytest.fixture(scope="session")
def child_environment() -> dict[str, str]:
    """Environment of a process that imports rgspipe and the helpers beside the tests, from any folder."""
    paths = [str(TESTS.parent / "src"), str(TESTS)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests first, so that no worker is left with one of minutes when the others are done."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)

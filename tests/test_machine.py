"""What a result says of the memory that it took."""

from __future__ import annotations

import resource
import subprocess
import sys

import numpy as np
import pytest

from rgspipe.machine import PeakMemory

MIB = 2**20


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not tell the peak since a moment")
def test_peak_memory_is_of_the_work_since_and_not_of_earlier_work() -> None:
    earlier = PeakMemory()
    before = earlier.mib()
    np.ones(300 * MIB, np.uint8).sum()
    assert earlier.mib() - before > 290
    later = PeakMemory()
    # The 300 MiB are gone; measured 0 more than before.
    assert later.mib() - before < 50
    np.ones(100 * MIB, np.uint8).sum()
    assert 90 < later.mib() - before < 150


def test_peak_memory_counts_children_that_end_meanwhile() -> None:
    memory = PeakMemory()
    before = memory.mib()
    # Of children the system tells only the largest ever: it has to be larger than any of earlier tests.
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024
    size = (max(before, largest) + 200) * MIB
    subprocess.run([sys.executable, "-c", f"b'x' * {size}"], check=True)
    assert memory.mib() - before > 190
    # A child of earlier work does not count.
    assert PeakMemory().mib() - before < 100

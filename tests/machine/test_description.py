"""What a result says of the memory that it took.

Each test measures in an interpreter of its own: in the one that runs all tests, memory of earlier ones may be given
back at any moment and hide what is taken.
"""

from __future__ import annotations

import subprocess
import sys

import pytest


def measured(work: str) -> list[int]:
    """What a fresh interpreter prints, in which `work` has run: whole numbers [MiB]."""
    imports = "import subprocess, sys\nimport numpy as np\nfrom rgspipe.machine.description import PeakMemory"
    code = f"{imports}\nMIB = 2**20\n{work}"
    printed = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    return [int(number) for number in printed.split()]


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not tell the peak since a moment")
def test_peak_memory_is_of_the_work_since_and_not_of_earlier_work() -> None:
    large, gone, small = measured(
        """
memory = PeakMemory()
before = memory.mib()
np.ones(300 * MIB, np.uint8).sum()
print(memory.mib() - before)
later = PeakMemory()
print(later.mib() - before)
np.ones(100 * MIB, np.uint8).sum()
print(later.mib() - before)
"""
    )
    # Measured 300, 0 and 100.
    assert 290 < large < 350
    assert gone < 50
    assert 90 < small < 150


def test_peak_memory_counts_children_that_end_meanwhile() -> None:
    while_it_ended, afterwards = measured(
        """
memory = PeakMemory()
before = memory.mib()
subprocess.run([sys.executable, "-c", f"b'x' * {(before + 200) * MIB}"], check=True)
print(memory.mib() - before)
print(PeakMemory().mib() - before)
"""
    )
    # Measured 208 and 0: a child of earlier work does not count.
    assert 190 < while_it_ended < 260
    assert afterwards < 50

"""What `make soak` measures with."""

from __future__ import annotations

import os
import subprocess
import sys

from soak import GROWN, descendants, growth, resident


def test_memory_that_rises_with_every_job_is_told_from_memory_that_does_not() -> None:
    begun = [100, 300, 500]  # while workers begin
    assert growth([*begun, *[500] * 6]) == 1.0
    assert growth([*begun, *range(500, 1100, 100)]) > GROWN


def test_memory_of_processes_that_a_process_has_started() -> None:
    program = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'print(0, flush=True); input()'])"
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline() == b"0\n"
        (child,) = descendants(process.pid)
        assert resident(child) > 2**20 and process.pid in descendants(os.getpid())
        process.communicate(b"\n")
    assert resident(process.pid) == 0 and not list(descendants(process.pid))

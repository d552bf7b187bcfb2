"""What `make soak` measures with."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from soak import GROWN, growth, processes, resident


def test_memory_that_rises_with_every_job_is_told_from_memory_that_does_not() -> None:
    begun = [100, 300, 500]  # while workers begin
    assert growth([*begun, *[500] * 6]) == 1.0
    assert growth([*begun, *range(500, 1100, 100)]) > GROWN


def test_memory_of_the_processes_that_run_in_a_folder(tmp_path: Path) -> None:
    program = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'print(0, flush=True); input()'])"
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline() == b"0\n"
        first, second = processes(tmp_path.resolve())
        assert process.pid in (first, second) and min(resident(first), resident(second)) > 2**20
        process.communicate(b"\n")
    assert resident(process.pid) == 0 and not processes(tmp_path.resolve())

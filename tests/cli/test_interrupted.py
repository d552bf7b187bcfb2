"""Ctrl-C: every run that was going on has stopped, not failed, and was not killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import pytest
from joblib import cpu_count

from rgspipe.store.status import read_statuses

#: Exit status of what was stopped with Ctrl-C.
INTERRUPTED = 130

TOYS = [sys.executable, "-m", "toys"]

PIPELINE = """
import sys
from rgspipe.cli import main, sequence
sequence.run_sequence.__defaults__ = ([sys.executable, "-m", "toys"],)
sys.exit(main(["pipeline=mine.yaml"]))
"""

COMMANDS = {
    "run": [*TOYS, "stage=crunch"],
    "sweep": [*TOYS, "-m", "stage=crunch", "seed=1,2"],
    "pipeline": [sys.executable, "-c", PIPELINE],
}


@pytest.mark.parametrize("what", COMMANDS)
def test_ctrl_c_is_written_down(tmp_path: Path, child_environment: Mapping[str, str], what: str) -> None:
    """A terminal tells it to every process at once; a step that is in native code hears it more than a second later."""
    (tmp_path / "mine.yaml").write_text("steps: [{stage: crunch}]")
    process = subprocess.Popen(
        COMMANDS[what], cwd=tmp_path, env=child_environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, start_new_session=True, preexec_fn=partial(signal.signal, signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    deadline = time.monotonic() + 60
    # A process that still imports has no word of its own for Ctrl-C.
    working = min(2, cpu_count()) if what == "sweep" else 1
    while len(list(tmp_path.glob("outputs/cornell/crunch/.partial-*/begun.txt"))) < working:
        assert process.poll() is None and time.monotonic() < deadline, process.stdout.read()
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == INTERRUPTED and "Interrupted" in output and "Traceback" not in output, output
    assert {status["state"] for _, status in read_statuses(tmp_path / "outputs" / "runs")} == {"stopped"}

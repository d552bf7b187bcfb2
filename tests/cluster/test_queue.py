"""What is understood of Slurm's answers."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from rgspipe.cluster import queue
from rgspipe.cluster.queue import JobState, job_states, parse_queue, require_slurm
from rgspipe.errors import InputError


def install(folder: Path, name: str, script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a command in front of the path."""
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=":")


def test_jobs_and_arrays_are_read_with_why_they_wait() -> None:
    text = "7|RUNNING|None\n12_3|PENDING|ReqNodeNotAvail, UnavailableNodes:a|b\n\nslurm: a remark\n"
    assert parse_queue(text) == {
        "7": JobState("RUNNING", "None"),
        "12_3": JobState("PENDING", "ReqNodeNotAvail, UnavailableNodes:a|b"),
    }


@pytest.mark.parametrize("state", ["PENDING", "RUNNING", "COMPLETING", "REQUEUED", "SUSPENDED"])
def test_a_job_that_may_still_end_well_is_alive(state: str) -> None:
    assert JobState(state).alive


@pytest.mark.parametrize("state", ["COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL", "OUT_OF_MEMORY"])
def test_a_job_that_has_ended_is_not(state: str) -> None:
    assert not JobState(state).alive


def test_a_job_that_slurm_has_forgotten_has_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, "squeue", "echo '5_0|RUNNING|None'", monkeypatch)
    states = job_states(["5_0", "5_1"])
    assert states is not None
    assert states["5_0"].alive and not states["5_1"].alive


def test_no_answer_is_not_taken_for_the_end_of_all_jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(
        tmp_path, "squeue", "echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1", monkeypatch
    )
    assert job_states(["5_0"]) is None

    def late(*arguments: object, **options: object) -> None:
        raise subprocess.TimeoutExpired("squeue", 1)

    monkeypatch.setattr(queue.subprocess, "run", late)
    assert job_states(["5_0"]) is None


def test_without_slurm_a_sweep_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"no sbatch, srun, squeue, scancel.*launcher=joblib"):
        require_slurm()

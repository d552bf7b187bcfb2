"""Waiting for the jobs of a sweep and saying how they ended, with Slurm's answers written down."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from rgspipe.cluster import sweep
from rgspipe.cluster.queue import JobState
from rgspipe.store.status import RunStatus

RUNNING, WAITING, DONE = JobState("RUNNING"), JobState("PENDING", "Priority"), JobState("COMPLETED")


@dataclass(frozen=True)
class PlainJob:
    """What is asked of a job when it has ended."""

    folder: Path
    number: int = 4
    overrides: Sequence[str] = ("stage=freeze", "seed=1")


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> list[Mapping[str, JobState] | None]:
    """Slurm's answers, to be filled in, the last of them first."""
    given: list[Mapping[str, JobState] | None] = []
    monkeypatch.setattr(sweep, "job_states", lambda ids: given.pop())
    return given


def test_a_job_ends_once_slurm_says_so_also_after_it_was_queued_again(answers: list) -> None:
    answers += reversed(
        [
            {"1": RUNNING, "2": WAITING},
            None,
            {"1": JobState("REQUEUED"), "2": DONE},
            {"1": WAITING},
            {"1": RUNNING},
            {"1": DONE},
        ]
    )
    assert list(sweep._ends(["1", "2"], 0.0)) == [("2", DONE), ("1", DONE)]
    assert answers == []


def test_progress_says_why_jobs_wait() -> None:
    states = {"1": RUNNING, "2": WAITING, "3": WAITING}
    assert sweep._progress(5, ["1", "2", "3"], states) == "Slurm: 2 of 5 jobs ended, 1 running, 2 waiting (Priority)"


def test_a_failed_job_is_told_in_its_own_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    RunStatus.start(tmp_path, "freeze", []).failed(RuntimeError("no room"), 1)
    sweep._conclude(PlainJob(tmp_path), "9_4", DONE)
    assert capsys.readouterr().err == "Job 4 failed: no room\n"


@pytest.mark.parametrize("started", [True, False])
def test_a_job_that_slurm_ended_gets_a_status_that_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], started: bool
) -> None:
    folder = tmp_path / "4"
    if started:
        RunStatus.start(folder, "freeze", ["stage=freeze", "seed=1"])
    sweep._conclude(PlainJob(folder), "9_4", JobState("OUT_OF_MEMORY"))
    assert "Job 4 killed: Slurm ended job 9_4: OUT_OF_MEMORY." in capsys.readouterr().err
    status = json.loads((folder / "status.json").read_text())
    assert (status["state"], status["exit_code"]) == ("killed", 1)
    assert status["overrides"] == ["stage=freeze", "seed=1"] and "OUT_OF_MEMORY" in status["error"]


def test_a_done_job_says_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    RunStatus.start(tmp_path, "freeze", []).done(Path("outputs/x"))
    sweep._conclude(PlainJob(tmp_path), "9_4", DONE)
    assert capsys.readouterr().err == ""


def test_a_status_file_may_come_late_over_the_network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    status = RunStatus.start(tmp_path, "freeze", [])
    monkeypatch.setattr(sweep.time, "sleep", lambda seconds: status.done(Path("outputs/x")))
    found = sweep._settled_status(tmp_path, 5.0)
    assert found is not None and found["state"] == "done"

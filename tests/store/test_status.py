"""Status files: running, done, failed, killed."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rgspipe.store.status import RunStatus, process_start, read_status, read_statuses


def status_text(**changes: object) -> str:
    """A status file of a run of this process, with some values changed."""
    values = {"state": "running", "stage": "freeze", "overrides": [], "pid": 1, "process_start": "?"}
    return json.dumps(values | changes)


def test_a_status_file_of_these_values_alone_is_believed(tmp_path: Path) -> None:
    (tmp_path / "status.json").write_text(status_text(state="done", result="x", seconds=1, exit_code=0))
    assert read_status(tmp_path)["state"] == "done"


def test_a_run_is_running_then_done(tmp_path: Path) -> None:
    status = RunStatus.start(tmp_path / "run", "freeze", ["stage=freeze", "seed=1"])
    values = read_status(tmp_path / "run")
    assert (values["state"], values["pid"]) == ("running", os.getpid())
    assert values["command"] == "python -m rgspipe stage=freeze seed=1"
    quoted = RunStatus.start(tmp_path / "quoted", "freeze", ["views.indices=[0,1]"]).values["command"]
    assert quoted == "python -m rgspipe 'views.indices=[0,1]'"  # a shell would take it for names of files
    status.done(Path("outputs/x"))
    values = read_status(tmp_path / "run")
    assert (values["state"], values["result"], values["exit_code"]) == ("done", "outputs/x", 0)
    assert values["seconds"] >= 0 and values["ended"] >= values["started"]


def test_a_failure_keeps_its_traceback(tmp_path: Path) -> None:
    status = RunStatus.start(tmp_path, "freeze", [])
    try:
        raise RuntimeError("no luck")
    except RuntimeError as error:
        status.failed(error, 1)
    values = read_status(tmp_path)
    assert values["state"] == "failed"
    assert values["error"] == "no luck"
    assert "test_status.py" in values["traceback"]


def test_a_run_whose_process_is_gone_was_killed(tmp_path: Path, child_environment: dict[str, str]) -> None:
    code = "import sys, time, pathlib; from rgspipe.store.status import RunStatus; "
    code += "RunStatus.start(pathlib.Path(sys.argv[1]), 'freeze', []); time.sleep(60)"
    process = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], env=child_environment)
    while read_status(tmp_path) is None:
        time.sleep(0.01)
    assert read_status(tmp_path)["state"] == "running"
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert read_status(tmp_path)["state"] == "killed"


def test_a_process_id_that_is_used_again_does_not_deceive(tmp_path: Path) -> None:
    status = RunStatus.start(tmp_path, "freeze", [])
    status.values["process_start"] = "another boot:1"
    status._write()
    assert read_status(tmp_path)["state"] == "killed"
    assert process_start(os.getpid()) == process_start(os.getpid())


def test_jobs_are_listed_in_their_order(tmp_path: Path) -> None:
    for number in (10, 9, 1):
        RunStatus.start(tmp_path / "sweep" / str(number), "freeze", [])
    assert [folder.name for folder, _ in read_statuses(tmp_path)] == ["1", "9", "10"]
    assert read_status(tmp_path) is None
    RunStatus.start(tmp_path / "sweep" / "²", "freeze", [])
    assert len(read_statuses(tmp_path)) == 4


def test_a_run_on_another_machine_is_believed(tmp_path: Path) -> None:
    status = RunStatus.start(tmp_path, "freeze", [])
    status.values |= {"host": "node7", "process_start": "another boot:1"}
    status._write()
    assert read_status(tmp_path)["state"] == "running"


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[1]",
        '{"state": "done"}',
        "[" * 100_000,
        status_text(pid="4"),
        status_text(pid=True),
        status_text(pid=None),
        status_text(process_start=7),
        status_text(overrides="seed=1"),
        status_text(overrides=["seed=1", 2]),
        status_text(stage=None),
        status_text(state=["done"]),
        status_text(state="dune"),
        status_text(host=5),
        status_text(state="done"),
        status_text(state="done", result=3),
        status_text(state="done", result="x", seconds="long"),
        status_text(state="failed", exit_code="1"),
        '{"state": "running", "stage": "freeze", "overrides": []}',
    ],
)
def test_a_damaged_status_file_does_not_hide_the_others(tmp_path: Path, content: str) -> None:
    for name in ("1", "2"):
        RunStatus.start(tmp_path / name, "freeze", []).done(Path("outputs/x"))
    (tmp_path / "1/status.json").write_text(content)
    assert [status["state"] for _, status in read_statuses(tmp_path)] == ["damaged", "done"]


def test_a_run_that_its_user_stopped_has_not_failed(tmp_path: Path) -> None:
    RunStatus.start(tmp_path, "freeze", []).stopped(130)
    values = read_status(tmp_path)
    assert (values["state"], values["exit_code"]) == ("stopped", 130) and "traceback" not in values


def test_a_status_that_cannot_be_written_hides_not_what_became_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    status = RunStatus.start(tmp_path, "freeze", [])

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    status.failed(RuntimeError("no luck"), 1)
    assert [str(tmp_path / "status.json") in record.message for record in caplog.records] == [True]

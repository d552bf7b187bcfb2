"""Where runs keep their status: a folder that cannot be had is told before anything starts."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import pytest

from rgspipe.cli import main
from rgspipe.cli.jobs import new_run_folder, run_jobs
from rgspipe.errors import InputError
from rgspipe.stages import load_stage


def test_two_runs_of_one_second_have_a_folder_each(tmp_path: Path) -> None:
    first, second = (new_run_folder(tmp_path, "freeze") for _ in range(2))
    assert first != second and first.is_dir() and second.is_dir()


@pytest.mark.parametrize("place", ["file", "file/below", "dangling"])
def test_outputs_that_are_no_folder_are_refused(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "dangling").symlink_to(tmp_path / "file" / "nothing")
    with pytest.raises(InputError) as refused:
        new_run_folder(tmp_path / place, "freeze")
    assert refused.value.where == "outputs" and str(tmp_path) in refused.value.found
    assert (tmp_path / "file").read_text() == "mine"


def test_a_full_disk_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(InputError, match="No space left"):
        new_run_folder(tmp_path, "freeze")


def test_a_given_folder_that_cannot_be_made_is_refused() -> None:
    with pytest.raises(InputError, match=r"hydra\.run\.dir"):
        run_jobs(["stage=freeze", "hydra.run.dir=/dev/null/x"], load_stage, multirun=False)


def test_no_job_at_once_is_refused() -> None:
    with pytest.raises(InputError, match=r"n_jobs"):
        run_jobs(["stage=freeze", "seed=1,2", "hydra.launcher.n_jobs=0"], load_stage, multirun=True)


@pytest.mark.parametrize("word", ["launcher=null", "+launcher=17"])
def test_a_launcher_that_is_no_name_is_refused(word: str) -> None:
    """Whether runs leave the machine, and which keys there are, is asked before anything is composed."""
    with pytest.raises(InputError, match="launcher=NAME"):
        run_jobs(["stage=freeze", word], load_stage, multirun=False)


@pytest.mark.parametrize("words", [["stage=freeze"], ["-m", "stage=freeze", "seed=1,2"], ["status"], ["demo"]])
def test_a_working_folder_that_was_removed_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert main(words) == 2 and "working folder: expected one that is there" in capsys.readouterr().err

"""What is said at the end of a run or a sweep: how jobs ended, and what usually comes next."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from rgspipe.cli import main
from rgspipe.store.status import read_statuses


def _said(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    assert main(["stage=overview", *arguments]) == 0
    return [line for line in capsys.readouterr().out.splitlines() if line.startswith("Next")]


def test_a_plain_run_leads_on_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    [line] = _said(capsys)
    words, _, path = line.partition(": ")
    assert words == "Next, open in a browser" and Path(path).name == "overview.html" and Path(path).is_file()
    assert _said(capsys) == [line]  # also where all is there already


def test_a_sweep_leads_on_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    [line] = _said(capsys, "-m", "launcher=basic", "seed=1,2")
    words, _, path = line.partition(": ")
    assert words == "Next, of job 1, open in a browser" and Path(path).is_file()


def test_a_sweep_with_a_failed_job_leads_nowhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "note").touch()
    assert main(["-m", "stage=overview", "launcher=basic", "outputs=here,note"]) != 0
    assert "Next" not in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [["hydra.run.dir=here"], ["-m", "launcher=basic", "seed=1,2", "hydra.sweep.dir=here"]],
    ids=["a step", "a sweep"],
)
def test_parts_of_something_larger_do_not(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert _said(capsys, *arguments) == []


@pytest.mark.slow
def test_jobs_that_never_began_are_told(
    tmp_path: Path, child_environment: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    """The process of a job ends, and others with it: they had no status, so that all jobs seemed to be told of."""
    words = ["-m", "stage=break", "seed=0,3,4,5", "hydra.launcher.n_jobs=2", "outputs=here"]
    ended = subprocess.run([sys.executable, "-m", "toys", *words], cwd=tmp_path, env=child_environment, check=False)
    assert ended.returncode == 1
    [sweep] = (tmp_path / "here/runs").iterdir()
    states = [status["state"] for _, status in read_statuses(sweep)]
    assert len(states) == 4 and set(states) <= {"done", "killed"} and "killed" in states
    said = capfd.readouterr().out
    assert f"{states.count('done')} of 4 jobs done" in said
    assert len((sweep / "table.csv").read_text().splitlines()) == 5


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["hydra.launcher.n_jobs=2", f"scene.name={'a' * 40},b"], {"job 0: ", "scene.name=b: "}),
        (["hydra.launcher.n_jobs=1", "views.count=1,2"], {""}),
        (["launcher=basic", "views.count=1,2"], {""}),
    ],
    ids=["two at once", "one at once", "one by one"],
)
def test_progress_of_jobs_side_by_side_says_whose_it_is(
    arguments: list[str], names: set[str], tmp_path: Path, child_environment: dict[str, str]
) -> None:
    """It could not be told apart."""
    command = [sys.executable, "-m", "toys", "-m", "stage=grow", "outputs=here", *arguments]
    subprocess.run(command, cwd=tmp_path, env=child_environment, check=True, capture_output=True)
    made = [status for path in (tmp_path / "here/runs").iterdir() for _, status in read_statuses(path)]
    manifests = [json.loads((tmp_path / status["result"] / "manifest.json").read_text()) for status in made]
    assert {manifest["facts"]["progress"] for manifest in manifests} == {f"{name}adding" for name in names}

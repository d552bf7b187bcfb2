"""The line at the end of a run that says what usually comes next."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.cli import main


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

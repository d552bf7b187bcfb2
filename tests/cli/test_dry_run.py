"""`--dry-run` shows what a run would make, and makes nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.cli import main
from rgspipe.stages import load_stage as real_stage
from toys import load


def test_the_plan_of_a_run_is_shown_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["stage=grow", "--dry-run"], load) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("Plan for ") and all("  make  " in line for line in said[1:])
    assert list(tmp_path.iterdir()) == []


def test_a_page_shows_the_plan_of_its_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--dry-run", "stage=view", f"outputs={tmp_path}"], real_stage) == 0
    assert "\n  freeze  " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["-m", "seed=1,2"], "a single run, found -m"),
        (["pipeline=reproduce"], "a single run, found pipeline=reproduce"),
        (["stage=trian"], "stage=train_surfels"),
        (["sed=1", "stage=freeze"], "seed"),
    ],
)
def test_what_is_no_single_run_is_refused(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*words, "--dry-run"], real_stage) == 2
    assert told in " ".join(capsys.readouterr().err.split())


def test_another_spelling_suggests_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stage=freeze", "--dryrun"]) == 2
    assert "Did you mean --dry-run?" in " ".join(capsys.readouterr().err.split())

"""`rgspipe outputs` says what results take, and removes them only where that is asked for twice."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from filelock import FileLock

import toys
from rgspipe.cli import main
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.graph.pipeline import run
from rgspipe.store.retention import removing
from rgspipe.store.status import process_start


def harvest(outputs: Path, resolution: int) -> None:
    changes = {"stage": "harvest", "outputs": str(outputs), "dataset.resolution": resolution, "report.views": [1]}
    run(with_changes(RgspipeConfig(), changes), toys.load)


@pytest.fixture
def outputs(tmp_path: Path) -> Path:
    """What two runs of three stages made; no link leads to what the first did."""
    harvest(tmp_path, 9)
    harvest(tmp_path, 8)
    return tmp_path


def test_results_are_listed_by_scene_and_stage(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["outputs", f"outputs={outputs}"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0].split() == ["scene", "stage", "folders", "size", "newest"]
    assert {tuple(line.split()[:3]) for line in told[1:4]} == {
        ("cornell", name, "2") for name in ("sow", "grow", "harvest")
    }
    assert told[4].endswith(f"MB in {outputs}")


def test_results_of_a_stage_are_listed_one_by_one(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["outputs", "--list", f"outputs={outputs}", "stage=grow"]) == 0
    _, *told, _ = capsys.readouterr().out.splitlines()
    assert {line.split()[0] for line in told} == {
        f"cornell/grow/{one.name}" for one in outputs.glob("cornell/grow/[0-9a-f]*")
    }
    assert sum(line.endswith("latest") for line in told) == 1
    assert all("MB" in line and "h ago" in line for line in told)


@pytest.mark.parametrize("command", [["outputs"], ["outputs", "prune", "remove=true"], ["status"], ["verify"]])
def test_a_folder_without_a_name_is_not_the_one_that_one_is_in(
    command: list[str], outputs: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Mostly a variable of the shell that is not set: outputs=$RESULTS.
    monkeypatch.chdir(outputs)
    assert main([*command, "outputs="]) == 2
    assert "expected a path, found no text" in " ".join(capsys.readouterr().err.split())


def test_what_a_killed_removal_left_goes_whatever_is_chosen_next(outputs: Path) -> None:
    left = outputs / "cornell" / "fit_light" / f".gone-{16 * 'a'}"
    left.mkdir(parents=True)
    assert main(["outputs", "prune", f"outputs={outputs}", "stage=fit_light"]) == 2
    assert left.exists()
    assert main(["outputs", "prune", f"outputs={outputs}", "stage=fit_light", "remove=true"]) == 2
    assert not left.exists()


def test_before_the_first_run_there_is_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["outputs"]) == 0 and capsys.readouterr().out == "No results in outputs.\n"
    assert main(["outputs", "outputs=nowhere"]) == 2


def test_nothing_is_said_to_be_in_a_folder_of_something_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A manifest that is missed would be no reason to advise somebody to remove a folder of letters."""
    (tmp_path / "letters" / "mother" / "2020").mkdir(parents=True)
    for words in (["outputs"], ["outputs", "prune", "remove=true"]):
        assert main([*words, f"outputs={tmp_path}"]) == 0
    assert capsys.readouterr().out.startswith(f"No results in {tmp_path}.")
    assert (tmp_path / "letters" / "mother" / "2020").exists()


def test_nothing_goes_without_being_told_to(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["outputs", "prune", f"outputs={outputs}"]) == 0
    assert "say remove=true to do it: 3 of 6 folders" in capsys.readouterr().out
    assert main(["outputs", "prune", f"outputs={outputs}", "remove=true"]) == 0
    assert "Removed 3 of 6 folders" in capsys.readouterr().out
    assert main(["outputs", "prune", f"outputs={outputs}", "remove=true"]) == 0
    assert "Nothing to remove" in capsys.readouterr().out
    assert main(["verify", f"outputs={outputs}"]) == 0
    assert capsys.readouterr().out.startswith("3 of 3")


def test_nothing_goes_while_a_run_may_need_it(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = outputs / "runs" / "now"
    folder.mkdir(parents=True)
    values = {"state": "running", "stage": "grow", "overrides": [], "command": "", "pid": os.getpid()}
    values |= {"process_start": process_start(os.getpid()), "started": "2026-01-01T00:00:00+00:00"}
    (folder / "status.json").write_text(json.dumps(values))
    assert main(["outputs", "prune", f"outputs={outputs}", "remove=true"]) == 2
    assert "now" in capsys.readouterr().err
    assert len(list(outputs.glob("cornell/*/[0-9a-f]*"))) == 6


def test_nothing_goes_while_something_is_made_by_whomever(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with FileLock(outputs / "cornell" / "harvest" / f".lock-{16 * 'a'}"):
        assert main(["outputs", "prune", f"outputs={outputs}"]) == 0
        told = capsys.readouterr().out.splitlines()[-1]
        assert told.startswith("That is refused for now: ") and 16 * "a" in told
        assert main(["outputs", "prune", f"outputs={outputs}", "remove=true"]) == 2
    assert 16 * "a" in capsys.readouterr().err
    assert len(list(outputs.glob("cornell/*/[0-9a-f]*"))) == 6


def test_what_another_prune_removes_is_not_told_as_a_run(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with removing(outputs):
        assert main(["outputs", "prune", f"outputs={outputs}"]) == 0
        assert "refused for now" in capsys.readouterr().out.splitlines()[-1]
        assert main(["outputs", "prune", f"outputs={outputs}", "remove=true"]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert "another outputs prune" in told and "process that makes" not in told and "status" not in told
    assert len(list(outputs.glob("cornell/*/[0-9a-f]*"))) == 6


@pytest.mark.parametrize(
    ("word", "found"),
    [
        ("older=3", "30d"),
        ("remove=yes", "remove=true"),
        ("spring", "prune"),
        ("outputs=/nowhere", "/nowhere"),
        ("stage=grwo", "stage=grow"),
        ("scene=x", "cornell"),
    ],
)
def test_what_cannot_be_meant_is_refused(
    outputs: Path, capsys: pytest.CaptureFixture[str], word: str, found: str
) -> None:
    assert main(["outputs", "prune", f"outputs={outputs}", word]) == 2
    assert found in capsys.readouterr().err


def test_a_list_removes_nothing(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["outputs", f"outputs={outputs}", "remove=true"]) == 2
    assert "prune" in capsys.readouterr().err

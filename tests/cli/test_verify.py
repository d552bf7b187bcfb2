"""`rgspipe verify` finds what was damaged after it was made, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import toys
from rgspipe.cli import main
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.graph.pipeline import run


@pytest.fixture
def outputs(tmp_path: Path) -> Path:
    """A store of three artifacts; one more is in the making."""
    changes = {"stage": "harvest", "outputs": str(tmp_path / "outputs"), "dataset.resolution": 8, "report.views": [1]}
    run(with_changes(RgspipeConfig(), changes), toys.load)
    (tmp_path / "outputs" / "cornell" / "grow" / ".partial-0123").mkdir()
    (tmp_path / "outputs" / "runs" / "now" / "config").mkdir(parents=True)
    return tmp_path / "outputs"


def test_what_is_whole_is_said_to_be(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", f"outputs={outputs}"]) == 0
    assert capsys.readouterr().out.startswith(f"3 of 3 artifacts in {outputs} are as they were made")


@pytest.mark.parametrize(
    ("name", "damage", "found"),
    [
        ("total.txt", lambda path: path.write_text("497\n"), "its checksum differs"),
        ("total.txt", lambda path: path.write_bytes(b""), "found 0 bytes"),
        ("total.txt", Path.unlink, "found no file"),
        ("manifest.json", lambda path: path.write_bytes(b""), "damaged JSON"),
        ("manifest.json", Path.unlink, "found no file"),
    ],
)
def test_what_is_damaged_is_named(
    outputs: Path, capsys: pytest.CaptureFixture[str], name: str, damage: Callable[[Path], object], found: str
) -> None:
    (path,) = (outputs / "cornell" / "grow").glob(f"[0-9a-f]*/{name}")
    damage(path)
    assert main(["verify", f"outputs={outputs}"]) == 2
    told = capsys.readouterr()
    assert told.out.startswith("2 of 3 artifacts")
    said = " ".join(told.err.split())
    assert str(path) in said and found in said and "Remove the folder" in said


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", f"outputs={tmp_path / 'nowhere'}"]) == 2
    assert "no such folder" in capsys.readouterr().err


def test_what_cannot_be_read_is_told_and_the_rest_is_verified(
    outputs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (path,) = (outputs / "cornell" / "grow").glob("[0-9a-f]*/manifest.json")
    path.unlink()
    path.symlink_to(path.name)  # a link to itself: also root cannot read it
    assert main(["verify", f"outputs={outputs}"]) == 2
    told = capsys.readouterr()
    assert told.out.startswith("2 of 3 artifacts") and str(path) in told.err
    assert "Too many levels of symbolic links" in " ".join(told.err.split())

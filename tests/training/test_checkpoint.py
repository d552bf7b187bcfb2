"""A training goes on from the state that it kept, and from none that was damaged."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from painted_room import painted_box
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.scene import PointLight
from rgspipe.training.checkpoint import Checkpoint
from rgspipe.training.record import Record

RECORDS = [Record("materials", 1, 0.5, 30.0, 1.25), Record("geometry", 2, 0.25, math.nan, 2.5)]


def _zeroed(path: Path) -> None:
    """The last block of the file was never written: it reads as zeros, and all sizes fit."""
    content = path.read_bytes()
    path.write_bytes(content[:-4096] + bytes(4096))


def _noted_otherwise(path: Path) -> None:
    tensors, note = load_tensors(path)
    note["records"][0]["loss"] = 0.4
    save_tensors(path, tensors, note)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "emptied": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-100]),
    "zeros": _zeroed,
    "another note": _noted_otherwise,
    "no safetensors": lambda path: path.write_text("none"),
}


@pytest.fixture
def checkpoint(tmp_path: Path) -> Checkpoint:
    surfels = painted_box()
    kept = Checkpoint(tmp_path / "checkpoint.safetensors")
    light = PointLight(torch.tensor([0.1, 0.2, 0.3]), torch.ones(3))
    kept.save(surfels, torch.rand(1, len(surfels), 3), None, RECORDS, [light])
    return kept


def test_what_was_kept_comes_back(checkpoint: Checkpoint) -> None:
    again = Checkpoint(checkpoint.path)
    surfels, _, state, lights = again.load(painted_box())
    assert torch.equal(surfels.albedo, painted_box().albedo) and state is None and len(lights) == 1
    assert str(again.records) == str(RECORDS)


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_was_damaged_is_dropped_in_a_line(checkpoint: Checkpoint, damage: str, caplog) -> None:
    DAMAGES[damage](checkpoint.path)
    again = Checkpoint(checkpoint.path)
    assert again.records == [] and again.load(painted_box()) is None
    assert not checkpoint.path.exists()
    assert [str(checkpoint.path) in record.message for record in caplog.records] == [True]

"""What a file may cost is a setting: of the readers in a block, and of a run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

import rgspipe as rg
import toys
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.display_image import read_display
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.ply_table import read_vertices, write_vertices
from rgspipe.datasets.reading_limits import ReadingLimits, reading_limits, reading_within
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.graph.pipeline import run
from rgspipe.store.files import write_json

#: What writes a file of a kind, what reads it, and a limit that it is beyond.
KINDS: dict[str, tuple[Callable[[Path], object], Callable[[Path], object], dict[str, int]]] = {
    "a.png": (lambda path: Image.new("L", (8, 8)).save(path), read_display, {"pixels": 63}),
    "a.json": (lambda path: write_json(path, {"a": "b" * 100}), lambda path: read_json(path, "a"), {"text_bytes": 100}),
    "a.ply": (lambda path: write_vertices(path, {"x": np.arange(9.0)}, []), read_vertices, {"vertices": 8}),
    "a.safetensors": (lambda path: save_tensors(path, {"x": torch.zeros(99)}), load_tensors, {"bytes": 99}),
}


@pytest.mark.parametrize("name", KINDS)
def test_what_is_beyond_a_limit_is_refused_with_the_setting(tmp_path: Path, name: str) -> None:
    write, read, limits = KINDS[name]
    write(tmp_path / name)
    read(tmp_path / name)
    with reading_within(ReadingLimits(**limits)), pytest.raises(rg.InputError, match=rf"{name}.*limits\.\*"):
        read(tmp_path / name)
    read(tmp_path / name)


def test_a_run_reads_within_its_own_and_depends_on_none(tmp_path: Path) -> None:
    config = with_changes(RgspipeConfig(), {"stage": "grow", "outputs": str(tmp_path), "dataset.resolution": 8})
    for pixels in (7, 8):
        # The second run finds what the first has made.
        artifact = run(with_changes(config, {"limits.pixels": pixels}), toys.load)
        assert artifact.facts["pixels"] == 7 and reading_limits() == ReadingLimits()

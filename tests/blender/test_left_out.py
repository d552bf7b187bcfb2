"""What a .blend file holds that no surfel can be is said before its images are rendered."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rgspipe.blender.job import DatasetJob
from rgspipe.blender.models.parameters import BlendFile
from rgspipe.blender.render_dataset import render_dataset

pytestmark = pytest.mark.slow

SMALL = {"train_views": 1, "test_views": 1, "targets_per_class": 0, "resolution": 8, "samples": 1, "seed": 3}


@pytest.fixture(scope="module")
def files(in_blender: Callable[..., None], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("house")
    in_blender(folder, "save_house")
    return folder


def _said(path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    render_dataset(DatasetJob(model=BlendFile(str(path)), **SMALL), folder)
    lines = capsys.readouterr().out.splitlines()
    return [line.removeprefix(f"warning: {path}: ") for line in lines if line.startswith("warning: ")]


def test_all_that_is_left_out_is_said_with_what_it_costs(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = _said(files / "house.blend", tmp_path / "house", capsys)
    begins = [
        "light of its lamps (2 area, 1 sun) is left out",
        "light of its world is left out",
        'light of "panel" is left out: nothing glows',
        'glass of "thin", "window" is in the images, but a surfel lets no light through',
        'metal of "tap" is in the images, but surfels are diffuse',
        'fog of "smoke" is in the images, but no model has any',
        "objects without faces (volumes: 1) are in the images, but",
    ]
    assert len(said) == len(begins)
    assert all(line.startswith(begin) for line, begin in zip(said, begins, strict=True)), said


def test_a_file_of_diffuse_surfaces_needs_no_word(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _said(files / "plain.blend", tmp_path / "plain", capsys) == []

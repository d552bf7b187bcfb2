"""The training as a stage: what its result depends on, and what it says of views that were left out."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from painted_room import painted_box, painted_views
from rgspipe.config import RgspipeConfig
from rgspipe.config.train import TrainConfig
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.grade_file import load_grade
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.evaluation.grading import graded_words
from rgspipe.options import settings
from rgspipe.stages.base import StageContext
from rgspipe.stages.scene.train_surfels import NO_RESULT, STAGE


def test_a_training_can_be_resumed_with_less_memory() -> None:
    left_out = {f"train.{setting.name}" for setting in settings(TrainConfig)} - set(STAGE.keys(RgspipeConfig()))
    assert left_out == {f"train.{name}" for name in NO_RESULT}


def _trained(folder: Path, left_out: int, black: int = 0) -> StageContext:
    """A training of materials alone on views of a painted room, of which the last are left out, and some are black."""
    splits: dict[str, list[dict]] = {"train": [], "test": []}
    views = painted_views()[:8]
    for index, view in enumerate(views):
        split = "train" if index < len(views) - left_out else "test"
        lit = float(index < len(views) - black)
        write_image(folder / f"data/{split}/{index}.exr", lit * view.image.numpy())
        splits[split].append(frame_entry(f"{split}/{index}", view.camera, view.light))
    for split, entries in splits.items():
        if entries:
            write_transforms(folder / f"data/transforms_{split}.json", entries)
    start = folder / "start.safetensors"
    save_surfels(start, painted_box())
    inputs = {
        "generate_dataset": SimpleNamespace(folder=lambda: folder / "data"),
        "init_depth": SimpleNamespace(file=lambda name: start),
    }
    light = {"rounds": 2, "steps": 0, "gather_rays": 16, "patches": 40, "supersampling": 1, "photometric_rounds": 0}
    config = replace(RgspipeConfig(), train=TrainConfig(**light, unseen=False))
    (folder / "out").mkdir()
    context = StageContext(config, inputs, {}, folder / "out")
    STAGE.run(context)
    return context


def test_views_left_out_that_are_black_leave_a_grade(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # It was a raw error about JSON once the scene had been trained.
    for black, psnr in ((1, True), (2, False)):
        (tmp_path / f"{black}").mkdir()
        context = _trained(tmp_path / f"{black}", 2, black)
        grade = load_grade(context.folder / "grade.json")
        assert grade.views == 2 and (grade.psnr is not None) == psnr == (context.facts["test_psnr_mean"] is not None)
        assert ("as the views that were left out are black" in capsys.readouterr().out) == (not psnr)


@pytest.mark.parametrize("left_out", [0, 2])
def test_it_says_how_well_it_renders_what_it_was_not_trained_on(
    tmp_path: Path, left_out: int, capsys: pytest.CaptureFixture[str]
) -> None:
    context = _trained(tmp_path, left_out)
    metrics = json.loads((tmp_path / "out/metrics.json").read_text())
    said = capsys.readouterr().out
    grade = load_grade(tmp_path / "out/grade.json")
    assert graded_words(grade) in said and grade.views == (left_out or 8)
    assert grade.psnr == (pytest.approx(metrics["test_psnr_mean"]) if left_out else None)
    # Views of a painted box that is closed, by which it is trained: nothing is guessed or missing.
    assert grade.guessed == 0.0 and grade.missing < 0.005
    assert (tmp_path / "out/comparison.png").is_file() == bool(left_out)
    if not left_out:
        assert "training: no view was left out of it" in said and context.facts["test_psnr_mean"] is None
        return
    mean, worst = metrics["test_psnr_mean"], metrics["test_psnr_min"]
    assert f"training: PSNR {mean:.1f} dB on 2 views that were left out, {worst:.1f} dB in the worst (test/" in said

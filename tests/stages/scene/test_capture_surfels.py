"""Photographs under unknown lamps as a stage: what it writes, and that later stages take it like a trained scene."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from photographed_room import LAMPS, painted_room, photographs
from rgspipe.capture.options import CaptureOptions
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.grade_file import load_grade
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.datasets.location import LAMPS_TRUTH
from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.options import settings
from rgspipe.stages.base import StageContext
from rgspipe.stages.scene.capture_surfels import NO_RESULT, STAGE
from rgspipe.stages.scene.freeze import STAGE as FREEZE
from rgspipe.stages.sources import surfel_stage

UNKNOWN = {"scene.lamps": "unknown"}


def test_the_scene_comes_from_this_stage_where_lamps_are_unknown() -> None:
    config = with_changes(RgspipeConfig(), UNKNOWN)
    assert surfel_stage(config) == "capture_surfels"
    assert surfel_stage(with_changes(config, {"freeze.surfels": "truth"})) == "true_surfels"
    assert [need.stage for need in FREEZE.needs(config)] == ["capture_surfels"]
    assert [need.stage for need in FREEZE.needs(RgspipeConfig())] == ["train_surfels", "generate_dataset"]


def test_a_capture_made_with_other_memory_is_the_same_one() -> None:
    left_out = {f"lamps.{setting.name}" for setting in settings(CaptureOptions)} - set(STAGE.keys(RgspipeConfig()))
    assert left_out == {f"lamps.{name}" for name in NO_RESULT} == {"lamps.memory_mib"}


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the stage's result."""
    folder = tmp_path_factory.mktemp("capture")
    entries = []
    for index, view in enumerate(photographs(LAMPS[:1])):
        write_image(folder / f"data/train/{index}.exr", view.image.numpy(), np.ones(view.image.shape[:2]))
        entries.append(frame_entry(f"train/{index}", view.camera))
    write_transforms(folder / "data/transforms_train.json", entries)
    write_lights(folder / "data" / LAMPS_TRUTH, LAMPS[:1])
    start = folder / "start.safetensors"
    save_surfels(start, painted_room())
    inputs = {
        "generate_dataset": SimpleNamespace(folder=lambda: folder / "data"),
        "init_depth": SimpleNamespace(file=lambda name: start),
    }
    options = CaptureOptions(count=1, gather_rays=64, supersampling=2, grid=4)
    (folder / "out").mkdir()
    config = replace(with_changes(RgspipeConfig(), UNKNOWN), lamps=options)
    STAGE.run(StageContext(config, inputs, {}, folder / "out"))
    return folder / "out"


def test_it_writes_surfels_lamps_and_a_grade(out: Path) -> None:
    assert len(load_surfels(out / "surfels.safetensors")) >= len(painted_room())
    assert len(read_lights(out / "lamps.json")) == 1
    assert load_grade(out / "grade.json").psnr is None
    assert not (out / "comparison.png").exists()


def test_it_says_how_far_lamps_are_from_those_that_are_known_to_have_been_on(out: Path) -> None:
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["truth"]["lamps"] == 1
    assert metrics["truth"]["position_error"][0] < 0.015, metrics["truth"]
    assert abs(metrics["truth"]["intensity_ratio"][0] - 1.0) < 0.15, metrics["truth"]
    assert metrics["words"].startswith("1 lamp was on")

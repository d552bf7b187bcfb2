"""What noise allows at best, of targets that have it put into them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from lit_room import HIDDEN, VISIBLE, frozen_room, room_cameras
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3_write import frame_entry, write_transforms
from rgspipe.evaluation.calibration import position_sd
from rgspipe.fitting import FitViews
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.evaluation.noise import noise_bounds
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key

LIGHTS = {"visible_000": PointLight(VISIBLE, 1.0), "occluded_000": PointLight(HIDDEN, 1.0)}


def _build(root: Path, stage: str, make) -> Artifact:
    def build(folder: Path) -> dict:
        make(folder)
        return {}

    return ArtifactStore(root).build(Key("room", stage, "aa"), {"config": {}, "inputs": {}, "code": {}}, build)[0]


def _write_targets(folder: Path) -> None:
    cameras = room_cameras(32)
    views = FitViews.prepare(frozen_room(), cameras)
    for name, light in LIGHTS.items():
        target = folder / "targets" / name
        for index, image in enumerate(views.render(light)):
            write_image(target / f"view_{index}.exr", image.numpy())
        entries = [frame_entry(f"./view_{index}", camera) for index, camera in enumerate(cameras)]
        write_transforms(target / "transforms.json", entries)
    listed = [{"name": name, "occlusion": name.split("_")[0]} for name in LIGHTS]
    (folder / "targets" / "targets.json").write_text(json.dumps({"targets": listed}))
    write_transforms(folder / "transforms_train.json", [frame_entry("./train/r_0", cameras[0], LIGHTS["visible_000"])])


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Artifact]:
    root = tmp_path_factory.mktemp("store")
    return {
        "freeze": _build(root, "freeze", lambda folder: frozen_room().save(folder)),
        "generate_dataset": _build(root, "generate_dataset", _write_targets),
    }


def _bounds(inputs: dict[str, Artifact], folder: Path, noise: float, views: int = 1, **truths: PointLight) -> dict:
    config = with_changes(RgspipeConfig(), {"target_capture.noise": noise, "views.count": views})
    rigs = {name: (light,) for name, light in (truths or LIGHTS).items()}
    return noise_bounds(StageContext(config, inputs, {}, folder), rigs)


def test_targets_without_noise_have_no_bound(inputs: dict[str, Artifact], tmp_path: Path) -> None:
    assert _bounds(inputs, tmp_path, 0.0) == {}


def test_each_target_whose_lights_are_known_has_one_that_goes_with_noise_and_views(
    inputs: dict[str, Artifact], tmp_path: Path
) -> None:
    size = frozen_room().size
    little, much, more = (_bounds(inputs, tmp_path, noise, views) for noise, views in ((0.01, 1), (0.1, 1), (0.1, 2)))
    assert set(little) == set(LIGHTS)
    for name in LIGHTS:
        few, many, fewer = (position_sd(found[name], size) for found in (little, much, more))
        assert many == pytest.approx(10.0 * few, rel=1e-5) and fewer < many
        assert torch.isfinite(little[name][0]).all()
    assert set(_bounds(inputs, tmp_path, 0.1, visible_000=LIGHTS["visible_000"])) == {"visible_000"}

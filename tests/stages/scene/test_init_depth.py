"""The stage init_depth on a small dataset on disk."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from raycast import room_views, surface_distance
from rgspipe.config import RgspipeConfig
from rgspipe.config.init import InitConfig
from rgspipe.datasets.exr import write_channels, write_image
from rgspipe.datasets.gs3_write import frame_entry, write_info, write_transforms
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.errors import InputError
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.scene import init_depth


def write_dataset(root: Path, with_depth: bool) -> None:
    light = PointLight(torch.zeros(3, dtype=torch.float64), torch.ones(3, dtype=torch.float64))
    entries = []
    for view in room_views(6, 32):
        write_image(root / f"{view.name}.exr", view.image.numpy())
        write_channels(root / f"{view.name}_depth.exr", {"Z": view.depth.numpy()})
        entries.append(frame_entry(view.name, view.camera, light, ("depth",) if with_depth else ()))
    write_transforms(root / "transforms_train.json", entries)
    write_info(root, "room", [[-0.5] * 3, [0.5] * 3], 1.0, [0.0] * 3)


def run(root: Path, folder: Path, **init: object) -> StageContext:
    folder.mkdir()
    config = replace(RgspipeConfig(), init=InitConfig(**init))
    context = StageContext(config, {"generate_dataset": SimpleNamespace(folder=lambda: root)}, {}, folder)
    init_depth.STAGE.run(context)
    return context


def test_depth_on_disk_becomes_surfels_on_its_surfaces(tmp_path):
    write_dataset(tmp_path / "data", with_depth=True)
    context = run(tmp_path / "data", tmp_path / "out", surfels=200, scale=0.5)
    surfels = load_surfels(tmp_path / "out" / "surfels.safetensors")
    assert len(surfels) == context.facts["count"] == 200
    assert 0 < context.facts["with_edges"] < 200
    off = surface_distance(surfels.centers.double().numpy())
    # Six photographs of 32² show some sides of the block by pixels across its edges alone, whose normals are rough.
    assert (off > 1e-5).mean() < 0.05 and off.max() < 0.018  # measured 0.015 and 0.0087; surfels are 0.18 apart
    whole = run(tmp_path / "data", tmp_path / "whole", surfels=200, clips=False)
    assert whole.facts["with_edges"] == 0


def test_without_depth_the_error_names_the_dataset(tmp_path):
    write_dataset(tmp_path / "data", with_depth=False)
    with pytest.raises(InputError, match=r"data: expected training views with a depth map.*depth_path"):
        run(tmp_path / "data", tmp_path / "out", surfels=200)
    assert not list((tmp_path / "out").iterdir())

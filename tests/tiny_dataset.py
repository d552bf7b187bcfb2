"""A tiny, valid dataset on disk, which tests then break in one place."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from rgspipe.datasets.exr import write_channels, write_image
from rgspipe.datasets.gs3_write import frame_entry, write_info, write_target_list, write_transforms
from rgspipe.scene import Camera, PointLight, look_at

WIDTH, HEIGHT = 6, 4


def tiny_camera() -> Camera:
    """A camera that looks along +y from (0, −2, 0)."""
    pose = look_at(torch.tensor([0.0, -2.0, 0.0]), torch.zeros(3))
    return Camera(pose, 5.0, 5.0, 0.5 * WIDTH, 0.5 * HEIGHT, WIDTH, HEIGHT)


def tiny_light() -> PointLight:
    """White, 2 W/sr."""
    values = [[0.1, 0.2, 0.3], [2.0, 2.0, 2.0]]
    return PointLight(*torch.tensor(values, dtype=torch.float64))


def write_tiny_dataset(root: Path) -> None:
    """One training view with depth, normals and albedo, one test view, one target with one view."""
    image = np.full((HEIGHT, WIDTH, 3), 0.25, np.float32)
    depth = np.full((HEIGHT, WIDTH), 2.0, np.float32)
    depth[0, 0] = 1e10
    for name in ("train/r_0000", "test/r_0000", "targets/one/view_0"):
        write_image(root / f"{name}.exr", image, np.ones((HEIGHT, WIDTH)))
    write_channels(root / "train/r_0000_depth.exr", {"Z": depth})
    write_channels(root / "train/r_0000_normal.exr", {"X": 0 * depth, "Y": 0 * depth - 1, "Z": 0 * depth})
    write_image(root / "train/r_0000_albedo.exr", image)
    surfaces = ("depth", "normal", "albedo")
    entry = frame_entry("train/r_0000", tiny_camera(), tiny_light(), surfaces)
    write_transforms(root / "transforms_train.json", [entry])
    write_transforms(root / "transforms_test.json", [frame_entry("test/r_0000", tiny_camera(), tiny_light())])
    write_transforms(root / "targets/one/transforms.json", [frame_entry("view_0", tiny_camera())])
    write_target_list(root, [("one", "visible")])
    write_info(root, "tiny", [[-0.5] * 3, [0.5] * 3], 1.0, [0.0] * 3)


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """The folder of a tiny dataset."""
    root = tmp_path / "scene"
    write_tiny_dataset(root)
    return root


@pytest.fixture
def change(dataset: Path) -> Callable[[str, Callable[[dict], object]], None]:
    """`change("transforms_train.json", lambda content: …)` edits a JSON file of the dataset in place."""

    def edit(name: str, function: Callable[[dict], object]) -> None:
        content = json.loads((dataset / name).read_text())
        function(content)
        (dataset / name).write_text(json.dumps(content))

    return edit

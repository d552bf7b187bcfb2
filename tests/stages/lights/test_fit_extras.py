"""What a fit writes beside its lights: cameras of training views that it could be given."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from rgspipe.scene import Camera
from rgspipe.stages.lights.extras import training_cameras

POSE = torch.eye(4).tolist()
LIKE = Camera.from_field_of_view(torch.eye(4), 0.8, 32, 24)


@pytest.mark.parametrize(
    ("stated", "size"),
    [
        ({"camera_intrinsics": [64.0, 48.0, 150.0, 150.0]}, (128, 96)),
        ({"camera_intrinsics": [64.0, 48.0, 150.0, 150.0], "w": 127, "h": 97}, (127, 97)),
        ({"camera_angle_x": 0.8}, (32, 24)),
    ],
)
def test_training_cameras_have_their_own_size_also_beside_targets_of_another(
    tmp_path: Path, stated: dict, size: tuple[int, int]
) -> None:
    frames = [{"file_path": "./train/r_0000", "file_ext": ".exr", "transform_matrix": POSE}]
    (tmp_path / "transforms_train.json").write_text(json.dumps(stated | {"frames": frames}))
    ((name, camera),) = training_cameras(tmp_path, LIKE)
    assert name == "train/r_0000" and (camera.width, camera.height) == size


def test_without_training_views_there_are_no_cameras(tmp_path: Path) -> None:
    assert training_cameras(None, LIKE) == training_cameras(tmp_path, LIKE) == []

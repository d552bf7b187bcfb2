"""Targets through cameras that a scene's own file has by name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.named_cameras import NamedCamera, read_camera, write_cameras
from rgspipe.datasets.read_files import files_read
from rgspipe.errors import InputError
from rgspipe.scene import look_at

POSE = look_at([0.1, -1.5, 0.3], [0.0, 0.0, 0.0])


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """A target of one image, through one of two cameras of a file elsewhere."""
    write_cameras(tmp_path / "cameras.json", {"Kitchen": NamedCamera(POSE, 1.2), "Door": NamedCamera(POSE, 0.9)})
    folder = tmp_path / "evening"
    folder.mkdir()
    write_image(folder / "render.exr", np.ones((24, 32, 3), np.float32))
    written(folder, {"file_path": "render", "camera": "Kitchen"})
    return folder


def written(folder: Path, frame: dict, **shared: object) -> None:
    content = {"cameras_path": "../cameras.json", **shared, "frames": [frame]}
    (folder / "transforms.json").write_text(json.dumps({key: value for key, value in content.items() if value}))


def test_a_target_s_camera_is_named(target: Path) -> None:
    [view] = load_target(target).views
    camera = view.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == pytest.approx((1.2 * 32, 1.2 * 32, 16.0, 12.0))
    torch.testing.assert_close(camera.camera_to_world, POSE.double())
    # A fit depends on what the cameras are.
    assert any(path.name == "cameras.json" for path in files_read(target))


@pytest.mark.parametrize(
    ("side", "size", "length"),
    [("longer", (32, 24), 32), ("longer", (24, 32), 32), ("width", (24, 32), 24), ("height", (32, 24), 24)],
)
def test_lens_and_shift_are_those_of_one_side(side: str, size: tuple[int, int], length: int) -> None:
    camera = NamedCamera(POSE, 1.5, side, (0.1, -0.2)).of_image(*size)
    assert camera.fx == camera.fy == pytest.approx(1.5 * length)
    assert camera.cx == pytest.approx(0.5 * size[0] - 0.1 * length)
    assert camera.cy == pytest.approx(0.5 * size[1] - 0.2 * length)


@pytest.mark.parametrize(
    ("frame", "shared", "message"),
    [
        ({"camera": "Attic"}, {}, r'cameras\.json: expected a camera "Attic", found Kitchen, Door'),
        ({"camera": 3}, {}, r"frames\[0\]\.camera: expected a path"),
        ({"camera": "Kitchen"}, {"cameras_path": None}, 'expected the key "cameras_path"'),
        ({"camera": "Kitchen"}, {"cameras_path": "none.json"}, "none.json"),
        ({"camera": "Kitchen"}, {"cameras_path": "é" * 5000}, "no such file"),
    ],
)
def test_a_camera_that_is_not_there_is_said_with_those_that_are(
    target: Path, frame: dict, shared: dict, message: str
) -> None:
    written(target, {"file_path": "render"} | frame, **shared)
    with pytest.raises(InputError, match=message):
        load_target(target)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("focal", -1.0, "at least"),
        ("focal", 1e-320, "at least"),
        ("side", "depth", "one of longer"),
        ("shift", [0.0], "2 finite"),
        ("shift", [0.0, 1e308], "at most 1e"),
        ("focal", None, "focal"),
    ],
)
def test_broken_cameras_are_refused(tmp_path: Path, key: str, value: object, message: str) -> None:
    path = tmp_path / "cameras.json"
    write_cameras(path, {"Kitchen": NamedCamera(POSE, 1.2)})
    content = json.loads(path.read_text())
    content["cameras"]["Kitchen"][key] = value
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=message):
        read_camera(path, "Kitchen")


def test_a_file_that_is_yet_to_be_made_says_what_makes_it(target: Path) -> None:
    (target.parent / "cameras.json").unlink()
    with pytest.raises(InputError, match=r"the stage generate_dataset writes cameras\.json"):
        load_target(target)

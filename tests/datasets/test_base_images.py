"""Images of a target's views with the lamps off."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.read_files import files_read
from rgspipe.errors import InputError

Change = Callable[[str, Callable[[dict], object]], None]
TARGET = "targets/one/transforms.json"


def _dim(path: Path, level: int = 30) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((4, 6, 3), level, np.uint8)).save(path)


def _copy(dataset: Path, to: Path) -> None:
    """A folder laid out as the target, with its cameras."""
    shutil.copytree(dataset / "targets/one", to)


def test_a_target_without_one_has_none(dataset: Path) -> None:
    assert load_target(dataset / "targets/one").views[0].base is None


def test_a_frame_names_its_own(dataset: Path, change: Change) -> None:
    _dim(dataset / "targets/one/off.png")
    change(TARGET, lambda content: content["frames"][0].update(base_path="off.png"))
    (view,) = load_target(dataset / "targets/one").views
    assert view.base.shape == view.image.shape
    assert float(view.base.min()) == float(view.base.max()) == pytest.approx(0.0130, abs=1e-4)


def test_one_elsewhere_is_among_the_files_read(dataset: Path, change: Change, tmp_path: Path) -> None:
    _dim(tmp_path / "elsewhere" / "off.png")
    change(TARGET, lambda content: content["frames"][0].update(base_path=str(tmp_path / "elsewhere" / "off.png")))
    assert tmp_path / "elsewhere" / "off.png" in files_read(dataset / "targets/one")


def test_a_folder_with_cameras_of_its_own(dataset: Path, tmp_path: Path) -> None:
    _copy(dataset, tmp_path / "off")
    (view,) = load_target(dataset / "targets/one", tmp_path / "off").views
    assert view.base.equal(view.image)


def test_a_folder_with_another_principal_point(dataset: Path, change: Change, tmp_path: Path) -> None:
    def by_angle(content: dict) -> None:
        del content["frames"][0]["camera_intrinsics"]
        content.update(camera_angle_x=1.0, cx=3.0)

    change(TARGET, by_angle)
    _copy(dataset, tmp_path / "off")
    load_target(dataset / "targets/one", tmp_path / "off")
    change(TARGET, lambda content: content.update(cx=2.5))
    with pytest.raises(InputError, match="camera of"):
        load_target(dataset / "targets/one", tmp_path / "off")


def test_a_folder_of_images_that_are_named_as_the_target_s(dataset: Path, tmp_path: Path) -> None:
    _copy(dataset, tmp_path / "off")
    (tmp_path / "off" / "transforms.json").unlink()
    (view,) = load_target(dataset / "targets/one", tmp_path / "off").views
    assert view.base.equal(view.image)


def test_it_is_masked_as_the_image_is(dataset: Path, change: Change, tmp_path: Path) -> None:
    mask = np.repeat([[255, 255, 255, 0, 0, 0]], 4, axis=0).astype(np.uint8)
    Image.fromarray(mask).save(dataset / "targets/one/mask.png")
    change(TARGET, lambda content: content["frames"][0].update(mask_path="mask.png"))
    _copy(dataset, tmp_path / "off")
    (view,) = load_target(dataset / "targets/one", tmp_path / "off").views
    assert view.base[:, :3].all() and not view.base[:, 3:].any()


def test_what_is_no_image_of_the_target_s_cameras_is_named(dataset: Path, tmp_path: Path) -> None:
    target = dataset / "targets/one"
    with pytest.raises(InputError, match="lamps off"):
        load_target(target, tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty"):
        load_target(target, tmp_path / "empty")
    _copy(dataset, tmp_path / "off")
    path = tmp_path / "off" / "transforms.json"
    whole = json.loads(path.read_text())
    moved = json.loads(path.read_text())
    moved["frames"][0]["transform_matrix"][0][3] += 0.01
    path.write_text(json.dumps(moved))
    with pytest.raises(InputError, match="camera of"):
        load_target(target, tmp_path / "off")
    path.write_text(json.dumps(whole | {"frames": whole["frames"] * 2}))
    with pytest.raises(InputError, match="1 cameras"):
        load_target(target, tmp_path / "off")

"""A dataset whose depth contradicts what its files state is refused by file, with what was meant and what to do."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from misread_views import lit_view, misread_view
from raycast import room_views
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import read_channels, write_channels, write_image
from rgspipe.datasets.gs3_write import frame_entry, write_info, write_transforms
from rgspipe.errors import InputError
from rgspipe.evidence.readings import Reading
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.images.generate_dataset import STAGE


def _written(root: Path, meant: Reading, convention: str = "planar_z") -> Path:
    """The folder of a capture of a room whose files state `convention` but were written as `meant`."""
    light, entries = PointLight([0.0, 0.0, 0.3], 1.0), []
    for index, view in enumerate(room_views(12, 20)):
        view = misread_view(view, meant, convention == "ray_distance")
        lengths = view.camera.rays()[2].reshape(view.depth.shape).float()
        stored = view.depth * lengths if convention == "ray_distance" else view.depth
        name = f"train/r_{index:04d}"
        write_image(root / f"{name}.exr", view.image.numpy() + 0.5)
        write_channels(root / f"{name}_depth.exr", {"Z": stored.numpy()})
        entries.append(frame_entry(name, view.camera, light, ("depth",)))
    write_transforms(root / "transforms_train.json", entries)
    write_info(root, "room", [[-0.5] * 3, [0.5] * 3], 1.0, [0.0] * 3)
    info = json.loads((root / "dataset_info.json").read_text())
    (root / "dataset_info.json").write_text(json.dumps(info | {"depth_convention": convention}))
    return root


def test_lamps_of_other_axes_are_told(tmp_path: Path) -> None:
    root = _written(tmp_path / "room", Reading())
    generator, entries = np.random.default_rng(5), []
    for view in room_views(24, 20, normals=True):
        lamp = generator.uniform(-0.35, 0.35, 3)
        lit = lit_view(view, PointLight(lamp, 1.0), generator)
        write_image(root / f"{view.name}.exr", lit.image.numpy())
        write_channels(root / f"{view.name}_depth.exr", {"Z": view.depth.numpy()})
        entries.append(frame_entry(view.name, view.camera, PointLight(lamp * [1, -1, -1], 1.0), ("depth",)))
    write_transforms(root / "transforms_train.json", entries)
    with pytest.raises(
        InputError, match=r"pl_pos: .* 0\.\d+ with the places with y and z of other sign\. Change the sign"
    ):
        _check(root, tmp_path / "out")


def _check(root: Path, folder: Path) -> None:
    folder.mkdir()
    config = with_changes(RgspipeConfig(), {"scene.kind": "external", "scene.path": str(root)})
    STAGE.run(StageContext(config, {}, {}, folder))


@pytest.mark.parametrize(
    ("meant", "file", "found", "remedy"),
    [
        (Reading(opencv=True), "transforms_train.json", "under OpenCV axes", "second and third column"),
        (
            Reading(opencv=True, inverse=True),
            "transforms_train.json",
            r"under OpenCV axes \(y down, z forwards\) and world-to-camera matrices",
            "Invert every transform_matrix. Change the sign",
        ),
        (Reading(other_depth=True), "dataset_info.json", "under ray_distance depth", '"depth_convention": "ray_dist'),
        (Reading(scale=0.001), "transforms_train.json", "under depth times 0.001", "Multiply the depth by 0.001"),
    ],
    ids=["OpenCV", "COLMAP", "along rays", "millimetres"],
)
def test_what_was_meant_is_said(tmp_path: Path, meant: Reading, file: str, found: str, remedy: str) -> None:
    root = _written(tmp_path / "room", meant)
    with pytest.raises(
        InputError, match=rf"found 9\d % of \d+ points agreeing {found}.* as read\. .*{remedy}"
    ) as caught:
        _check(root, tmp_path / "out")
    assert caught.value.where == str(root / file)
    assert not list((tmp_path / "out").iterdir())


def test_planar_depth_that_is_called_ray_distance_is_told(tmp_path: Path) -> None:
    root = _written(tmp_path / "room", Reading(other_depth=True), "ray_distance")
    with pytest.raises(InputError, match=r"under planar_z depth.*\"depth_convention\": \"planar_z\""):
        _check(root, tmp_path / "out")


@pytest.mark.parametrize("convention", ["planar_z", "ray_distance"])
def test_what_is_stated_rightly_passes(tmp_path: Path, convention: str) -> None:
    _check(_written(tmp_path / "room", Reading(), convention), tmp_path / "out")
    assert (tmp_path / "out/dataset.json").is_file()


def test_depth_that_agrees_under_no_reading_is_refused(tmp_path: Path) -> None:
    """As of scans: 1 over the depth passed, and so did images upside down."""
    root = _written(tmp_path / "room", Reading())
    for path in root.glob("train/*_depth.exr"):
        (depth,) = read_channels(path).values()
        write_channels(path, {"Z": np.ascontiguousarray(depth[::-1])})
    with pytest.raises(InputError, match=r"transforms_train\.json: .* agreeing, under no axes and no unit.*mirrored"):
        _check(root, tmp_path / "out")

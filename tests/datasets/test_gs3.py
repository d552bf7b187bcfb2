"""Datasets in the GS³ format: what a good one gives, and that everything broken is refused by file and key."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from rgspipe.datasets.exr import write_channels, write_image
from rgspipe.datasets.gs3 import load_dataset, load_target, target_folders
from rgspipe.datasets.images import read_depth
from rgspipe.datasets.location import load_views, open_dataset, point_at_dataset
from rgspipe.errors import InputError
from rgspipe.scene import Camera, look_at

Change = Callable[[str, Callable[[dict], object]], None]
TRAIN = "transforms_train.json"


def test_a_good_dataset_is_read_as_it_was_written(dataset: Path) -> None:
    loaded = load_dataset(dataset)
    (view,) = loaded.train
    assert view.name == "train/r_0000"
    assert view.image.shape == (4, 6, 3) and view.image.dtype == torch.float32
    assert (view.image == 0.25).all() and (view.alpha == 1).all()
    torch.testing.assert_close(view.light.intensity, torch.full((3,), 2.0, dtype=torch.float64))  # watts / 4π
    assert view.depth[0, 0] == math.inf and (view.depth.flatten()[1:] == 2).all()
    assert (view.normal == torch.tensor([0.0, -1.0, 0.0])).all() and (view.albedo == 0.25).all()
    assert loaded.test[0].depth is None
    (target,) = loaded.targets
    assert (target.name, target.occlusion, target.views[0].light) == ("one", "visible", None)


@pytest.mark.parametrize("stored", [0.0, math.nan])
@pytest.mark.parametrize("convention", ["planar_z", "ray_distance"])
def test_unknown_depth_is_told_from_no_surface(dataset: Path, change: Change, stored: float, convention: str) -> None:
    change("dataset_info.json", lambda info: info.update(depth_convention=convention))
    depth = np.full((4, 6), 2.0, np.float32)
    depth[0, 0], depth[0, 1], depth[0, 2] = stored, np.inf, 1e10
    write_channels(dataset / "train" / "r_0000_depth.exr", {"Z": depth})
    found = load_dataset(dataset).train[0].depth
    assert found.isnan().sum() == 1 and found[0, 0].isnan()
    assert found.isposinf().sum() == 2 and found[0, 1:3].isposinf().all()


def test_only_what_is_wanted_is_read(dataset: Path) -> None:
    (dataset / "transforms_test.json").unlink()
    loaded = load_dataset(dataset, test=False, targets=False)
    assert len(loaded.train) == 1 and loaded.test == () and loaded.targets == ()


def test_ray_distance_becomes_planar_depth(dataset: Path, change: Change) -> None:
    change("dataset_info.json", lambda info: info.update(depth_convention="ray_distance"))
    view = load_dataset(dataset).train[0]
    _, _, lengths = view.camera.rays()
    expected = 2.0 / lengths.reshape(4, 6).float()
    torch.testing.assert_close(view.depth.flatten()[1:], expected.flatten()[1:])
    assert view.depth[0, 0] == math.inf


def test_one_field_of_view_for_all_frames(dataset: Path, change: Change) -> None:
    def share(content: dict) -> None:
        content["camera_angle_x"] = 1.0
        del content["frames"][0]["camera_intrinsics"], content["frames"][0]["file_ext"]

    change(TRAIN, share)
    camera = load_dataset(dataset).train[0].camera
    assert camera.fx == camera.fy == pytest.approx(3.0 / math.tan(0.5))
    assert (camera.cx, camera.cy) == (3.0, 2.0)


def test_poses_that_a_fit_of_gs3_found_stand_over_the_first_ones(dataset: Path, change: Change) -> None:
    """R_opt to the world, with OpenCV axes, and T_opt from it."""
    pose = look_at([1.0, -3.0, 0.5], [0.0, 0.0, 0.0]).double().numpy()
    camera_to_world = pose @ np.diag([1.0, -1.0, -1.0, 1.0])
    world_to_camera = np.linalg.inv(camera_to_world)
    refined = {"R_opt": camera_to_world[:3, :3].tolist(), "T_opt": world_to_camera[:3, 3].tolist()}
    change("transforms_train.json", lambda content: content["frames"][0].update(refined))
    (view,) = load_dataset(dataset).train
    # Measured 2e-16.
    np.testing.assert_allclose(view.camera.camera_to_world.numpy(), pose, atol=1e-12)
    change("transforms_train.json", lambda content: content["frames"][0].pop("T_opt"))
    with pytest.raises(InputError, match=r'the key "T_opt"'):
        load_dataset(dataset)


def test_a_lamp_at_the_top_is_that_of_all_frames_that_name_no_other(dataset: Path, change: Change) -> None:
    """NRHints names places alone: one power for all is enough. They counted as unknown lamps."""
    (own,) = load_dataset(dataset).train

    def share(content: dict) -> None:
        content |= {key: content["frames"][0].pop(key) for key in ("pl_pos", "pl_intensity")}
        content["frames"].append(content["frames"][0] | {"pl_pos": [1.0, 2.0, 3.0], "file_path": "train/r_0001"})

    (dataset / "train/r_0001.exr").write_bytes((dataset / "train/r_0000.exr").read_bytes())
    change("transforms_train.json", share)
    first, second = load_dataset(dataset).train
    assert torch.equal(first.light.position, own.light.position)
    assert torch.equal(second.light.intensity, own.light.intensity)
    assert second.light.position.tolist() == [1.0, 2.0, 3.0]


def test_png_is_linearised_and_premultiplied(dataset: Path, change: Change) -> None:
    Image.fromarray(np.full((4, 6, 4), (188, 188, 188, 51), np.uint8), "RGBA").save(dataset / "train/r_0000.png")
    change(TRAIN, lambda content: content["frames"][0].update(file_ext=".png"))
    view = load_dataset(dataset).train[0]
    linear = ((188 / 255 + 0.055) / 1.055) ** 2.4  # the sRGB curve: 188 is 0.503
    torch.testing.assert_close(view.image, torch.full((4, 6, 3), linear * 0.2), rtol=1e-5, atol=0)  # measured 1e-7
    torch.testing.assert_close(view.alpha, torch.full((4, 6), 0.2))


def test_a_dataset_may_have_no_targets(dataset: Path) -> None:
    shutil.rmtree(dataset / "targets")
    assert load_dataset(dataset).targets == ()


def test_a_target_of_its_own_has_no_known_class(dataset: Path, tmp_path: Path) -> None:
    shutil.copytree(dataset / "targets/one", tmp_path / "mine")
    target = load_target(tmp_path / "mine")
    assert (target.name, target.occlusion, len(target.views)) == ("mine", "unknown", 1)


def test_an_artifact_may_point_at_a_dataset(dataset: Path, tmp_path: Path) -> None:
    point_at_dataset(tmp_path / "artifact", dataset)
    assert open_dataset(tmp_path / "artifact", test=False).root == dataset
    assert open_dataset(dataset, test=False).root == dataset


def _frame(**changes: object) -> Callable[[dict], None]:
    def edit(content: dict) -> None:
        for key, value in changes.items():
            if value is ...:
                del content["frames"][0][key]
            else:
                content["frames"][0][key] = value

    return edit


def _matrix(*diagonal: float, bottom: float = 1.0) -> list[list[float]]:
    return np.diag([*diagonal, bottom]).tolist()


NAN_MATRIX = [[float("nan"), 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda content: content.pop("frames"), 'the key "frames"'),
        (lambda content: content.update(frames=[]), "at least one frame"),
        (lambda content: content.update(frames=["a"]), r"frames\[0\].*JSON object"),
        (_frame(file_path=...), r'frames\[0\].*"file_path"'),
        (_frame(file_path=7), r"frames\[0\]\.file_path.*a path"),
        (_frame(file_path="./train/other"), r"train/other\.exr.*no such file"),
        (_frame(file_ext=3), r"file_ext.*suffix"),
        (_frame(transform_matrix=...), '"transform_matrix"'),
        (_frame(transform_matrix=[[1, 0], [0, 1]]), r"transform_matrix.*4 × 4"),
        (_frame(transform_matrix="eye"), r"transform_matrix.*4 × 4"),
        (_frame(transform_matrix=NAN_MATRIX), r"transform_matrix.*finite"),
        (_frame(transform_matrix=_matrix(1, 1, 1.01)), r"transform_matrix.*rigid.*up to 0\.02"),
        (_frame(transform_matrix=_matrix(1, 1, -1)), r"transform_matrix.*determinant −1"),
        (_frame(transform_matrix=_matrix(1, 1, 1, bottom=2)), r"transform_matrix.*last row"),
        (_frame(camera_intrinsics=...), 'camera_angle_x.*or "camera_intrinsics".*neither'),
        (_frame(camera_intrinsics=[3, 2, 5]), '4 finite numbers under "camera_intrinsics"'),
        (
            _frame(camera_intrinsics=[1.5, 1.0, 2.5, 2.5], w=..., h=...),
            r"camera_intrinsics.*6 × 4 pixels.*middle of one of 3 × 2",
        ),
        (_frame(camera_intrinsics=[3, 2, -5, 5]), "focal lengths in pixels, above 0"),
        (_frame(camera_intrinsics=[3, 2, 5, 1e-320]), "focal lengths in pixels, above 0"),
        (_frame(camera_intrinsics=[64, 64, 100, 100]), r"r_0000\.exr.*principal point.*6 × 4"),
        (_frame(w=128, h=128), r'r_0000\.exr.*"w": 128.*6 × 4'),
        (_frame(camera_intrinsics=..., camera_angle_x=4), "camera_angle_x.*between 1e-06 and π"),
        (_frame(camera_intrinsics=..., camera_angle_x=1e-320), "camera_angle_x.*between 1e-06 and π"),
        (_frame(pl_pos=[0, 0, 1e308]), r"pl_pos.*within"),
        (_frame(pl_intensity=1e308), r"pl_intensity.*up to"),
        (
            _frame(transform_matrix=[[1, 0, 0, 1e308], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
            "transform_matrix.*within",
        ),
        (_frame(pl_pos=...), r'frames\[0\].*"pl_pos"'),
        (_frame(pl_pos=[0, 0]), '3 finite numbers under "pl_pos"'),
        (_frame(pl_intensity=...), r'frames\[0\].*"pl_intensity"'),
        (_frame(pl_intensity=[0, 0, 0]), "pl_intensity.*above 0"),
        (_frame(pl_intensity=[1, -1, 1]), "pl_intensity.*above 0"),
        (_frame(pl_intensity=["a", 1, 1]), '3 finite numbers under "pl_intensity"'),
        (_frame(depth_path="./gone.exr"), r"gone\.exr.*no such file"),
    ],
)
def test_what_is_wrong_with_the_cameras_is_named(
    dataset: Path, change: Change, edit: Callable[[dict], object], message: str
) -> None:
    change(TRAIN, edit)
    with pytest.raises(InputError, match=message) as caught:
        load_dataset(dataset)
    assert str(dataset) in str(caught.value)


def _fill(path: Path, channels: str, value: float = 1.0, height: int = 4) -> None:
    write_channels(path, {name: np.full((height, 6), value, np.float32) for name in channels})


def _transparent(path: Path) -> None:
    write_image(path, np.ones((4, 6, 3), np.float32), np.zeros((4, 6), np.float32))


@pytest.mark.parametrize(
    ("name", "spoil", "message"),
    [
        ("r_0000", lambda path: path.write_bytes(path.read_bytes()[:-40]), "whole OpenEXR"),
        ("r_0000", lambda path: path.write_text("no image"), "whole OpenEXR"),
        ("r_0000", lambda path: _fill(path, "RGBA", float("nan")), "NaN or infinity"),
        ("r_0000", lambda path: _fill(path, "RG"), "4 channels R, G, B, A"),
        ("r_0000", lambda path: _fill(path, "RGBA", 3.0), "alpha from 0 to 1"),
        ("r_0000", lambda path: _transparent(path), "pixels that are opaque.*alpha 0 everywhere.*colours up to 1"),
        ("r_0000_depth", lambda path: _fill(path, "Z", -1.0), "24 negative pixels"),
        ("r_0000_depth", lambda path: _fill(path, "XYZ"), "one channel of depth"),
        ("r_0000_depth", lambda path: _fill(path, "Z", height=5), "6 × 4 pixels, as the colour image"),
        ("r_0000_normal", lambda path: _fill(path, "XYZ", float("inf")), "NaN or infinity"),
        ("r_0000_albedo", lambda path: _fill(path, "RGB", height=2), "6 × 4 pixels, as the colour image"),
    ],
)
def test_what_is_wrong_with_an_image_is_named(
    dataset: Path, name: str, spoil: Callable[[Path], object], message: str
) -> None:
    path = dataset / "train" / f"{name}.exr"
    spoil(path)
    with pytest.raises(InputError, match=message) as caught:
        load_dataset(dataset)
    assert caught.value.where == str(path)


def test_depth_without_a_convention_shows_both(dataset: Path, change: Change) -> None:
    change("dataset_info.json", lambda info: info.pop("depth_convention"))
    with pytest.raises(InputError, match=r'dataset_info\.json.*"planar_z".*"ray_distance"'):
        load_dataset(dataset)
    for other in ("inverse", ["inverse"]):
        change("dataset_info.json", lambda info, other=other: info.update(depth_convention=other))
        with pytest.raises(InputError, match=r'"planar_z".*"ray_distance".*inverse'):
            load_dataset(dataset)
    (dataset / "dataset_info.json").unlink()
    with pytest.raises(InputError, match=r'dataset_info\.json.*"planar_z".*"ray_distance".*no such file'):
        load_dataset(dataset)


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"version": 2}, '"version": 1, found 2'), ({"image_alpha": "straight"}, "premultiplied")],
)
def test_a_dataset_info_that_is_not_understood_is_refused(
    dataset: Path, change: Change, changes: dict, message: str
) -> None:
    change("dataset_info.json", lambda info: info.update(changes))
    with pytest.raises(InputError, match=message):
        load_dataset(dataset)


@pytest.mark.parametrize("name", [TRAIN, "transforms_test.json", "targets/one/transforms.json"])
def test_missing_and_broken_transforms_are_named(dataset: Path, name: str) -> None:
    (dataset / name).write_text('{"frames": [')
    with pytest.raises(InputError, match=rf"{name}.*invalid JSON"):
        load_dataset(dataset)
    (dataset / name).unlink()
    if name != "transforms_test.json":
        with pytest.raises(InputError, match=rf"{name}.*no such file"):
            load_dataset(dataset)


def test_a_dataset_may_leave_no_view_out_until_it_is_to_be_judged(dataset: Path) -> None:
    (dataset / "transforms_test.json").unlink()
    loaded = load_dataset(dataset)
    assert len(loaded.train) == 1 and loaded.test == ()
    with pytest.raises(InputError, match=r"transforms_test\.json.*left out of training.*Move some frames"):
        load_views(dataset, "test")


def test_what_a_target_s_depth_holds_need_not_be_said(dataset: Path, tmp_path: Path) -> None:
    shutil.copytree(dataset / "targets/one", tmp_path / "mine")
    content = json.loads((tmp_path / "mine/transforms.json").read_text())
    content["frames"][0]["depth_path"] = "nowhere"
    (tmp_path / "mine/transforms.json").write_text(json.dumps(content))
    (view,) = load_target(tmp_path / "mine").views
    assert view.depth is None and view.image.shape == (4, 6, 3)


def test_a_target_without_images_is_named(dataset: Path, tmp_path: Path) -> None:
    (dataset / "targets/one/view_0.exr").unlink()
    with pytest.raises(InputError, match=r"one/view_0\.exr.*no such file"):
        load_dataset(dataset)
    (tmp_path / "bare").mkdir()
    with pytest.raises(InputError, match=r"bare/transforms\.json.*no such file"):
        load_target(tmp_path / "bare")
    with pytest.raises(InputError, match=r"nowhere.*no such folder"):
        load_target(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("item", "message"),
    [
        ({"name": "two", "occlusion": "visible"}, "two.*no such folder"),
        ({"name": "../one", "occlusion": "visible"}, "name of a folder"),
        ({"name": "one", "occlusion": "dim"}, r"targets\[0\]\.occlusion.*visible, out_of_frame"),
        ({"occlusion": "visible"}, r'targets\[0\].*"name"'),
    ],
)
def test_a_list_of_targets_that_does_not_fit_is_named(dataset: Path, change: Change, item: dict, message: str) -> None:
    change("targets/targets.json", lambda content: content.update(targets=[item]))
    with pytest.raises(InputError, match=message):
        load_dataset(dataset)


def test_a_dataset_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere.*no such folder"):
        load_dataset(tmp_path / "nowhere")


def test_a_broken_png_is_named(dataset: Path, change: Change) -> None:
    change(TRAIN, _frame(file_ext=".png"))
    (dataset / "train/r_0000.png").write_bytes(b"\x89PNG")
    with pytest.raises(InputError, match=r"r_0000\.png.*unreadable"):
        load_dataset(dataset)
    Image.fromarray(np.zeros((4, 6), np.uint8)).save(dataset / "train/r_0000.png")
    with pytest.raises(InputError, match=r"r_0000\.png.*8-bit RGB or RGBA"):
        load_dataset(dataset)


def test_images_of_colour_only_are_opaque(dataset: Path) -> None:
    write_image(dataset / "train/r_0000.exr", np.ones((4, 6, 3)))
    assert (load_dataset(dataset).train[0].alpha == 1).all()


def test_a_name_with_its_suffix_needs_no_file_ext(dataset: Path, change: Change) -> None:
    Image.fromarray(np.full((4, 6, 3), 128, np.uint8)).save(dataset / "train/a.png")
    change(TRAIN, _frame(file_path="train/a.png", file_ext=...))
    assert load_dataset(dataset).train[0].name == "train/a"


@pytest.mark.parametrize("written", ["a.png", "a.PNG", "a.jpg"])
@pytest.mark.parametrize("stated", ["train/a", ".\\train\\a"])
def test_a_name_without_a_suffix_is_that_of_the_image_that_is_there(
    dataset: Path, change: Change, written: str, stated: str
) -> None:
    """NeRF's own datasets name PNG images so, and programs on Windows write backslashes: no such EXR was found."""
    Image.new("RGB", (6, 4), (188, 188, 188)).save(dataset / "train" / written)
    change(TRAIN, _frame(file_path=stated, file_ext=...))
    assert float(load_dataset(dataset).train[0].image.mean()) == pytest.approx(0.5028, abs=1e-3)  # 0.50289


def test_maps_need_no_suffix_either(dataset: Path, change: Change) -> None:
    change(TRAIN, _frame(depth_path="train/r_0000_depth"))
    assert load_dataset(dataset).train[0].depth is not None


@pytest.mark.parametrize("place", ["", "targets/one"])
def test_a_target_s_depth_is_read_as_the_dataset_says(dataset: Path, change: Change, place: str) -> None:
    shutil.copy(dataset / "train/r_0000_depth.exr", dataset / "targets/one/depth.exr")
    change("targets/one/transforms.json", _frame(depth_path="depth.exr"))
    if place:
        shutil.move(dataset / "dataset_info.json", dataset / place / "dataset_info.json")
    depth = load_target(dataset / "targets/one").views[0].depth
    assert depth is not None and depth[1, 1] == 2.0


@pytest.mark.parametrize("key", ["k1", "k4", "p2"])
def test_distorted_images_are_refused(dataset: Path, change: Change, key: str) -> None:
    change(TRAIN, _frame(**{key: 0}))
    load_dataset(dataset)
    change(TRAIN, _frame(**{key: -0.05}))
    with pytest.raises(InputError, match=rf"frames\[0\]: {key}.*without distortion"):
        load_dataset(dataset)


OTHER_LENSES = [("camera_model", "OPENCV_FISHEYE"), ("is_fisheye", True), ("distortion_params", [0.1, 0, 0, 0])]


@pytest.mark.parametrize(("key", "value"), OTHER_LENSES)
def test_lenses_that_bend_by_other_keys_are_refused(dataset: Path, change: Change, key: str, value: object) -> None:
    """They were ignored."""
    change(TRAIN, lambda content: content.update({"camera_model": "OPENCV", "skew": 0, "k5": None} | {key: value}))
    with pytest.raises(InputError, match=rf"frames\[0\]: {key}.*without distortion"):
        load_dataset(dataset)


def test_an_image_of_two_frames_is_refused(dataset: Path, change: Change) -> None:
    """It counted twice, under another lamp or pose, too."""
    change(
        TRAIN, lambda content: content["frames"].append(content["frames"][0] | {"file_path": "train/../train/r_0000"})
    )
    with pytest.raises(
        InputError, match=r"transforms_train\.json: .*once, found r_0000\.exr in frames\[0\] and frames\[1\]"
    ):
        load_dataset(dataset)


@pytest.mark.parametrize(
    ("key", "value"), [("applied_transform", [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0]]), ("applied_scale", 0.5)]
)
def test_a_target_in_other_axes_or_another_unit_is_refused(
    dataset: Path, change: Change, key: str, value: object
) -> None:
    change("targets/one/transforms.json", lambda content: content.update({key: value}))
    with pytest.raises(InputError, match=rf"{key}.*axes and the unit of the scene"):
        load_target(dataset / "targets/one")


def test_a_png_of_depth_is_called_one(tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 6), 900, np.uint16)).save(tmp_path / "depth.png")
    camera = Camera(torch.eye(4, dtype=torch.float64), 5.0, 5.0, 3.0, 2.0, 6, 4)
    with pytest.raises(InputError, match=r"depth\.png: expected depth as OpenEXR.*found a PNG image.*0\.001"):
        read_depth(tmp_path / "depth.png", camera, "planar_z")


def test_a_negative_pixel_is_no_radiance(dataset: Path) -> None:
    image = np.full((4, 6, 3), 0.25, np.float32)
    image[1, 2] = -0.2  # noise in the dark
    write_image(dataset / "train/r_0000.exr", image)
    load_dataset(dataset)
    image[1, 2] = -10.0
    write_image(dataset / "train/r_0000.exr", image)
    with pytest.raises(InputError, match=r"r_0000\.exr.*which is not negative.*down to -10, and none above 0.25"):
        load_dataset(dataset)


def test_views_under_lamps_that_nothing_names_have_no_lights(dataset: Path, change: Change) -> None:
    def unnamed(content: dict) -> None:
        for frame in content["frames"]:
            del frame["pl_pos"], frame["pl_intensity"]

    change("transforms_train.json", unnamed)
    loaded = load_dataset(dataset)
    assert [view.light for view in loaded.train] == [None]
    assert loaded.test[0].light is not None and loaded.train[0].depth is not None


def test_a_view_that_names_half_of_a_light_is_wrong(dataset: Path, change: Change) -> None:
    change("transforms_train.json", lambda content: content["frames"][0].pop("pl_pos"))
    with pytest.raises(InputError, match="pl_pos"):
        load_dataset(dataset)


def test_a_suffix_may_be_named_without_its_dot(dataset: Path, change: Change) -> None:
    change(TRAIN, _frame(file_ext="exr"))
    load_dataset(dataset)


def test_an_image_whose_suffix_has_other_letters_is_found(dataset: Path, change: Change) -> None:
    """As cameras name theirs, and file systems that do not tell letters apart find them."""
    (dataset / "train/r_0000.exr").rename(dataset / "train/r_0000.EXR")
    change(TRAIN, lambda content: content["frames"][0].update(file_path="train/r_0000.exr"))
    load_dataset(dataset)


def test_targets_that_no_list_names_go_by_the_numbers_in_their_names(dataset: Path) -> None:
    """A sequence of frames that were numbered without zeros is in the order in which it was taken."""
    (dataset / "targets/targets.json").unlink(missing_ok=True)
    (dataset / "targets/one").rename(dataset / "targets/frame_2")
    for name in ("frame_10", "frame_1", "3", "frame"):
        shutil.copytree(dataset / "targets/frame_2", dataset / "targets" / name)
    assert [path.name for path in target_folders(dataset)] == ["3", "frame", "frame_1", "frame_2", "frame_10"]


def test_all_images_that_are_missing_are_told_at_once(dataset: Path, change: Change) -> None:
    """The first was named alone, and its path was to be checked."""
    change(TRAIN, lambda content: content["frames"].append(content["frames"][0] | {"file_path": "train/r_0001"}))
    (dataset / "train/r_0000_depth.exr").unlink()
    words = (
        r"transforms_train\.json: .*r_0000_depth\.exr.*r_0001\.exr.*no such file \(2 of 2 frames\).*take these frames"
    )
    with pytest.raises(InputError, match=words):
        load_dataset(dataset)


def test_views_that_are_held_out_and_trained_on_are_refused(dataset: Path, change: Change) -> None:
    """The scene was judged by what it had been made of."""
    change("transforms_test.json", lambda content: content["frames"][0].update(file_path="./test/../train/r_0000"))
    words = r"transforms_test\.json: frames\[0\]\.file_path: .*r_0000\.exr, which transforms_train\.json has, too"
    with pytest.raises(InputError, match=words):
        load_dataset(dataset)
    assert load_dataset(dataset, test=False).train

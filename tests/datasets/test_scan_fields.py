"""Fields of captures that cannot be meant: each is refused by its key, and none is rounded or left out silently."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from readable_captures import SCANNED
from rgspipe.datasets.scans.colmap_model import read_cameras
from rgspipe.datasets.scans.layouts import read_scan
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import read_picture
from rgspipe.errors import InputError
from scan_layouts import photographed, write_colmap, write_nerfstudio, write_polycam, write_replica


@pytest.mark.parametrize(
    ("key", "value"),
    [("w", 8.7), ("h", 0.5), ("applied_scale", 1e300), ("applied_scale", 1e-320), ("depth_unit_scale_factor", 1e300)],
)
def test_numbers_of_nerfstudio_that_cannot_be_are_refused_by_their_key(tmp_path: Path, key: str, value: float) -> None:
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png", {key: value})
    with pytest.raises(InputError, match=rf"transforms\.json: frames\[0\].*{key}"):
        read_scan(tmp_path, ScanOptions())


OPTICS = [("k5", 0.3), ("k6", -0.1), ("skew", 3.0), ("distortion_params", [0.3, 0.1, 0, 0, 0, 0]), ("is_fisheye", True)]
OPTICS += [("fisheye_crop_radius", 4), ("rolling_shutter", [0, 0, 0.1, 0]), ("rolling_shutter_time", 0.01)]


@pytest.mark.parametrize(("key", "value"), OPTICS)
@pytest.mark.parametrize("shared", [True, False])
def test_optics_of_nerfstudio_that_are_not_known_are_refused(
    tmp_path: Path, key: str, value: object, shared: bool
) -> None:
    """They were left out without a word."""
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png", {key: value} if shared else {})
    if not shared:
        _of_second(tmp_path / "transforms.json", {key: value})
    with pytest.raises(InputError, match=rf"transforms\.json: frames\[{0 if shared else 1}\]: {key}: expected 0"):
        read_scan(tmp_path, ScanOptions())


def _of_second(path: Path, fields: dict) -> None:
    """Add fields to the second frame of a file."""
    content = json.loads(path.read_text())
    content["frames"][1] |= fields
    path.write_text(json.dumps(content))


def test_a_field_of_view_and_the_image_s_size_will_do_for_nerfstudio(tmp_path: Path) -> None:
    """As instant-ngp takes them; they were refused."""
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png")
    path, lens = tmp_path / "transforms.json", read_scan(tmp_path, ScanOptions()).frames[0].lens
    content = json.loads(path.read_text())
    shared = {key: value for key, value in content.items() if key not in ("fl_x", "fl_y", "w", "h", "cx", "cy")}
    angle = 2.0 * np.arctan(0.5 * lens.width / lens.fx)
    path.write_text(json.dumps(shared | {"camera_angle_x": angle}))
    found = read_scan(tmp_path, ScanOptions()).frames[0].lens
    assert (found.fx, found.width, found.height) == pytest.approx((lens.fx, lens.width, lens.height))
    path.write_text(json.dumps(shared | {"camera_angle_x": angle, "camera_angle_y": 0.5 * angle}))
    with pytest.raises(InputError, match="camera_angle_y: expected the same field of view"):
        read_scan(tmp_path, ScanOptions())
    path.write_text(json.dumps(content | {"camera_angle_x": 0.5 * angle}))  # nerfstudio looks at fl_x alone
    assert read_scan(tmp_path, ScanOptions()).frames[0].lens.fx == lens.fx


def test_optics_of_nerfstudio_that_do_nothing_are_read(tmp_path: Path) -> None:
    nothing = {"k5": 0, "skew": 0.0, "distortion_params": [0.0] * 6, "is_fisheye": False, "rolling_shutter_time": None}
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png", nothing)
    assert not read_scan(tmp_path, ScanOptions()).frames[0].lens.bends
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png", {"is_fisheye": True, "camera_model": "OPENCV_FISHEYE"})
    assert read_scan(tmp_path, ScanOptions()).frames[0].lens.fisheye


def test_a_model_that_is_null_and_sizes_as_text_are_read(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png")
    expected = read_scan(tmp_path, ScanOptions()).frames[0].lens
    shared = {"camera_model": None, "w": str(expected.width), "h": str(expected.height)}
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png", shared)
    assert read_scan(tmp_path, ScanOptions()).frames[0].lens == expected


def test_depth_of_instant_ngp_has_the_scale_that_it_states(tmp_path: Path) -> None:
    """As NeRFCapture writes it; without a scale instant-ngp has no depth. A key that is null is none."""
    write_nerfstudio(tmp_path, photographed(2, 8), depth=".png")
    path = tmp_path / "transforms.json"
    content = json.loads(path.read_text())
    for frame in content["frames"]:
        frame |= {"depth_path": frame.pop("depth_file_path").removesuffix(".png"), "mask_path": None}
    content["frames"][1] |= {"depth_path": None, "depth_file_path": None}
    path.write_text(json.dumps(content | {"integer_depth_scale": 10.0 / 65535.0}))
    first, second = read_scan(tmp_path, ScanOptions()).frames
    assert first.depth.unit == 10.0 / 65535.0 and first.depth.path.name == "0.png" and first.mask is None
    assert second.depth is None
    path.write_text(json.dumps(content))
    assert all(frame.depth is None for frame in read_scan(tmp_path, ScanOptions(), depth=False).frames)


def test_a_frame_of_nerfstudio_has_its_own_scale(tmp_path: Path) -> None:
    """That of the first frame held for all."""
    write_nerfstudio(tmp_path, SCANNED, ".png", ".png", {"applied_scale": 0.5})
    before = read_scan(tmp_path, ScanOptions()).frames
    _of_second(tmp_path / "transforms.json", {"applied_scale": 2.0})
    after = read_scan(tmp_path, ScanOptions()).frames
    for index, factor in ((0, 1.0), (1, 0.25)):
        np.testing.assert_allclose(after[index].pose[:3, 3], factor * before[index].pose[:3, 3])


def test_half_a_pixel_of_polycam_is_refused(tmp_path: Path) -> None:
    write_polycam(tmp_path, SCANNED, SCANNED)
    path = min((tmp_path / "keyframes/corrected_cameras").iterdir())
    path.write_text(json.dumps(json.loads(path.read_text()) | {"width": 8.5}))
    with pytest.raises(InputError, match=r'a whole number under "width", found 8\.5'):
        read_scan(tmp_path, ScanOptions())


def images_of(root: Path) -> Path:
    """The list of images of a COLMAP model as text."""
    write_colmap(root, SCANNED, False)
    return root / "sparse/0/images.txt"


def test_an_image_of_colmap_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    path = images_of(tmp_path)
    path.write_text(path.read_text().replace("00.exr", "01.exr"))
    with pytest.raises(InputError, match=r"images\.txt: expected each image once, found '01\.exr' twice"):
        read_scan(tmp_path, ScanOptions())


@pytest.mark.parametrize("binary", [False, True])
def test_a_camera_of_colmap_that_is_there_twice_is_refused(tmp_path: Path, binary: bool) -> None:
    write_colmap(tmp_path, SCANNED, binary)
    path = tmp_path / f"sparse/0/cameras.{'bin' if binary else 'txt'}"
    content = path.read_bytes()
    camera = content[8:] if binary else content.splitlines(keepends=True)[-1]
    path.write_bytes((2).to_bytes(8, "little") + 2 * camera if binary else content + camera)
    with pytest.raises(InputError, match=r"cameras\.(bin|txt).*camera \d+ twice"):
        read_cameras(path)


def test_a_name_of_colmap_that_no_path_can_have_is_refused(tmp_path: Path) -> None:
    path = images_of(tmp_path)
    path.write_text(path.read_text().replace("00.exr", "a/" * 3000 + "00.exr"))
    with pytest.raises(InputError, match="no readable file"):
        read_picture(read_scan(tmp_path, ScanOptions()).frames[-1].image, "srgb")


def test_images_of_colmap_without_lines_of_points_are_refused(tmp_path: Path) -> None:
    """Every second photograph was taken for the points of the one before it, and left out."""
    path = images_of(tmp_path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], *lines[1::2]]) + "\n")
    with pytest.raises(InputError, match=r"images\.txt: expected a line of points below that of 00\.exr.*found '2 "):
        read_scan(tmp_path, ScanOptions())


def test_marks_of_encoding_do_no_harm(tmp_path: Path) -> None:
    """As editors on Windows write them before the first line."""
    write_colmap(tmp_path / "colmap", photographed(2, 8), binary=False)
    write_nerfstudio(tmp_path / "nerfstudio", photographed(2, 8))
    write_replica(tmp_path / "replica", photographed(2, 8))
    texts = (
        *(tmp_path / "colmap/sparse/0").iterdir(),
        tmp_path / "nerfstudio/transforms.json",
        tmp_path / "replica/traj.txt",
    )
    for path in texts:
        path.write_text("\ufeff" + path.read_text())
    for path in tmp_path.iterdir():
        if path.is_dir():
            assert len(read_scan(path, ScanOptions()).frames) == 2


def test_empty_lines_between_images_of_colmap_and_a_last_line_that_is_missing_do_no_harm(tmp_path: Path) -> None:
    path = images_of(tmp_path)
    count = len(read_scan(tmp_path, ScanOptions()).frames)
    lines = path.read_text().rstrip("\n").splitlines()
    path.write_text("\n".join([lines[0], "", *lines[1:3], "", "", *lines[3:]]))
    assert len(read_scan(tmp_path, ScanOptions()).frames) == count == len(SCANNED)


@pytest.mark.parametrize(
    ("model", "count", "expected"), [("SIMPLE_PINHOLE", 4, 3), ("SIMPLE_RADIAL", 6, 4), ("PINHOLE", 5, 4)]
)
def test_parameters_of_colmap_that_a_model_has_not_are_refused(
    tmp_path: Path, model: str, count: int, expected: int
) -> None:
    """Those beyond the principal point became distortion."""
    path = tmp_path / "cameras.txt"
    path.write_text(" ".join(["1", model, "8", "8", *["4"] * count]))
    with pytest.raises(InputError, match=rf"cameras\.txt: expected {expected} parameters.* {model}, found {count}\."):
        read_cameras(path)


def test_a_field_of_view_in_radians_is_refused() -> None:
    with pytest.raises(InputError, match=r"fov: expected a value from 3\.2 to 179 .*radians.*found 1\.2"):
        ScanOptions(fov=1.2)

"""Photographs and depth at the size that is worked with: clipped levels, exposures, holes, and lenses that bend."""

from __future__ import annotations

import json
import struct
import tracemalloc
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import ExifTags, Image

from raycast import BLOCK, ROOM, cast, room_views
from rgspipe.datasets.display_image import read_levels
from rgspipe.datasets.exif_exposure import exposure_of
from rgspipe.datasets.exr import read_image, write_image
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.scans.frame import DepthImage, Lens
from rgspipe.datasets.scans.importing import import_scan
from rgspipe.datasets.scans.layouts import read_scan
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import _colmap_array, read_depth_image, read_picture, size_of
from rgspipe.datasets.scans.resample import resampled_colour, resampled_depth, straight_camera
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.scene import srgb
from scan_layouts import (
    lens_of,
    photographed,
    pose_of,
    write_depth,
    write_dng,
    write_exposed,
    write_hdr,
    write_nerfstudio,
    write_wide_png,
)


def imported(root: Path, **options: object) -> tuple[View, ...]:
    taken = ScanOptions(**options)
    import_scan(read_scan(root, taken), taken, root.parent / "imported")
    return load_dataset(root.parent / "imported", targets=False).train


@pytest.mark.parametrize("channels", [3, 4])
def test_sixteen_bits_are_read_whole(tmp_path: Path, channels: int) -> None:
    levels = np.random.default_rng(0).integers(0, 65536, (7, 5, channels)).astype(np.uint16)
    write_wide_png(tmp_path / "a.png", levels)
    read = read_picture(tmp_path / "a.png", "linear")
    assert np.array_equal(np.round(65535.0 * read.light.astype(np.float64)), levels[..., :3])


def test_the_response_is_srgb_or_none(tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 4, 3), 128, np.uint8)).save(tmp_path / "a.png")
    linear, curved = (read_picture(tmp_path / "a.png", response).light[0, 0, 0] for response in ("linear", "srgb"))
    assert linear == pytest.approx(128 / 255) and curved == pytest.approx(float(srgb.decode(np.array(128 / 255))))


def test_what_is_clipped_is_saturated_however_little_of_a_pixel_it_is(tmp_path: Path) -> None:
    views = [replace(view, image=0.2 * view.image) for view in photographed(3, 32)]
    views[0].image[9, 13, 1] = 4.0
    write_nerfstudio(tmp_path / "scan", views, ".png", ".png")
    read = imported(tmp_path / "scan", resolution=8)
    expected = torch.zeros(8, 8, 3, dtype=torch.bool)
    expected[2, 3, 1] = True
    assert torch.equal(read[0].saturated, expected)
    assert not any(bool(view.saturated.any()) for view in read[1:])


def test_photographs_are_made_alike_by_what_they_state(tmp_path: Path) -> None:
    views = photographed(3, 32)
    seconds = (0.01, 0.02, 0.04)
    write_nerfstudio(tmp_path / "scan", views, ".jpg", ".png")
    for index, (view, shutter) in enumerate(zip(views, seconds, strict=True)):
        write_exposed(tmp_path / f"scan/images/{index}.jpg", 0.25 * shutter / 0.01 * view.image.numpy(), shutter)
    assert exposure_of(tmp_path / "scan/images/1.jpg") == pytest.approx(0.02 * 200 / 4)
    for exposure, expected in (("exif", [0.5, 0.5, 0.5]), ("same", [0.25, 0.5, 1.0])):
        read = imported(tmp_path / "scan", exposure=exposure)
        means = [float(a.image.median() / b.image.median()) for a, b in zip(read, views, strict=True)]
        assert means == pytest.approx(expected, rel=0.03), exposure
        limits = [view.saturated_from for view in read]
        assert limits[0] / limits[2] == pytest.approx(4.0 if exposure == "exif" else 1.0)


def test_photographs_some_of_which_state_nothing_are_alike_or_refused(tmp_path: Path) -> None:
    """One that stated nothing made nobody's exposure count, and no word was said."""
    views = photographed(3, 32)
    write_nerfstudio(tmp_path / "scan", views, ".jpg", ".png")
    written = [tmp_path / f"scan/images/{index}.jpg" for index in range(3)]
    write_exposed(written[0], views[0].image.numpy(), 0.01)
    write_exposed(written[2], views[2].image.numpy(), 0.0102)
    assert len(imported(tmp_path / "scan")) == 3
    write_exposed(written[2], views[2].image.numpy(), 0.04)
    with pytest.raises(InputError, match=r"images/1\.jpg: .*differ by a factor of 4, found .* 1 of 3.*exposure='same'"):
        imported(tmp_path / "scan")
    assert len(imported(tmp_path / "scan", exposure="same")) == 3


def test_holes_of_depth_stay_holes(tmp_path: Path) -> None:
    depth = np.full((16, 16), 2.0)
    depth[:8, :8] = 0.0
    depth[12, 12] = np.inf
    write_depth(tmp_path / "a.png", depth, 1000.0)
    read = read_depth_image(DepthImage(tmp_path / "a.png", 1e-3))
    lens = Lens(16.0, 16.0, 8.0, 8.0, 16, 16)
    small = resampled_depth(read, straight_camera(lens, np.eye(4), 8, tmp_path), lens)
    assert np.isnan(small[:4, :4]).all() and np.isfinite(small).sum() == 48
    assert np.nanmax(np.abs(small - 2.0)) < 1e-6


def test_the_highest_level_of_depth_is_no_distance(tmp_path: Path) -> None:
    write_depth(tmp_path / "a.png", np.array([[65535.0, 65534.0, 1.0]]), 1.0)
    read = read_depth_image(DepthImage(tmp_path / "a.png", 1.0))
    assert np.array_equal(read, np.array([[np.nan, 65534.0, 1.0]], np.float32), equal_nan=True)


@pytest.mark.parametrize("shape", [(3, 4), (3, 4, 1)])
def test_depth_of_numpy_is_read(tmp_path: Path, shape: tuple) -> None:
    depth = np.arange(1.0, 13.0, dtype=np.float32)
    np.save(tmp_path / "a.npy", depth.reshape(shape))
    assert np.array_equal(read_depth_image(DepthImage(tmp_path / "a.npy", 2.0)), 2.0 * depth.reshape(3, 4))


@pytest.mark.parametrize(
    "stored", [np.ones((3, 4, 2)), np.ones(12), np.array([[None]]), np.ones((0, 4)), np.ones((3, 4), bool)]
)
def test_other_arrays_of_numpy_are_no_depth(tmp_path: Path, stored: np.ndarray) -> None:
    np.save(tmp_path / "a.npy", stored)
    with pytest.raises(InputError, match=r"a\.npy: expected an array \(H, W\) of depth"):
        read_depth_image(DepthImage(tmp_path / "a.npy", 1.0))


@pytest.mark.parametrize("kind", ["8 bits", "colours"])
def test_pictures_of_depth_are_refused(tmp_path: Path, kind: str) -> None:
    shape = (4, 4) if kind == "8 bits" else (4, 4, 3)
    Image.fromarray(np.full(shape, 9, np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(InputError, match="16 bits of grey"):
        read_depth_image(DepthImage(tmp_path / "a.png", 1e-3))


def test_depth_in_whole_metres_is_refused(tmp_path: Path) -> None:
    """It is what `depth.astype(np.uint16)` leaves of metres; in millimetres no surface comes of it, without a word."""
    Image.fromarray(np.array([[0, 1], [4, 65535]], np.uint16)).save(tmp_path / "a.png")
    with pytest.raises(InputError, match="found levels up to 4, as of depth in metres that was rounded"):
        read_depth_image(DepthImage(tmp_path / "a.png", 1e-3))


def test_smaller_images_are_means_and_depth_of_planes_stays_in_them() -> None:
    (fine,), (coarse,) = room_views(1, 128), room_views(1, 32)
    lens = lens_of(fine)
    image = np.random.default_rng(0).random((128, 128, 3)).astype(np.float32)
    camera = straight_camera(lens, pose_of(fine), 32, Path("a"))
    colour, clipped = resampled_colour(image, None, camera, lens)
    assert np.abs(colour - image.reshape(32, 4, 32, 4, 3).mean(axis=(1, 3))).max() < 1e-6 and not clipped.any()
    depth = resampled_depth(fine.depth.numpy(), camera, lens)
    miss = np.abs(depth / coarse.depth.numpy() - 1.0)
    # Within faces a median of 16 pixels is the middle of the plane: measured 2e-5; edges are the rest.
    assert np.quantile(miss, 0.9) < 1e-4


def test_an_image_of_one_row_costs_what_its_pixels_cost() -> None:
    """30 000 columns become 8: 3750² samples in each pixel, as many rows as columns, took gigabytes."""
    wide = Lens(30_000.0, 30_000.0, 15_000.0, 0.5, 30_000, 1)
    depth = np.full((1, 30_000), 2.0, np.float32)
    tracemalloc.start()
    found = resampled_depth(depth, straight_camera(wide, np.eye(4), 8, Path("wide.png")), wide)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.shape == (1, 8) and np.all(found == 2.0)
    assert peak < 2**29  # Measured: 234 MiB.


def test_lines_that_a_lens_bends_are_straight_again() -> None:
    """Against rays of the room through the camera that is made."""
    (view,) = room_views(1, 128)
    known = (
        ((-0.12, 0.03), (0.002, -0.001), ()),
        ((0.08, 0.0, 0.01, 0.0), (0.0, 0.0), ()),
        ((-0.05, 0.01, 0.002), (0.001, 0.0), (0.08, 0.01, 0.003)),
    )
    for radial, tangential, rational in known:
        lens = replace(lens_of(view, radial, tangential), rational=rational)
        depth = _bent_depth(view, lens)
        camera = straight_camera(lens, pose_of(view), 64, Path("a"))
        found = resampled_depth(depth, camera, lens)
        _, directions, lengths = camera.rays()
        distance, _ = cast([ROOM, BLOCK], camera.origin.numpy(), directions.numpy())
        truth = (distance / lengths.numpy()).reshape(found.shape)
        assert np.isfinite(found).all(), "every pixel lies in the photograph"
        # Measured 6e-6; without the lens it is 0.022 and 0.010.
        assert np.median(np.abs(found / truth - 1.0)) < 2e-5
        straight = resampled_depth(depth, camera, replace(lens, radial=(), rational=()))
        assert np.median(np.abs(straight / truth - 1.0)) > 0.005


def _bent_depth(view: View, lens: Lens) -> np.ndarray:
    """Planar depth at the pixels of a lens, by solving for each one's ray."""
    column, row = np.meshgrid(np.arange(lens.width) + 0.5, np.arange(lens.height) + 0.5)
    wanted_x, wanted_y = (column - lens.cx) / lens.fx, (row - lens.cy) / lens.fy
    x, y = wanted_x.copy(), wanted_y.copy()
    for _ in range(50):
        u, v = lens.places(x, y)
        x, y = x + wanted_x - (u - lens.cx) / lens.fx, y + wanted_y - (v - lens.cy) / lens.fy
    local = np.stack([x, -y, -np.ones_like(x)], axis=-1).reshape(-1, 3)
    directions = local @ pose_of(view)[:3, :3].T
    lengths = np.linalg.norm(directions, axis=1)
    distance, _ = cast([ROOM, BLOCK], pose_of(view)[:3, 3], directions / lengths[:, None])
    return (distance / lengths).reshape(lens.height, lens.width).astype(np.float32)


def test_a_lens_that_folds_the_image_is_refused() -> None:
    lens = Lens(40.0, 40.0, 32.0, 32.0, 64, 64, (-30.0,))
    with pytest.raises(InputError, match="distortion"):
        straight_camera(lens, np.eye(4), 64, Path("a.png"))


def test_no_photograph_is_made_larger_than_it_is(tmp_path: Path) -> None:
    """Intrinsics of twice the size made 48 pixels 96."""
    views = photographed(3, 48)
    write_nerfstudio(tmp_path / "scan", views)
    path = tmp_path / "scan/transforms.json"
    content = json.loads(path.read_text())
    content |= {key: 2 * content[key] for key in ("w", "h", "fl_x", "fl_y", "cx", "cy")}
    path.write_text(json.dumps(content))
    for read, view in zip(imported(tmp_path / "scan", resolution=96), views, strict=True):
        assert (read.camera.width, read.camera.height) == (48, 48)
        assert read.camera.fx == pytest.approx(view.camera.fx) and read.camera.cx == pytest.approx(view.camera.cx)
        assert torch.allclose(read.image, view.image, atol=1e-6)


@pytest.mark.parametrize(
    ("size", "stated", "turned", "taken"),
    [
        ((48, 32), (96, 64), 6, True),
        ((48, 32), (32, 48), 6, False),
        ((48, 32), None, 6, False),
        ((48, 32), (48, 32), 3, False),
        ((48, 48), (48, 48), 8, False),
    ],
)
def test_a_photograph_on_its_side_is_taken_as_stored_where_intrinsics_say_so(
    tmp_path: Path, size: tuple, stated: tuple | None, turned: int, taken: bool
) -> None:
    """COLMAP ignores the tag, so that its intrinsics are of the pixels as they are stored."""
    levels = np.random.default_rng(0).integers(0, 256, (size[1], size[0], 3)).astype(np.uint8)
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = turned
    Image.fromarray(levels).save(tmp_path / "a.png", exif=exif)
    if taken:
        light = read_picture(tmp_path / "a.png", "linear", stated).light
        assert np.array_equal(np.round(255.0 * light), levels)
        return
    with pytest.raises(InputError, match=f"orientation {turned}"):
        read_picture(tmp_path / "a.png", "linear", stated)


@pytest.mark.parametrize("kept", [255, 1])
def test_masked_pixels_are_left_out_however_little_of_one_is_masked(tmp_path: Path, kept: int) -> None:
    """Programs write masks of 0 and 255, or of 0 and 1."""
    views = photographed(3, 32)
    write_nerfstudio(tmp_path / "scan", views)
    levels = np.full((32, 32), kept, np.uint8)
    levels[9, 13] = 0
    Image.fromarray(levels).save(tmp_path / "scan/mask.png")
    path = tmp_path / "scan/transforms.json"
    content = json.loads(path.read_text())
    content["frames"][0]["mask_path"] = "mask.png"
    path.write_text(json.dumps(content))
    read = imported(tmp_path / "scan", resolution=8)
    expected = torch.ones(8, 8)
    expected[2, 3] = 0.0
    assert torch.equal(read[0].alpha, expected) and bool(read[1].alpha.all())
    assert torch.equal(read[0].depth.isnan(), expected == 0.0)


@pytest.mark.parametrize("suffix", [".png", ".16.png", ".exr"])
def test_what_of_a_photograph_is_not_opaque_does_not_count(tmp_path: Path, suffix: str) -> None:
    """Its colours, which programs make white or black, were taken for light."""
    write_nerfstudio(tmp_path / "scan", photographed(3, 32), suffix)
    path = tmp_path / f"scan/images/0{suffix}"
    alpha = np.ones((32, 32), np.float32)
    alpha[9, 13] = 0.0
    _with_alpha(path, alpha)
    read = imported(tmp_path / "scan", resolution=8)
    expected = torch.ones(8, 8)
    expected[2, 3] = 0.0
    assert torch.equal(read[0].alpha, expected) and bool(read[1].alpha.all())
    assert torch.equal(read[0].depth.isnan(), expected == 0.0)
    _with_alpha(path, 0.0 * alpha)
    with pytest.raises(InputError, match=r"images/0.*: expected a photograph with pixels that are opaque, found none"):
        imported(tmp_path / "scan", resolution=8)


def _with_alpha(path: Path, alpha: np.ndarray) -> None:
    if path.suffix == ".exr":
        write_image(path, read_image(path)[0] * alpha[..., None], alpha)
        return
    levels = read_levels(path).levels
    opaque = (np.iinfo(levels.dtype).max * alpha).astype(levels.dtype)
    write = write_wide_png if levels.dtype == np.uint16 else lambda path, levels: Image.fromarray(levels).save(path)
    write(path, np.dstack([levels, opaque]))


def test_a_fisheye_lens_is_undone(tmp_path: Path) -> None:
    """Angles grow as θ (1 + 0.05 θ²) from the middle; beyond the crop nothing is asked."""
    lens = Lens(30.0, 30.0, 32.0, 32.0, 64, 64, (0.05,), fisheye=True)
    angle, turn = 0.7, 0.4
    x, y = np.tan(angle) * np.cos(turn), np.tan(angle) * np.sin(turn)
    column, row = lens.places(np.array([x, 0.0]), np.array([y, 0.0]))
    far = 30.0 * angle * (1.0 + 0.05 * angle**2)
    assert np.allclose(column, [32.0 + far * np.cos(turn), 32.0]) and np.allclose(
        row, [32.0 + far * np.sin(turn), 32.0]
    )
    # A picture of the angle's tangent across, which a camera without distortion shows as a ramp.
    rays = np.linspace(-1.9, 1.9, 4001)
    at = lens.places(rays, np.zeros_like(rays))[0]
    image = np.repeat(np.interp(np.arange(64) + 0.5, at, rays)[None, :, None], 64, axis=0).repeat(3, axis=2)
    camera = straight_camera(lens, np.eye(4), 64, tmp_path)
    found, _ = resampled_colour(image.astype(np.float32), None, camera, lens)
    expected = (np.arange(camera.width) + 0.5 - camera.cx) / camera.fx
    assert np.abs(found[32, 2:-2, 0] - expected[2:-2]).max() < 2e-3  # measured 9e-4, of interpolation


def test_raw_photographs_are_read_without_a_curve_in_their_white_balance(tmp_path: Path) -> None:
    pytest.importorskip("rawpy")
    levels = np.full((64, 96), 500, np.uint16)
    levels[0::2, 1::2] = levels[1::2, 0::2] = 1000
    levels[:, 48:] *= 2
    levels[40:] = 4095
    write_dng(tmp_path / "a.dng", levels)
    read = read_picture(tmp_path / "a.dng", "srgb")
    for column, level in ((20, 1000), (80, 2000)):
        assert np.abs(read.light[20, column] - level / 4095).max() < 1e-3
    assert bool((read.light[50:] >= read.clipped_from).all()) and not bool((read.light[:36] >= read.clipped_from).any())
    (tmp_path / "half.dng").write_bytes((tmp_path / "a.dng").read_bytes()[:900])
    with pytest.raises(InputError, match=r"half\.dng.*raw photograph"):
        read_picture(tmp_path / "half.dng", "srgb")


@pytest.mark.parametrize("side", [13_000, 60_000])
def test_a_photograph_that_claims_a_huge_size_is_never_decoded(tmp_path: Path, side: int) -> None:
    """Pillow refuses the larger one itself; of a PNG it decodes all pixels to get to what EXIF says."""
    path = tmp_path / "bomb.png"
    Image.new("RGB", (8, 8)).save(path)
    content = bytearray(path.read_bytes())
    content[16:24] = struct.pack(">II", side, side)
    content[29:33] = struct.pack(">I", zlib.crc32(content[12:29]))
    path.write_bytes(content)
    for read in (exposure_of, size_of, lambda path: read_picture(path, "srgb")):
        try:
            assert read(path) in (None, (side, side))
        except InputError as error:
            assert "bomb.png" in str(error)


@pytest.mark.parametrize("packed", [True, False])
def test_radiance_pictures_come_back(tmp_path: Path, packed: bool) -> None:
    light = np.random.default_rng(0).lognormal(0.0, 3.0, (5, 21, 3)).astype(np.float32)
    light[2] = 0.25
    write_hdr(tmp_path / "a.hdr", light, packed)
    read = read_picture(tmp_path / "a.hdr", "srgb").light
    assert np.abs(read - light).max(axis=2).max() / light.max() < 1 / 256
    assert (np.abs(read - light) <= light.max(axis=2, keepdims=True) / 250).all()
    for length in (10, 80, (tmp_path / "a.hdr").stat().st_size - 1):
        (tmp_path / "b.hdr").write_bytes((tmp_path / "a.hdr").read_bytes()[:length])
        with pytest.raises(InputError, match=r"b\.hdr"):
            read_picture(tmp_path / "b.hdr", "srgb")


@pytest.mark.parametrize("channels", [0, -1])
def test_depth_of_colmap_without_a_channel_is_refused(tmp_path: Path, channels: int) -> None:
    (tmp_path / "a.bin").write_bytes(b"4&4&%d&" % channels + bytes(64))
    with pytest.raises(InputError, match="channels"):
        _colmap_array(tmp_path / "a.bin")

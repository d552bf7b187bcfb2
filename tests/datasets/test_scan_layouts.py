"""A small room written in the layouts of other programs and read again, and folders that have none of them."""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from raycast import room_views
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.scans.importing import Imported, import_scan
from rgspipe.datasets.scans.layouts import READERS, read_scan
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.pictures import read_depth_image
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from scan_layouts import (
    FLIP,
    photographed,
    pose_of,
    write_colmap,
    write_depth,
    write_iid,
    write_interiorverse,
    write_nerfstudio,
    write_openrooms,
    write_photograph,
    write_polycam,
    write_replica,
    write_scannet,
    write_wide_png,
)

SIZE = 32
VIEWS = photographed(4, SIZE)


def back(root: Path, **options: object) -> tuple[Imported, tuple[View, ...]]:
    """What is imported of a folder at the size that its photographs have."""
    taken = ScanOptions(**({"resolution": SIZE} | options))
    folder = root.parent / "imported"
    made = import_scan(read_scan(root, taken), taken, folder)
    return made, load_dataset(folder, targets=False).train


def off(read: Sequence[View], written: Sequence[View]) -> tuple[float, float]:
    """The largest difference of a pose, and the largest relative one of a depth."""
    poses = [
        (a.camera.camera_to_world - b.camera.camera_to_world).abs().max() for a, b in zip(read, written, strict=True)
    ]
    depths = [((a.depth - b.depth).abs() / b.depth).nan_to_num().max() for a, b in zip(read, written, strict=True)]
    return float(torch.stack(poses).max()), float(torch.stack(depths).max())


@pytest.mark.parametrize(
    ("layout", "write"),
    [
        ("nerfstudio", write_nerfstudio),
        ("colmap", lambda root, views: write_colmap(root, views, binary=False)),
        ("colmap", lambda root, views: write_colmap(root, views, binary=True)),
    ],
    ids=["nerfstudio", "colmap text", "colmap binary"],
)
def test_floats_come_back_as_they_were(tmp_path: Path, layout: str, write: Callable) -> None:
    write(tmp_path / "scan", VIEWS)
    made, views = back(tmp_path / "scan")
    assert made.frames == made.with_depth == 4 and made.known == 1.0
    assert read_scan(tmp_path / "scan", ScanOptions()).layout == layout
    assert max(off(views, VIEWS)) < 1e-12
    for read, written in zip(views, VIEWS, strict=True):
        assert torch.equal(read.image, written.image)
        assert read.saturated_from is None
        assert (read.camera.fx, read.camera.cx) == (written.camera.fx, written.camera.cx)


@pytest.mark.parametrize(("suffix", "levels"), [(".png", 255), (".16.png", 65535)])
def test_levels_come_back_to_half_of_one(tmp_path: Path, suffix: str, levels: int) -> None:
    write_nerfstudio(tmp_path / "scan", VIEWS, suffix, ".png")
    _, views = back(tmp_path / "scan")
    # sRGB is nowhere steeper than 2.3 (linear over encoded), and depth is in millimetres.
    worst = max(float((a.image - b.image).abs().max()) for a, b in zip(views, VIEWS, strict=True))
    assert worst < 2.3 * 0.5 / levels + 1e-6
    nearest = min(float(view.depth.min()) for view in VIEWS)
    assert off(views, VIEWS)[1] < 0.00051 / nearest


def test_scale_of_nerfstudio_is_undone(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path / "scan", VIEWS, shared={"applied_scale": 0.25})
    path = tmp_path / "scan/transforms.json"
    content = json.loads(path.read_text())
    for frame in content["frames"]:
        for row in frame["transform_matrix"][:3]:
            row[3] *= 0.25
    path.write_text(json.dumps(content))
    assert max(off(back(tmp_path / "scan")[1], VIEWS)) < 1e-12


def test_polycam_comes_back_with_its_own_size_of_depth(tmp_path: Path) -> None:
    views, coarse = photographed(3, 128), room_views(3, 64)
    write_polycam(tmp_path / "scan", views, coarse)
    assert read_scan(tmp_path / "scan", ScanOptions()).layout == "polycam"
    _, read = back(tmp_path / "scan", resolution=128)
    assert off(read, views)[0] < 1e-12
    # The unsure first row is two of ours, as they lie in it; and so wide is the rim, which may be black.
    inside = np.s_[2:-2, 2:-2]
    assert all(bool((view.alpha > 0).sum() == 124**2) and bool(view.depth[inside].isfinite().all()) for view in read)
    misses = torch.cat(
        [((a.depth - b.depth).abs() / b.depth)[inside].reshape(-1) for a, b in zip(read, views, strict=True)]
    )
    # Half a millimetre of half a unit to one; the rest is at edges. Measured 0.0003 and 0.0009.
    assert float(misses.median()) < 0.0006 and float(misses.quantile(0.8)) < 0.002


def test_polycam_that_was_not_corrected_is_read_as_it_was_taken(tmp_path: Path) -> None:
    """An empty folder of corrected cameras beside the others was refused."""
    write_polycam(tmp_path, VIEWS, VIEWS)
    for kind in ("cameras", "images"):
        (tmp_path / f"keyframes/corrected_{kind}").rename(tmp_path / f"keyframes/{kind}")
    (tmp_path / "keyframes/corrected_cameras").mkdir()
    frames = read_scan(tmp_path, ScanOptions()).frames
    assert [frame.image.parent.name for frame in frames] == ["images"] * len(VIEWS)
    assert frames[0].border == 0.0  # no distortion was undone


def test_replica_comes_back(tmp_path: Path) -> None:
    write_replica(tmp_path / "scans/room0", VIEWS)
    _, views = back(tmp_path / "scans/room0")
    pose, depth = off(views, VIEWS)
    assert pose < 1e-12 and depth < 0.5 / 6553.5 / min(float(view.depth.min()) for view in VIEWS) + 1e-6
    assert views[0].camera.cx == VIEWS[0].camera.cx
    # JPEG at quality 95 halves the resolution of colours: measured 0.009.
    assert all(float((a.image - b.image).abs().median()) < 0.02 for a, b in zip(views, VIEWS, strict=True))


def test_replica_comes_back_as_semantic_nerf_has_it(tmp_path: Path) -> None:
    """Frames 9 and 10 of twelve poses, which go by numbers and not by letters."""
    views = dict(zip((3, 9, 10), VIEWS[:3], strict=True))
    for number, view in views.items():
        write_photograph(tmp_path / f"scan/rgb/rgb_{number}.png", view.image.numpy())
        write_depth(tmp_path / f"scan/depth/depth_{number}.png", view.depth.numpy(), 1000.0)
    poses = [pose_of(views[number]) @ FLIP if number in views else np.eye(4) for number in range(12)]
    np.savetxt(tmp_path / "scan/traj_w_c.txt", np.reshape(poses, (12, 16)))
    field = float(np.degrees(2.0 * np.arctan(0.5 * SIZE / VIEWS[0].camera.fx)))
    _, read = back(tmp_path / "scan", fov=field)
    pose, depth = off(read, VIEWS[:3])
    assert pose < 1e-12 and depth < 0.5e-3 / min(float(view.depth.min()) for view in VIEWS) + 1e-6
    lens = read_scan(tmp_path / "scan", ScanOptions()).frames[0].lens
    assert lens.fx == pytest.approx(0.5 * SIZE, rel=1e-12) and lens.cx == 0.5 * SIZE
    (tmp_path / "scan/rgb/rgb_3.png").rename(tmp_path / "scan/rgb/rgb_12.png")
    with pytest.raises(InputError, match=r"12 poses, and images up to 12"):
        read_scan(tmp_path / "scan", ScanOptions())


@pytest.mark.parametrize("scale", [0.0, -1.0])
def test_steps_of_depth_that_cannot_be_are_refused_where_they_stand(tmp_path: Path, scale: float) -> None:
    write_replica(tmp_path / "scans/room0", VIEWS)
    path = tmp_path / "scans/cam_params.json"
    content = json.loads(path.read_text())
    content["camera"]["scale"] = scale
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"cam_params.json: camera.scale: .*above 0"):
        read_scan(tmp_path / "scans/room0", ScanOptions())


def test_scannet_comes_back_without_lost_frames_and_with_depth_of_its_own_lens(tmp_path: Path) -> None:
    write_scannet(tmp_path / "scan", VIEWS)
    made, views = back(tmp_path / "scan")
    left = [VIEWS[0], *VIEWS[2:]]
    assert "1 of 4 frames" in made.notes[0]
    assert off(views, left)[0] < 1e-12
    for read, written in zip(views, left, strict=True):
        miss = (read.depth - written.depth)[::2, ::2].abs()
        assert float(miss.max()) < 0.00051, "every second pixel is one of the depth image"


@pytest.mark.parametrize("shift", [6, 8])
def test_depth_of_scannet_that_shows_less_than_the_photograph_is_known_there_alone(tmp_path: Path, shift: int) -> None:
    """The border of the depth image went on for ever."""
    write_scannet(tmp_path / "scan", VIEWS[:1])
    intrinsics = tmp_path / "scan/intrinsic"
    matrix = np.loadtxt(intrinsics / "intrinsic_color.txt")
    matrix[:2, 2] -= shift
    np.savetxt(intrinsics / "intrinsic_depth.txt", matrix)
    seen = slice(shift, shift + 16)
    write_depth(tmp_path / "scan/depth/0.png", VIEWS[0].depth.numpy()[seen, seen], 1000.0)
    _, (view,) = back(tmp_path / "scan")
    shown = torch.zeros(SIZE, SIZE, dtype=torch.bool)
    shown[seen, seen] = True
    assert torch.equal(view.depth.isfinite(), shown)
    # Half a millimetre is a step's; single precision is the rest.
    assert float((view.depth - VIEWS[0].depth)[shown].abs().max()) < 0.00051


@pytest.mark.parametrize("name", ["color", "depth"])
def test_cameras_of_scannet_in_two_places_are_refused(tmp_path: Path, name: str) -> None:
    write_scannet(tmp_path / "scan", VIEWS)
    path = tmp_path / f"scan/intrinsic/extrinsic_{name}.txt"
    np.savetxt(path, np.eye(4))
    read_scan(tmp_path / "scan", ScanOptions())
    beside = np.eye(4)
    beside[0, 3] = 0.3
    np.savetxt(path, beside)
    with pytest.raises(InputError, match=rf"extrinsic_{name}\.txt: expected the identity"):
        read_scan(tmp_path / "scan", ScanOptions())


def test_one_photograph_with_predictions_comes_back(tmp_path: Path) -> None:
    write_iid(tmp_path / "scan", VIEWS[0], (24, 40))
    made, (view,) = back(tmp_path / "scan", fov=np.degrees(1.4))
    assert view.camera.fx == pytest.approx(VIEWS[0].camera.fx)
    # Pixels of another shape show the same field; measured 0.004.
    ratio = (view.depth / VIEWS[0].depth).log()
    assert float((ratio - ratio.median()).abs().median()) < 0.006
    assert float(view.depth.median()) == pytest.approx(1.0, abs=0.05)
    assert float((view.albedo - 0.5 * VIEWS[0].image).abs().max()) == 0.0
    assert any("not in metres" in note for note in made.notes)


@pytest.mark.parametrize("response", ["srgb", "linear"])
def test_albedo_in_levels_is_in_srgb_whatever_the_photograph_is(tmp_path: Path, response: str) -> None:
    write_iid(tmp_path / "scan", VIEWS[0], (SIZE, SIZE))
    (tmp_path / "scan/albedo.exr").unlink()
    write_photograph(tmp_path / "scan/albedo.png", np.full((SIZE, SIZE, 3), 0.5))
    _, (view,) = back(tmp_path / "scan", response=response)
    # Measured 0.003: half a level is up to 0.0033; read as linear it is 0.74.
    assert float((view.albedo - 0.5).abs().max()) < 0.0034


def test_interiorverse_comes_back_with_the_diffuse_part_of_its_albedo(tmp_path: Path) -> None:
    root = tmp_path / "scenes_80" / "L3D"
    write_interiorverse(root, VIEWS[:2])
    with pytest.raises(InputError, match=r"2 \(000_im\.exr, 001_im\.exr\)"):
        read_scan(root, ScanOptions())
    made, (view,) = back(root, photograph="001_im")
    assert "80°" in made.notes[0] and view.camera.fx == pytest.approx(16.0 / np.tan(np.radians(40.0)))
    assert torch.equal(view.image, VIEWS[1].image) and view.saturated_from is None
    assert bool(view.depth[0, 0].isnan())
    assert float((view.depth / VIEWS[1].depth - 1.0).nan_to_num().abs().max()) < 1e-6
    assert float((view.albedo - 0.6 * VIEWS[1].image).abs().max()) < 1e-6


def test_openrooms_comes_back(tmp_path: Path) -> None:
    write_openrooms(tmp_path / "scan", VIEWS)
    made, views = back(tmp_path / "scan", fov=np.degrees(1.4))
    assert made.with_depth == 4 and read_scan(tmp_path / "scan", ScanOptions()).layout == "openrooms"
    pose, depth = off(views, VIEWS)
    assert pose < 1e-12 and depth < 1e-12
    for read, written in zip(views, VIEWS, strict=True):
        # Eight bits of the brightest channel: half of one is 1/256 to 1/512 of it.
        assert float((read.image - written.image).abs().max() / written.image.max()) < 1.0 / 256
        assert float((read.albedo - written.image).abs().max()) < 2.3 * 0.5 / 255 + 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace(text.splitlines()[1], "1 2"), "three finite numbers"),
        (lambda text: "\n".join(text.splitlines()[:-1]), "4 cameras of three lines, found 11"),
        (lambda text: "\n".join(text.splitlines()[1:-1]), "three lines a camera"),
        (lambda text: "\n".join(["2", *text.splitlines()[1:7]]), r"2 cameras and 4 images, the last im_4\.hdr"),
        (lambda text: text.replace(text.splitlines()[2], text.splitlines()[1]), "camera 1"),
    ],
)
def test_broken_cameras_of_openrooms_are_refused(tmp_path: Path, change: Callable, words: str) -> None:
    write_openrooms(tmp_path, VIEWS)
    path = tmp_path / "cam.txt"
    path.write_text(change(path.read_text()))
    with pytest.raises(InputError, match=words):
        read_scan(tmp_path, ScanOptions())


@pytest.mark.parametrize(
    ("model", "values"),
    [
        ("OPENCV_FISHEYE", 8),
        ("RADIAL_FISHEYE", 5),
        ("SIMPLE_RADIAL_FISHEYE", 4),
        ("FISHEYE", 4),
        ("SIMPLE_FISHEYE", 3),
    ],
)
@pytest.mark.parametrize("binary", [False, True])
def test_fisheye_lenses_of_colmap_are_read(tmp_path: Path, model: str, values: int, binary: bool) -> None:
    write_colmap(tmp_path, VIEWS[:1], binary=binary)
    focal = [20.0, 21.0] if model in ("OPENCV_FISHEYE", "FISHEYE") else [20.0]
    numbers = [*focal, 16.0, 15.0, *np.linspace(0.1, 0.01, values - 2 - len(focal)).tolist()]
    folder = tmp_path / "sparse/0"
    if binary:
        kinds = {"OPENCV_FISHEYE": 5, "SIMPLE_RADIAL_FISHEYE": 8, "RADIAL_FISHEYE": 9}
        kind = (kinds | {"SIMPLE_FISHEYE": 14, "FISHEYE": 15})[model]
        content = struct.pack(f"<QiiQQ{values}d", 1, 7, kind, SIZE, SIZE, *numbers)
        (folder / "cameras.bin").write_bytes(content)
    else:
        (folder / "cameras.txt").write_text(f"7 {model} {SIZE} {SIZE} {' '.join(map(repr, numbers))}\n")
    lens = read_scan(tmp_path, ScanOptions()).frames[0].lens
    assert lens.fisheye and lens.bends and (lens.fx, lens.fy) == (20.0, focal[-1])
    assert lens.radial == tuple(numbers[len(focal) + 2 :])


@pytest.mark.parametrize("binary", [False, True])
def test_the_rational_lens_of_colmap_is_read(tmp_path: Path, binary: bool) -> None:
    """FULL_OPENCV has k3 after the two tangential terms, and k4 to k6 below the line."""
    write_colmap(tmp_path, VIEWS[:1], binary=binary)
    values = [20.0, 21.0, 16.0, 15.0, 0.1, 0.02, 0.003, 0.004, 0.05, 0.06, 0.007, 0.008]
    if binary:
        content = struct.pack("<QiiQQ12d", 1, 7, 6, SIZE, SIZE, *values)
        (tmp_path / "sparse/0/cameras.bin").write_bytes(content)
    else:
        line = f"7 FULL_OPENCV {SIZE} {SIZE} {' '.join(map(repr, values))}\n"
        (tmp_path / "sparse/0/cameras.txt").write_text(line)
    lens = read_scan(tmp_path, ScanOptions()).frames[0].lens
    x, y, r = 0.3, -0.4, 0.25  # r²
    bent = (1 + 0.1 * r + 0.02 * r**2 + 0.05 * r**3) / (1 + 0.06 * r + 0.007 * r**2 + 0.008 * r**3)
    u = 20.0 * (x * bent + 2 * 0.003 * x * y + 0.004 * (r + 2 * x**2)) + 16.0
    v = 21.0 * (y * bent + 0.003 * (r + 2 * y**2) + 2 * 0.004 * x * y) + 15.0
    np.testing.assert_allclose(lens.places(np.array([x]), np.array([y])), [[u], [v]], rtol=1e-14)


def test_of_several_models_the_largest_is_taken_and_said(tmp_path: Path) -> None:
    write_colmap(tmp_path / "few", VIEWS[:2], binary=True)
    write_colmap(tmp_path / "scan", VIEWS, binary=True)
    (tmp_path / "scan/sparse/0").rename(tmp_path / "scan/sparse/10")
    for name in ("0", "2"):
        shutil.copytree(tmp_path / "few/sparse/0", tmp_path / f"scan/sparse/{name}")
    scan = read_scan(tmp_path / "scan", ScanOptions())
    assert len(scan.frames) == len(VIEWS) and scan.stated.parent.name == "10"
    assert f"10 with {len(VIEWS)} of {len(VIEWS) + 4} photographs" in scan.notes[1]


@pytest.mark.parametrize(("broken", "file"), [("0", "images"), ("2", "images"), ("2", "cameras")])
def test_a_model_beside_others_that_cannot_be_read_is_left_out_and_said(tmp_path: Path, broken: str, file: str) -> None:
    """It took the whole capture with it."""
    write_colmap(tmp_path / "scan", VIEWS, binary=True)
    (tmp_path / "scan/sparse/0").rename(tmp_path / "scan/sparse/1")
    write_colmap(tmp_path / "few", VIEWS[:2], binary=True)
    shutil.copytree(tmp_path / "few/sparse/0", tmp_path / f"scan/sparse/{broken}")
    path = tmp_path / f"scan/sparse/{broken}/{file}.bin"
    path.write_bytes(path.read_bytes()[:-9])
    scan = read_scan(tmp_path / "scan", ScanOptions())
    assert len(scan.frames) == len(VIEWS) and scan.stated.parent.name == "1"
    assert "left out" in scan.notes[1] and str(path) in scan.notes[1] and len(scan.notes) == 2
    path.unlink()  # which is no model, of which nothing needs to be said
    assert len(read_scan(tmp_path / "scan", ScanOptions()).notes) == 1


def test_inverse_depth_beside_a_model_is_read_by_its_scale_and_offset(tmp_path: Path) -> None:
    write_colmap(tmp_path / "scan", VIEWS, binary=True, depth=False)
    (tmp_path / "scan/depths").mkdir()
    stated, nearest = {}, [1.0 / float(view.depth.min()) for view in VIEWS]
    for index, (view, near) in enumerate(zip(VIEWS, nearest, strict=True)):
        levels = np.round(65536 * (1.0 / view.depth.numpy() - 0.05) / near).astype(np.uint16)
        Image.fromarray(levels).save(tmp_path / f"scan/depths/{index:02d}.png")
        stated[f"{index:02d}"] = {"scale": near, "offset": 0.05}
    # Of these 3D Gaussian Splatting uses no depth, either.
    stated["00"]["scale"], stated["01"]["scale"] = 0.0, 50.0 * nearest[1]
    (tmp_path / "scan/sparse/0/depth_params.json").write_text(json.dumps(stated))
    scan = read_scan(tmp_path / "scan", ScanOptions(pose_unit=2.0))
    assert [frame.depth is None for frame in scan.frames[:4]] == [True, True, False, False]
    for frame, view in zip(scan.frames[2:], VIEWS[2:], strict=True):
        # Half a level of 65536 is up to 1e-4 of the farthest depth.
        np.testing.assert_allclose(read_depth_image(frame.depth), 2.0 * view.depth.numpy(), rtol=1e-4)
    (tmp_path / "scan/sparse/0/depth_params.json").write_text('{"00": {"scale": 1}}')
    with pytest.raises(InputError, match=r'depth_params\.json: 00.*"offset"'):
        read_scan(tmp_path / "scan", ScanOptions())


def test_folders_of_scannetpp_are_read(tmp_path: Path) -> None:
    write_colmap(tmp_path, VIEWS, binary=False)
    (tmp_path / "sparse/0").rename(tmp_path / "colmap")
    (tmp_path / "images").rename(tmp_path / "resized_images")
    write_wide_png(tmp_path / "0.png", np.full((SIZE, SIZE, 1), 65535, np.uint16))
    (tmp_path / "resized_anon_masks").mkdir()
    (tmp_path / "0.png").rename(tmp_path / "resized_anon_masks/00.png")
    scan = read_scan(tmp_path, ScanOptions())
    assert [frame.mask is None for frame in scan.frames[:2]] == [False, True]
    assert max(off(back(tmp_path)[1], VIEWS)) < 1e-12


def test_frames_are_spread_evenly(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path / "scan", photographed(9, 8))
    scan = read_scan(tmp_path / "scan", ScanOptions(frames=3))
    assert [frame.image.stem for frame in scan.frames] == ["0", "4", "8"]


def test_sparse_points_without_depth_are_refused_with_what_to_do(tmp_path: Path) -> None:
    write_colmap(tmp_path / "scan", VIEWS, binary=True, depth=False)
    with pytest.raises(InputError, match=r"depth of the photographs.*patch_match_stereo"):
        read_scan(tmp_path / "scan", ScanOptions())


def test_maps_of_colmap_are_read(tmp_path: Path) -> None:
    write_colmap(tmp_path / "scan", VIEWS, binary=True, depth=False)
    folder = tmp_path / "scan/stereo/depth_maps"
    folder.mkdir(parents=True)
    for index, view in enumerate(VIEWS):
        header = f"{SIZE}&{SIZE}&1&".encode()
        (folder / f"{index:02d}.exr.geometric.bin").write_bytes(header + view.depth.numpy().astype("<f4").tobytes())
    assert max(off(back(tmp_path / "scan")[1], VIEWS)) < 1e-12


def test_smaller_copies_alone_will_do_for_colmap(tmp_path: Path) -> None:
    write_colmap(tmp_path, VIEWS, binary=True)
    (tmp_path / "images").rename(tmp_path / "images_2")
    assert read_scan(tmp_path, ScanOptions()).frames[0].image == tmp_path / "images_2/00.exr"


@pytest.mark.parametrize("suffix", ["txt", "bin"])
def test_a_model_that_is_cut_off_is_refused(tmp_path: Path, suffix: str) -> None:
    write_colmap(tmp_path / "scan", VIEWS, binary=suffix == "bin")
    path = tmp_path / f"scan/sparse/0/images.{suffix}"
    content = path.read_bytes()
    # Of text the first pose, as one cannot see that lines are missing.
    for length in (60 if suffix == "txt" else len(content) // 2 - 7, 3):
        path.write_bytes(content[:length])
        with pytest.raises(InputError, match=rf"images\.{suffix}"):
            read_scan(tmp_path / "scan", ScanOptions())


def test_lenses_that_are_not_known_are_refused(tmp_path: Path) -> None:
    write_colmap(tmp_path / "a", VIEWS[:1], binary=False)
    cameras = tmp_path / "a/sparse/0/cameras.txt"
    cameras.write_text(cameras.read_text().replace("OPENCV", "THIN_PRISM_FISHEYE"))
    write_nerfstudio(tmp_path / "b", VIEWS[:1], shared={"camera_model": "EQUIRECTANGULAR"})
    for root in (tmp_path / "a", tmp_path / "b"):
        with pytest.raises(InputError, match="image_undistorter"):
            read_scan(root, ScanOptions())
    cameras.write_text(f"7 FOV {SIZE} {SIZE} 20 20 16 16 0.9\n")
    with pytest.raises(InputError, match=r"cameras\.txt: .*FISHEYE, found 'FOV'.*image_undistorter"):
        read_scan(tmp_path / "a", ScanOptions())
    write_colmap(tmp_path / "c", VIEWS[:1], binary=True)
    content = struct.pack("<QiiQQ12d", 1, 7, 10, SIZE, SIZE, *[20.0] * 12)
    (tmp_path / "c/sparse/0/cameras.bin").write_bytes(content)
    with pytest.raises(InputError, match="THIN_PRISM_FISHEYE"):
        read_scan(tmp_path / "c", ScanOptions())


def test_a_folder_without_a_layout_is_told_with_what_is_in_it(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError) as caught:
        read_scan(tmp_path, ScanOptions())
    for word in (*READERS, "notes.txt, photos/", "Correct the path"):
        assert word in str(caught.value)


def test_two_layouts_are_not_guessed_between(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path, VIEWS)
    write_colmap(tmp_path, VIEWS, binary=True)
    with pytest.raises(InputError, match=r"nerfstudio and colmap.*ScanOptions\(format='nerfstudio'\)"):
        read_scan(tmp_path, ScanOptions())
    assert read_scan(tmp_path, ScanOptions(format="colmap")).layout == "colmap"
    with pytest.raises(InputError, match=r"traj\.txt.*looks like nerfstudio and colmap"):
        read_scan(tmp_path, ScanOptions(format="replica"))


def test_several_photographs_without_poses_are_refused(tmp_path: Path) -> None:
    write_iid(tmp_path, VIEWS[0], (24, 40))
    for kind in ("im", "depth"):
        (tmp_path / kind).mkdir()
    (tmp_path / "im.png").rename(tmp_path / "im/a.png")
    (tmp_path / "depth.exr").rename(tmp_path / "depth/a.exr")
    assert read_scan(tmp_path, ScanOptions()).layout == "iid"
    (tmp_path / "im/b.png").write_bytes((tmp_path / "im/a.png").read_bytes())
    with pytest.raises(InputError, match=r"without poses several do not go together.*ScanOptions\(photograph=NAME\)"):
        read_scan(tmp_path, ScanOptions())
    assert read_scan(tmp_path, ScanOptions(photograph="a")).frames[0].image.name == "a.png"
    with pytest.raises(InputError, match=r"of the name c.*a\.png, b\.png"):
        read_scan(tmp_path, ScanOptions(photograph="c"))


def test_depth_of_another_shape_than_its_photograph_is_refused(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path / "a", VIEWS[:1], ".exr", ".png")
    write_depth(tmp_path / "a/depth/0.png", np.full((SIZE // 2, SIZE), 2.0), 1000.0)
    with pytest.raises(InputError, match=r"depth/0\.png: expected an image of the shape of its intrinsics, 32 × 32"):
        back(tmp_path / "a")
    write_depth(tmp_path / "a/depth/0.png", np.full((SIZE // 2, SIZE // 2), 2.0), 1000.0)
    _, (view,) = back(tmp_path / "a")
    assert float((view.depth - 2.0).abs().max()) < 1e-6  # measured 5e-8


def test_turned_photographs_and_intrinsics_of_other_ones_are_refused(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path / "a", VIEWS, shared={"w": 48, "cx": 24.0})
    with pytest.raises(InputError, match=r"0\.exr.*shape of its intrinsics, 48 × 32"):
        back(tmp_path / "a")
    for key, value, words in (("cx", 2.0, "principal point"), ("fl_x", 1e6, "focal"), ("k1", 1e3, "distortion")):
        write_nerfstudio(tmp_path / key, VIEWS, shared={key: value})
        with pytest.raises(InputError, match=words):
            read_scan(tmp_path / key, ScanOptions())

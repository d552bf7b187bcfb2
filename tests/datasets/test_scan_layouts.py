"""A small room written in the layouts of other programs and read again, and folders that have none of them."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
import torch

from raycast import room_views
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.scans.importing import Imported, import_scan
from rgspipe.datasets.scans.layouts import READERS, read_scan
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from scan_layouts import (
    photographed,
    write_colmap,
    write_iid,
    write_nerfstudio,
    write_polycam,
    write_replica,
    write_scannet,
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
    # The unsure first row is two of ours, as they lie in it.
    assert all(bool(view.depth[:1].isnan().all()) and bool(view.depth[2:].isfinite().all()) for view in read)
    misses = torch.cat(
        [((a.depth - b.depth).abs() / b.depth)[2:].reshape(-1) for a, b in zip(read, views, strict=True)]
    )
    # Half a millimetre of half a unit to one; the rest is at edges. Measured 0.0003 and 0.0009.
    assert float(misses.median()) < 0.0006 and float(misses.quantile(0.8)) < 0.002


def test_replica_comes_back(tmp_path: Path) -> None:
    write_replica(tmp_path / "scans/room0", VIEWS)
    _, views = back(tmp_path / "scans/room0")
    pose, depth = off(views, VIEWS)
    assert pose < 1e-12 and depth < 0.5 / 6553.5 / min(float(view.depth.min()) for view in VIEWS) + 1e-6
    assert views[0].camera.cx == VIEWS[0].camera.cx
    # JPEG at quality 95 halves the resolution of colours: measured 0.009.
    assert all(float((a.image - b.image).abs().median()) < 0.02 for a, b in zip(views, VIEWS, strict=True))


def test_scannet_comes_back_without_lost_frames_and_with_depth_of_its_own_lens(tmp_path: Path) -> None:
    write_scannet(tmp_path / "scan", VIEWS)
    made, views = back(tmp_path / "scan")
    left = [VIEWS[0], *VIEWS[2:]]
    assert "1 of 4 frames" in made.notes[0]
    assert off(views, left)[0] < 1e-12
    for read, written in zip(views, left, strict=True):
        miss = (read.depth - written.depth)[::2, ::2].abs()
        assert float(miss.max()) < 0.00051, "every second pixel is one of the depth image"


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
    cameras.write_text(cameras.read_text().replace("OPENCV", "OPENCV_FISHEYE"))
    write_nerfstudio(tmp_path / "b", VIEWS[:1], shared={"camera_model": "EQUIRECTANGULAR"})
    for root in (tmp_path / "a", tmp_path / "b"):
        with pytest.raises(InputError, match="image_undistorter"):
            read_scan(root, ScanOptions())


def test_a_folder_without_a_layout_is_told_with_what_is_in_it(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError) as caught:
        read_scan(tmp_path, ScanOptions())
    for word in (*READERS, "notes.txt, photos/", "scene.path"):
        assert word in str(caught.value)


def test_two_layouts_are_not_guessed_between(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path, VIEWS)
    write_colmap(tmp_path, VIEWS, binary=True)
    with pytest.raises(InputError, match=r"nerfstudio and colmap.*scene\.rgbd\.format"):
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
    with pytest.raises(InputError, match="without poses several do not go together"):
        read_scan(tmp_path, ScanOptions())


def test_turned_photographs_and_intrinsics_of_other_ones_are_refused(tmp_path: Path) -> None:
    write_nerfstudio(tmp_path / "a", VIEWS, shared={"w": 48, "cx": 24.0})
    with pytest.raises(InputError, match=r"0\.exr.*shape of its intrinsics, 48 × 32"):
        back(tmp_path / "a")
    for key, value, words in (("cx", 2.0, "principal point"), ("fl_x", 1e6, "focal"), ("k1", 1e3, "distortion")):
        write_nerfstudio(tmp_path / key, VIEWS, shared={key: value})
        with pytest.raises(InputError, match=words):
            read_scan(tmp_path / key, ScanOptions())

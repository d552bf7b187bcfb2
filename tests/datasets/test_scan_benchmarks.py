"""Captures of TUM's RGB-D benchmark, 7-Scenes and ARKitScenes, written and read again, and such as are none."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.scans.importing import import_scan
from rgspipe.datasets.scans.layouts import read_scan
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.timed import nearest
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.stages.images.scan_conventions import check_scan
from scan_layouts import landscape, photographed, write_arkitscenes, write_seven_scenes, write_tum

SIZE = 32
VIEWS = photographed(4, SIZE)


def back(root: Path, **options: object) -> tuple[View, ...]:
    """What is imported of a folder at the size of its photographs, once it was checked."""
    taken, folder = ScanOptions(resolution=SIZE, **options), root.parent / "imported"
    scan = read_scan(root, taken)
    import_scan(scan, taken, folder)
    views = load_dataset(folder, targets=False).train
    check_scan(scan, views)
    return views


def differ(read: tuple[View, ...], written: list[View]) -> tuple[float, float, float]:
    """The largest differences of poses, colours and relative depth, of that the median over what is known."""
    pairs = list(zip(read, written, strict=True))
    poses = max(float((a.camera.camera_to_world - b.camera.camera_to_world).abs().max()) for a, b in pairs)
    colours = max(float((a.image - b.image).abs().max()) for a, b in pairs)
    depths = max(float(((a.depth - b.depth).abs() / b.depth).nanmedian()) for a, b in pairs)
    return poses, colours, depths


#: Half a level of 255 where sRGB is steepest.
HALF_LEVEL = 2.3 * 0.5 / 255 + 1e-6


def test_tum_comes_back(tmp_path: Path) -> None:
    write_tum(tmp_path / "scan", VIEWS)
    poses, colours, depths = differ(views := back(tmp_path / "scan"), VIEWS)
    assert poses < 1e-12 and colours < HALF_LEVEL and depths < 0.5 / 5000 / 0.1
    assert (views[0].camera.fx, views[0].camera.cx) == pytest.approx((VIEWS[0].camera.fx, VIEWS[0].camera.cx))
    scan = read_scan(tmp_path / "scan", ScanOptions())
    assert scan.layout == "tum" and "1 of 5 photographs" in scan.notes[1] and "calibration.txt" in scan.notes[0]
    assert {path.name for path in scan.sources} == {"groundtruth.txt", "rgb.txt", "depth.txt", "calibration.txt"}


@pytest.mark.parametrize(
    ("name", "fx", "cx"), [("freiburg1_desk", 525.0, 320.0), ("freiburg3_long_office_household", 535.4, 320.6)]
)
def test_cameras_of_tum_are_told_by_the_folder(tmp_path: Path, name: str, fx: float, cx: float) -> None:
    root = tmp_path / f"rgbd_dataset_{name}"
    write_tum(root, VIEWS[:1])
    (root / "calibration.txt").unlink()
    lens = read_scan(root, ScanOptions()).frames[0].lens
    assert (lens.fx, lens.cx, lens.width, lens.height) == (fx, pytest.approx(cx), 640, 480)
    root.rename(tmp_path / "mine")
    with pytest.raises(InputError, match=r"intrinsics of the photographs: calibration\.txt .*name mine.*fov=DEGREES"):
        read_scan(tmp_path / "mine", ScanOptions())
    lens = read_scan(tmp_path / "mine", ScanOptions(fov=90)).frames[0].lens
    assert lens.fx == pytest.approx(0.5 * SIZE)


def test_seven_scenes_come_back(tmp_path: Path) -> None:
    views, depths = landscape(4, SIZE, 525.0), landscape(4, SIZE, 585.0)
    write_seven_scenes(tmp_path / "seq-01", views, depths)
    poses, colours, depth = differ(read := back(tmp_path / "seq-01"), views)
    # Poses have eight digits; depth is seen through another lens: measured 3e-3 with 24 rows.
    assert poses < 1e-7 and colours < HALF_LEVEL and depth < 6e-3
    assert read[0].camera.fx == pytest.approx(525.0 * SIZE / 640.0)
    # The longer lens of the depth camera shows less than the photographs do.
    known = np.isfinite(read[1].depth.numpy())
    assert not known[0].any() and not known[:, 0].any() and known[3:-3, 3:-3].all()


def test_arkitscenes_come_back(tmp_path: Path) -> None:
    write_arkitscenes(tmp_path / "scan", VIEWS)
    poses, colours, depths = differ(views := back(tmp_path / "scan"), VIEWS)
    assert poses < 1e-12 and colours < HALF_LEVEL and depths < 0.5e-3 / 0.1
    assert all(bool(view.depth[0].isnan().all()) and bool(view.depth[1:].isfinite().all()) for view in views)
    (note,) = read_scan(tmp_path / "scan", ScanOptions()).notes
    assert "1 of 5 photographs" in note
    shutil.copytree(tmp_path / "scan/41069021_frames", tmp_path / "scan/7_frames")
    with pytest.raises(InputError, match="one video, found 2: 41069021_frames, 7_frames"):
        read_scan(tmp_path / "scan", ScanOptions())
    assert len(read_scan(tmp_path / "scan/7_frames", ScanOptions()).frames) == 4


@pytest.mark.parametrize(
    ("steps", "flip", "words"),
    [
        (5000.0, np.eye(4), r"scene\.rgbd\.axes=opengl"),
        (1000.0, np.diag([1.0, -1.0, -1.0, 1.0]), r"depth_unit"),
    ],
)
def test_axes_and_units_of_tum_that_are_other_ones_are_told(
    tmp_path: Path, steps: float, flip: np.ndarray, words: str
) -> None:
    """By the depth of views that overlap, as of every layout."""
    write_tum(tmp_path / "scan", photographed(10, SIZE), steps, flip)
    with pytest.raises(InputError, match=words):
        back(tmp_path / "scan")


def changed(name: str, change: Callable[[str], str]) -> Callable[[Path], None]:
    def apply(root: Path) -> None:
        (path,) = root.glob(name)
        path.write_text(change(path.read_text()))

    return apply


BROKEN: dict[str, tuple[Callable, Callable[[Path], None], str]] = {
    "other times": (write_tum, changed("rgb.txt", lambda t: t.replace("130503", "2")), r"none of them within 0\.02 s"),
    "no files": (write_tum, changed("rgb.txt", lambda t: "# none\n"), r"rgb\.txt: expected a time and a file a line"),
    "names alone": (write_tum, changed("depth.txt", lambda t: t.split()[-1]), r"depth\.txt: expected a time and a"),
    "Euler's angles": (
        write_tum,
        changed("groundtruth.txt", lambda t: "\n".join(" ".join(line.split()[:7]) for line in t.splitlines()[1:])),
        r"groundtruth\.txt: expected times, places and quaternions: 8 numbers a line",
    ),
    "no quaternion": (
        write_tum,
        changed("groundtruth.txt", lambda t: "1305031102.175 0 0 0 0 0 0 2\n"),
        r"groundtruth\.txt: expected a time, x y z, and a quaternion x y z w of length 1, found",
    ),
    "a matrix that is cut off": (
        lambda root, views: write_seven_scenes(root, views, views),
        changed("frame-000000.pose.txt", lambda t: "\n".join(t.splitlines()[:3])),
        r"frame-000000\.pose\.txt: expected 4 lines, found 3",
    ),
    "rows for columns": (
        lambda root, views: write_seven_scenes(root, views, views),
        changed("frame-000000.pose.txt", lambda t: "\n".join(
            " ".join(map(str, row)) for row in np.array([line.split() for line in t.splitlines()]).T.tolist())),
        r"frame-000000\.pose\.txt: .*transposed",
    ),
    "half a pixel": (
        write_arkitscenes,
        changed("*_frames/*_intrinsics/*_305.376.pincam", lambda t: t.replace("32 32 ", "32 32.5 ")),
        r"305\.376\.pincam: expected whole numbers of pixels, found 32\.5",
    ),
    "a rotation of nothing": (
        write_arkitscenes,
        changed("*_frames/lowres_wide.traj", lambda t: "305.3774 nan 0 0 0 0 0\n" + t.split("\n", 1)[1]),
        r"lowres_wide\.traj: time 305\.377: expected finite numbers",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_are_refused_by_name(tmp_path: Path, case: str) -> None:
    write, spoil, words = BROKEN[case]
    write(tmp_path / "scan", VIEWS[:2])
    spoil(tmp_path / "scan")
    with pytest.raises(InputError, match=words):
        read_scan(tmp_path / "scan", ScanOptions())


def test_intrinsics_that_are_missing_are_named(tmp_path: Path) -> None:
    write_arkitscenes(tmp_path, VIEWS[:2])
    (tmp_path / "41069021_frames/lowres_wide_intrinsics/41069021_305.476.pincam").unlink()
    with pytest.raises(InputError, match=r"41069021_305\.477\.pincam: expected intrinsics at the time of the photo"):
        read_scan(tmp_path, ScanOptions())


def test_the_nearest_in_time_is_taken_if_it_is_near() -> None:
    found = nearest(np.array([3.0, 1.0, 2.0]), np.array([0.9, 1.4, 1.6, 2.5001, 9.0]), 0.5)
    assert found == [1, 1, 2, 0, None]
    assert nearest(np.zeros(0), np.array([1.0]), 0.5) == [None]

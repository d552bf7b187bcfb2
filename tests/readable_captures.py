"""Captures of every layout, each with what writes it and what reads it; and what a kind of file is."""

from __future__ import annotations

import importlib.util
import json
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from PIL import ExifTags, Image

from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.scans.importing import import_scan
from rgspipe.datasets.scans.layouts import read_scan
from rgspipe.datasets.scans.options import ScanOptions
from rgspipe.datasets.scans.raw_image import read_raw
from scan_layouts import (
    landscape,
    photographed,
    write_arkitscenes,
    write_colmap,
    write_dng,
    write_iid,
    write_interiorverse,
    write_nerfstudio,
    write_openrooms,
    write_polycam,
    write_replica,
    write_scannet,
    write_seven_scenes,
    write_tum,
)

#: What a reader makes of a folder: all of its numbers.
Numbers = Iterator[torch.Tensor]

#: Photographs of a capture.
SCANNED, WIDE = photographed(2, 8), landscape(2, 8, 525.0)

#: The folder of a video of ARKitScenes.
VIDEO = "41069021_frames"


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        file: the one that is changed, in the folder.
        make: writes it, and what belongs to it, into an empty folder.
        read: reads the folder.
    """

    file: str
    make: Callable[[Path], object]
    read: Callable[[Path], Numbers]


def _of_scan(file: str, write: Callable[[Path], None]) -> Kind:
    """A file of a capture of two photographs, which is imported."""

    def read(folder: Path) -> Numbers:
        options = ScanOptions(resolution=8)
        with tempfile.TemporaryDirectory(dir=folder.parent) as made:
            import_scan(read_scan(folder, options), options, Path(made))
            views = load_dataset(made, targets=False).train
        return iter([view.image for view in views] + [view.camera.camera_to_world for view in views])

    return Kind(file, write, read)


def _exposed(root: Path) -> None:
    """Photographs that state how they were exposed."""
    write_nerfstudio(root, SCANNED, ".jpg", ".png")
    exif, base = Image.Exif(), ExifTags.Base
    exif.get_ifd(ExifTags.IFD.Exif).update({base.ExposureTime: 0.01, base.FNumber: 2.8, base.ISOSpeedRatings: 200})
    for path in (root / "images").iterdir():
        with Image.open(path) as image:
            image.save(path, exif=exif)


def _replica_lens(root: Path) -> None:
    write_replica(root, SCANNED)
    view = SCANNED[0].camera
    numbers = {"w": view.width, "h": view.height, "fx": view.fx, "fy": view.fy, "cx": view.cx, "cy": view.cy}
    (root / "cam_params.json").write_text(json.dumps({"camera": {**numbers, "scale": 6553.5}}))


def _colmap_map(root: Path) -> None:
    write_colmap(root, SCANNED, True, depth=False)
    path = root / "stereo/depth_maps/00.exr.geometric.bin"
    path.parent.mkdir(parents=True)
    path.write_bytes(b"8&8&1&" + SCANNED[0].depth.numpy().astype("<f4").tobytes())


CAPTURES: dict[str, Kind] = {
    "scan: nerfstudio": _of_scan("transforms.json", lambda root: write_nerfstudio(root, SCANNED, ".png", ".png")),
    "scan: wide PNG": _of_scan("images/0.16.png", lambda root: write_nerfstudio(root, SCANNED, ".16.png", ".png")),
    "scan: depth": _of_scan("depth/0.png", lambda root: write_nerfstudio(root, SCANNED, ".png", ".png")),
    "scan: photograph": _of_scan("images/0.jpg", _exposed),
    "scan: Polycam": _of_scan(
        "keyframes/corrected_cameras/1000.json", lambda root: write_polycam(root, *2 * [SCANNED])
    ),
    "scan: COLMAP cameras": _of_scan("sparse/0/cameras.bin", lambda root: write_colmap(root, SCANNED, True)),
    "scan: COLMAP images": _of_scan("sparse/0/images.bin", lambda root: write_colmap(root, SCANNED, True)),
    "scan: COLMAP text": _of_scan("sparse/0/images.txt", lambda root: write_colmap(root, SCANNED, False)),
    "scan: COLMAP map": _of_scan("stereo/depth_maps/00.exr.geometric.bin", _colmap_map),
    "scan: Replica": _of_scan("traj.txt", lambda root: write_replica(root, SCANNED)),
    "scan: ScanNet": _of_scan("intrinsic/intrinsic_color.txt", lambda root: write_scannet(root, SCANNED)),
    "scan: InteriorVerse": _of_scan("000_material.exr", lambda root: write_interiorverse(root, SCANNED[:1])),
    "scan: OpenRooms": _of_scan("cam.txt", lambda root: write_openrooms(root, SCANNED)),
    "scan: OpenRooms depth": _of_scan("imdepth_1.dat", lambda root: write_openrooms(root, SCANNED)),
    "scan: Radiance picture": _of_scan("im_1.hdr", lambda root: write_openrooms(root, SCANNED)),
    "scan: Radiance, plain": _of_scan("im_2.hdr", lambda root: write_openrooms(root, SCANNED)),
    "scan: Replica, lens": _of_scan("cam_params.json", _replica_lens),
    "scan: TUM": _of_scan("groundtruth.txt", lambda root: write_tum(root, SCANNED)),
    "scan: TUM, list": _of_scan("rgb.txt", lambda root: write_tum(root, SCANNED)),
    "scan: TUM, lens": _of_scan("calibration.txt", lambda root: write_tum(root, SCANNED)),
    "scan: 7-Scenes": _of_scan("frame-000000.pose.txt", lambda root: write_seven_scenes(root, WIDE, WIDE)),
    "scan: ARKitScenes": _of_scan(f"{VIDEO}/lowres_wide.traj", lambda root: write_arkitscenes(root, SCANNED)),
    "scan: ARKitScenes, lens": _of_scan(
        f"{VIDEO}/lowres_wide_intrinsics/41069021_305.376.pincam", lambda root: write_arkitscenes(root, SCANNED)
    ),
    "scan: one image": _of_scan("depth.exr", lambda root: write_iid(root, SCANNED[0], (8, 8))),
}

if importlib.util.find_spec("rawpy") is not None:
    CAPTURES["raw photograph"] = Kind(
        "a.dng",
        lambda folder: write_dng(folder / "a.dng", np.full((32, 32), 999, np.uint16)),
        lambda folder: iter([torch.from_numpy(read_raw(folder / "a.dng")[0])]),
    )

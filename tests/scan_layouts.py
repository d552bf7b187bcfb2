"""A small room, photographed, and written in the layouts of other programs."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import tifffile
import torch
from PIL import ExifTags, Image
from scipy.spatial.transform import Rotation

from raycast import room_views
from rgspipe.datasets.exr import write_channels, write_image
from rgspipe.datasets.scans.frame import Lens
from rgspipe.datasets.views import View
from rgspipe.scene import srgb

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


def photographed(count: int = 12, resolution: int = 32, angle: float = 1.4) -> list[View]:
    """Views of a room of two units with a block in it, whose surfaces have smooth colours below 0.9."""
    views = []
    for view in room_views(count, resolution, angle=angle):
        origins, directions, lengths = view.camera.rays()
        points = origins + directions * (view.depth.double().reshape(-1) * lengths)[:, None]
        colours = 0.45 + 0.4 * torch.sin(5.0 * points + torch.tensor([0.0, 1.0, 2.0]))
        views.append(replace(view, image=colours.reshape(*view.depth.shape, 3).float()))
    return views


def landscape(count: int, width: int, focal: float) -> list[View]:
    """Such views of 4 : 3 by a focal length of 640 pixels across."""
    views, rows = photographed(count, width, 2.0 * np.arctan(320.0 / focal)), width // 8
    parts = ("image", "alpha", "depth")
    return [
        replace(
            view,
            camera=replace(view.camera, cy=3 * rows, height=6 * rows),
            **{name: getattr(view, name)[rows:-rows] for name in parts},
        )
        for view in views
    ]


def lens_of(view: View, radial: tuple[float, ...] = (), tangential: tuple[float, float] = (0.0, 0.0)) -> Lens:
    camera = view.camera
    return Lens(camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, radial, tangential)


def pose_of(view: View) -> np.ndarray:
    return view.camera.camera_to_world.numpy().copy()


def write_photograph(path: Path, light: np.ndarray) -> None:
    """EXR, 8-bit PNG or JPEG by the suffix; .16.png has 16 bits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".exr":
        write_image(path, light)
        return
    levels = srgb.encode(np.clip(np.asarray(light, np.float64), 0.0, 1.0))
    if path.name.endswith(".16.png"):
        write_wide_png(path, np.round(65535.0 * levels).astype(np.uint16))
    else:
        Image.fromarray(np.round(255.0 * levels).astype(np.uint8)).save(path, quality=95)


def write_exposed(path: Path, light: np.ndarray, shutter: object, f_number: object = 2.0) -> None:
    """A photograph of ISO 200 that states its exposure."""
    path.parent.mkdir(parents=True, exist_ok=True)
    levels = np.round(255.0 * srgb.encode(np.clip(light.astype(np.float64), 0.0, 1.0))).astype(np.uint8)
    exif, base = Image.Exif(), ExifTags.Base
    stated = {base.ExposureTime: shutter, base.FNumber: f_number, base.ISOSpeedRatings: 200}
    exif.get_ifd(ExifTags.IFD.Exif).update(stated)
    Image.fromarray(levels).save(path, quality=95, subsampling=0, exif=exif)


def write_wide_png(path: Path, levels: np.ndarray) -> None:
    """(H, W, 1, 3 or 4) uint16; each row with another of the format's filters, as real files have them."""
    height, width, channels = levels.shape
    rows = levels.astype(">u2").reshape(height, -1).view(np.uint8).astype(np.int64)
    step, lines = 2 * channels, []
    for index, row in enumerate(rows):
        kind = (0, 1, 2)[index % 3] if index else 0
        left = np.concatenate([np.zeros(step, np.int64), row[:-step]])
        predicted = (0 * row, left, rows[index - 1])[kind]
        lines.append(bytes([kind]) + ((row - predicted) % 256).astype(np.uint8).tobytes())
    header = struct.pack(">IIBBBBB", width, height, 16, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(b"".join(lines))), (b"IEND", b""))
    chunks = (struct.pack(">I", len(c)) + name + c + struct.pack(">I", zlib.crc32(name + c)) for name, c in parts)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def write_depth(path: Path, depth: np.ndarray, steps: float) -> None:
    """A 16-bit PNG with so many steps a unit, or EXR as it is; what is not finite is 0."""
    path.parent.mkdir(parents=True, exist_ok=True)
    depth = np.where(np.isfinite(depth), depth, 0.0)
    if path.suffix == ".exr":
        write_channels(path, {"Z": depth})
    else:
        Image.fromarray(np.round(steps * depth).astype(np.uint16)).save(path)


def write_nerfstudio(
    root: Path, views: Sequence[View], image: str = ".exr", depth: str | None = ".exr", shared: dict | None = None
) -> None:
    frames = []
    for index, view in enumerate(views):
        write_photograph(root / f"images/{index}{image}", view.image.numpy())
        files = {"file_path": f"images/{index}{image}"}
        if depth is not None:
            write_depth(root / f"depth/{index}{depth}", view.depth.numpy(), 1000.0)
            files["depth_file_path"] = f"depth/{index}{depth}"
        frames.append(files | {"transform_matrix": pose_of(view).tolist()})
    camera = views[0].camera
    content = {"fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy}
    content |= {"w": camera.width, "h": camera.height, "camera_model": "OPENCV"} | (shared or {})
    (root / "transforms.json").write_text(json.dumps(content | {"frames": frames}))


def write_polycam(root: Path, views: Sequence[View], depths: Sequence[View]) -> None:
    """Photographs, and depth from the same places of another size, whose first row is unsure; z is Polycam's y."""
    for index, (view, coarse) in enumerate(zip(views, depths, strict=True)):
        name = f"{1000 + index}"
        write_photograph(root / f"keyframes/corrected_images/{name}.jpg", view.image.numpy())
        depth = coarse.depth.numpy()
        write_depth(root / f"keyframes/depth/{name}.png", depth, 1000.0)
        confidence = root / f"keyframes/confidence/{name}.png"
        confidence.parent.mkdir(exist_ok=True)
        sure = np.full(depth.shape, 255, np.uint8)
        sure[0] = 0
        Image.fromarray(sure).save(confidence)
        # Our first row is the file's third.
        rows = pose_of(view)[[1, 2, 0]]
        content = {f"t_{row}{column}": rows[row, column] for row in range(3) for column in range(4)}
        camera = view.camera
        content |= {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
        content |= {"width": camera.width, "height": camera.height, "blur_score": 1.0}
        path = root / f"keyframes/corrected_cameras/{name}.json"
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(content))


def write_colmap(root: Path, views: Sequence[View], binary: bool, depth: bool = True) -> None:
    """One camera with OPENCV's parameters and no distortion; images with two points each but the last, with none."""
    folder, camera = root / "sparse/0", views[0].camera
    folder.mkdir(parents=True)
    values = [camera.fx, camera.fy, camera.cx, camera.cy, 0.0, 0.0, 0.0, 0.0]
    images = []
    for index, view in enumerate(views):
        write_photograph(root / f"images/{index:02d}.exr", view.image.numpy())
        if depth:
            write_depth(root / f"depth/{index:02d}.exr", view.depth.numpy(), 1.0)
        matrix = np.linalg.inv(pose_of(view) @ FLIP)
        images.append((f"{index:02d}.exr", quaternion_of(matrix[:3, :3]), matrix[:3, 3]))
    write = _binary_model if binary else _text_model
    write(folder, (camera.width, camera.height), values, images)


def _text_model(folder: Path, size: tuple[int, int], values: list[float], images: list) -> None:
    numbers = " ".join(map(repr, values))
    (folder / "cameras.txt").write_text(f"# Camera list\n7 OPENCV {size[0]} {size[1]} {numbers}\n")
    lines = ["# Image list"]
    for index, (name, quaternion, place) in enumerate(images):
        stated = " ".join(repr(float(value)) for value in (*quaternion, *place))
        lines += [f"{index + 1} {stated} 7 {name}", "" if index == len(images) - 1 else "1.5 2.5 -1 3.5 4.5 9"]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")


def _binary_model(folder: Path, size: tuple[int, int], values: list[float], images: list) -> None:
    (folder / "cameras.bin").write_bytes(struct.pack("<QiiQQ8d", 1, 7, 4, *size, *values))
    parts = [struct.pack("<Q", len(images))]
    for index, (name, quaternion, place) in enumerate(images):
        parts.append(struct.pack("<i7di", index + 1, *quaternion, *place, 7) + name.encode() + b"\0")
        points = [] if index == len(images) - 1 else [(1.5, 2.5, -1), (3.5, 4.5, 9)]
        parts += [struct.pack("<Q", len(points)), *(struct.pack("<ddq", *point) for point in points)]
    (folder / "images.bin").write_bytes(b"".join(parts))


def quaternion_of(rotation: np.ndarray) -> np.ndarray:
    """(w, x, y, z), by the axis that a rotation leaves alone."""
    symmetric = np.array(
        [
            [
                rotation.trace(),
                *(rotation[(a + 2) % 3, (a + 1) % 3] - rotation[(a + 1) % 3, (a + 2) % 3] for a in range(3)),
            ],
            *([0.0] * 4 for _ in range(3)),
        ]
    )
    symmetric[1:, 1:] = rotation + rotation.T - np.eye(3) * rotation.trace()
    symmetric[1:, 0] = symmetric[0, 1:]
    return np.linalg.eigh(symmetric)[1][:, -1]


def write_replica(root: Path, views: Sequence[View], scale: float = 6553.5) -> None:
    for index, view in enumerate(views):
        write_photograph(root / f"results/frame{index:06d}.jpg", view.image.numpy())
        write_depth(root / f"results/depth{index:06d}.png", view.depth.numpy(), scale)
    lines = [" ".join(map(repr, (pose_of(view) @ FLIP).reshape(-1).tolist())) for view in views]
    (root / "traj.txt").write_text("\n".join(lines) + "\n")
    camera = views[0].camera
    content = {"w": camera.width, "h": camera.height, "fx": camera.fx, "fy": camera.fy}
    content |= {"cx": camera.cx - 0.5, "cy": camera.cy - 0.5, "scale": scale}
    (root.parent / "cam_params.json").write_text(json.dumps({"camera": content}))


def write_scannet(root: Path, views: Sequence[View]) -> None:
    """Depth half as large with intrinsics of its own; the second frame was lost."""
    for index, view in enumerate(views):
        write_photograph(root / f"color/{index}.jpg", view.image.numpy())
        write_depth(root / f"depth/{index}.png", view.depth.numpy()[::2, ::2], 1000.0)
        pose = pose_of(view) @ FLIP if index != 1 else np.full((4, 4), -np.inf)
        (root / "pose").mkdir(exist_ok=True)
        np.savetxt(root / f"pose/{index}.txt", pose)
    camera = views[0].camera
    (root / "intrinsic").mkdir()
    # The depth image has every second pixel, from the first on: its pixels' centres are where those were.
    for name, step in (("color", 1.0), ("depth", 2.0)):
        matrix = np.diag([camera.fx / step, camera.fy / step, 1.0, 1.0])
        matrix[:2, 2] = (camera.cx - 0.5) / step, (camera.cy - 0.5) / step
        np.savetxt(root / f"intrinsic/intrinsic_{name}.txt", matrix)


def write_tum(root: Path, views: Sequence[View], steps: float = 5000.0, flip: np.ndarray = FLIP) -> None:
    """Depth 5 ms after each photograph, poses at twice the rate with some in between, and one photograph without."""
    lists: dict[str, list[str]] = {name: ["# a comment"] for name in ("rgb", "depth", "groundtruth")}
    for index, view in enumerate(views):
        time = 1305031102.175304 + 0.1 * index
        write_photograph(root / f"rgb/{time:.6f}.png", view.image.numpy())
        write_depth(root / f"depth/{time + 0.005:.6f}.png", view.depth.numpy(), steps)
        lists["rgb"].append(f"{time:.6f} rgb/{time:.6f}.png")
        lists["depth"].append(f"{time + 0.005:.6f} depth/{time + 0.005:.6f}.png")
        pose = pose_of(view) @ flip
        w, *xyz = quaternion_of(pose[:3, :3]).tolist()
        lists["groundtruth"].append(" ".join(map(repr, [round(time + 0.003, 6), *pose[:3, 3].tolist(), *xyz, w])))
        lists["groundtruth"].append(f"{time + 0.05:.6f} 9 9 9 0 0 0 1")
    lists["rgb"].append(f"{time + 9.0:.6f} rgb/{time:.6f}.png")
    for name, lines in lists.items():
        (root / f"{name}.txt").write_text("\n".join(lines) + "\n")
    camera = views[0].camera
    (root / "calibration.txt").write_text(f"{camera.fx!r} {camera.fy!r} {camera.cx - 0.5!r} {camera.cy - 0.5!r}\n")


def write_seven_scenes(root: Path, views: Sequence[View], depths: Sequence[View]) -> None:
    """Photographs, and depth from the same places through the other lens; what is not known is 65535."""
    for index, (view, coarse) in enumerate(zip(views, depths, strict=True)):
        write_photograph(root / f"frame-{index:06d}.color.png", view.image.numpy())
        levels = np.round(1000.0 * coarse.depth.numpy())
        levels[0, 0] = 65535
        Image.fromarray(levels.astype(np.uint16)).save(root / f"frame-{index:06d}.depth.png")
        np.savetxt(root / f"frame-{index:06d}.pose.txt", pose_of(view) @ FLIP, delimiter="\t ", fmt="%.7e")


def write_arkitscenes(root: Path, views: Sequence[View]) -> None:
    """In a folder of frames; the first row of depth is unsure, and the last photograph has no pose."""
    folder, lines = root / "41069021_frames", []
    for name in ("lowres_wide_intrinsics", "confidence"):
        (folder / name).mkdir(parents=True)
    for index, view in enumerate(views):
        time = 305.377 + 0.1 * index
        name, camera = f"41069021_{time:.3f}", view.camera
        write_photograph(folder / f"lowres_wide/{name}.png", view.image.numpy())
        write_depth(folder / f"lowres_depth/{name}.png", view.depth.numpy(), 1000.0)
        sure = np.full(view.depth.shape, 2, np.uint8)
        sure[0] = 0
        Image.fromarray(sure).save(folder / f"confidence/{name}.png")
        numbers = [camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy]
        # Names of intrinsics may be a millisecond off.
        path = folder / f"lowres_wide_intrinsics/41069021_{time - 0.001:.3f}.pincam"
        path.write_text(" ".join(map(repr, numbers)))
        matrix = np.linalg.inv(pose_of(view) @ FLIP)
        rotation = Rotation.from_matrix(matrix[:3, :3]).as_rotvec()
        lines.append(" ".join(map(repr, [time + 0.0004, *rotation.tolist(), *matrix[:3, 3].tolist()])))
    write_photograph(folder / "lowres_wide/41069021_999.000.png", views[0].image.numpy())
    (folder / "lowres_wide.traj").write_text("\n".join(lines) + "\n")


def write_iid(root: Path, view: View, depth_size: tuple[int, int]) -> None:
    """im.png, albedo.exr and depth.exr of one view; depth times 0.01, in another size and shape of pixels."""
    write_photograph(root / "im.png", view.image.numpy())
    write_image(root / "albedo.exr", 0.5 * view.image.numpy())
    depth = Image.fromarray(view.depth.numpy()).resize(depth_size, Image.Resampling.BILINEAR)
    write_depth(root / "depth.exr", 0.01 * np.asarray(depth), 1.0)


def write_interiorverse(root: Path, views: Sequence[View]) -> None:
    """Linear EXR with albedo of which a quarter is metal's, and depth in millimetres with a hole; material's red is not
    looked at."""
    root.mkdir(parents=True, exist_ok=True)
    for index, view in enumerate(views):
        name = root / f"{index:03d}"
        write_image(Path(f"{name}_im.exr"), view.image.numpy())
        write_image(Path(f"{name}_albedo.exr"), 0.8 * view.image.numpy())
        material = np.zeros(view.image.shape, np.float32)
        material[..., 0], material[..., 1] = 0.9, 0.25
        write_image(Path(f"{name}_material.exr"), material)
        depth = 1000.0 * view.depth.numpy()
        depth[0, 0] = np.inf
        write_channels(Path(f"{name}_depth.exr"), {"Z": depth})


def write_openrooms(root: Path, views: Sequence[View]) -> None:
    """Cameras from 1 on, as origin, target and up; light as Radiance pictures, packed and not in turns."""
    root.mkdir(parents=True, exist_ok=True)
    lines = [str(len(views))]
    for index, view in enumerate(views):
        pose = pose_of(view)
        points = (pose[:3, 3], pose[:3, 3] - 2.0 * pose[:3, 2], pose[:3, 1] - 0.3 * pose[:3, 2])
        lines += [" ".join(repr(float(value)) for value in point) for point in points]
        write_hdr(root / f"im_{index + 1}.hdr", view.image.numpy(), packed=index % 2 == 0)
        depth = view.depth.numpy().astype("<f4")
        (root / f"imdepth_{index + 1}.dat").write_bytes(struct.pack("<ii", *depth.shape) + depth.tobytes())
        write_photograph(root / f"imbaseColor_{index + 1}.png", view.image.numpy())
    (root / "cam.txt").write_text("\n".join(lines) + "\n")


def write_hdr(path: Path, light: np.ndarray, packed: bool) -> None:
    """Bytes with a shared exponent; packed rows have a run of four wherever four bytes are the same."""
    mantissa, exponent = np.frexp(light.max(axis=2))
    scale = np.where(light.max(axis=2) > 1e-32, 256.0 * mantissa / np.maximum(light.max(axis=2), 1e-32), 0.0)
    rows = np.concatenate([light * scale[..., None], (exponent + 128)[..., None]], axis=2).astype(np.uint8)
    content = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {rows.shape[0]} +X {rows.shape[1]}\n".encode()
    for row in rows:
        if packed:
            content += b"\x02\x02" + struct.pack(">H", len(row))
            content += b"".join(_packed(row[:, channel].tobytes()) for channel in range(4))
        else:
            content += row.tobytes()
    path.write_bytes(content)


def _packed(values: bytes) -> bytes:
    parts = []
    for begin in range(0, len(values), 4):
        four = values[begin : begin + 4]
        same = len(set(four)) == 1
        parts.append(bytes([128 + len(four), four[0]]) if same else bytes([len(four)]) + four)
    return b"".join(parts)


def write_dng(path: Path, levels: np.ndarray) -> None:
    """Levels (H, W) below 4096 under a pattern red, green, green, blue; a neutral surface has half as much red and
    blue as green."""
    tags = [(254, 4, 1, 0), (33421, 3, 2, (2, 2)), (33422, 1, 4, bytes([0, 1, 1, 2]))]
    tags += [(50706, 1, 4, bytes([1, 4, 0, 0])), (50707, 1, 4, bytes([1, 1, 0, 0])), (50708, 2, 0, "Test")]
    tags += [(50714, 3, 1, 0), (50717, 4, 1, 4095), (50778, 3, 1, 21), (50728, 5, 3, (1, 2, 1, 1, 1, 2))]
    tags += [(50721, 10, 9, (1, 1, *2 * (*3 * (0, 1), 1, 1)))]
    tifffile.imwrite(path, levels, photometric=32803, extratags=tags, metadata=None, compression=None)

"""Read folders of TensoIR (Jin et al. 2023): a folder a view, with masks, albedo and normals, under environment light.

    train_000/metadata.json  rgba_<light>.png  albedo.png  normal.png      8-bit PNG; colours in sRGB, straight alpha

Their images hold no point lights and no depth, so surfels cannot be trained on them as they are.
"""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.display_image import read_colour_levels
from rgspipe.datasets.field_of_view import camera_of_angle
from rgspipe.datasets.images import check_size, read_colour
from rgspipe.datasets.json_file import read_json, required
from rgspipe.datasets.rigid_pose import rigid_pose
from rgspipe.datasets.views import Dataset, View
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar
from rgspipe.scene import Camera

METADATA = "metadata.json"
IMAGES = "rgba*.png"


def is_tensoir(root: Path) -> bool:
    """Whether a folder has views as TensoIR lays them out, and no transforms of its own."""
    return not (root / "transforms_train.json").exists() and bool(_folders(root, "train") + _folders(root, "test"))


def load_tensoir(root: Path, *, train: bool = True, test: bool = True) -> Dataset:
    """The wanted splits; views are linear and premultiplied, have no light and no depth.

    Of a view under several lights the first one by name is read; a view's name says which.

    Raises:
        InputError: any file is missing, broken or inconsistent.
    """
    splits = {"train": train, "test": test}
    views = {
        name: tuple(
            _view(folder) for folder in progress_bar(_folders(root, name), f"reading {name} views", unit="view")
        )
        if wanted
        else ()
        for name, wanted in splits.items()
    }
    return Dataset(root, views["train"], views["test"], ())


def _folders(root: Path, split: str) -> list[Path]:
    return sorted(path for path in root.glob(f"{split}*") if (path / METADATA).is_file())


def _view(folder: Path) -> View:
    images = sorted(folder.glob(IMAGES))
    if not images:
        raise InputError(folder, expected=f"an image {IMAGES}", found="none", remedy="Copy the images into it.")
    image, alpha = read_colour(images[0])
    camera = _camera(folder / METADATA, image)
    albedo, normal = folder / "albedo.png", folder / "normal.png"
    return View(
        f"{folder.name}/{images[0].stem}",
        camera,
        image,
        alpha,
        normal=_normals(normal, camera) if normal.exists() else None,
        albedo=_albedo(albedo, camera) if albedo.exists() else None,
    )


def _camera(path: Path, image: Tensor) -> Camera:
    content = read_json(path, "the camera of a view")
    place = f"{path}: cam_transform_mat"
    text = required(content, "cam_transform_mat", path)
    try:
        values = [float(part) for part in text.split(",")] if isinstance(text, str) else []
    except ValueError:
        values = []
    if len(values) != 16:
        raise InputError(place, expected="16 numbers with commas", found=repr(text)[:120], remedy="Correct it.")
    pose = rigid_pose([values[row : row + 4] for row in range(0, 16, 4)], place)
    angle = required(content, "cam_angle_x", path)
    height, width = image.shape[:2]
    for key, found in (("imw", width), ("imh", height)):
        stated = content.get(key, found)
        if stated != found:
            remedy = "Correct it, or export the image at this size."
            raise InputError(f"{path}: {key}", expected=f"{found}, as the image has", found=repr(stated), remedy=remedy)
    return camera_of_angle(pose, angle, width, height, f"{path}: cam_angle_x")


def _albedo(path: Path, camera: Camera) -> Tensor:
    """(H, W, 3) linear albedo, 0 where there is no surface."""
    colour, alpha = read_colour(path)
    check_size(path, colour, camera)
    # Premultiplied at silhouettes; the reflectance of the surface there is wanted.
    return torch.where(alpha[..., None] > 0, colour / alpha.clamp(min=1e-6)[..., None], 0.0)


def _normals(path: Path, camera: Camera) -> Tensor:
    """(H, W, 3) unit normals in world axes, stored as (n + 1)/2; 0 where there is no surface."""
    stored = read_colour_levels(path)
    check_size(path, stored.levels, camera)
    normals = 2.0 * torch.from_numpy(stored.values) - 1.0
    length = normals.norm(dim=-1, keepdim=True)
    there = length > 0.5
    if stored.alpha is not None:
        there &= torch.from_numpy(stored.alpha)[..., None] > 0
    return torch.where(there, normals / length.clamp(min=1e-6), 0.0)

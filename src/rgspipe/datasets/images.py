"""The images of a view as tensors: colour, depth, normals, albedo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from rgspipe.datasets.display_image import FORMATS, read_colour_levels, read_levels
from rgspipe.datasets.exr import read_array, read_channels, read_depth_channel, read_image
from rgspipe.datasets.radiance_image import read_hdr
from rgspipe.datasets.tiff_image import read_tiff
from rgspipe.errors import InputError
from rgspipe.scene import Camera
from rgspipe.scene.arrays import check_radiance

#: Depths from here on (Blender writes 1e10) say that there is no surface.
NO_SURFACE = 1e9


def _read_radiance(path: Path) -> tuple[np.ndarray, np.ndarray]:
    light = read_hdr(path)
    return light, np.ones(light.shape[:2], np.float32)


#: What reads images of light, by suffix; others are of levels.
LINEAR = {".exr": read_image, ".hdr": _read_radiance, ".tif": read_tiff, ".tiff": read_tiff}


def read_colour(path: Path) -> tuple[Tensor, Tensor]:
    """Linear, premultiplied colour (H, W, 3) and alpha (H, W) of an image.

    EXR, TIFF of floats and Radiance's .hdr are linear; PNG and JPEG are sRGB with straight alpha.

    Raises:
        InputError: missing or broken file, other channels, negative radiance, NaN or infinity, alpha outside of [0, 1],
            or 0 everywhere beside light.
    """
    image, alpha = LINEAR.get(path.suffix.lower(), _read_display_image)(path)
    check_radiance(path, float(image.min()), float(image.max()))
    if alpha.min() < 0 or alpha.max() > 1 + 1e-3:
        found = f"{alpha.min():g} to {alpha.max():g}"
        raise InputError(path, expected="alpha from 0 to 1", found=found, remedy="Export the image again.")
    _check_seen(path, image, alpha)
    return torch.from_numpy(image), torch.from_numpy(np.minimum(alpha, 1.0))


def read_depth(path: Path, camera: Camera, convention: str) -> Tensor:
    """Planar depth (H, W) float32; `convention` says what the file holds.

    +inf where there is no surface, and NaN where the depth is unknown, which a file says with NaN or with the 0 of
    depth sensors.

    Raises:
        InputError: missing or broken file, a PNG or JPEG, more than one channel, another size than the image, negative
            depth.
    """
    if path.suffix.lower() in FORMATS:
        raise InputError(
            path,
            expected="depth as OpenEXR, of one channel of floats in the unit of the cameras' places",
            found=f"a {FORMATS[path.suffix.lower()]} image",
            remedy="Multiply its levels by the unit (0.001 for millimetres in metres), and write them as EXR.",
        )
    stored = read_depth_channel(path)
    check_size(path, stored, camera)
    depth = torch.from_numpy(np.array(stored))
    if (depth < 0).any():
        found = f"{int((depth < 0).sum())} negative pixels, the lowest {float(depth.min()):g}"
        raise InputError(
            path, expected="depths ≥ 0, growing away from the camera", found=found, remedy="Change the sign."
        )
    if convention == "ray_distance":
        _, _, lengths = camera.rays()
        depth_planar = depth.double() / lengths.reshape(depth.shape)
        depth = torch.where(depth < NO_SURFACE, depth_planar.float(), depth)
    depth = torch.where(depth >= NO_SURFACE, torch.inf, depth)
    return torch.where(depth == 0, torch.nan, depth)


def read_vectors(path: Path, names: tuple[str, ...], camera: Camera) -> Tensor:
    """An image (H, W, 3) float32 of normals ("X", "Y", "Z") or albedo ("R", "G", "B").

    Raises:
        InputError: missing or broken file, other channels, another size than the image, NaN or infinity.
    """
    stored = read_array(path, names)
    check_size(path, stored, camera)
    return torch.from_numpy(stored)


def read_mask(path: Path, camera: Camera) -> Tensor:
    """A mask (H, W) float32 in [0, 1]: a grey PNG or JPEG, the alpha of one that has any, or EXR with one channel.

    Raises:
        InputError: missing or broken file, colours, another size than the image, values outside of [0, 1].
    """
    if path.suffix.lower() == ".exr":
        channels = read_channels(path)
        if len(channels) != 1:
            found = f"{len(channels)}: {', '.join(sorted(channels))}"
            raise InputError(path, expected="one channel, the mask", found=found, remedy="Export only the mask.")
        (stored,) = channels.values()
    else:
        stored = _mask_levels(path)
    check_size(path, stored, camera)
    if not (stored.min() >= 0 and stored.max() <= 1):
        found = f"{stored.min():g} to {stored.max():g}"
        raise InputError(path, expected="values from 0 to 1", found=found, remedy="Export the mask again.")
    return torch.from_numpy(np.array(stored, dtype=np.float32))


def check_size(path: Path, stored: np.ndarray | Tensor, camera: Camera) -> None:
    """Refuse a map (H, W, …) of another size than the image.

    Raises:
        InputError: naming the file and both sizes.
    """
    height, width = stored.shape[:2]
    if (width, height) != (camera.width, camera.height):
        raise InputError(
            path,
            expected=f"{camera.width} × {camera.height} pixels, as the colour image",
            found=f"{width} × {height}",
            remedy="Export it at the size of the colour image.",
        )


def _read_display_image(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """A PNG or JPEG, linearised with the sRGB curve and premultiplied."""
    stored = read_colour_levels(path)
    light, alpha = stored.light, stored.alpha
    if alpha is None:
        return light, np.ones(light.shape[:2], np.float32)
    _check_seen(path, light, alpha)
    light *= alpha[..., None]
    return light, alpha


def _check_seen(path: Path, image: np.ndarray, alpha: np.ndarray) -> None:
    """Refuse colours without alpha, of programs that have no use for it, or for which 1 is transparent."""
    if alpha.max() == 0.0 < image.max():
        expected, found = "pixels that are opaque", f"alpha 0 everywhere, beside colours up to {image.max():g}"
        raise InputError(path, expected=expected, found=found, remedy="Write it without alpha, or correct its alpha.")


def _mask_levels(path: Path) -> np.ndarray:
    """(H, W) of a mask that an image program wrote: its alpha where that says anything, or else its grey levels."""
    stored = read_levels(path)
    values, alpha = stored.values, stored.alpha
    if alpha is not None and alpha.min() < 1.0:
        return alpha
    if stored.levels.max() == 1:  # of programs that store false and true
        values = stored.levels.astype(np.float32)
    if not (values == values[..., :1]).all():
        found = "colours, all of them opaque"
        raise InputError(path, expected="grey levels, or an alpha channel", found=found, remedy="Export it in grey.")
    return values[..., 0]

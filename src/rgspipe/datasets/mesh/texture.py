"""Pictures that lie on the triangles of a mesh, or are a part of its file."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from rgspipe.datasets.display_image import DAMAGED, opened
from rgspipe.datasets.input_file import check_pixel_count
from rgspipe.errors import InputError
from rgspipe.scene import srgb

FORMATS = ["PNG", "JPEG"]


def check_texture(content: bytes, path: Path) -> None:
    """Refuse the content of a picture that is no PNG or JPEG, or too large; its pixels are not decoded.

    Raises:
        InputError: names `path`.
    """
    try:
        with opened(io.BytesIO(content), path, FORMATS):
            return
    except InputError:
        raise
    except UnidentifiedImageError as cause:
        expected, remedy = "textures as PNG or JPEG", "Convert them."
        raise InputError(path, expected=expected, found="a texture in another format", remedy=remedy) from cause
    except DAMAGED as cause:
        raise _broken(path, cause) from cause


def texture_light(image: Image.Image, path: Path) -> np.ndarray:
    """(H, W, 3) linear float32 of a checked picture that has not been decoded yet.

    Raises:
        InputError: its pixels cannot be decoded; names `path`.
    """
    return srgb.decode_levels(_levels(image, path))


def without_metal(light: np.ndarray | None, picture: Image.Image, most: float, path: Path) -> np.ndarray:
    """(H, W, 3) a texture, or white, times 1 − `most` times the blue of a picture of what is metal, as glTF has it.

    Raises:
        InputError: as `texture_light`.
    """
    levels = _levels(picture, path)
    diffuse = 1.0 - most * levels[..., 2:].astype(np.float32) / np.iinfo(levels.dtype).max
    light = np.ones((1, 1, 3), np.float32) if light is None else light
    height, width = np.maximum(light.shape[:2], diffuse.shape[:2])
    return _sized(light, height, width) * _sized(diffuse, height, width)


def _sized(texture: np.ndarray, height: int, width: int) -> np.ndarray:
    """A texture by the nearest texels in another size."""
    rows, columns = np.arange(height) * texture.shape[0] // height, np.arange(width) * texture.shape[1] // width
    return texture[rows[:, None], columns]


def _levels(image: Image.Image, path: Path) -> np.ndarray:
    """(H, W, 3) uint8 or uint16."""
    check_pixel_count(path, *image.size)
    try:
        if image.mode.startswith("I;16"):  # grey, which the library cuts off at 255
            return np.repeat(np.asarray(image).astype(np.uint16)[..., None], 3, axis=2)
        return np.asarray(image.convert("RGB"))
    except DAMAGED as cause:
        raise _broken(path, cause) from cause


def _broken(path: Path, cause: BaseException) -> InputError:
    remedy = "Write the texture again."
    return InputError(path, expected="whole textures", found=f"a broken one: {cause}", remedy=remedy)

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
    check_pixel_count(path, *image.size)
    try:
        levels = np.asarray(image.convert("RGB"))
    except DAMAGED as cause:
        raise _broken(path, cause) from cause
    return srgb.decode_levels(levels)


def _broken(path: Path, cause: BaseException) -> InputError:
    remedy = "Write the texture again."
    return InputError(path, expected="whole textures", found=f"a broken one: {cause}", remedy=remedy)

"""Photographs that a program gives, as `fit_lights` takes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import torch
from torch import Tensor

from rgspipe.arguments import as_one_of
from rgspipe.errors import InputError
from rgspipe.scene import Camera
from rgspipe.scene.arrays import ArrayLike, as_list, as_tensor, check_finite, check_levels
from rgspipe.viewer.material import Photograph

#: Of cameras, or none.
Masks: TypeAlias = "Sequence[ArrayLike] | ArrayLike | None"


def as_photographs(
    cameras: Camera | Sequence[Camera],
    images: Sequence[ArrayLike] | ArrayLike,
    masks: Masks = None,
    emitters: Masks = None,
) -> list[Photograph]:
    """Photographs of cameras and their images (H, W, 3) of linear radiance; one stands for a list of it.

    Args:
        masks: (H, W) per camera, the scene's share of each pixel; 1 if None.
        emitters: (H, W) per camera, 1 where a lamp's own pixels are; nothing is known of them if None.

    Raises:
        InputError: there are not as many images or masks as cameras, or one of them does not fit its camera.
    """
    cameras, images = [cameras] if isinstance(cameras, Camera) else list(cameras), as_list(images, axes=3)
    _check_count("images", images, cameras)
    shares, lit = _masks("masks", masks, cameras), _masks("emitters", emitters, cameras)
    return [
        _photograph(index, camera, image, mask, own)
        for index, (camera, image, mask, own) in enumerate(zip(cameras, images, shares, lit, strict=True))
    ]


def _photograph(
    index: int, camera: Camera, image: ArrayLike, mask: Tensor | None, emitters: Tensor | None
) -> Photograph:
    camera = as_one_of(camera, Camera, f"cameras[{index}]", "Camera.look_at makes one.")
    where, size = f"images[{index}]", (camera.height, camera.width, 3)
    check_levels(where, image)
    radiance = as_tensor(image, where, size, torch.float32)
    check_finite(radiance, where, "Make it again.")
    return Photograph(f"view {index}", camera, radiance.detach().cpu(), mask, emitters=emitters)


def _masks(name: str, masks: Masks, cameras: Sequence[Camera]) -> list[Tensor | None]:
    """A mask (H, W) of values from 0 to 1 for each camera; none where none are given."""
    if masks is None:
        return [None] * len(cameras)
    values = as_list(masks, axes=2)
    _check_count(name, values, cameras)
    return [_mask(f"{name}[{index}]", value, cameras[index]) for index, value in enumerate(values)]


def _mask(where: str, value: ArrayLike, camera: Camera) -> Tensor:
    mask = as_tensor(value, where, (camera.height, camera.width), torch.float32).detach().cpu()
    check_finite(mask, where, "Make it again.")
    if not 0.0 <= float(mask.min()) <= float(mask.max()) <= 1.0:
        found = f"values from {float(mask.min()):.4g} to {float(mask.max()):.4g}"
        raise InputError(where, expected="values from 0 to 1", found=found, remedy="Divide levels by the largest.")
    return mask


def _check_count(name: str, values: Sequence[ArrayLike], cameras: Sequence[Camera]) -> None:
    if len(cameras) != len(values):
        expected, remedy = f"one for each camera ({len(cameras)})", "Pass both as rg.fit_lights took them."
        raise InputError(name, expected=expected, found=f"{len(values)} of them", remedy=remedy)

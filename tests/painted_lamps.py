"""What pictures of lit rooms show besides reflected light: lamps themselves, highlights, fireflies."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.scene import Camera, PointLight

#: Rays along each side of a pixel.
FINE = 6

#: The floor of `lit_room`.
FLOOR = -0.5


def with_lamp(
    image: Tensor, camera: Camera, distance: Tensor, light: PointLight, radius: float
) -> tuple[Tensor, Tensor]:
    """An image (H, W, 3) in which a light is a sphere of even radiance I/(πr²), and its share of each pixel (H, W).

    Args:
        distance: (H, W) from the camera to what hides the sphere if it is nearer.
    """
    origins, directions, _ = camera.rays(subsamples=FINE)
    away = light.position.double() - origins
    along = (away * directions).sum(dim=1)
    beside = away.square().sum(dim=1) - along.square()
    front = along - (radius**2 - beside).clamp(min=0.0).sqrt()
    hit = (beside < radius**2) & (front > 0.0) & (front < distance.double().reshape(-1).repeat_interleave(FINE**2))
    share = hit.double().reshape(-1, FINE**2).mean(dim=1).reshape(image.shape[:2])
    radiance = light.intensity.double() / (math.pi * radius**2)
    return (image * (1.0 - share[..., None]) + share[..., None] * radiance).float(), share


def with_highlight(image: Tensor, camera: Camera, light: PointLight, specular: float, exponent: float) -> Tensor:
    """An image (H, W, 3) in which the floor has a Phong lobe that the scene does not know of."""
    origins, directions, _ = camera.rays()
    reach = (FLOOR - origins[:, 2]) / directions[:, 2]
    places = origins + reach[:, None] * directions
    floor = (reach > 0.0) & (places[:, :2].abs() < 0.5).all(dim=1)
    arriving = light.position.double() - places
    square = arriving.square().sum(dim=1)
    mirrored = directions * torch.tensor([1.0, 1.0, -1.0], dtype=torch.float64)
    cosine = (mirrored * arriving).sum(dim=1).clamp(min=0.0) / square.sqrt()
    lobe = specular * (exponent + 2.0) / (2.0 * math.pi) * cosine**exponent
    falling = arriving[:, 2] / square**1.5
    added = torch.where(floor, lobe * falling, 0.0)[:, None] * light.intensity.double()
    return (image + added.reshape(image.shape)).float()


def with_fireflies(image: Tensor, count: int, brighter: float, seed: int) -> Tensor:
    """An image (H, W, 3) with single pixels that are so many times as bright as its mean."""
    generator = torch.Generator().manual_seed(seed)
    bright = image.clone().reshape(-1, 3)
    bright[torch.randperm(len(bright), generator=generator)[:count]] = brighter * float(image.mean())
    return bright.reshape(image.shape)

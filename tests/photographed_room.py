"""A painted room with a box in it, and photographs of it under lamps that a test is to find."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import torch

from lit_room import room_surfels
from rgspipe.datasets.views import View
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, PointLight, Surfels, look_at
from rgspipe.training.materials import trace_views

#: Reflectance of the six sides that surfels may face.
PAINT = torch.tensor(
    [[0.7, 0.7, 0.7], [0.6, 0.2, 0.2], [0.2, 0.5, 0.2], [0.2, 0.3, 0.6], [0.5, 0.5, 0.2], [0.6, 0.5, 0.4]]
)

#: Two lamps, of which the second stands behind the box for half of the cameras.
LAMPS = (PointLight([0.1, -0.25, 0.3], [1.0, 0.8, 0.6]), PointLight([0.32, 0.3, -0.3], [0.3, 0.4, 0.5]))


def painted_room() -> Surfels:
    """1272 surfels."""
    surfels = room_surfels().to(torch.float32)
    axis = surfels.normals.abs().argmax(dim=1)
    side = 2 * axis + (surfels.normals.gather(1, axis[:, None])[:, 0] > 0)
    return replace(surfels, albedo=PAINT[side].contiguous())


@cache
def frozen_room() -> FrozenScene:
    return FrozenScene.freeze(painted_room(), gather_rays=256, patches=600)


def cameras(count: int, resolution: int) -> list[Camera]:
    """Cameras in the upper half of the room, which look all over it."""
    generator = torch.Generator().manual_seed(0)
    made = []
    for _ in range(count):
        origin = 0.42 * (2.0 * torch.rand(3, generator=generator) - 1.0)
        origin[2] = 0.1 + 0.3 * torch.rand(1, generator=generator).item()
        aim = 0.8 * (torch.rand(3, generator=generator) - 0.5)
        made.append(Camera.from_field_of_view(look_at(origin, aim - origin), 1.7, resolution, resolution))
    return made


@cache
def photographs(lamps: tuple[PointLight, ...] = LAMPS, count: int = 14, resolution: int = 64) -> tuple[View, ...]:
    """Rendered with all bounces and direct light where pixels look."""
    frozen, views = frozen_room(), []
    for index, camera in enumerate(cameras(count, resolution)):
        with torch.no_grad():
            image = frozen.render(camera, lamps)
        views.append(View(f"train/{index}", camera, image, torch.ones(resolution, resolution)))
    return tuple(views)


def radiance_under(
    lamps: tuple[PointLight, ...], emission: torch.Tensor | None = None, darker: float | np.ndarray = 1.0
) -> torch.Tensor:
    """(N, 3) of the painted room's surfels with all bounces, where some surfaces may glow by themselves (N, 3).

    Args:
        darker: what the paint is multiplied by, or (N, 1) that of each surfel.
    """
    frozen, albedo = frozen_room(), darker * painted_room().albedo.double().numpy()
    irradiance, _ = frozen.unit_irradiance(torch.stack([lamp.position.double() for lamp in lamps]))
    powers = torch.stack([lamp.intensity.double() for lamp in lamps]) / torch.pi
    first = albedo * (irradiance.double().T @ powers).numpy() + (0.0 if emission is None else emission.double().numpy())
    gather = frozen.gather.to_scipy().astype("float64")
    sent = first
    for _ in range(40):
        sent = first + albedo * (gather @ sent)
    return torch.from_numpy(sent).float()


def pictures(radiance: torch.Tensor, count: int = 10, resolution: int = 40) -> list[View]:
    """Photographs of surfels that send `radiance` (N, 3) to all sides, or (V, N, 3), to each camera its own."""
    taken = []
    for index, (view, weights) in enumerate(_blank(count, resolution)):
        image = weights.operator @ (radiance if radiance.ndim == 2 else radiance[index])
        taken.append(replace(view, image=image.reshape(resolution, resolution, 3)))
    return taken


@cache
def _blank(count: int, resolution: int) -> list[tuple[View, ViewWeights]]:
    """Black photographs, and what of the surfels their pixels show."""
    black, whole = torch.zeros(resolution, resolution, 3), torch.ones(resolution, resolution)
    views = [View(f"train/{i}", camera, black, whole) for i, camera in enumerate(cameras(count, resolution))]
    return list(zip(views, trace_views(painted_room(), views, 2), strict=True))

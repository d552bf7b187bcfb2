"""A room with walls of six colours, and photographs of it that the renderer made itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import torch

from rgspipe.datasets.views import View
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Camera, PointLight, Surfels, look_at
from rgspipe.training.lighting import total_irradiance, trace_lighting
from rgspipe.training.materials import build_frozen, trace_views
from rgspipe.training.options import TrainOptions
from rooms import closed_box

#: How the light bounces in the photographs.
LIGHT = TrainOptions(rounds=5, steps=0, gather_rays=64, patches=100, supersampling=1, at_pixels=False)


def painted_box() -> Surfels:
    """A closed room of 864 surfels whose six walls have six colours."""
    surfels = closed_box(1 / 12).to(torch.float32)
    colours = torch.tensor([[0.7, 0.7, 0.7], [0.6, 0.1, 0.1], [0.1, 0.5, 0.1], [0.2, 0.3, 0.6], [0.5, 0.5, 0.2]])
    axis = surfels.normals.abs().argmax(dim=1)
    side = 2 * axis + (surfels.normals.gather(1, axis[:, None])[:, 0] > 0)
    return replace(surfels, albedo=colours[side % len(colours)].contiguous())


def photographed(surfels: Surfels, cameras: Sequence[Camera], lamps: Sequence[PointLight]) -> list[View]:
    """What each camera sees under its lamp, rendered with all bounces."""
    empty = []
    for index, (camera, lamp) in enumerate(zip(cameras, lamps, strict=True)):
        blank = torch.zeros(camera.height, camera.width, 3)
        empty.append(View(f"train/{index}", camera, blank, torch.ones(camera.height, camera.width), lamp))
    lighting = trace_lighting(SurfelBvh(surfels), empty)
    radiance = total_irradiance(lighting, surfels.albedo, build_frozen(surfels, LIGHT).transport) * surfels.albedo
    weights = trace_views(surfels, empty, supersampling=1)
    return [replace(view, image=weights[v].image(radiance[v])) for v, view in enumerate(empty)]


def painted_views() -> list[View]:
    """Sixteen 32² views from inside, each with a light of its own."""
    return list(_painted_views())


@cache
def _painted_views() -> tuple[View, ...]:
    generator = torch.Generator().manual_seed(0)
    cameras, lamps = [], []
    for _ in range(16):
        origin, target, light = (0.7 * (torch.rand(3, generator=generator) - 0.5) for _ in range(3))
        cameras.append(Camera.from_field_of_view(look_at(origin, target - origin), 1.6, 32, 32))
        lamps.append(PointLight(light.double(), torch.tensor([1.0, 0.8, 1.2], dtype=torch.float64)))
    return tuple(photographed(painted_box(), cameras, lamps))

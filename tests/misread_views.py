"""Views as they are read from files that were written by other conventions than they state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.evidence.readings import FLIP, Reading
from rgspipe.scene import PointLight


def misread_view(view: View, meant: Reading, along_rays: bool = False) -> View:
    """A view whose files were written as `meant`, and are read as stated: `along_rays` says with which depth."""
    matrix = view.camera.camera_to_world.numpy()
    matrix = matrix @ FLIP if meant.opencv else matrix
    matrix = np.linalg.inv(matrix) if meant.inverse else matrix
    lengths = view.camera.rays()[2].reshape(view.depth.shape)
    depth = view.depth / meant.scale
    if meant.other_depth:
        depth = depth / lengths if along_rays else depth * lengths
    camera = replace(view.camera, camera_to_world=torch.from_numpy(matrix))
    return replace(view, camera=camera, depth=depth.float())


def lit_view(view: View, light: PointLight, generator: np.random.Generator) -> View:
    """A room of blotchy paint under direct light, without shadows, and half as much light that bounced."""
    origins, directions, lengths = view.camera.rays()
    points = origins + directions * (view.depth.reshape(-1).double() * lengths)[:, None]
    path = light.position - points
    facing = (path * view.normal.reshape(-1, 3).double()).sum(dim=1).clamp(min=0.0)
    received = facing / path.norm(dim=1) ** 3
    albedo = torch.from_numpy(generator.uniform(0.5, 0.8, len(points)))
    radiance = (albedo * (received + 0.5 * received.mean())).reshape(*view.depth.shape, 1)
    return replace(view, image=radiance.expand(-1, -1, 3).float(), light=light)

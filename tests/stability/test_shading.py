"""Gradients of shaded rays towards surfels, thresholds and radiance in hard scenes, in float32 against float64."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from double_precision import in_double
from hard_cases import DEEP, FEW, GEOMETRIES, SCENES, HardScene, rays
from rgspipe.renderer import reference
from rgspipe.renderer.kernels.shade import shade_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Surfels

GEOMETRY = ("centers", "rotations", "scales", "opacities", "clip_offsets", "clip_angles")


def gradient_of(leaf: Tensor) -> Tensor:
    """Zero where no ray meets anything."""
    return torch.zeros_like(leaf) if leaf.grad is None else leaf.grad


def shaded(scene: HardScene, surfels: Surfels, kernel: bool, count: int = 100) -> tuple[Tensor, dict[str, Tensor]]:
    """Colours, and the gradients of their sum of squares in units of each parameter: lengths in sizes of the scene."""
    dtype = surfels.centers.dtype
    leaves = {name: getattr(surfels, name).clone().requires_grad_() for name in GEOMETRY}
    surfels = replace(surfels, **leaves)
    thresholds = torch.tensor([surfels.coverage.low, surfels.coverage.high], dtype=dtype, requires_grad=True)
    generator = torch.Generator().manual_seed(3)
    radiance = torch.rand(1, len(surfels), 3, generator=generator)
    radiance = (radiance if kernel else radiance.double()).requires_grad_()
    origins, directions = rays(scene, count)
    view = torch.zeros(len(origins), dtype=torch.int32)
    arguments = (surfels, thresholds, radiance, origins, directions, view)
    colours = shade_rays(SurfelBvh(surfels), *arguments) if kernel else reference.shade_rays(*arguments)
    colours.square().sum().backward()
    gradients = {name: gradient_of(leaf) for name, leaf in leaves.items()}
    for name in ("centers", "scales", "clip_offsets"):
        gradients[name] = scene.size * gradients[name]
    # The length of a quaternion is free: only the part across it means anything.
    turn, unit = gradients["rotations"], leaves["rotations"].detach()
    gradients["rotations"] = turn - (turn * unit).sum(dim=1, keepdim=True) * unit
    return colours.detach(), gradients | {"thresholds": gradient_of(thresholds), "radiance": gradient_of(radiance)}


@pytest.mark.parametrize("name", [name for name in GEOMETRIES if name != "no surfel"])
def test_colours_and_gradients(name: str, within) -> None:
    scene = SCENES[name]
    surfels = scene.build()
    count = FEW if name in DEEP else 100
    colours, gradients = shaded(scene, surfels, kernel=True, count=count)
    expected, exact = shaded(scene, in_double(surfels), kernel=False, count=count)
    # Measured at most 8e-7, and 1.2e-5 with needles.
    within("colours", colours, expected, 5e-5)
    if name == "coincident duplicates":
        half = len(surfels) // 2
        fold = lambda g: g[:half] + g[half:] if len(g) == 2 * half else g  # noqa: E731 - twins share by rounding
        gradients, exact = ({key: fold(g) for key, g in part.items()} for part in (gradients, exact))
    # Measured at most 7e-6, and 8e-5 with needles: 1e-7 of their length is 1e-3 of their width.
    bound = 5e-4 if name == "anisotropy of 1e4" else 2e-5
    for key, gradient in gradients.items():
        within(key, gradient, exact[key], bound)


def test_without_surfels_rays_are_black_and_have_no_gradient() -> None:
    scene = SCENES["no surfel"]
    colours, gradients = shaded(scene, scene.build().to(torch.float32), kernel=True)
    assert float(colours.abs().max()) == 0.0
    assert float(gradients["thresholds"].abs().max()) == 0.0

"""Clouds and stacks of surfels, rays through them, and the devices that kernels run on."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from rgspipe.scene import NO_CLIP, Coverage, Surfels
from rooms import surfels_on

#: Parameters of a test that holds on every device.
DEVICES = [
    "cpu",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")),
]

#: Far away: float32 tells places apart by 1e-3 here.
FAR = torch.tensor([1e4, -1e4, 1e4], dtype=torch.float64)


def cloud(count: int, seed: int) -> Surfels:
    """Surfels in the unit cube: anisotropic, half transparent, half of them clipped."""
    generator = torch.Generator().manual_seed(seed)

    def uniform(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator, dtype=torch.float64)

    clipped = uniform(count, 2) < 0.5
    return Surfels(
        centers=uniform(count, 3) - 0.5,
        rotations=torch.nn.functional.normalize(uniform(count, 4) - 0.5, dim=1),
        scales=0.05 + 0.1 * uniform(count, 2),
        opacities=0.3 + 0.65 * uniform(count),
        albedo=uniform(count, 3),
        clip_offsets=torch.where(clipped, 0.05 * uniform(count, 2), torch.full((count, 2), NO_CLIP).double()),
        clip_angles=6.28 * uniform(count, 2),
        coverage=Coverage(low=0.2, high=0.9, layer_thickness=0.03, clip_softness=0.03),
    )


def cloud_rays(count: int, seed: int) -> tuple[Tensor, Tensor]:
    """Rays from a sphere around the cube into it."""
    generator = torch.Generator().manual_seed(seed)
    origins = torch.nn.functional.normalize(torch.randn(count, 3, generator=generator, dtype=torch.float64), dim=1)
    aims = torch.rand(count, 3, generator=generator, dtype=torch.float64) - 0.5
    return 1.5 * origins, torch.nn.functional.normalize(aims - 1.5 * origins, dim=1)


def stack(depths: Tensor, opacity: float, coverage: Coverage) -> Surfels:
    """Sheets at heights `depths` that face up, in random order; sideways they differ a little."""
    generator = torch.Generator().manual_seed(0)
    count = len(depths)
    aside = 0.02 * torch.rand(count, 2, generator=generator, dtype=torch.float64)
    points = torch.cat([aside, depths.double()[:, None]], dim=1)[torch.randperm(count, generator=generator)]
    sheets = surfels_on(points, torch.tensor([[0.0, 0.0, 1.0]]).expand(count, 3), 0.2)
    return Surfels(**(sheets.tensors() | {"opacities": torch.full((count,), opacity).double()}), coverage=coverage)


def thousand_faint_layers() -> Surfels:
    """A thousand layers of which each stops a little: a ray meets them all, and a twentieth of it passes."""
    coverage = Coverage(low=0.0, high=1.0, layer_thickness=1e-4, clip_softness=0.01)
    return stack(torch.linspace(-0.4, 0.4, 1000), 0.033, coverage)


def one_full_layer() -> Surfels:
    """So many faint sheets within one layer that no row holds them, and yet light passes."""
    coverage = Coverage(low=0.0, high=1.0, layer_thickness=0.1, clip_softness=0.01)
    return stack(torch.linspace(0.0, 0.05, 190), 0.0125, coverage)


def rays_down(count: int, height: float = 0.6) -> tuple[Tensor, Tensor]:
    """Rays that fall on a stack, leaning by up to 0.05."""
    generator = torch.Generator().manual_seed(1)
    directions = torch.cat([0.1 * torch.rand(count, 2, generator=generator) - 0.05, -torch.ones(count, 1)], dim=1)
    origins = torch.tensor([0.01, 0.01, height], dtype=torch.float64).expand(count, 3).clone()
    return origins, torch.nn.functional.normalize(directions.double(), dim=1)


def moved(surfels: Surfels, by: Tensor) -> Surfels:
    """The same surfels elsewhere."""
    return Surfels(**(surfels.tensors() | {"centers": surfels.centers + by}), coverage=surfels.coverage)


def reordered(surfels: Surfels, order: Tensor) -> Surfels:
    """The same surfels in another order."""
    return Surfels(**{name: x[order] for name, x in surfels.tensors().items()}, coverage=surfels.coverage)

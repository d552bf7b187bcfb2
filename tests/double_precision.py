"""A frozen scene's step in plain float64 torch: what the float32 step is held against.

Every ray is tested against every surfel (`rgspipe.renderer.reference`), the sparse products are dense, and all
derivatives are autograd's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.renderer import reference
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.surfel_bvh import usable_scales
from rgspipe.renderer.radiosity import LARGEST_ALBEDO
from rgspipe.scene import Surfels


def in_double(surfels: Surfels) -> Surfels:
    """Float64 surfels with scales that can be divided by."""
    surfels = surfels.to(torch.float64)
    return replace(surfels, scales=usable_scales(surfels.scales))


def irradiance(surfels: Surfels, position: Tensor, shadows: bool = True) -> Tensor:
    """(N,) irradiance of a unit light at `position` (3,), or a place (4,), differentiable."""
    return reference.unit_irradiance(surfels, position[None], shadows)[0]


def irradiance_and_slope(surfels: Surfels, position: Tensor, shadows: bool = True) -> tuple[Tensor, Tensor]:
    """`irradiance` (N,) and its derivative (N, 3)."""
    position = position.double()
    slope = torch.autograd.functional.jacobian(
        lambda x: irradiance(surfels, x, shadows), position, vectorize=True, strategy="forward-mode"
    )
    return irradiance(surfels, position, shadows), slope


@dataclass(frozen=True)
class DoubleTransport:
    """All bounces, from the operators of a frozen scene: average R (P, N), gather F_p (N, P), inverse H per channel."""

    average: Tensor
    gather: Tensor
    inverse: Tensor
    albedo: Tensor

    @classmethod
    def of(cls, frozen: FrozenScene) -> DoubleTransport:
        average = frozen.transport.average.matrix.to_dense().double()
        gather = frozen.transport.gather.matrix.to_dense().double()
        albedo = frozen.surfels.albedo.double()
        bounces = albedo.clamp(0.0, LARGEST_ALBEDO).T[:, :, None] * gather
        inverse = torch.linalg.inv(torch.eye(len(average), dtype=torch.float64) - average @ bounces)
        return cls(average, gather, inverse, albedo)

    def radiance(self, lit: Tensor, indirect: bool = True) -> Tensor:
        """(N, 3, K) radiance under K irradiances (N, K)."""
        direct = self.albedo[:, :, None] * lit[:, None, :] / math.pi
        if not indirect:
            return direct
        patches = torch.einsum("cpq,qn,nck->pck", self.inverse, self.average, direct)
        return direct + self.albedo[:, :, None] * torch.einsum("np,pck->nck", self.gather, patches)


def solve_radiosity(gather: Tensor, albedo: Tensor, direct: Tensor) -> Tensor:
    """(N, C) B = (I − ρF)⁻¹ D by elimination, differentiable towards D."""
    rho, identity = albedo.clamp(0.0, LARGEST_ALBEDO), torch.eye(len(gather), dtype=torch.float64)
    systems = torch.stack([identity - column[:, None] * gather for column in rho.T])
    return torch.linalg.solve(systems, direct.T[:, :, None])[:, :, 0].T


@dataclass(frozen=True)
class DoubleStep:
    """One evaluation of a light fit: the images of one point light in a frozen scene.

    Attributes:
        surfels: float64.
        transport: its bounces.
        views: (pixels, N) weights of all views stacked.
    """

    surfels: Surfels
    transport: DoubleTransport
    views: Tensor

    @classmethod
    def of(cls, frozen: FrozenScene, surfels: Surfels, views: Tensor) -> DoubleStep:
        """The operators are those of `frozen`; the surfels are as they were before it took them into float32."""
        return cls(in_double(surfels), DoubleTransport.of(frozen), views.to_dense().double())

    def columns(self, position: Tensor) -> Tensor:
        """(pixels, 3, 4) image of a unit light and its derivatives: `LightProblem.evaluate`."""
        lit, slope = irradiance_and_slope(self.surfels, position)
        return torch.einsum("pn,nck->pck", self.views, self.transport.radiance(torch.cat([lit[:, None], slope], dim=1)))

    def image(self, position: Tensor, log_intensity: Tensor) -> Tensor:
        """(pixels, 3), differentiable towards both (3,)."""
        radiance = self.transport.radiance(irradiance(self.surfels, position)[:, None])[:, :, 0]
        return (self.views @ radiance) * log_intensity.exp()


def adam_loss(
    image: Tensor, target: Tensor, sizes: list[tuple[int, int]], masks: list[Tensor], ssim_weight: float
) -> Tensor:
    """The published loss of stacked images (pixels, 3) in float64, with the plain definition of SSIM."""
    losses, start = [], 0
    for (height, width), mask in zip(sizes, masks, strict=True):
        pixels = slice(start, start + height * width)
        start = pixels.stop
        covered = mask.double()[:, :, None]
        x, y = (covered * values[pixels].reshape(height, width, 3) for values in (image, target))
        losses.append((1.0 - ssim_weight) * (x - y).abs().mean() + ssim_weight * (1.0 - ssim(x, y)))
    return torch.stack(losses).mean()


def ssim(x: Tensor, y: Tensor) -> Tensor:
    """Mean structural similarity of (H, W, C) in float64, as it is written: Gaussian window of 11, σ = 1.5."""
    x, y = x.permute(2, 0, 1)[:, None], y.permute(2, 0, 1)[:, None]
    offsets = torch.arange(11, dtype=torch.float64) - 5
    line = torch.exp(-0.5 * (offsets / 1.5).square())
    window = (line[:, None] * line / line.sum().square())[None, None]
    blur = lambda image: torch.nn.functional.conv2d(image, window, padding=5)  # noqa: E731 - as in the formula
    mx, my = blur(x), blur(y)
    vx, vy, vxy = blur(x * x) - mx * mx, blur(y * y) - my * my, blur(x * y) - mx * my
    c1, c2 = 0.01**2, 0.03**2
    return ((2 * mx * my + c1) * (2 * vxy + c2) / ((mx * mx + my * my + c1) * (vx + vy + c2))).mean()

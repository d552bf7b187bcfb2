"""Radiance of surfels under a training view's light, differentiable towards their places, normals and albedo."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.renderer.kernels.irradiance import SOFTENING, transmittance
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.lights import PointLight
from rgspipe.scene.surfels import Surfels

#: Lights whose shadows are traced at once; bounds the memory of their derivatives.
LIGHTS_AT_ONCE = 16


@dataclass(frozen=True)
class SurfelLight:
    """The light of one view as it reaches the surfels.

    Attributes:
        position: (3,) scene units.
        intensity: (3,) W/sr.
        transmittance: (N,) part that shadows let through; it lags behind the geometry.
        indirect: (N, 3) irradiance from other surfels over π; it lags too.
    """

    position: Tensor
    intensity: Tensor
    transmittance: Tensor
    indirect: Tensor


def surfel_lights(surfels: Surfels, lights: Sequence[PointLight], total: Tensor) -> list[SurfelLight]:
    """Shadows and indirect light of V lights, as they are with `surfels`.

    Args:
        total: (V, N, 3) direct and indirect irradiance over π.
    """
    bvh = SurfelBvh(surfels)
    found = []
    for start in range(0, len(lights), LIGHTS_AT_ONCE):
        block = lights[start : start + LIGHTS_AT_ONCE]
        positions = torch.stack([light.position for light in block])
        passing, _ = transmittance(bvh, positions)
        for k, light in enumerate(block):
            position, intensity = light.position.to(surfels.centers), light.intensity.to(surfels.centers)
            direct = direct_irradiance(surfels, position, intensity, passing[k])
            found.append(SurfelLight(position, intensity, passing[k], total[start + k] - direct))
    return found


def direct_irradiance(surfels: Surfels, position: Tensor, intensity: Tensor, transmittance: Tensor) -> Tensor:
    """(N, 3) direct irradiance over π, differentiable towards centres and normals:

        I/π · T · max(0, n·d) / (|d|⁴ + ε⁴)^{3/4},   d = position − centre

    as `renderer.direct.unit_irradiance` has it; the softening ε (half a scale) gets no gradient.
    """
    factor = geometry_factor(position - surfels.centers, surfels.normals, softening_lengths(surfels))
    return (transmittance * factor)[:, None] * (intensity / math.pi)


def softening_lengths(surfels: Surfels) -> Tensor:
    """(N,) ε of the inverse square law, scene units; a constant to gradients."""
    return float(SOFTENING) * surfels.scales.detach().prod(dim=1).sqrt()


def geometry_factor(paths: Tensor, normals: Tensor, softening: Tensor) -> Tensor:
    """(K,) max(0, n·d) / (|d|⁴ + ε⁴)^{3/4} of paths d (K, 3) to a light."""
    inverse = (paths.square().sum(dim=1).square() + softening.pow(4)).rsqrt()
    return (paths * normals).sum(dim=1).clamp(min=0.0) * inverse * inverse.sqrt()


def shaded_radiance(surfels: Surfels, lights: Sequence[SurfelLight]) -> Tensor:
    """(V, N, 3) ρ (direct + indirect), with the indirect light and the shadows held."""
    rows = []
    for light in lights:
        direct = direct_irradiance(surfels, light.position, light.intensity, light.transmittance)
        rows.append(surfels.albedo * (direct + light.indirect))
    return torch.stack(rows)

"""Glossy reflectance of surfels: a Phong lobe each, on top of their diffuse albedo."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

#: ρ + k_s may exceed 1 by this, the rounding of reflectances that add up to 1.
ENERGY_ROUNDING = 1e-5


@dataclass(frozen=True)
class Gloss:
    """Specular reflectance k_s and exponent n of the modified Phong model (Lafortune and Willems 1994).

        f(ω_i, ω_o) = ρ/π + k_s · (n + 2)/(2π) · max(0, cos α)^n

    α is the angle between ω_o and the mirrored ω_i. A surfel reflects at most ρ + k_s of the light that falls on it
    (exactly so for light along its normal), so ρ + k_s ≤ 1 never makes energy.

    Attributes:
        reflectance: (N, 3) k_s in [0, 1]; 0 for surfels that are diffuse.
        exponents: (N,) n ≥ 1.
    """

    reflectance: Tensor
    exponents: Tensor

    def __post_init__(self) -> None:
        count = self.reflectance.shape[0]
        for name, shape in {"reflectance": (count, 3), "exponents": (count,)}.items():
            found = tuple(getattr(self, name).shape)
            if found != shape:
                raise ValueError(f"gloss.{name} must have shape {shape}, got {found}")

    def __len__(self) -> int:
        return self.reflectance.shape[0]

    @property
    def glossy(self) -> Tensor:
        """(G,) int64 indices of the surfels that are not diffuse."""
        return (self.reflectance > 0.0).any(dim=1).nonzero()[:, 0]

    def detached(self) -> Gloss:
        """The same numbers without their gradients."""
        return Gloss(self.reflectance.detach(), self.exponents.detach())

    def to(self, *args: torch.dtype | torch.device | str) -> Gloss:
        """A copy with both tensors moved by `Tensor.to`."""
        return Gloss(self.reflectance.to(*args), self.exponents.to(*args))

    def selected(self, index: Tensor) -> Gloss:
        """That of the surfels `index` (M,)."""
        return Gloss(self.reflectance[index], self.exponents[index])

    def tensors(self) -> dict[str, Tensor]:
        """Both tensors by name, as they are stored."""
        return {"reflectance": self.reflectance, "exponents": self.exponents}

    def check(self, albedo: Tensor) -> None:
        """Refuse reflectances that make energy, and exponents for which a lobe has no finite slope.

        Args:
            albedo: (N, 3) diffuse reflectance of the same surfels.

        Raises:
            ValueError: k_s is negative, ρ + k_s exceeds 1, or n is below 1.
        """
        if bool((self.reflectance < 0.0).any()):
            raise ValueError(f"gloss.reflectance must not be negative, got {float(self.reflectance.min()):.4g}")
        total = torch.where(self.reflectance > 0.0, albedo + self.reflectance, torch.zeros_like(albedo))
        if bool((total > 1.0 + ENERGY_ROUNDING).any()):
            raise ValueError(f"albedo + gloss.reflectance must be at most 1, got {float(total.max()):.4g}")
        if bool((self.exponents < 1.0).any()):
            raise ValueError(f"gloss.exponents must be at least 1, got {float(self.exponents.min()):.4g}")

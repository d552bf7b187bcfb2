"""Weighted normal equations of one light's position and colour, with the colour in closed form.

Per channel c the model of a target y is a_c·U_c(x): linear in the intensity a, nonlinear in the position x.
All that a Gauss-Newton step needs are the 5 × 5 moments of the columns [U, ∂U/∂x, y] under the weights, so
pixels are visited once, in float64. The intensity is eliminated (variable projection, Golub and Pereyra
1973, with Kaufman's approximation of the Jacobian).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Moments:
    """Σ over pixels of w² [U, ∂U/∂x, y]ᵀ[U, ∂U/∂x, y], per channel.

    Attributes:
        values: (3, 5, 5) float64; row and column 0 are U, 1 to 3 its derivative, 4 the target.
    """

    values: Tensor

    @property
    def intensity(self) -> Tensor:
        """(3,) the intensity ≥ 0 with the least squared error; 0 in a channel that the light does not reach."""
        square, product = self.values[:, 0, 0], self.values[:, 0, 4]
        reached = square > 0
        return torch.where(reached, product / torch.where(reached, square, torch.ones_like(square)), 0.0).clamp(min=0.0)

    @property
    def cost(self) -> float:
        """Σ w² (y − aU)² at the best intensity."""
        return float(self.cost_at(self.intensity))

    def cost_at(self, intensity: Tensor) -> Tensor:
        """Σ w² (y − aU)² at an intensity (3,)."""
        v = self.values
        return (v[:, 4, 4] - 2.0 * intensity * v[:, 0, 4] + intensity.square() * v[:, 0, 0]).sum().clamp(min=0.0)

    def position_system(self) -> tuple[Tensor, Tensor]:
        """Gauss-Newton matrix (3, 3) and descent direction (3,) of the position, intensity eliminated."""
        v, a = self.values, self.intensity
        square = v[:, 0, 0].clamp(min=1e-300)
        cross = v[:, 0, 1:4]
        projected = v[:, 1:4, 1:4] - cross[:, :, None] * cross[:, None, :] / square[:, None, None]
        matrix = (a.square()[:, None, None] * projected).sum(dim=0)
        direction = (a[:, None] * (v[:, 1:4, 4] - a[:, None] * cross)).sum(dim=0)
        return matrix, direction

    def information(self, intensity: Tensor) -> Tensor:
        """(6, 6) Gauss-Newton matrix of (position, intensity)."""
        v, a = self.values, intensity
        full = torch.zeros((6, 6), dtype=torch.float64)
        full[:3, :3] = (a.square()[:, None, None] * v[:, 1:4, 1:4]).sum(dim=0)
        full[:3, 3:] = (a[:, None] * v[:, 0, 1:4]).T
        full[3:, :3] = full[:3, 3:].T
        full[3:, 3:] = torch.diag(v[:, 0, 0])
        return full


def moments(columns: Tensor, target: Tensor, weights: Tensor) -> Moments:
    """Moments of unit image and derivative `columns` (P, 3, 4) and `target` (P, 3).

    Args:
        weights: (P, 3) or (P, 1) squared weights w².
    """
    joined = torch.cat([columns.double(), target.double()[:, :, None]], dim=2).permute(1, 0, 2)
    weighted = joined * weights.double().expand(target.shape).T[:, :, None]
    return Moments((weighted.transpose(1, 2) @ joined).cpu())


def covariance(system: Moments, intensity: Tensor, values: int) -> Tensor:
    """(6, 6) covariance of (x, y, z, r, g, b) with the residual of `values` numbers as independent noise.

    Directions that the views do not determine at all get a variance of zero information, expressed by the
    pseudo-inverse as 0; a dark channel is such a direction.
    """
    noise = system.cost_at(intensity) / max(1, values - 6)
    information = system.information(intensity)
    # Unknowns have different units: scale the matrix to a unit diagonal before its rank is judged.
    scale = information.diagonal().clamp(min=0.0).sqrt()
    inverse = torch.where(scale > 0, 1.0 / scale.clamp(min=1e-300), 0.0)
    correlation = information * inverse[:, None] * inverse[None, :]
    return noise * torch.linalg.pinv(correlation, rtol=1e-12, hermitian=True) * inverse[:, None] * inverse[None, :]

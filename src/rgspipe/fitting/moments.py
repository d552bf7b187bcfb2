"""Weighted normal equations of a rig's parameters and colours, with the colours in closed form.

Per channel c the model of a target y is Σ_l a_lc·U_lc(x_l): linear in the intensities a, nonlinear in the parameters x.
All that a Gauss-Newton step needs are the moments of the columns [U_1 … U_L, ∂U_1/∂x_1 … ∂U_L/∂x_L, y] under the
weights, so pixels are visited once, in float64. The intensities are eliminated (variable projection, Golub and Pereyra
1973, with Kaufman's approximation of the Jacobian).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.fitting.nonnegative import nonnegative


@dataclass(frozen=True)
class Moments:
    """Σ over pixels of w² [U, ∂U/∂x, y]ᵀ[U, ∂U/∂x, y], per channel.

    Attributes:
        values: (3, L + D + 1, L + D + 1) float64; first the L unit images, then their D derivatives, then the target.
        owners: (D,) int64 light of each derivative.
        lights: L.
    """

    values: Tensor
    owners: Tensor
    lights: int

    @cached_property
    def intensity(self) -> Tensor:
        """(L, 3) the intensities ≥ 0 with the least squared error; 0 in a channel that a light does not reach."""
        count = self.lights
        return nonnegative(self.values[:, :count, :count], self.values[:, :count, -1]).T

    @property
    def cost(self) -> float:
        """Σ w² (y − Σ aU)² at the best intensities."""
        return float(self.cost_at(self.intensity))

    def cost_at(self, intensity: Tensor) -> Tensor:
        """Σ w² (y − Σ aU)² at intensities (L, 3)."""
        v, count, a = self.values, self.lights, intensity.T
        square = torch.einsum("cl,clm,cm->c", a, v[:, :count, :count], a)
        return (v[:, -1, -1] - 2.0 * (a * v[:, :count, -1]).sum(dim=1) + square).sum().clamp(min=0.0)

    def parameter_system(self) -> tuple[Tensor, Tensor]:
        """Gauss-Newton matrix (D, D) and descent direction (D,) of the parameters, intensities eliminated.

        Only intensities above zero are free to answer a step, so only their images are projected out.
        """
        v, count = self.values, self.lights
        images, slopes = slice(0, count), slice(count, -1)
        matrix = torch.zeros((len(self.owners),) * 2, dtype=torch.float64)
        direction = torch.zeros(len(self.owners), dtype=torch.float64)
        for channel in range(3):
            a = self.intensity[:, channel]
            strength = a[self.owners]
            active = (a > 0).nonzero()[:, 0]
            cross = v[channel, images, slopes]
            block = v[channel, slopes, slopes] - self._projected(channel, active)
            matrix += strength[:, None] * strength[None, :] * block
            direction += strength * (v[channel, slopes, -1] - a @ cross)
        return matrix, direction

    def _projected(self, channel: int, active: Tensor) -> Tensor:
        """(D, D) part of the derivatives' moments that the images of the lights `active` explain."""
        v, count = self.values[channel], self.lights
        cross = v[active, count:-1]
        gram = v[active][:, active]
        if len(active) == 1:
            return cross.T @ cross / gram.clamp(min=1e-300)
        scale = gram.diagonal().clamp(min=1e-300).sqrt()
        correlation = gram / scale[:, None] / scale[None, :]
        cross = cross / scale[:, None]
        return cross.T @ torch.linalg.pinv(correlation, rtol=1e-12, hermitian=True) @ cross

    def information(self, intensity: Tensor) -> Tensor:
        """(D + 3L, D + 3L) Gauss-Newton matrix of the parameters and then the intensities, light after light."""
        v, count, parameters = self.values, self.lights, len(self.owners)
        full = torch.zeros((parameters + 3 * count,) * 2, dtype=torch.float64)
        for channel in range(3):
            strength = intensity[self.owners, channel]
            columns = parameters + 3 * torch.arange(count) + channel
            full[:parameters, :parameters] += strength[:, None] * strength[None, :] * v[channel, count:-1, count:-1]
            side = strength[:, None] * v[channel, :count, count:-1].T
            full[:parameters, columns] = side
            full[columns, :parameters] = side.T
            full[columns[:, None], columns[None, :]] = v[channel, :count, :count]
        return full


def moments(columns: Sequence[Tensor], target: Tensor, weights: Tensor) -> Moments:
    """Moments of unit images with derivatives, and of the target.

    Args:
        columns: per light (P, 3, 1 + d), the image of a unit light and its derivatives.
        target: (P, 3).
        weights: (P, 3) or (P, 1) squared weights w².
    """
    images = [part[:, :, :1] for part in columns]
    slopes = [part[:, :, 1:] for part in columns]
    joined = torch.cat([*images, *slopes, target[:, :, None].to(columns[0])], dim=2).double().permute(1, 0, 2)
    weighted = joined * weights.double().expand(target.shape).T[:, :, None]
    owners = torch.cat([torch.full((part.shape[2],), index) for index, part in enumerate(slopes)])
    return Moments((weighted.transpose(1, 2) @ joined).cpu(), owners, len(images))


def covariance(system: Moments, intensity: Tensor, values: int) -> Tensor:
    """(D + 3L, D + 3L) covariance of parameters and intensities, the residual of `values` numbers as independent noise.

    Directions that the views do not determine at all get a variance of zero information, expressed by the
    pseudo-inverse as 0; a dark channel is such a direction.
    """
    information = system.information(intensity)
    noise = system.cost_at(intensity) / max(1, values - len(information))
    # Unknowns have different units: scale the matrix to a unit diagonal before its rank is judged.
    scale = information.diagonal().clamp(min=0.0).sqrt()
    inverse = torch.where(scale > 0, 1.0 / scale.clamp(min=1e-300), 0.0)
    correlation = information * inverse[:, None] * inverse[None, :]
    return noise * torch.linalg.pinv(correlation, rtol=1e-12, hermitian=True) * inverse[:, None] * inverse[None, :]

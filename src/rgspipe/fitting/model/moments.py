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

from rgspipe.fitting.model.nonnegative import nonnegative


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
        return information(self.values, self.owners, intensity)


def information(values: Tensor, owners: Tensor, intensity: Tensor) -> Tensor:
    """(…, D + 3L, D + 3L) Gauss-Newton matrices of the parameters and then the intensities (L, 3), light after light.

    Args:
        values: (…, 3, L + D + 1, L + D + 1), as in `Moments`.
        owners: (D,) light of each derivative.
    """
    count, parameters = len(intensity), len(owners)
    full = values.new_zeros((*values.shape[:-3], *(parameters + 3 * count,) * 2))
    for channel in range(3):
        v, strength = values[..., channel, :, :], intensity[owners, channel]
        columns = parameters + 3 * torch.arange(count) + channel
        outer = strength[:, None] * strength[None, :]
        full[..., :parameters, :parameters] += outer * v[..., count:-1, count:-1]
        side = strength[:, None] * v[..., count:-1, :count]
        full[..., :parameters, columns] = side
        full[..., columns, :parameters] = side.transpose(-1, -2)
        full[..., columns[:, None], columns[None, :]] = v[..., :count, :count]
    return full


def scores(values: Tensor, owners: Tensor, intensity: Tensor) -> Tensor:
    """(…, D + 3L) sums of Jacobian times target, of the unknowns of `information`; for moments of the residual."""
    return _scores(values[..., :-1, -1], owners, intensity)


def image_scores(columns: Sequence[Tensor], images: Tensor, weights: Tensor, intensity: Tensor) -> Tensor:
    """(S, D + 3L) float64 sums of Jacobian times images (S, P, 3), of the unknowns of `information`.

    Args:
        columns, weights: as in `moments`.
    """
    _, weighted = _joined(columns, images.new_zeros(images.shape[1:]), weights)
    against = torch.einsum("cpk,spc->sck", weighted[:, :, :-1], images.double())
    return _scores(against.cpu(), _owners(columns), intensity)


def _scores(against: Tensor, owners: Tensor, intensity: Tensor) -> Tensor:
    """Of the sums (…, 3, L + D) of unit images and derivatives times a target."""
    count, parameters = len(intensity), len(owners)
    full = against.new_zeros((*against.shape[:-2], parameters + 3 * count))
    for channel in range(3):
        full[..., :parameters] += intensity[owners, channel] * against[..., channel, count:]
        full[..., parameters + channel :: 3] = against[..., channel, :count]
    return full


def moments(columns: Sequence[Tensor], target: Tensor, weights: Tensor) -> Moments:
    """Moments of unit images with derivatives, and of the target.

    Args:
        columns: per light (P, 3, 1 + d), the image of a unit light and its derivatives.
        target: (P, 3).
        weights: (P, 3) or (P, 1) squared weights w².
    """
    joined, weighted = _joined(columns, target, weights)
    return Moments((weighted.transpose(1, 2) @ joined).cpu(), _owners(columns), len(columns))


def group_moments(
    columns: Sequence[Tensor], target: Tensor, weights: Tensor, groups: Tensor, count: int
) -> tuple[Tensor, Tensor]:
    """`Moments.values` (count, 3, L + D + 1, L + D + 1) of each group of pixels, and the derivatives' owners (D,).

    Args:
        groups: (P,) int64 in [0, count), the group of each pixel.
    """
    order = torch.argsort(groups)
    sizes = torch.bincount(groups, minlength=count).tolist()
    ordered = [part[order] for part in columns]
    joined, weighted = _joined(ordered, target[order], weights.expand(target.shape)[order])
    parts = zip(weighted.split(sizes, dim=1), joined.split(sizes, dim=1), strict=True)
    return torch.stack([left.transpose(1, 2) @ right for left, right in parts]).cpu(), _owners(columns)


def _joined(columns: Sequence[Tensor], target: Tensor, weights: Tensor) -> tuple[Tensor, Tensor]:
    """(3, P, L + D + 1) float64 unit images, derivatives and target; and the same times the weights."""
    images = [part[:, :, :1] for part in columns]
    slopes = [part[:, :, 1:] for part in columns]
    joined = torch.cat([*images, *slopes, target[:, :, None].to(columns[0])], dim=2).double().permute(1, 0, 2)
    return joined, joined * weights.double().expand(target.shape).T[:, :, None]


def _owners(columns: Sequence[Tensor]) -> Tensor:
    return torch.cat([torch.full((part.shape[2] - 1,), index) for index, part in enumerate(columns)])

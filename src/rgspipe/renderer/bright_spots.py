"""What bounces off the brightest spots of a scene, which few of the hemisphere's rays hit: by shadow rays instead.

A lamp near a surface lights a spot that takes little of what any surfel sees. Of its rays a surfel has a few there, or
none, so that images of lamps near surfaces are noisy, the more so the nearer they are. Least squares prefer images with
less noise, and so lamps that are farther away: errors in variables (Fuller 1987). From a few points that stand for the
spot each surfel gets what it should, without noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.receiver import RECEIVER_FADE, RECEIVER_SKIP
from rgspipe.renderer.transport import PatchTransport

#: Share of the scene's area that counts as a spot. Of a lamp 0.05 from a wall it reflects two fifths of all that is
#: reflected first. Two and four times as much area finds lamps no better; half of it has not been tried.
SHARE = 0.01

#: Points that stand for it; each costs a shadow ray to every surfel. Of 12 lamps 0.01 to 0.05 before a surface the mean
#: error is 0.36 % of the room with 16, 0.39 % with 32, 0.38 % with 64 and 0.66 % with none (docs/laboratory/lamps.md).
#: In a coarser room (tests/fitting/search/test_bright_spots.py) 8 leave a lamp twice as far off as 64 do.
POINTS = 16


@dataclass(frozen=True)
class SpotTransport:
    """Transport in which light from the S surfels of bright spots goes its first way from K points.

    With the direct radiosity D, of which P D is the spots', and the transport T of all other light:

        I(D) = O + T(D − P D + O),     O = ρ F_K R_K D

    Attributes:
        others: T.
        chosen: (S,) int64 the spots' surfels.
        average: (K, S) R_K, means over the surfels of each point by area.
        factors: (N, K) F_K, form factors from each surfel to what each point stands for.
    """

    others: PatchTransport
    chosen: Tensor
    average: Tensor
    factors: Tensor

    def to(self, device: torch.device | str) -> SpotTransport:
        """The same on another device."""
        return SpotTransport(*(part.to(device) for part in (self.others, self.chosen, self.average, self.factors)))

    def indirect(self, direct: Tensor) -> Tensor:
        """(N, 3, K) indirect part of the radiosity for K lightings with direct radiosity (N, 3, K)."""
        sent = self.factors @ (self.average @ direct[self.chosen].flatten(1))
        own = self.others.albedo[:, :, None] * sent.reshape(direct.shape)
        return own + self.others.indirect(direct.index_fill(0, self.chosen, 0.0) + own)


def spot_share(frozen: FrozenScene, irradiance: Tensor) -> float:
    """Part of what surfaces reflect first under a lighting (N,) that its spot does."""
    sent, areas = _sent(frozen, irradiance), frozen.areas.double().cpu()
    bright = _brightest(sent, areas)
    return float((sent * areas)[bright].sum() / (sent * areas).sum().clamp(min=1e-300))


def with_bright_spots(frozen: FrozenScene, irradiances: Sequence[Tensor]) -> FrozenScene:
    """The scene with its brightest spots under each of several lightings taken out of the patches; the scene itself
    where no surface sees a spot.

    Args:
        frozen: a diffuse scene with patch transport.
        irradiances: (N,) of each lighting.
    """
    areas = frozen.areas.double().cpu()
    averages, factors, order, chosen = [], [], [], torch.zeros(len(areas), dtype=torch.bool)
    for irradiance in irradiances:
        spot = _brightest(_sent(frozen, irradiance), areas) & ~chosen
        places = spot.nonzero()[:, 0]
        if len(places):
            average = _means(frozen, places, areas)
            averages.append(average)
            factors.append(_form_factors(frozen, places, average, areas[places]))
            order.append(places)
            chosen |= spot
    if not any(bool(one.any()) for one in factors):
        return frozen
    average = torch.block_diag(*averages).to(frozen.surfels.albedo)
    spots = SpotTransport(frozen.transport, torch.cat(order).to(frozen.device), average, torch.cat(factors, dim=1))
    return replace(frozen, solver=spots)


def _sent(frozen: FrozenScene, irradiance: Tensor) -> Tensor:
    """(N,) float64 what surfels reflect, over the number that makes it radiance."""
    return irradiance.double().cpu().clamp(min=0.0) * frozen.surfels.albedo.double().cpu().mean(dim=1)


def _brightest(radiosity: Tensor, areas: Tensor) -> Tensor:
    """(N,) bool the brightest surfels, as many as cover SHARE of the area, that are lit at all."""
    order = radiosity.argsort(descending=True, stable=True)
    within = areas[order].cumsum(0) <= SHARE * areas.sum()
    within[:1] = True
    return torch.zeros_like(within).index_put_((order,), within) & (radiosity > 0.0)


def _means(frozen: FrozenScene, places: Tensor, areas: Tensor) -> Tensor:
    """(K, S) float64 means by area over the surfels `places` of each of K points."""
    surfels = frozen.surfels
    labels = cluster_patches(surfels.centers[places], surfels.normals[places], POINTS, seed=0)
    members = torch.from_numpy(np.equal.outer(np.arange(labels.max() + 1), labels)).double() * areas[places]
    return members / members.sum(dim=1, keepdim=True)


def _form_factors(frozen: FrozenScene, places: Tensor, average: Tensor, areas: Tensor) -> Tensor:
    """(N, K) float32 cos θ cos θ' V A / (π r² + A) from each surfel to each point of area A.

    The A below keeps the factor of what is near within 1 (Wallace, Elmquist and Haines 1989).
    """
    surfels = frozen.surfels
    centers = (surfels.centers if frozen.centers is None else frozen.centers).double().cpu()
    normals = torch.nn.functional.normalize(average @ surfels.normals[places].double().cpu(), dim=1)
    points = average @ centers[places]
    area = (average > 0.0).double() @ areas
    # Surfels of the spot itself are passed, as they are at the other end of a ray.
    away = float(RECEIVER_SKIP + RECEIVER_FADE) * float(surfels.scales.detach().median())
    before = (points + away * normals).to(frozen.device)
    passing = _share(*(unit_irradiance(frozen.bvh, before, shadows)[0] for shadows in (True, False)))
    received = passing * unit_irradiance(frozen.bvh, points.to(frozen.device), shadows=False)[0]
    offset = centers[None] - points[:, None]
    squared = offset.square().sum(dim=2)
    cosine = ((offset * normals[:, None]).sum(dim=2) / squared.sqrt().clamp(min=1e-30)).clamp(min=0.0)
    factors = received.double().cpu() * squared * cosine * area[:, None] / (math.pi * squared + area[:, None])
    return factors.T.contiguous().to(surfels.albedo)


def _share(part: Tensor, whole: Tensor) -> Tensor:
    return torch.where(whole > 0.0, part / whole.clamp(min=1e-30), torch.zeros_like(whole))

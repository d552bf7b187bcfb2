"""How much light shadows can take: nothing, by proof, or the largest loss over lights placed where it is worst."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import normalize

from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.mutual_visibility import mutual_visibility
from rgspipe.renderer.point_sets import fibonacci_directions

#: Radius of the ball in which lights may be, over half the diagonal of the bounding box.
BALL_RADII = 2.0

#: Lights nearer to a surfel than this many of its scales are in the surface, as the scene knows it: not in the domain.
CLEARANCE = 2.0

#: A loss so large that no tolerance allows it ends the search.
CERTAIN = 0.5

#: Lights of each kind, in the order in which they are tried; the first ones settle it in a room.
FIRST, BEHIND, GRAZING, UNIFORM = 16, 32, 32, 64

#: Rounds of lights around the worst ones, lights in each, and how many are the worst.
ROUNDS, AROUND, WORST = 3, 16, 4

#: Receivers among which occluders are looked for.
RECEIVERS = 256

#: Lights whose irradiance is computed at once.
LIGHTS_AT_ONCE = 16


@dataclass(frozen=True)
class ShadowBound:
    """What shadows of one light can take from the radiance, in the ball of BALL_RADII and clear of surfaces.

    Attributes:
        point: the largest radiance that a point light loses to shadow anywhere, as a share of its brightest direct
            radiance without shadows.
        spot: the largest part of its own light that any lit surfel loses: a cone may be aimed at just that surfel,
            which then is the brightest.
        proved: no surfel can shade another (`mutual_visibility`), both are zero. Otherwise they are the largest of a
            sample, which a shadow that few positions cast can exceed.
        lights: how many were tried; with CERTAIN reached there is no need to go on.
        uniform: how many of them were drawn from the whole domain: with 95 % confidence less than 3/uniform of it
            casts larger shadows.
        sun: `point` of lights at infinity, of UNIFORM directions all around; all of it where none was tried.
    """

    point: float
    spot: float
    proved: bool
    lights: int
    uniform: int
    sun: float = 1.0


def shadow_bound(frozen: FrozenScene, seed: int) -> ShadowBound:
    """Prove that there are no shadows, or else search for the worst one."""
    if not mutual_visibility(frozen.surfels).shadow:
        return ShadowBound(0.0, 0.0, True, 0, 0, 0.0)
    generator = torch.Generator().manual_seed(seed)
    search = _Search(frozen)
    for count, draw in ((FIRST, sample_lights), (BEHIND, _behind_occluders), (GRAZING, _grazing)):
        search.try_lights(draw(frozen, count, generator), uniform=draw is sample_lights)
    search.try_lights(sample_lights(frozen, UNIFORM, generator), uniform=True)
    for step in range(ROUNDS):
        search.try_lights(search.around_worst(0.05 * frozen.size * 0.4**step, generator), uniform=False)
    return ShadowBound(search.point, search.spot, False, search.tried, search.uniform, _sun_loss(frozen))


def shadow_losses(frozen: FrozenScene, positions: Tensor) -> tuple[Tensor, Tensor]:
    """(L,) `ShadowBound.point` and (L,) `ShadowBound.spot` of lights at (L, 3), or places (L, 4).

    0 for lights that light nothing.
    """
    albedo = frozen.surfels.albedo.amax(dim=1)
    lit, shadowed = (unit_irradiance(frozen.bvh, positions, shadows=on)[0] * albedo for on in (False, True))
    peak = lit.amax(dim=1)
    point = torch.where(peak > 0.0, (lit - shadowed).amax(dim=1) / peak.clamp(min=1e-30), torch.zeros_like(peak))
    loss = torch.where(lit > 0.0, 1.0 - shadowed / lit.clamp(min=1e-30), torch.zeros_like(lit))
    return point, loss.amax(dim=1)


def _sun_loss(frozen: FrozenScene) -> float:
    """`ShadowBound.sun`, no further than CERTAIN."""
    towards, worst = fibonacci_directions(UNIFORM).double(), 0.0
    for block in torch.cat([towards, towards.new_zeros(UNIFORM, 1)], dim=1).split(LIGHTS_AT_ONCE):
        worst = max(worst, float(shadow_losses(frozen, block)[0].amax()))
        if worst >= CERTAIN:
            break
    return worst


def sample_lights(frozen: FrozenScene, count: int, generator: torch.Generator) -> Tensor:
    """(count, 3) float64 positions in the domain of the bound.

    Uniform in the bounding box and in the ball of BALL_RADII around it, half each, those in surfaces replaced by others
    in the ball.
    """
    middle, extent = _box(frozen)
    inside = middle + extent * (torch.rand(count // 2, 3, generator=generator) - 0.5)
    others = 2 * count - count // 2
    radius = _ball_radius(frozen) * torch.rand(others, 1, generator=generator).pow(1.0 / 3.0)
    ball = middle + radius * normalize(torch.randn(others, 3, generator=generator), dim=1)
    drawn = torch.cat([inside, ball])
    return drawn[clear_of_surfels(frozen, drawn)][:count]


def clear_of_surfels(frozen: FrozenScene, positions: Tensor) -> Tensor:
    """(L,) whether the nearest surfel to each position (L, 3) is farther than CLEARANCE of its scales."""
    scales = frozen.surfels.scales.double().prod(dim=1).sqrt().clamp(min=1e-30)
    centers = frozen.bvh.surfels.centers.double()
    blocks = positions.to(centers).split(LIGHTS_AT_ONCE)
    return torch.cat([(torch.cdist(block, centers) / scales).amin(dim=1) > CLEARANCE for block in blocks]).cpu()


class _Search:
    """The worst of the lights tried so far."""

    def __init__(self, frozen: FrozenScene) -> None:
        self.frozen = frozen
        self.positions, self.losses = torch.zeros(0, 3, dtype=torch.float64), torch.zeros(0)
        self.point = self.spot = 0.0
        self.tried = self.uniform = 0

    def try_lights(self, positions: Tensor, uniform: bool) -> None:
        positions = positions[clear_of_surfels(self.frozen, positions)]
        for block in positions.split(LIGHTS_AT_ONCE):
            if self.point >= CERTAIN or not len(block):
                return
            point, spot = (loss.cpu() for loss in shadow_losses(self.frozen, block))
            self.positions, self.losses = torch.cat([self.positions, block]), torch.cat([self.losses, point])
            self.point, self.spot = max(self.point, float(point.amax())), max(self.spot, float(spot.amax()))
            self.tried += len(block)
            self.uniform += len(block) * uniform

    def around_worst(self, distance: float, generator: torch.Generator) -> Tensor:
        """(AROUND, 3) lights at normally distributed offsets of `distance` from the worst so far."""
        worst = self.positions[self.losses.topk(min(WORST, len(self.losses))).indices]
        if not len(worst):
            return worst
        repeated = worst.repeat(math.ceil(AROUND / len(worst)), 1)[:AROUND]
        return repeated + distance * torch.randn(AROUND, 3, generator=generator)


def _behind_occluders(frozen: FrozenScene, count: int, generator: torch.Generator) -> Tensor:
    """Lights that a surfel stands in front of, as seen from another: half behind the steepest, half behind any."""
    centers, normals, receivers = _receivers(frozen, RECEIVERS, generator)
    apart = centers - centers[receivers][:, None]
    distance = apart.norm(dim=2).clamp(min=1e-30)
    elevation = torch.einsum("rc,rnc->rn", normals[receivers], apart) / distance
    # Neighbours on the receiver's own surface cast no shadow on it.
    elevation[distance < 4.0 * frozen.surfels.scales.amax().cpu()] = 0.0
    steepest = elevation.argmax(dim=1)
    among = (elevation > 0.0).float() + 1e-12
    drawn = torch.multinomial(among, 1, generator=generator)[:, 0]
    half = count // 2
    first = elevation.amax(dim=1).topk(min(half, len(receivers))).indices
    r = torch.cat([first, torch.arange(len(receivers))[: count - half]])
    j = torch.cat([steepest[first], drawn[: count - half]])
    towards = centers[j] - centers[receivers[r]]
    farthest = (_ball_radius(frozen) / towards.norm(dim=1, keepdim=True).clamp(min=1e-30)).clamp(min=1.1)
    beyond = 1.05 + (farthest - 1.05).clamp(min=0.0) * torch.rand(len(r), 1, generator=generator).square()
    return centers[receivers[r]] + beyond * towards


def _grazing(frozen: FrozenScene, count: int, generator: torch.Generator) -> Tensor:
    """Lights low over a surfel's plane, elevations from 0.001 to 0.3 rad evenly in their logarithm."""
    centers, normals, receivers = _receivers(frozen, count, generator)
    normal = normals[receivers]
    sideways = normalize(torch.linalg.cross(normal, torch.randn(normal.shape, generator=generator).double()), dim=1)
    elevation = 1e-3 * torch.full((len(normal), 1), 300.0).pow(torch.rand(len(normal), 1, generator=generator))
    distance = _ball_radius(frozen) * torch.rand(len(normal), 1, generator=generator)
    return centers[receivers] + distance * (elevation.cos() * sideways + elevation.sin() * normal)


def _receivers(frozen: FrozenScene, count: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
    """Centres and normals (N, 3) in float64 on the CPU, and the indices of up to `count` random surfels."""
    surfels = frozen.surfels
    chosen = torch.randperm(len(surfels), generator=generator)[:count]
    return surfels.centers.cpu().double(), surfels.normals.cpu().double(), chosen


def _box(frozen: FrozenScene) -> tuple[Tensor, Tensor]:
    lower, upper = (corner.cpu().double() for corner in frozen.bounds)
    return 0.5 * (lower + upper), upper - lower


def _ball_radius(frozen: FrozenScene) -> float:
    return BALL_RADII * 0.5 * float(_box(frozen)[1].norm())

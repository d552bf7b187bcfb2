"""Slow, plain torch versions of the kernels, in the dtype of their inputs (float64 in tests).

Every ray is tested against every surfel and everything is differentiable by autograd, so these say what
the kernels must compute. The kernels take a hierarchy where these take the surfels; the rest of a
signature is the same.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import GRAZING, OPAQUE
from rgspipe.renderer.kernels.irradiance import SOFTENING
from rgspipe.renderer.kernels.pixel_light import BLUR, MIDDLE_WEIGHT, NEAR, NODE, REACH, SIDE_WEIGHT
from rgspipe.renderer.kernels.places import homogeneous
from rgspipe.renderer.kernels.receiver import COPLANAR_COSINE, COPLANAR_OFFSET, RECEIVER_FADE, RECEIVER_SKIP
from rgspipe.renderer.kernels.shadow import EDGE_ON, IN_PLANE
from rgspipe.scene.camera import Camera
from rgspipe.scene.surfels import Coverage, Surfels


def smoothstep(raw: Tensor, low: Tensor | float, high: Tensor | float) -> Tensor:
    """0 below low, 1 above high, 3y² − 2y³ between."""
    y = ((raw - low) / (high - low)).clamp(0.0, 1.0)
    return y * y * (3.0 - 2.0 * y)


def alpha_at(surfels: Surfels, offsets: Tensor, met: Tensor) -> Tensor:
    """(R, N) opacity of surfel n at offsets (R, N, 3) from its centre in its plane, where it counts; 0 elsewhere.

    Args:
        met: (R, N) bool, which of them are asked for.
    """
    coverage, widest = surfels.coverage, surfels.scales.detach().amax(dim=1)
    # No surfel reaches farther than its Gaussian with all of its opacity would: nine in ten need no more arithmetic.
    reach = widest * math.sqrt(-2.0 * math.log(coverage.minimum_alpha)) * (1.0 + 1e-6)
    ray, index = (met & (offsets.detach().square().sum(-1) < reach.square())).nonzero(as_tuple=True)
    local = torch.einsum("pc,pac->pa", offsets[ray, index], surfels.frames[:, :2][index])
    standardised = local / surfels.scales[index]
    alpha = surfels.opacities[index] * torch.exp(-0.5 * standardised.square().sum(-1))
    direction = torch.stack([surfels.clip_angles.cos(), surfels.clip_angles.sin()], dim=-1)
    along = torch.einsum("pa,pka->pk", local, direction[index])
    alpha = alpha * (0.5 + (surfels.clip_offsets[index] - along) / coverage.clip_softness).clamp(0.0, 1.0).prod(dim=-1)
    counted = torch.where(alpha > coverage.minimum_alpha, alpha, torch.zeros_like(alpha))
    return torch.zeros(met.shape, dtype=alpha.dtype).index_put((ray, index), counted)


def composite_dense(
    surfels: Surfels,
    origins: Tensor,
    directions: Tensor,
    nearest: float = 1e-4,
    two_sided: bool = False,
    thresholds: Tensor | None = None,
) -> tuple[Tensor, Tensor]:
    """Weights (R, N) of every surfel in every ray, and what passes (R,): `kernels.composite.composite`, dense."""
    coverage, normals = surfels.coverage, surfels.normals
    low, high = (coverage.low, coverage.high) if thresholds is None else thresholds
    facing = directions @ normals.T
    met = facing.abs() > GRAZING if two_sided else facing < -GRAZING
    safe = torch.where(met, facing, torch.ones_like(facing))
    depth = ((surfels.centers[None] - origins[:, None]) * normals).sum(-1) / safe
    offsets = origins[:, None] + depth[..., None] * directions[:, None] - surfels.centers
    every = alpha_at(surfels, offsets, met & (depth > nearest))
    # Layers are made of what a ray meets alone, nearest first.
    most = int((every.detach() > 0).sum(dim=1).amax()) if len(every) else 0
    remaining, order = torch.where(every.detach() > 0, depth.detach(), torch.inf).topk(most, dim=1, largest=False)
    alpha = every.gather(1, order)
    weights = torch.zeros_like(alpha)
    passing = torch.ones(len(origins), dtype=alpha.dtype)
    while bool((remaining < torch.inf).any()):
        front = remaining.amin(dim=1, keepdim=True)
        layer = (remaining <= front + coverage.layer_thickness) & (remaining < torch.inf)
        live = passing.detach() >= OPAQUE
        in_layer = torch.where(layer & live[:, None], alpha, torch.zeros_like(alpha))
        covered = smoothstep(1.0 - (1.0 - in_layer).prod(dim=1), low, high)
        total = in_layer.sum(dim=1)
        share = passing * covered / torch.where(total > 0, total, torch.ones_like(total))
        weights = weights + in_layer * share[:, None]
        passing = passing * (1.0 - covered)
        remaining = torch.where(layer, torch.full_like(remaining, torch.inf), remaining)
    return torch.zeros_like(every).scatter(1, order, weights), passing


def shade_rays(
    surfels: Surfels, thresholds: Tensor, radiance: Tensor, origins: Tensor, directions: Tensor, ray_view: Tensor
) -> Tensor:
    """(R, 4) colours and coverage: `kernels.shade.shade_rays`."""
    weights, _ = composite_dense(surfels, origins, directions, thresholds=thresholds)
    colours = torch.einsum("rn,rnc->rc", weights, radiance[ray_view.long()])
    return torch.cat([colours, weights.sum(dim=1, keepdim=True)], dim=1)


def geometry_factor(positions: Tensor, centers: Tensor, normals: Tensor, scales: Tensor) -> tuple[Tensor, Tensor]:
    """Unshadowed irradiance from unit point lights, max(0, n·d)/(|d|⁴ + ε⁴)^{3/4} with d = light − centre.

    The fourth powers keep the inverse square law where it holds: its relative error is ¾(ε/|d|)⁴.

    Args:
        positions: (L, 3) lights, or places (L, 4); centers, normals: (N, 3); scales: (N,) ε over SOFTENING.

    Returns:
        (L, N) irradiance per intensity, 1/scene unit², and its derivative (L, N, 3) towards the position.
    """
    places = homogeneous(positions)[:, None]
    d = places[..., :3] - places[..., 3:] * centers
    square = d.square().sum(-1)
    inverse = (square.square() + (places[..., 3] * SOFTENING * scales).pow(4)).rsqrt()
    cube = inverse * inverse.sqrt()
    projected = (d * normals).sum(-1)
    lit = projected >= 0
    factor = torch.where(lit, projected * cube, torch.zeros_like(cube))
    slope = normals * cube[..., None] - d * (3.0 * projected * square * cube * inverse * inverse)[..., None]
    return factor, torch.where(lit[..., None], slope, torch.zeros_like(slope))


def unit_irradiance(surfels: Surfels, positions: Tensor, shadows: bool = True) -> Tensor:
    """(L, N) irradiance of unit point lights (L, 3), or at places (L, 4): `direct.unit_irradiance`."""
    scales = surfels.scales.prod(dim=1).sqrt()
    factor, _ = geometry_factor(positions, surfels.centers, surfels.normals, scales)
    return factor * transmittance(surfels, positions) if shadows else factor


def transmittance(surfels: Surfels, positions: Tensor) -> Tensor:
    """(L, N) parts of the lights (L, 3) that reach the surfels: `kernels.irradiance.transmittance`."""
    everyone = torch.arange(len(surfels))
    return torch.stack([transmittance_at(surfels, light, everyone, surfels.centers) for light in positions])


def transmittance_at(surfels: Surfels, light: Tensor, receivers: Tensor, points: Tensor) -> Tensor:
    """(R,) part of a light (3,) or (4,) that reaches points (R, 3) on the planes of the surfels `receivers` (R,)."""
    coverage, normals, centers = surfels.coverage, surfels.normals, surfels.centers
    place = homogeneous(light)

    def way(at: Tensor) -> Tensor:
        return place[:3] - place[3] * at

    scale, own = surfels.scales.prod(dim=1).sqrt()[receivers], normals[receivers]
    between = centers[None] - points[:, None]
    coplanar = (own @ normals.T > COPLANAR_COSINE) & (
        (between * own[:, None]).sum(-1).abs() < COPLANAR_OFFSET * scale[:, None]
    )
    lit = (way(points) * own).sum(dim=1) > 0.0
    path = torch.where(lit[:, None], way(points), own)
    rays = path / path.norm(dim=1, keepdim=True)
    facing = rays @ normals.T
    met = (facing.abs() > IN_PLANE * EDGE_ON) & ~coplanar & ((way(centers) * normals).sum(-1) * facing > 0.0)
    depth = (between * normals).sum(-1) / torch.where(met, facing, torch.ones_like(facing))
    fade = ((depth / scale[:, None] - RECEIVER_SKIP) / RECEIVER_FADE).clamp(0.0, 1.0)
    fade = torch.where(facing < 0.0, (depth > 0.0).to(fade), fade)
    fade = fade * smoothstep(facing.abs(), 0.0, EDGE_ON)
    alpha = alpha_at(surfels, depth[..., None] * rays[:, None] - between, met & (fade > 0.0))
    passing = _layers_from_afar(alpha * fade, depth, coverage)
    return torch.where(lit, passing, torch.ones_like(passing))


def _layers_from_afar(alpha: Tensor, depth: Tensor, coverage: Coverage) -> Tensor:
    """(R,) what passes the layers of occluders (R, N), counted from the light: the largest depths come first."""
    most = int((alpha.detach() > 0).sum(dim=1).amax()) if len(alpha) else 0
    place, order = torch.where(alpha.detach() > 0, depth.detach(), -torch.inf).topk(most, dim=1)
    alpha = alpha.gather(1, order)
    clear = passing = torch.ones(len(alpha), dtype=alpha.dtype)
    front = torch.full_like(clear, torch.inf)
    for k in range(most):
        starts = place[:, k] < front - coverage.layer_thickness
        covered = smoothstep(1.0 - clear, coverage.low, coverage.high)
        passing = torch.where(starts, passing * (1.0 - covered), passing)
        clear = torch.where(starts, torch.ones_like(clear), clear) * (1.0 - alpha[:, k])
        front = torch.where(starts, place[:, k], front)
    return passing * (1.0 - smoothstep(1.0 - clear, coverage.low, coverage.high))


def points_on_surfels(surfels: Surfels, origin: Tensor, rays: Tensor, indices: Tensor, reach: Tensor | float) -> Tensor:
    """(R, 3) where rays (R, 3) from `origin` (3,) meet the planes of surfels `indices` (R,), near their centres."""
    centers, normals = surfels.centers[indices], surfels.normals[indices]
    across = (rays * normals).sum(-1)
    distance = ((centers - origin) * normals).sum(-1) / across
    beside = origin + distance[:, None] * rays - centers
    return centers + beside * (reach / beside.norm(dim=1).clamp(min=1e-300)).clamp(max=1.0)[:, None]


def direct_image(
    surfels: Surfels,
    weights: Tensor,
    edges: Tensor,
    camera: Camera,
    light: Tensor,
    passing: Tensor,
    own_passing: Tensor,
) -> Tensor:
    """(P, 3) direct radiance of a light (3,) of 1 W/sr: `kernels.pixel_light.PixelLight.image`, its value.

    Args:
        weights: (P, N) dense view weights.
        edges: (P,) bool.
        passing: (N,) transmittance of the way to each surfel; own_passing: (P,) of each pixel, negative where unknown.
    """
    place = homogeneous(light)
    _, directions, lengths = camera.rays()
    rays, axes = directions * lengths[:, None], camera.camera_to_world[:3, :3].double()
    right, up = axes[:, 0] / camera.fx, axes[:, 1] / camera.fy
    pixels, indices = weights.nonzero(as_tuple=True)
    scale = surfels.scales.prod(dim=1).sqrt()[indices]
    reach = torch.where(edges[pixels], REACH * scale, torch.full_like(scale, torch.inf))
    normals, origin = surfels.normals[indices], camera.origin.double()

    def looked_at(x: float, y: float) -> Tensor:
        return points_on_surfels(surfels, origin, rays[pixels] + x * right + y * up, indices, reach)

    seen = looked_at(0.0, 0.0)
    away = seen - origin
    footprint = right.norm() * away.square().sum(-1) / (away * normals).sum(-1).abs()
    softening = torch.minimum(SOFTENING * scale, BLUR * footprint)

    def lit(seen: Tensor) -> Tensor:
        path = place[:3] - place[3] * seen
        square = path.square().sum(-1)
        soft = (square.square() + (place[3] * softening).pow(4)).pow(0.75)
        return (path * normals).sum(-1).clamp(min=0.0) / soft

    near = place[3] * footprint > NEAR * (place[:3] - place[3] * seen).norm(dim=1)
    nodes = ((-float(NODE), float(SIDE_WEIGHT)), (0.0, float(MIDDLE_WEIGHT)), (float(NODE), float(SIDE_WEIGHT)))
    mean = sum(wx * wy * lit(looked_at(x, y)) for x, wx in nodes for y, wy in nodes)
    part = torch.where(own_passing[pixels] >= 0.0, own_passing[pixels], passing[indices])
    contribution = weights[pixels, indices] * part * torch.where(near, mean, lit(seen))
    image = torch.zeros(len(weights), 3, dtype=weights.dtype)
    return image.index_add(0, pixels, contribution[:, None] * surfels.albedo[indices] / math.pi)

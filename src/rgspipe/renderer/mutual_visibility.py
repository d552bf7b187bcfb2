"""Whether surfels of a scene can stand in each other's light, or see each other at all: a proof without rays.

Surfel j can shade surfel i, or be seen by it, only where its footprint rises above the tangent plane of i. On a convex
object no footprint does, but for neighbours that the renderer passes over as i's own surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.gather import LIFT, build_gather
from rgspipe.renderer.kernels.receiver import COPLANAR_COSINE, COPLANAR_OFFSET
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh, usable_scales
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.surfels import Surfels

#: Surfels are tested in groups, by a cylinder around their footprints, before they are tested one by one: so many in a
#: group, times the root of all, which balances both tests.
GROUP_SHARE = 1.0 / 3.0

#: Receivers looked at first, which suffice in a room, and at once after that.
FIRST_RECEIVERS, RECEIVERS_AT_ONCE = 64, 4096

#: Pairs of a receiver and a group that are looked into, times the number of surfels, before the proof is given up.
MOST_PAIRS = 60

#: A rise of less than this part of the receiver's scale does not count: lights whose elevation over the receiver is
#: below 1e-4 rad could tell it.
LEAST_RISE = 1e-4


@dataclass(frozen=True)
class MutualVisibility:
    """What cannot be ruled out in a scene.

    Attributes:
        shadow: that a surfel keeps light from another, for some position of a light. If False, the transmittance from
            every light to every surfel is 1.
        sight: that the front of a surfel lies in the hemisphere of another. If False, the gather operator is zero.
    """

    shadow: bool
    sight: bool


@dataclass(frozen=True)
class _Footprints:
    """Where the footprints of surfels are; float64, on the CPU. Leading dimensions …: (N) or (groups, members).

    Attributes:
        centers, normals: (…, 3).
        reach: (…, 2, 3) half axes of the ellipse in which opacity exceeds the coverage's minimum.
        scales: (…,) geometric mean of the two scales.
    """

    centers: Tensor
    normals: Tensor
    reach: Tensor
    scales: Tensor

    @classmethod
    def of(cls, surfels: Surfels) -> _Footprints:
        surfels = surfels.to(torch.float64).to("cpu")
        scales, frames = usable_scales(surfels.scales), surfels.frames
        ratio = (surfels.opacities / surfels.coverage.minimum_alpha).clamp(min=1.0)
        reach = ((2.0 * ratio.log()).sqrt()[:, None] * scales)[:, :, None] * frames[:, :2]
        return cls(surfels.centers - surfels.centers.mean(dim=0), frames[:, 2], reach, scales.prod(dim=1).sqrt())

    def __getitem__(self, index: object) -> _Footprints:
        return _Footprints(*(getattr(self, item.name)[index] for item in fields(self)))

    @property
    def lifted(self) -> Tensor:
        """(…, 3) where gather rays start."""
        return self.centers + LIFT * self.scales[..., None] * self.normals

    @property
    def radius(self) -> Tensor:
        """(…,) of the circle around each ellipse."""
        return self.reach.norm(dim=-1).amax(dim=-1)


@dataclass(frozen=True)
class _Cylinders:
    """Around the footprints of G groups.

    Attributes:
        centers, axes: (G, 3), the axes of unit length.
        radii, heights: (G,) radius and half the height.
        spread: (G,) largest distance of a member's normal from the axis.
        back: (G,) how far behind the centre, along its own normal, the plane of a member is at most.
    """

    centers: Tensor
    axes: Tensor
    radii: Tensor
    heights: Tensor
    spread: Tensor
    back: Tensor

    @classmethod
    def around(cls, groups: _Footprints) -> _Cylinders:
        centers = groups.centers.mean(dim=1)
        axes = torch.nn.functional.normalize(groups.normals.mean(dim=1), dim=1)
        apart = groups.centers - centers[:, None]
        along = (apart * axes[:, None]).sum(dim=2)
        across = (apart - along[..., None] * axes[:, None]).norm(dim=2)
        rise = torch.einsum("gkac,gc->gka", groups.reach, axes).norm(dim=2)
        radii, heights = (across + groups.radius).amax(dim=1), (along.abs() + rise).amax(dim=1)
        spread = (groups.normals - axes[:, None]).norm(dim=2).amax(dim=1)
        back = -(apart * groups.normals).sum(dim=2).amin(dim=1)
        return cls(centers, axes, radii, heights, spread, back)

    def top(self, receivers: _Footprints) -> Tensor:
        """(R, G) height of each cylinder's highest point over the plane of each receiver."""
        cosine = receivers.normals @ self.axes.T
        sine = (1.0 - cosine.square()).clamp(min=0.0).sqrt()
        offset = (receivers.normals * receivers.centers).sum(dim=1, keepdim=True)
        return receivers.normals @ self.centers.T - offset + self.radii * sine + self.heights * cosine.abs()

    def front(self, points: Tensor) -> Tensor:
        """(R, G) at least the height of each point (R, 3) over the plane of any member of a group."""
        over = points @ self.axes.T - (self.axes * self.centers).sum(dim=1)
        return over + self.spread * torch.cdist(points, self.centers) + self.back


def build_needed_gather(bvh: SurfelBvh, rays: int, *, seed: int, areas: Tensor) -> SparseOperator:
    """`build_gather`, but no ray is cast where no surfel can see another."""
    if mutual_visibility(bvh.surfels).sight:
        return build_gather(bvh, rays, seed=seed, areas=areas)
    nothing = scipy.sparse.csr_matrix((len(bvh.surfels), len(bvh.surfels)), dtype=np.float32)
    return SparseOperator.from_scipy(nothing, bvh.device)


def mutual_visibility(surfels: Surfels) -> MutualVisibility:
    """What cannot be ruled out between N surfels; edges are ignored, so that footprints count as whole ellipses.

    Rules out both for convex objects whose footprints are small against their curvature: spheres from some 2500
    surfels on. Cost grows as N^1.5 there (docs/reference/model/effects.md), and the test ends early where surfels face
    each other.
    """
    shadow, sight = False, False
    if len(surfels) < 2:
        return MutualVisibility(shadow, sight)
    footprints, looked_into = _Footprints.of(surfels), 0
    groups = footprints[_groups(footprints)]
    cylinders = _Cylinders.around(groups)
    order = torch.randperm(len(surfels), generator=torch.Generator().manual_seed(0))
    for block in (order[:FIRST_RECEIVERS], *order[FIRST_RECEIVERS:].split(RECEIVERS_AT_ONCE)):
        receivers = footprints[block]
        rises = cylinders.top(receivers) > LEAST_RISE * receivers.scales[:, None]
        if shadow:
            # What is left to find is what a receiver sees the front of.
            rises &= cylinders.front(receivers.lifted) > 0.0
        near = rises.nonzero()
        looked_into += len(near)
        # In parts, so that memory stays bounded however many groups rise.
        for i, g in (part.unbind(1) for part in near.split(RECEIVERS_AT_ONCE)):
            pair_shadow, pair_sight = _possible(receivers, i, groups, g)
            shadow, sight = shadow or pair_shadow, sight or pair_sight
            if shadow and sight:
                return MutualVisibility(True, True)
        if looked_into > MOST_PAIRS * len(surfels):
            return MutualVisibility(True, True)
    return MutualVisibility(shadow, sight)


def _groups(footprints: _Footprints) -> Tensor:
    """(G, members) indices of surfels alike in place and direction; the last group repeats one of its own."""
    features = torch.cat([footprints.centers / footprints.centers.abs().max(), footprints.normals], dim=1).numpy()
    size = math.ceil(GROUP_SHARE * math.sqrt(len(features)))
    parts, waiting = [], [np.arange(len(features))]
    while waiting:
        part = waiting.pop()
        if len(part) <= size:
            parts.append(np.resize(part, size))
            continue
        chosen = features[part]
        axis = np.argmax(chosen.max(axis=0) - chosen.min(axis=0))
        half = math.ceil(len(part) / size) // 2 * size
        order = np.argpartition(chosen[:, axis], half)
        waiting += [part[order[:half]], part[order[half:]]]
    return torch.from_numpy(np.stack(parts))


def _possible(receivers: _Footprints, i: Tensor, groups: _Footprints, g: Tensor) -> tuple[bool, bool]:
    """Whether in any pair of receivers i and groups g a member can shade the receiver, or be seen by it."""
    normal = receivers.normals[i]
    height = torch.einsum("pc,pkc->pk", normal, groups.centers[g] - receivers.centers[i][:, None])
    cosine = torch.einsum("pc,pkc->pk", normal, groups.normals[g])
    sine = (1.0 - cosine.square()).clamp(min=0.0).sqrt()
    p, k = (height + groups.radius[g] * sine > LEAST_RISE * receivers.scales[i][:, None]).nonzero(as_tuple=True)
    one, other, height, cosine = receivers[i[p]], groups[g[p], k], height[p, k], cosine[p, k]
    top = height + torch.einsum("pc,pac->pa", one.normals, other.reach).norm(dim=1)
    # As the shadow kernel passes over neighbours, the surfel itself among them …
    own_surface = (cosine > COPLANAR_COSINE) & (height.abs() < COPLANAR_OFFSET * one.scales)
    shades = (top > LEAST_RISE * one.scales) & ~own_surface
    # … and as gather rays start above the surfel and meet fronts only.
    seen = (top > LIFT * one.scales) & ((other.normals * (one.lifted - other.centers)).sum(dim=1) > 0.0)
    return bool(shades.any()), bool(seen.any())

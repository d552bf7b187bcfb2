"""A frozen scene: geometry and materials are fixed, so light moves through precomputed linear operators."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.direct import differentiable_irradiance, unit_irradiance
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.spot import spot_share
from rgspipe.renderer.transport import PatchTransport, build_patch_transport, cluster_patches
from rgspipe.renderer.view_weights import ViewWeights, build_view_weights
from rgspipe.scene.camera import Camera
from rgspipe.scene.lights import LightRig, SpotLight
from rgspipe.scene.surfels import Surfels


@dataclass(frozen=True)
class FrozenScene:
    """Surfels with their light transport.

    Attributes:
        surfels: N surfels, float32.
        areas: (N,) surface that each stands for, scene units².
        gather: (N, N) which surfels each surfel sees.
        transport: all bounces, averaged over patches.
    """

    surfels: Surfels
    areas: Tensor
    gather: SparseOperator
    transport: PatchTransport

    @classmethod
    def freeze(cls, surfels: Surfels, *, gather_rays: int, patches: int, seed: int) -> FrozenScene:
        """Precompute the operators of `surfels`: the gather from hemisphere rays, then patch transport."""
        surfels = surfels.to(torch.float32)
        bvh = SurfelBvh(surfels)
        areas = surfel_areas(bvh, seed=seed)
        gather = build_gather(bvh, gather_rays, seed=seed, areas=areas)
        labels = cluster_patches(surfels.centers, surfels.normals, patches, seed=seed)
        transport = build_patch_transport(gather, labels, areas, surfels.albedo)
        return cls(surfels, areas, gather, transport)

    @cached_property
    def bvh(self) -> SurfelBvh:
        """The hierarchy for shadow and camera rays."""
        return SurfelBvh(self.surfels)

    @cached_property
    def bounds(self) -> tuple[Tensor, Tensor]:
        """(3,) lower and upper corner of the surfels' centres."""
        return self.surfels.centers.amin(dim=0), self.surfels.centers.amax(dim=0)

    @property
    def size(self) -> float:
        """Longest side of the bounding box, scene units."""
        lower, upper = self.bounds
        return float((upper - lower).amax())

    def view(self, camera: Camera, supersampling: int = 4) -> ViewWeights:
        """The camera's image as a linear function of the radiance."""
        return build_view_weights(self.bvh, camera, supersampling)

    def unit_irradiance(self, positions: Tensor, shadows: bool = True) -> tuple[Tensor, Tensor]:
        """Irradiance (L, N) of unit point lights at (L, 3) and its derivative (L, N, 3)."""
        return unit_irradiance(self.bvh, positions, shadows)

    def radiance(self, irradiance: Tensor, indirect: bool = True) -> Tensor:
        """Outgoing radiance (N, 3, K) for K direct irradiances (N, K), grey; linear and differentiable."""
        direct = self.surfels.albedo[:, :, None] * (irradiance / math.pi)[:, None, :]
        return direct + self.transport.indirect(direct) if indirect else direct

    def radiance_of(self, rig: LightRig, indirect: bool = True) -> Tensor:
        """Outgoing radiance (N, 3) under a rig of point and spot lights."""
        positions = torch.stack([light.position for light in rig]).to(self.surfels.centers)
        intensity = torch.stack([light.intensity for light in rig]).to(self.surfels.centers)
        irradiance = differentiable_irradiance(self.bvh, positions)
        shares = [
            spot_share(light, self.surfels.centers, position) if isinstance(light, SpotLight) else None
            for light, position in zip(rig, positions, strict=True)
        ]
        lit = torch.stack([e if s is None else e * s for e, s in zip(irradiance, shares, strict=True)])
        # Channels are independent: intensity scales each light's radiance channel by channel.
        return torch.einsum("nck,kc->nc", self.radiance(lit.T, indirect), intensity)

    def render(self, view: ViewWeights, rig: LightRig, indirect: bool = True) -> Tensor:
        """(height, width, 3) image of the scene under `rig`."""
        return view.image(self.radiance_of(rig, indirect))

"""A bounding volume hierarchy over surfels, and the arrays that every ray cast reads."""

from __future__ import annotations

from dataclasses import replace

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, as_vec3
from rgspipe.scene.surfels import Surfels

#: Smallest scale of a surfel over the largest in the scene.
MINIMUM_SCALE = 1e-7


@wp.struct
class SurfelArrays:
    """Per surfel: what a ray needs. Axes are divided by the scales, clip ramps by the softness."""

    center: wp.array(dtype=wp.vec3)
    normal: wp.array(dtype=wp.vec3)
    u_axis: wp.array(dtype=wp.vec3)  # u / s_u: its dot product with x − center is u in standard deviations
    v_axis: wp.array(dtype=wp.vec3)
    opacity: wp.array(dtype=float)
    clip_a: wp.array(dtype=wp.vec3)  # ramp of a clip: x − y·u − z·v, with u, v in standard deviations
    clip_b: wp.array(dtype=wp.vec3)
    scale: wp.array(dtype=float)  # geometric mean of the two scales


@wp.func
def surfel_alpha(s: SurfelArrays, j: int, x: wp.vec3):
    """Opacity of surfel j at the offset x from its centre in its plane."""
    u = wp.dot(x, s.u_axis[j])
    v = wp.dot(x, s.v_axis[j])
    a = s.clip_a[j]
    b = s.clip_b[j]
    ramp = wp.clamp(a[0] - a[1] * u - a[2] * v, 0.0, 1.0) * wp.clamp(b[0] - b[1] * u - b[2] * v, 0.0, 1.0)
    return s.opacity[j] * wp.exp(-0.5 * (u * u + v * v)) * ramp


class SurfelBvh:
    """Surfels ready for ray casts.

    Args:
        surfels: N surfels; with none of them every ray passes. The kernels work in float32; the tensors'
            device is the rays' device.
    """

    def __init__(self, surfels: Surfels) -> None:
        surfels = replace(surfels, scales=usable_scales(surfels.scales))
        self.surfels = surfels
        self.device = surfels.centers.device
        frames, scales, coverage = surfels.frames, surfels.scales, surfels.coverage
        axes = frames[:, :2] / scales[:, :, None]
        self.arrays = SurfelArrays()
        self.arrays.center = as_vec3(surfels.centers)
        self.arrays.normal = as_vec3(frames[:, 2])
        self.arrays.u_axis, self.arrays.v_axis = as_vec3(axes[:, 0]), as_vec3(axes[:, 1])
        self.arrays.opacity = as_array(surfels.opacities.float())
        ramps = clip_ramps(surfels)
        self.arrays.clip_a, self.arrays.clip_b = as_vec3(ramps[:, 0]), as_vec3(ramps[:, 1])
        self.arrays.scale = as_array(scales.prod(dim=1).sqrt().float())
        extent = footprint_extent(surfels)
        self._lower, self._upper = as_vec3(surfels.centers - extent), as_vec3(surfels.centers + extent)
        self._bvh = wp.Bvh(self._lower, self._upper) if len(surfels) else None
        self.coverage = coverage

    @property
    def id(self) -> int:
        """Warp's handle of the hierarchy; 0 if there are no surfels, where no kernel may be launched."""
        return self._bvh.id if self._bvh is not None else 0


def usable_scales(scales: Tensor) -> Tensor:
    """Scales (N, 2) with those of no extent made so small that no ray meets the surfel, but not zero.

    A scale of zero has an infinite inverse, and infinity times a distance of zero is no number.
    """
    largest = scales.detach().amax() if scales.numel() else scales.new_tensor(1.0)
    return scales.clamp(min=float(MINIMUM_SCALE * largest.clamp(min=1e-30)))


def clip_ramps(surfels: Surfels) -> Tensor:
    """(N, 2, 3) coefficients (x, y, z) of both ramps x − y·u − z·v, u and v in standard deviations."""
    softness = surfels.coverage.clip_softness
    direction = torch.stack([surfels.clip_angles.cos(), surfels.clip_angles.sin()], dim=-1)
    slope = direction * surfels.scales[:, None, :] / softness
    return torch.cat([(surfels.clip_offsets / softness + 0.5)[..., None], slope], dim=-1)


def footprint_extent(surfels: Surfels) -> Tensor:
    """(N, 3) half-size of the box around each footprint, where opacity exceeds the coverage's minimum."""
    ratio = (surfels.opacities / surfels.coverage.minimum_alpha).clamp(min=1.01)
    radius = (2.0 * ratio.log()).sqrt()
    axes = surfels.frames[:, :2] * surfels.scales[:, :, None]
    # A surfel parallel to an axis has a flat box; a margin keeps rays in its plane from rounding past it.
    margin = 1e-4 * surfels.scales.amax(dim=1, keepdim=True) + 1e-7 * surfels.centers.abs().amax(dim=1, keepdim=True)
    return radius[:, None] * axes.square().sum(dim=1).sqrt() + margin

"""A bounding volume hierarchy over surfels, and the records that every ray cast reads."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cached_property

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.coverage import LayerRule, layer_rule
from rgspipe.renderer.kernels.launch import as_array, as_vec3, torch_stream
from rgspipe.renderer.kernels.receiver import ray_starts
from rgspipe.scene.surfels import Surfels

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: Smallest scale of a surfel over the largest in the scene.
MINIMUM_SCALE = 1e-7

#: Surfels in a leaf of the hierarchy. Queries cost the same for 1, 2 and 4; more make the build quicker.
LEAF_SIZE = 4


@wp.struct
class SurfelRecord:
    """What a ray needs of a surfel, in one piece of memory. The order of the fields is that of `surfel_records`."""

    center: wp.vec3  # from the scene's middle
    normal: wp.vec3
    u_axis: wp.vec3  # u / s_u: its dot product with x − center is u in standard deviations
    v_axis: wp.vec3
    clip_a: wp.vec3  # ramp of a clip: x − y·u − z·v, with u, v in standard deviations
    clip_b: wp.vec3
    opacity: float
    reach: float  # u² + v² beyond which the opacity is below the coverage's minimum
    scale: float  # geometric mean of the two scales


@wp.struct
class SurfelTree:
    """What rays are cast at."""

    bvh: wp.uint64
    records: wp.array(dtype=SurfelRecord)
    starts: wp.array(dtype=float)  # `ray_starts` of each record; of none without a hierarchy
    rule: LayerRule


@wp.func
def clip_height(clip: wp.vec3, u: float, v: float):
    """Ramp of a clip before it is clamped to [0, 1]."""
    return clip[0] - clip[1] * u - clip[2] * v


@wp.func
def surfel_alpha(surfels: wp.array(dtype=SurfelRecord), j: int, x: wp.vec3):
    """Opacity of surfel j at the offset x from its centre in its plane; 0 beyond its reach."""
    u = wp.dot(x, surfels[j].u_axis)
    v = wp.dot(x, surfels[j].v_axis)
    square = u * u + v * v
    alpha = float(0.0)
    if square < surfels[j].reach:
        ramp_a = wp.clamp(clip_height(surfels[j].clip_a, u, v), 0.0, 1.0)
        ramp_b = wp.clamp(clip_height(surfels[j].clip_b, u, v), 0.0, 1.0)
        alpha = surfels[j].opacity * wp.exp(-0.5 * square) * ramp_a * ramp_b
    return alpha


class SurfelBvh:
    """Surfels ready for ray casts.

    Kernels work in float32 and measure from the middle of the scene, so that a scene far from the origin
    loses no digits but those it was given with; within, surfels are ordered along a space-filling curve,
    so that rays that follow each other read the same memory. Neither shows outside of the kernels.

    Args:
        surfels: N surfels of any floating dtype; with none of them every ray passes. The tensors' device
            is the rays' device.
    """

    def __init__(self, surfels: Surfels) -> None:
        self.surfels = surfels = replace(surfels, scales=usable_scales(surfels.scales))
        self.device = surfels.centers.device
        self.coverage = surfels.coverage
        self.rule = layer_rule(surfels.coverage)
        centers = surfels.centers.detach().double()
        self.middle = 0.5 * (centers.amin(dim=0) + centers.amax(dim=0)) if len(surfels) else centers.new_zeros(3)
        order = curve_order(centers - self.middle)
        #: Surfel of each record, and record of each surfel.
        self.order, self.rank = as_array(order.int()), as_array(order.argsort().int())
        self._record(order)

    def _record(self, order: Tensor) -> None:
        # Warp reads the tensor's memory; the attribute keeps it.
        surfels = self.surfels
        self._records = surfel_records(surfels, self.middle)[order]
        self.records = wp.array(
            ptr=self._records.data_ptr(),
            dtype=SurfelRecord,
            shape=(len(surfels),),
            device=wp.device_from_torch(self.device),
        )

    def displaced(self, centers: Tensor) -> SurfelBvh:
        """The same surfels at `centers` (N, 3), a little elsewhere.

        Places are measured from the same middle, and shadow rays begin as far from their receivers.
        """
        moved = copy(self)
        for made in ("_hierarchy", "tree", "leaves"):
            moved.__dict__.pop(made, None)
        moved.surfels = replace(self.surfels, centers=centers)
        moved.__dict__["_starts"] = self._starts
        moved._record(wp.to_torch(self.order).long())
        return moved

    @cached_property
    def _hierarchy(self) -> wp.Bvh:
        extent = footprint_extent(self.surfels, self.middle)
        centers = self.local(self.surfels.centers)
        order = wp.to_torch(self.order).long()
        lower, upper = as_vec3((centers - extent)[order]), as_vec3((centers + extent)[order])
        with torch_stream(self.device):
            return wp.Bvh(lower, upper, leaf_size=LEAF_SIZE)

    @cached_property
    def tree(self) -> SurfelTree:
        """What kernels cast rays at; the hierarchy is built when it is asked for. There must be surfels."""
        return self._tree(self._hierarchy.id, self._starts)

    @cached_property
    def leaves(self) -> SurfelTree:
        """The same without a hierarchy, for kernels that cast no ray."""
        return self._tree(0, torch.empty(0, device=self.device))

    @cached_property
    def _starts(self) -> Tensor:
        order = wp.to_torch(self.order).long()
        normals, scales = self.surfels.normals[order], self.surfels.scales[order].prod(dim=1).sqrt().float()
        return ray_starts(self._hierarchy, self.local(self.surfels.centers)[order], normals, scales)

    def _tree(self, bvh: int, starts: Tensor) -> SurfelTree:
        tree = SurfelTree()
        tree.bvh, tree.records, tree.starts, tree.rule = bvh, self.records, as_array(starts), self.rule
        return tree

    def local(self, points: Tensor) -> Tensor:
        """Points (…, 3) from the scene's middle, float32, contiguous, on the surfels' device."""
        return (points.detach().to(self.device, torch.float64) - self.middle).float().contiguous()


def surfel_records(surfels: Surfels, middle: Tensor) -> Tensor:
    """(N, 21) float32: the fields of `SurfelRecord`, one after the other."""
    frames, scales, ramps = surfels.frames, surfels.scales, clip_ramps(surfels)
    axes = frames[:, :2] / scales[:, :, None]
    parts = [surfels.centers.double() - middle, frames[:, 2], axes[:, 0], axes[:, 1], ramps[:, 0], ramps[:, 1]]
    parts += [surfels.opacities[:, None], footprint_reach(surfels)[:, None], scales.prod(dim=1).sqrt()[:, None]]
    return torch.cat([part.detach().float() for part in parts], dim=1).contiguous()


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


def footprint_reach(surfels: Surfels) -> Tensor:
    """(N,) u² + v², in standard deviations, where opacity falls to the coverage's minimum; 0 if it never exceeds it."""
    return 2.0 * (surfels.opacities / surfels.coverage.minimum_alpha).clamp(min=1.0).log()


def footprint_extent(surfels: Surfels, middle: Tensor) -> Tensor:
    """(N, 3) half-size of the box around each footprint, where opacity exceeds the coverage's minimum."""
    axes = surfels.frames[:, :2] * surfels.scales[:, :, None]
    extent = footprint_reach(surfels).sqrt()[:, None] * axes.square().sum(dim=1).sqrt()
    # A surfel parallel to an axis has a flat box; a margin keeps rays in its plane from rounding past it.
    distance = (surfels.centers - middle).abs().amax(dim=1, keepdim=True)
    return (extent + 1e-4 * surfels.scales.amax(dim=1, keepdim=True) + 1e-7 * distance).detach().float()


def curve_order(points: Tensor) -> Tensor:
    """(N,) order of points (N, 3) along a Z-order curve of 2¹⁰ cells a side (Morton 1966)."""
    if len(points) == 0:
        return torch.zeros(0, dtype=torch.int64, device=points.device)
    lower = points.amin(dim=0)
    side = (points.amax(dim=0) - lower).amax().clamp(min=1e-30)
    cells = ((points - lower) / side * 1023.0).long()
    # Spread the ten bits of each coordinate so that two zeros follow every bit.
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cells = (cells | (cells << shift)) & mask
    return (cells[:, 0] | (cells[:, 1] << 1) | (cells[:, 2] << 2)).argsort(stable=True)

"""The rays of a view's pixels as kernels read them."""

from __future__ import annotations

import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_vec3, vector
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.camera import Camera

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})


@wp.struct
class PixelRays:
    """One ray through each pixel's centre."""

    origin: wp.vec3
    directions: wp.array(dtype=wp.vec3)  # to the plane one unit in front of the camera
    right: wp.vec3  # from a pixel to its neighbours, on that plane
    up: wp.vec3


def pixel_rays(bvh: SurfelBvh, camera: Camera, pixels: Tensor | None = None) -> PixelRays:
    """The rays of a camera in the coordinates of the surfels' hierarchy.

    Args:
        pixels: (P,) int64 whose rays; all if None.
    """
    _, directions, lengths = camera.rays(pixels)
    axes = camera.camera_to_world[:3, :3].double()
    rays = PixelRays()
    rays.origin = vector(bvh.local(camera.origin))
    rays.directions = as_vec3((directions * lengths[:, None]).to(bvh.device))
    rays.right, rays.up = vector(axes[:, 0] / camera.fx), vector(axes[:, 1] / camera.fy)
    return rays

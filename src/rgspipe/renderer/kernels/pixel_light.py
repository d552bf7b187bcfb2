"""The image of a light with the inverse square and the cosine taken where pixels look, not at surfels' centres."""

from __future__ import annotations

import math

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch
from rgspipe.renderer.kernels.pixel_rays import PixelRays
from rgspipe.renderer.kernels.places import as_place, way_to
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})

#: In a pixel on an edge the ray through the pixel's centre may miss a surfel that the pixel sees: it counts as
#: meeting its plane at most this many scales from the surfel's centre.
REACH = wp.constant(2.5)

#: A pixel's footprint that is longer than this part of its distance from the light is averaged over 3 × 3 points.
#: The midpoint of a shorter one is wrong by at most about ½ (length/distance)² = 0.5 %.
NEAR = wp.constant(0.1)

#: Within this part of a footprint a pixel sees a light as if it were farther away, as nine points see nothing of what
#: is finer. Were it half a surfel's scale as for surfels (`kernels.irradiance.SOFTENING`), lamps 0.01 from a wall would
#: shine 13 % too dim on it, or 75 % in a coarse room (tests/renderer/test_pixel_direct.py). Twice of it makes pixels of
#: that room as much as 6 % too dim instead of 1.5 %, half of it changes nothing.
BLUR = wp.constant(0.25)

#: Gauss-Legendre nodes and weights on [−½, ½]: ±NODE and 0.
NODE = wp.constant(0.5 * math.sqrt(0.6))
SIDE_WEIGHT, MIDDLE_WEIGHT = wp.constant(5.0 / 18.0), wp.constant(8.0 / 18.0)


@wp.struct
class PixelView:
    """What the pixels of a view see: the entries of its weights in compressed rows, and the surfels."""

    rows: wp.array(dtype=int)
    columns: wp.array(dtype=int)
    weights: wp.array(dtype=float)
    edges: wp.array(dtype=int)  # 1 where a pixel is on or beside an edge
    centers: wp.array(dtype=wp.vec3)
    normals: wp.array(dtype=wp.vec3)
    scales: wp.array(dtype=float)
    softening: wp.array(dtype=float)


@wp.func
def point_on_surfel(o: wp.vec3, d: wp.vec3, c: wp.vec3, n: wp.vec3, reach: float):
    """Where a ray meets a surfel's plane, held within `reach` of its centre."""
    across = wp.dot(d, n)
    x = c
    if wp.abs(across) > 1.0e-6 * wp.length(d):
        beside = o + (wp.dot(c - o, n) / across) * d - c
        x = c + beside * wp.min(1.0, reach / wp.max(wp.length(beside), 1.0e-30))
    return x


@wp.func
def light_at(x: wp.vec3, n: wp.vec3, light: wp.vec4, softening: float):
    """What `direct.unit_irradiance` has at x without shadows, and its derivative towards the light's position."""
    path = way_to(light, x)
    projected = wp.dot(path, n)
    lit = wp.vec4(0.0, 0.0, 0.0, 0.0)
    if projected > 0.0:
        square = wp.dot(path, path)
        soft = light[3] * softening * softening
        inverse = 1.0 / wp.sqrt(square * square + soft * soft)
        cube = inverse * wp.sqrt(inverse)
        slope = n * cube - path * (3.0 * projected * square * cube * inverse * inverse)
        lit = wp.vec4(projected * cube, slope[0], slope[1], slope[2])
    return lit


@wp.func
def light_on_pixel(view: PixelView, rays: PixelRays, p: int, j: int, light: wp.vec4):
    """`light_at` where pixel p looks on surfel j; its mean over the pixel's footprint beside the light."""
    d = rays.directions[p]
    c = view.centers[j]
    n = view.normals[j]
    reach = wp.where(view.edges[p] == 1, REACH * view.scales[j], 1.0e30)
    x = point_on_surfel(rays.origin, d, c, n, reach)
    # Longest side of the pixel's footprint: pixels are nearly square, and leaning stretches them.
    seen = x - rays.origin
    footprint = wp.length(rays.right) * wp.dot(seen, seen) / wp.max(wp.abs(wp.dot(seen, n)), 1.0e-30)
    softening = wp.min(view.softening[j], BLUR * footprint)
    lit = wp.vec4(0.0, 0.0, 0.0, 0.0)
    if light[3] * footprint <= NEAR * wp.length(way_to(light, x)):
        lit = light_at(x, n, light, softening)
    else:
        for a in range(3):
            for b in range(3):
                shifted = d + (float(a) - 1.0) * NODE * rays.right + (float(b) - 1.0) * NODE * rays.up
                weight = float(1.0)
                weight *= wp.where(a == 1, MIDDLE_WEIGHT, SIDE_WEIGHT)
                weight *= wp.where(b == 1, MIDDLE_WEIGHT, SIDE_WEIGHT)
                lit += weight * light_at(point_on_surfel(rays.origin, shifted, c, n, reach), n, light, softening)
    return lit


@wp.kernel
def _direct_image(
    offset: int,
    slab: int,
    view: PixelView,
    rays: PixelRays,
    reflectance: wp.array(dtype=wp.vec3),
    light: wp.vec4,
    passing: wp.array(dtype=float),
    passing_slope: wp.array(dtype=wp.vec3),
    own_passing: wp.array(dtype=wp.vec4),
    image: wp.array(dtype=wp.vec4, ndim=2),
):
    p = wp.tid() + offset
    own = own_passing[p]
    red = wp.vec4(0.0, 0.0, 0.0, 0.0)
    green = wp.vec4(0.0, 0.0, 0.0, 0.0)
    blue = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for e in range(view.rows[p], view.rows[p + 1]):
        j = view.columns[e]
        part = passing[j]
        slope = passing_slope[j]
        if own[0] >= 0.0:
            part = own[0]
            slope = wp.vec3(own[1], own[2], own[3])
        if part > 0.0 or wp.dot(slope, slope) > 0.0:
            lit = light_on_pixel(view, rays, p, j, light)
            lit = view.weights[e] * (part * lit + wp.vec4(0.0, slope[0], slope[1], slope[2]) * lit[0])
            r = reflectance[j]
            red += r[0] * lit
            green += r[1] * lit
            blue += r[2] * lit
    image[p, 0] = red
    image[p, 1] = green
    image[p, 2] = blue


@wp.kernel
def _direct_entries(
    offset: int,
    slab: int,
    view: PixelView,
    rays: PixelRays,
    light: wp.vec4,
    passing: wp.array(dtype=float),
    own_passing: wp.array(dtype=wp.vec4),
    entries: wp.array(dtype=float),
):
    p = wp.tid() + offset
    for e in range(view.rows[p], view.rows[p + 1]):
        j = view.columns[e]
        part = wp.where(own_passing[p][0] >= 0.0, own_passing[p][0], passing[j])
        entry = float(0.0)
        if part > 0.0:
            lit = light_on_pixel(view, rays, p, j, light)
            entry = view.weights[e] * part * lit[0]
        entries[e] = entry


class PixelLight:
    """One view's surfels and rays, ready for any number of lights.

    Args:
        bvh: N surfels.
        matrix: (P, N) view weights in compressed rows.
        edges: (P,) bool, pixels on or beside an edge.
        rays: of the pixels.
        softening: (N,) ε of `direct.unit_irradiance`, scene units; less of it where pixels are finer.
    """

    def __init__(self, bvh: SurfelBvh, matrix: Tensor, edges: Tensor, rays: PixelRays, softening: Tensor) -> None:
        surfels = bvh.surfels
        self._bvh, self._pixels = bvh, matrix.shape[0]
        view = self._view = PixelView()
        view.rows, view.columns = as_array(matrix.crow_indices()), as_array(matrix.col_indices())
        view.weights, view.edges = as_array(matrix.values()), as_array(edges.to(bvh.device).int())
        view.centers, view.normals = as_vec3(bvh.local(surfels.centers)), as_vec3(surfels.normals)
        scales = surfels.scales.detach().prod(dim=1).sqrt()
        view.scales, view.softening = as_array(scales.float()), as_array(softening.float())
        self._rays = rays
        self._reflectance = as_vec3(surfels.albedo / math.pi)

    def image(self, light: Tensor, passing: Tensor, passing_slope: Tensor, own_passing: Tensor) -> Tensor:
        """(P, 3, 4) radiance under a light of 1 W/sr in RGB: its value, and its derivative towards x, y and z.

        Args:
            light: (3,) position, or (4,) place.
            passing: (N,) transmittance of the way to each surfel.
            passing_slope: (N, 3) its derivative towards the position.
            own_passing: (P, 4) the same two of a pixel, where they are known better than from its surfels; the
                transmittance is negative where they are not.
        """
        image = torch.empty((self._pixels, 3, 4), dtype=torch.float32, device=self._bvh.device)
        inputs = [self._view, self._rays, self._reflectance, as_place(self._bvh, light)]
        inputs += [as_array(passing.float()), as_vec3(passing_slope)]
        inputs.append(wp.from_torch(own_passing.contiguous(), dtype=wp.vec4))
        launch(_direct_image, self._pixels, [*inputs, wp.from_torch(image, dtype=wp.vec4)], self._bvh.device)
        return image

    def entries(self, light: Tensor, passing: Tensor, own_passing: Tensor) -> Tensor:
        """(entries,) irradiance per W/sr in place of each of the view's weights, times that weight.

        The image of the light is these in the weights' places, times the surfels' albedo over π.

        Args:
            light, passing, own_passing: as for `image`.
        """
        entries = torch.empty(self._view.columns.shape[0], dtype=torch.float32, device=self._bvh.device)
        inputs = [self._view, self._rays, as_place(self._bvh, light), as_array(passing.float())]
        inputs += [wp.from_torch(own_passing.contiguous(), dtype=wp.vec4), as_array(entries)]
        launch(_direct_entries, self._pixels, inputs, self._bvh.device)
        return entries

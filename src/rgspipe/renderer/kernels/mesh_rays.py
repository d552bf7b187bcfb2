"""Rays and the triangles that they meet first."""

from __future__ import annotations

from dataclasses import dataclass

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, as_vec3, launch, torch_stream
from rgspipe.scene.mesh import TriangleMesh

# Adjoints are written by hand; generating them would double the compile time.
wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True, eq=False)
class MeshHits:
    """Where M rays end.

    Attributes:
        distance: (M,) float32 in lengths of the direction; infinite where nothing is met.
        face: (M,) int64, −1 there.
        weights: (M, 3) float32 barycentric, of the triangle's corners.
    """

    distance: Tensor
    face: Tensor
    weights: Tensor


@wp.kernel
def _first_hits(
    offset: int,
    slab: int,
    mesh: wp.uint64,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    longest: float,
    distance: wp.array(dtype=float),
    face: wp.array(dtype=int),
    weights: wp.array(dtype=wp.vec3),
):
    i = offset + wp.tid()
    found = wp.mesh_query_ray(mesh, origins[i], directions[i], longest)
    if found.result:
        distance[i] = found.t
        face[i] = found.face
        weights[i] = wp.vec3(found.u, found.v, 1.0 - found.u - found.v)


class MeshRays:
    """A mesh ready for ray casts, in float32 from its middle, so that none of its digits are lost far from the origin.

    Args:
        mesh: with at least one triangle.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        vertices = torch.from_numpy(mesh.vertices)
        self.middle = 0.5 * (vertices.amin(dim=0) + vertices.amax(dim=0))
        self._points = as_vec3(vertices - self.middle)
        self._indices = as_array(torch.from_numpy(mesh.faces).int().reshape(-1))
        with torch_stream(torch.device("cpu")):
            self._mesh = wp.Mesh(self._points, self._indices)

    def hits(self, origins: Tensor, directions: Tensor, longest: float = float("inf")) -> MeshHits:
        """What rays from `origins` (M, 3) along `directions` (M, 3) meet first, up to `longest` lengths of these."""
        count = len(directions)
        distance, face = torch.full((count,), torch.inf), torch.full((count,), -1, dtype=torch.int32)
        weights = torch.zeros(count, 3)
        inputs = [self._mesh.id, as_vec3(self._local(origins)), as_vec3(directions), min(longest, 1e30)]
        inputs += [as_array(distance), as_array(face), as_vec3(weights)]
        launch(_first_hits, count, inputs, torch.device("cpu"))
        return MeshHits(distance, face.long(), weights)

    def sees(self, origins: Tensor, ends: Tensor, slack: float) -> Tensor:
        """(M,) bool: whether nothing is between `origins` and `ends` (M, 3), but for `slack` before the ends."""
        between = ends - origins
        lengths = between.norm(dim=1).clamp(min=1e-300)
        hits = self.hits(origins, between / lengths[:, None])
        return hits.distance >= (lengths - slack)

    def _local(self, points: Tensor) -> Tensor:
        return points - self.middle

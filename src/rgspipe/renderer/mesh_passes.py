"""What cameras see of a mesh: depth, normals and colours, as a scan has them."""

from __future__ import annotations

import numpy as np

from rgspipe.renderer.kernels.mesh_rays import MeshRays
from rgspipe.scene import Camera
from rgspipe.scene.mesh import TriangleMesh
from rgspipe.scene.passes import Passes


class MeshPasses:
    """A mesh that cameras look at."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.mesh, self.rays = mesh, MeshRays(mesh)

    def seen_by(self, camera: Camera) -> Passes:
        """What is behind the centres of a camera's pixels."""
        origins, directions, lengths = camera.rays()
        hits = self.rays.hits(origins, directions)
        met = (hits.face >= 0).numpy()
        faces, weights = hits.face.numpy()[met], hits.weights.double().numpy()[met]
        normal, albedo = np.zeros((2, camera.pixel_count, 3), np.float32)
        facing = self.mesh.normals[faces]
        turned = (facing * directions.numpy()[met]).sum(axis=1) > 0.0
        normal[met] = np.where(turned[:, None], -facing, facing)
        albedo[met] = np.nan_to_num(self.mesh.paint.at(faces, weights))
        depth = (hits.distance.double() / lengths).float().numpy()
        shape = (camera.height, camera.width)
        painted = albedo.reshape(*shape, 3) if self.mesh.paint.known else None
        return Passes(depth.reshape(shape), normal.reshape(*shape, 3), painted)

"""Points spread over those sides of a mesh's triangles that air touches.

Which way round triangles are wound says nothing in files from elsewhere, and walls may be single sheets that two rooms
share. What tells is air: cameras are in it, and a side of a surface is in it if a point just before it sees a place
that is. So sides are found from the cameras, from those that cameras see, and so on, as far as air reaches; the inside
of closed bodies, which light never enters, gets no points, and a sheet with air on both sides gets two.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import qmc

from rgspipe.renderer.kernels.mesh_rays import MeshRays
from rgspipe.scene.mesh import Numbers, TriangleMesh
from rgspipe.training.initialise.cloud import Cloud

#: Points for each surfel, on average: thinning wants about sixteen cells a surfel to be filled.
PER_SURFEL = 40

#: How far before a surface its air is, in parts of the mesh's size, and by how much rays may end before they arrive.
BEFORE, SLACK = 1e-4, 1e-5

#: Rounds in which air spreads, and places in it that a side may be seen from in each: first ones anywhere, then
#: neighbours, which is how air gets into nooks. A round that finds less than SETTLED of the air is the last.
ROUNDS, ASKED, SETTLED = 6, 6, 0.002

Flags = NDArray[np.bool_]


def cloud_from_mesh(mesh: TriangleMesh, eyes: Numbers, count: int, seed: int = 0) -> Cloud:
    """Points for `count` surfels, evenly by area, with normals towards the air that the cameras are in.

    Args:
        eyes: (V, 3) places of the cameras.
        seed: the same mesh, cameras, count and seed give the same points.
    """
    rng = np.random.default_rng(seed)
    points, normals = _spread(mesh, PER_SURFEL * count, rng)
    before = np.concatenate([points + BEFORE * mesh.size * side * normals for side in (1.0, -1.0)])
    air = _in_air(mesh, before, eyes, rng)
    both = Cloud(np.concatenate([points, points]), np.concatenate([normals, -normals]))
    return both[air]


def _spread(mesh: TriangleMesh, count: int, rng: np.random.Generator) -> tuple[Numbers, Numbers]:
    """Points (M, 3) of even density on all triangles, by Sobol's sequence, and the triangles' normals (M, 3)."""
    draws = qmc.Sobol(3, rng=rng).random_base2(int(np.ceil(np.log2(max(count, 2)))))
    bounds = np.cumsum(mesh.areas)
    faces = np.minimum(np.searchsorted(bounds, draws[:, 0] * bounds[-1]), len(mesh) - 1)
    root = np.sqrt(draws[:, 1])
    weights = np.stack([1.0 - root, root * (1.0 - draws[:, 2]), root * draws[:, 2]], axis=1)
    return mesh.points(faces, weights), mesh.normals[faces]


def _in_air(mesh: TriangleMesh, places: Numbers, eyes: Numbers, rng: np.random.Generator) -> Flags:
    """(P,) which places (P, 3) are in the air that the `eyes` (V, 3) are in."""
    rays, slack = MeshRays(mesh), SLACK * mesh.size
    tree, air = cKDTree(places), np.zeros(len(places), bool)
    for _ in range(ROUNDS):
        before = int(air.sum())
        for beside in (False, True):
            open_ = (~air).nonzero()[0]
            if beside:
                near = tree.query(places[open_], k=ASKED + 1, workers=1)[1][:, 1:].clip(max=len(places) - 1)
                ends, counts = places[near], air[near]
            else:
                known = places[air] if air.any() else eyes
                ends = known[rng.integers(len(known), size=(len(open_), ASKED))]
                counts = np.ones(ends.shape[:2], bool)
            air[open_] = _any_seen(rays, places[open_], ends, counts, slack)
        if air.sum() - before <= SETTLED * before:
            break
    return air


def _any_seen(rays: MeshRays, places: Numbers, ends: Numbers, counts: Flags, slack: float) -> Flags:
    """(P,) whether places (P, 3) see any of their `ends` (P, K, 3) that count (P, K)."""
    row, column = counts.nonzero()
    seen = rays.sees(torch.from_numpy(places[row]), torch.from_numpy(ends[row, column]), slack).numpy()
    return np.bincount(row[seen], minlength=len(places)) > 0

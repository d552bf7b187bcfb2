"""Rays at triangles, beside Möller and Trumbore's test of every triangle in float64."""

from __future__ import annotations

import numpy as np
import torch

from mesh_files import boxes_mesh, unpainted
from raycast import BLOCK, ROOM, cast, view_of
from rgspipe.renderer.kernels.mesh_rays import MeshRays
from rgspipe.renderer.mesh_passes import MeshPasses


def first_hits(vertices: np.ndarray, faces: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> tuple:
    """Distance and face of the nearest triangle, tried one by one."""
    best, which = np.full(len(origins), np.inf), np.full(len(origins), -1)
    for number, (a, b, c) in enumerate(vertices[faces]):
        across = np.cross(directions, c - a)
        determinant = across @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((origins - a) * across).sum(axis=1) / determinant
            turned = np.cross(origins - a, b - a)
            v = (directions * turned).sum(axis=1) / determinant
            t = (turned @ (c - a)) / determinant
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < best)
        best, which = np.where(hit, t, best), np.where(hit, number, which)
    return best, which


def test_the_first_triangle_is_met_as_in_float64() -> None:
    rng = np.random.default_rng(0)
    # Far from the origin, where float32 alone would leave three digits.
    vertices, faces = rng.normal(size=(300, 3)) + 1e4, rng.integers(0, 300, (150, 3))
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 0] != faces[:, 2])]
    origins, directions = 3.0 * rng.normal(size=(4000, 3)) + 1e4, rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = MeshRays(unpainted(vertices, faces)).hits(torch.from_numpy(origins), torch.from_numpy(directions))
    distance, face = first_hits(vertices, faces, origins, directions)
    same = hits.face.numpy() == face
    # Rays through edges may go either way; measured: all the same, of which 12 % meet a triangle.
    assert same.mean() > 0.998 and (face >= 0).mean() > 0.1
    met = same & (face >= 0)
    assert np.abs(hits.distance.numpy()[met] / distance[met] - 1.0).max() < 2e-4  # measured
    # From the middle, as float32 weights add up to 1 but for 1e-7, of 1e4.
    points = np.einsum("mk,mkd->md", hits.weights.double().numpy()[met], vertices[faces[face[met]]] - 1e4) + 1e4
    assert np.abs(points - (origins + distance[:, None] * directions)[met]).max() < 1e-5  # measured 1.2e-6
    assert np.isinf(hits.distance.numpy()[same & (face < 0)]).all()


def test_what_is_seen_is_what_nothing_stands_before() -> None:
    rays = MeshRays(boxes_mesh(ROOM, BLOCK))
    rng = np.random.default_rng(1)
    a, b = (torch.from_numpy(rng.uniform(-0.49, 0.49, (2000, 3))) for _ in range(2))
    between = (b - a).numpy()
    lengths = np.linalg.norm(between, axis=1)
    free = np.array([cast([BLOCK], x.numpy(), d[None] / n)[0][0] for x, d, n in zip(a, between, lengths, strict=True)])
    outside = (np.abs(BLOCK.local(a.numpy())) > 0.5 * np.array(BLOCK.size)).any(axis=1)
    seen = rays.sees(a, b, 1e-5).numpy()
    assert (seen == (free > lengths))[outside].mean() > 0.999


def test_passes_are_those_of_the_boxes() -> None:
    view = view_of([ROOM, BLOCK], (0.3, -0.4, 0.3), (-0.1, 0.1, -0.2), 48, normals=True)
    found = MeshPasses(boxes_mesh(ROOM, BLOCK)).seen_by(view.camera)
    off = np.abs(found.depth / view.depth.numpy() - 1.0)
    assert np.quantile(off, 0.999) < 1e-6
    assert (np.abs(found.normal - view.normal.numpy()).max(axis=2) < 1e-6).mean() > 0.999
    assert found.albedo is None

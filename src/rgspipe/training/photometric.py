"""Normals from shading and heights from normals, by linear least squares over all views at once.

Every training view has a light of its own, so a surfel is seen under many: photometric stereo (Woodham 1980) with
near lights, shadows and interreflection. With shadows T and indirect light G held, a pixel's radiance

    L_p = Σ_j w_pj ρ_j (I/π T_j n_j·d_pj / (|d_pj|⁴ + ε_j⁴)^{3/4} + G_j),    d_pj = light − point of surfel j at pixel p

is linear in small turns of the normals. Single surfels blend in pixels, so turns are tied to those of neighbours on
the same surface. Images say little of a surface's height; it follows the normals, as in Woodham's integration.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
import torch
from torch import Tensor

from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.surfels import Surfels
from rgspipe.training.levels import level
from rgspipe.training.parameters import tilted
from rgspipe.training.regularise import Neighbours
from rgspipe.training.shading import SurfelLight, geometry_factor, softening_lengths

#: Cosine below which a ray is too steep to say where on a surfel's plane it looks.
GRAZING = 0.05

#: Share of direct light in pixels whose normals can be told: others are in shadow or on its edge.
LIT = 0.98

#: Largest turn of a normal in one solve [rad]: beyond, the light's cosine is no longer linear.
LARGEST_TURN = 0.1

#: Conjugate-gradient steps at most, and the relative residual at which they end.
CG_STEPS, CG_TOLERANCE = 200, 1e-4


#: Angle [rad] below which surfels are smoother than shading could make them: on a clean Cornell box, whose normals are
#: right, the solve turns them by 0.3° (10k surfels, 100 views of 128²) to 1.5° (3k surfels, 30 views of 64²).
LEAST_ROUGHNESS = 0.01

#: Weights of neighbours' likeness and of normals as they are, relative to what images say of a typical surfel.
SMOOTHNESS, PULL = 1000.0, 0.02

#: Weight of heights as they are, relative to one neighbour's continuity.
HEIGHT_PULL = 1.0


def roughness(surfels: Surfels, pairs: Neighbours) -> float:
    """Median angle [rad] between chords of neighbours and their mean tangent plane: zero on planes and spheres."""
    first, second = pairs.first, pairs.second
    chord = surfels.centers[second] - surfels.centers[first]
    mean = 0.5 * (surfels.normals[first] + surfels.normals[second])
    angle = (mean * chord).sum(dim=1).abs() / chord.norm(dim=1).clamp(min=1e-12)
    used = pairs.weight > 0.25
    return float(angle[used].median()) if bool(used.any()) else 0.0


def fit_normals(
    surfels: Surfels,
    weights: Iterable[ViewWeights],
    images: Sequence[Tensor],
    lights: Sequence[SurfelLight],
    pairs: Neighbours,
) -> Surfels:
    """`surfels` (N) with normals that explain the shading of V views best: one Gauss-Newton step.

    A surfel's relative albedo is solved for with its two turns and then let go, so that an albedo that was fitted
    with the old normals does not hold them back. Pixels on edges and in or beside shadows are left out; those that
    fit badly weigh less.

    Args:
        weights, images, lights: of the views; images (pixels, 3).
        pairs: which surfels are on one surface.
    """
    count = len(surfels)
    matrix, right = scipy.sparse.csr_matrix((3 * count, 3 * count)), np.zeros(3 * count)
    for view, image, light in zip(weights, images, lights, strict=True):
        jacobian, residual, trust = shading_of_view(surfels, view, image, light)
        weighted = jacobian.multiply(trust[:, None]).tocsr()
        matrix = matrix + weighted.T @ jacobian
        right += weighted.T @ residual
    typical = _typical(matrix.diagonal()[: 2 * count])
    smooth, smooth_right = _smoothness(surfels, pairs)
    blank = scipy.sparse.csr_matrix((count, count))
    matrix = matrix + SMOOTHNESS * typical * scipy.sparse.block_diag([smooth, blank])
    matrix = matrix + PULL * typical * scipy.sparse.identity(3 * count)
    right[: 2 * count] += SMOOTHNESS * typical * smooth_right
    turns = torch.from_numpy(_solve(matrix, right)[: 2 * count].reshape(2, count).T).to(surfels.rotations)
    size = turns.norm(dim=1, keepdim=True).clamp(min=1e-12)
    return replace(surfels, rotations=tilted(surfels.rotations, turns * (LARGEST_TURN / size).clamp(max=1.0)))


def fit_heights(surfels: Surfels, measured: Tensor, pairs: Neighbours) -> Surfels:
    """`surfels` moved along their normals until neighbours lie in each other's planes: `regularise.continuity` at its
    least, with a pull to where they were measured.

    Args:
        measured: (N, 3) centres as depth has them; only their heights over the surfels' planes matter.
    """
    count = len(surfels)
    normals, centers = surfels.normals.double(), surfels.centers.double()
    first, second = pairs.first, pairs.second
    mean = 0.5 * (normals[first] + normals[second])
    gap = (mean * (centers[second] - centers[first])).sum(dim=1).numpy()
    to_second, to_first = (mean * normals[second]).sum(dim=1).numpy(), (mean * normals[first]).sum(dim=1).numpy()
    rows = np.arange(len(first))
    values, columns = np.concatenate([to_second, -to_first]), np.concatenate([second.numpy(), first.numpy()])
    difference = scipy.sparse.csr_matrix((values, (np.tile(rows, 2), columns)), shape=(len(rows), count))
    weight = pairs.weight.double().numpy()
    weighted = difference.multiply(weight[:, None]).tocsr()
    matrix = weighted.T @ difference + HEIGHT_PULL * scipy.sparse.identity(count)
    above = ((measured.double() - centers) * normals).sum(dim=1).numpy()
    right = HEIGHT_PULL * above - weighted.T @ gap
    heights = torch.from_numpy(_solve(matrix, right)).clamp(-pairs.spacing, pairs.spacing)
    return replace(surfels, centers=surfels.centers + (heights[:, None] * normals).to(surfels.centers))


def shading_of_view(
    surfels: Surfels, view: ViewWeights, image: Tensor, light: SurfelLight
) -> tuple[scipy.sparse.csr_matrix, np.ndarray, np.ndarray]:
    """Derivative (Q, 3N) of the Q pixels that tell normals towards turns about u, about v and log-albedo; their
    residuals (Q,) and weights (Q,). Radiance is the mean of the channels in units of the view's level."""
    operator = view.operator.to_scipy()
    coverage = view.coverage.double().cpu().numpy()
    lit = (operator @ light.transmittance.double().numpy()) / np.maximum(coverage, 1e-6)
    pixels = np.flatnonzero(~view.edges.cpu().numpy() & (coverage > 0.5) & (lit > LIT))
    rows = operator[pixels].tocoo()
    p, j = torch.from_numpy(rows.row).long(), torch.from_numpy(rows.col).long()
    origin, rays, _ = view.camera.rays(torch.from_numpy(pixels))
    normals, centers = surfels.normals[j], surfels.centers[j]
    o, d = origin.to(centers)[p], rays.to(centers)[p]
    across = (d * normals).sum(dim=1)
    safe = torch.where(across.abs() > GRAZING, across, torch.ones_like(across))
    seen_at = o + (((centers - o) * normals).sum(dim=1) / safe)[:, None] * d
    path = light.position - seen_at
    softening = softening_lengths(surfels)[j]
    weight = torch.from_numpy(rows.data).to(centers)
    # Mean over the channels of ρ I/π and of ρ G.
    strength = (surfels.albedo @ light.intensity)[j] / (3.0 * math.pi) * light.transmittance[j] * weight
    ambient = (surfels.albedo * light.indirect).mean(dim=1)[j] * weight
    predicted = strength * geometry_factor(path, normals, softening) + ambient
    shown = np.bincount(rows.row, predicted.double().numpy(), len(pixels))
    against = float(level(image, torch.from_numpy(shown) if len(pixels) else torch.zeros(1)))
    strength, predicted, shown = strength / against, predicted / against, shown / against
    facing = ((path * normals).sum(dim=1) > 0.0) & (across.abs() > GRAZING)
    slope = _slope(path, normals, softening, d / safe[:, None], centers - seen_at)
    slope = torch.where(facing, strength, torch.zeros_like(strength))[:, None] * slope
    frames = surfels.frames[j]
    # A turn about u leans the normal towards −v, one about v towards u.
    values = torch.cat([-(slope * frames[:, 1]).sum(dim=1), (slope * frames[:, 0]).sum(dim=1), predicted])
    columns = np.concatenate([rows.col, rows.col + len(surfels), rows.col + 2 * len(surfels)])
    shape = (len(pixels), 3 * len(surfels))
    jacobian = scipy.sparse.csr_matrix((values.double().numpy(), (np.tile(rows.row, 3), columns)), shape=shape)
    seen = image[torch.from_numpy(pixels)].double().mean(dim=1).numpy() / against
    residual = seen - shown
    return jacobian, residual, _trust(residual, seen)


def _slope(path: Tensor, normals: Tensor, softening: Tensor, ray: Tensor, beside: Tensor) -> Tensor:
    """(K, 3) derivative of the geometry factor towards normals at points that pixels see.

    Args:
        path: (K, 3) from the point to the light.
        ray: (K, 3) the pixel's direction over its cosine to the normal: a turn moves the point along it.
        beside: (K, 3) from the point to the surfel's centre, about which it turns.
    """
    square, projected = path.square().sum(dim=1), (path * normals).sum(dim=1)
    inverse = (square.square() + softening.pow(4)).rsqrt()
    cube = inverse * inverse.sqrt()
    towards_light = cube[:, None] * normals - (3.0 * projected * square * cube * inverse.square())[:, None] * path
    return cube[:, None] * path - (towards_light * ray).sum(dim=1, keepdim=True) * beside


def _trust(residual: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Weights of squared errors: relative in bright pixels, absolute in dark; less for those that fit badly."""
    relative = np.abs(residual) / (seen + 0.1)
    typical = 2.0 * np.median(relative) + 1e-4 if len(relative) else 1.0
    return 1.0 / (seen + 0.1) ** 2 / (1.0 + (relative / typical) ** 2)


def _smoothness(surfels: Surfels, pairs: Neighbours) -> tuple[scipy.sparse.csr_matrix, np.ndarray]:
    """Matrix (2N, 2N) and right side of Σ w |n_i + δn_i − n_j − δn_j|² over the turns, per neighbour."""
    count, edges = len(surfels), len(pairs.first)
    frames = surfels.frames.double()
    first, second = pairs.first, pairs.second
    rows = np.arange(3 * edges)
    parts = []
    for index, sign in ((first, 1.0), (second, -1.0)):
        for axis, offset, turn in ((1, 0, -1.0), (0, count, 1.0)):
            values = (sign * turn * frames[index, axis]).T.reshape(-1).numpy()
            parts.append((values, np.tile(index.numpy() + offset, 3)))
    values, columns = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    difference = scipy.sparse.csr_matrix((values, (np.tile(rows, 4), columns)), shape=(3 * edges, 2 * count))
    apart = (frames[first, 2] - frames[second, 2]).T.reshape(-1).numpy()
    degree = max(edges / max(count, 1), 1.0)
    weighted = difference.multiply(np.tile(pairs.weight.double().numpy() / degree, 3)[:, None]).tocsr()
    return (weighted.T @ difference).tocsr(), -(weighted.T @ apart)


def _typical(diagonal: np.ndarray) -> float:
    used = diagonal[diagonal > 0.0]
    return float(np.median(used)) if len(used) else 1.0


def _solve(matrix: scipy.sparse.spmatrix, right: np.ndarray) -> np.ndarray:
    """Conjugate gradients with the diagonal as preconditioner."""
    matrix = matrix.tocsr()
    precondition = scipy.sparse.diags(1.0 / np.maximum(matrix.diagonal(), 1e-30))
    return scipy.sparse.linalg.cg(matrix, right, rtol=CG_TOLERANCE, maxiter=CG_STEPS, M=precondition)[0]

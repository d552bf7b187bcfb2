"""Surfels on the surfaces that no camera saw.

Between the space that cameras look through and the rest lies a boundary. Most of it is surface, and has surfels. Where
it has none no camera saw what is there: the back of a box, the floor behind it. Left open, such places swallow light;
a closed room has none that does. So they get surfels whose albedo is that of their neighbours. Where a shadow of sight
hides more than a thin layer the boundary is not where the surface is, but still a place that light does not pass. A
pillar, though, hides room, where a light may stand: from its boundary one looks through what is hidden at the fronts of
surfaces that were seen. Such places are left open; from the boundary of a thing one looks at the backs of its own.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

from rgspipe.completion.free_space import Grid, seen_through
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.openness import openness
from rgspipe.renderer.point_sets import cosine_directions
from rgspipe.scene import Camera
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.surfels import NO_CLIP, Surfels, quaternion_from_normal, quaternion_to_axes

log = logging.getLogger(__name__)

#: Scenes that see more than this of their surroundings are objects in empty space: the dark side of what is not seen
#: there is no wall of a room, and may be anywhere.
MOST_OPEN = 0.5

#: Cells of the grid along the distance of two surfels, and how far rays must reach past a cell's middle, in cells.
CELLS_PER_SPACING, MARGIN = 2.0, 0.5

#: Blur of the boundary, in cells: it takes the steps of the cells away.
BLUR = 1.0

#: A place of the boundary is without surfels if none is within so many distances of neighbours.
BARE = 1.1

#: More unseen surfels than this part of the seen ones are not added: so few cameras do not tell surfaces from space
#: that nobody looked into, and walls across it would hide what is there.
MOST_UNSEEN = 0.1

#: Nothing is added where more than this part of what would be hidden is the front of seen surfaces: there is a way
#: through. Of 66 places in the Cornell box the part is 0.01 (median; 0.07 at the ninth decile), of 284 behind the
#: pillar of the corridor 0.60.
MOST_THROUGH = 0.25

#: Rays of each place into what would be hidden, and how many distances away neighbours count as much: the boundary is
#: round at edges, where single places look past the thing that they close.
LOOKS, AROUND = 64, 3.0

#: Neighbours whose albedo an unseen surfel gets, and how much of a distance a full turn of the normal counts for.
NEIGHBOURS, TURN = 8, 2.5

#: Standard deviation of unseen surfels over their distance: a little wider than those that were fitted to edges.
SCALE = 0.87


def with_unseen_surfaces(surfels: Surfels, cameras: Sequence[Camera]) -> Surfels:
    """The surfels and, after them, those of surfaces that no camera saw.

    Nothing is added to an object in empty space, nor to a scene of which the cameras saw too little.

    Args:
        surfels: N ≥ 2 of a scene that `cameras` saw.
        cameras: those that it was made from.
    """
    bvh = SurfelBvh(replace(surfels, centers=surfels.centers.double()))
    if not cameras or len(surfels) <= NEIGHBOURS or openness(bvh, surfels) > MOST_OPEN:
        return surfels
    centers = surfels.centers.double().cpu()
    spacing = float(np.median(cKDTree(centers.numpy()).query(centers.numpy(), k=2)[0][:, 1]))
    grid = Grid.over(centers.amin(dim=0), centers.amax(dim=0), spacing / CELLS_PER_SPACING)
    cell = float(grid.cell.mean())
    places, normals = _boundary(grid, seen_through(grid, bvh, cameras, MARGIN * cell).numpy())
    distance, _ = cKDTree(centers.numpy()).query(places)
    bare = distance > BARE * max(spacing, CELLS_PER_SPACING * cell)
    places, normals = places[bare], normals[bare]
    chosen = _apart(places, spacing)
    if len(chosen) > MOST_UNSEEN * len(surfels):
        log.info("The cameras saw too little of the scene to close it where they saw nothing.")
        return surfels
    if not chosen:
        return surfels
    places, normals = places[chosen], normals[chosen]
    closing = _around(places, _through(bvh, surfels, places, normals), AROUND * spacing) < MOST_THROUGH
    if not closing.any():
        return surfels
    places, normals = places[closing], normals[closing]
    log.info("%d surfels close the scene where no camera saw what is there.", len(places))
    return _joined(surfels, places, normals, spacing)


def _boundary(grid: Grid, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(F, 3) places on the boundary of the free cells, and (F, 3) unit normals towards these."""
    field = gaussian_filter(free.astype(np.float32), BLUR, mode="nearest")
    if field.min() >= 0.5 or field.max() <= 0.5:
        return np.empty((0, 3)), np.empty((0, 3))
    corners, triangles, _, _ = marching_cubes(field, 0.5)
    lower, cell = grid.lower.numpy(), grid.cell.numpy()
    a, b, c = (lower + (corners[triangles[:, index]] + 0.5) * cell for index in range(3))
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1)
    real = length > 1e-6 * float(cell.mean()) ** 2
    places, normals = ((a + b + c) / 3.0)[real], across[real] / length[real, None]

    def freedom(points: np.ndarray) -> np.ndarray:
        return map_coordinates(field, ((points - lower) / cell - 0.5).T, order=1, mode="nearest")

    step = float(cell.mean()) * normals
    return places, np.where((freedom(places + step) < freedom(places - step))[:, None], -normals, normals)


def _apart(places: np.ndarray, spacing: float) -> list[int]:
    """Indices of places that are `spacing` or more from each other, and to none of which another could be added."""
    if not len(places):
        return []
    tree, taken, chosen = cKDTree(places), np.zeros(len(places), dtype=bool), []
    for index in np.random.default_rng(0).permutation(len(places)):
        if not taken[index]:
            chosen.append(int(index))
            taken[tree.query_ball_point(places[index], spacing)] = True
    return chosen


def _through(bvh: SurfelBvh, surfels: Surfels, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(U,) part of what lies behind each place, cosine-weighted, that is the front of a seen surface."""
    frames = quaternion_to_axes(quaternion_from_normal(torch.from_numpy(-normals)))
    directions = cosine_directions(frames, LOOKS, torch.Generator().manual_seed(0)).reshape(-1, 3)
    hits = composite(bvh, torch.from_numpy(places).repeat_interleave(LOOKS, dim=0), directions, two_sided=True)
    facing = surfels.normals.to(hits.weights)[hits.indices.long().clamp(min=0)]
    facing = (facing * directions.to(hits.weights)[:, None]).sum(dim=2)
    fronts = (hits.weights * (facing < 0.0)).sum(dim=1)
    return fronts.reshape(len(places), LOOKS).mean(dim=1).cpu().numpy()


def _around(places: np.ndarray, values: np.ndarray, reach: float) -> np.ndarray:
    """(U,) median of the values of all places within `reach` of each, itself among them."""
    near = cKDTree(places).query_ball_point(places, reach)
    return np.array([np.median(values[index]) for index in near])


def _joined(surfels: Surfels, places: np.ndarray, normals: np.ndarray, spacing: float) -> Surfels:
    """`surfels` and one at each of `places` (U, 3), as reflecting as its neighbours and diffuse."""
    turn = TURN * spacing
    features = np.hstack([surfels.centers.double().cpu().numpy(), turn * surfels.normals.double().cpu().numpy()])
    _, nearest = cKDTree(features).query(np.hstack([places, turn * normals]), k=NEIGHBOURS)
    count = len(places)
    own = {
        "centers": torch.from_numpy(places),
        "rotations": quaternion_from_normal(torch.from_numpy(normals)),
        "scales": torch.full((count, 2), SCALE * spacing),
        "opacities": surfels.opacities.median().expand(count),
        "albedo": surfels.albedo[torch.from_numpy(nearest).to(surfels.albedo.device)].mean(dim=1),
        "clip_offsets": torch.full((count, 2), NO_CLIP),
        "clip_angles": torch.zeros(count, 2),
    }
    joined = {name: torch.cat([tensor, own[name].to(tensor)]) for name, tensor in surfels.tensors().items()}
    gloss = surfels.gloss
    if gloss is not None:
        dull, exponents = gloss.reflectance.new_zeros(count, 3), gloss.exponents.median().expand(count)
        gloss = Gloss(torch.cat([gloss.reflectance, dull]), torch.cat([gloss.exponents, exponents]))
    return replace(surfels, **joined, gloss=gloss)

"""Surfels on the surfaces that no camera saw.

Between room and what is no room lies a boundary. Most of it has surfels. Where it has none no camera saw what is there:
the back of a box, the floor behind it. Left open, such places swallow light; a closed room has none that does. So they
get surfels whose albedo is that of their neighbours.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes
from torch import Tensor

from rgspipe.completion.ends import ends
from rgspipe.completion.free_space import Grid, SeenSpace
from rgspipe.completion.hidden_room import parts_in_sight, with_hidden_room
from rgspipe.completion.planes import Plane, frame_of, planes_of
from rgspipe.completion.rasters import BARE, Continued
from rgspipe.completion.round_things import round_things
from rgspipe.completion.structure import continued
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.openness import openness
from rgspipe.scene import Camera
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.guesses import doubts_of_guesses, spread_of_albedo
from rgspipe.scene.surfels import NO_CLIP, Surfels, quaternion_from_normal, quaternion_to_axes

log = logging.getLogger(__name__)

#: Scenes that see more than this of their surroundings are objects in empty space: the dark side of what is not seen
#: there is no wall of a room, and may be anywhere.
MOST_OPEN = 0.5

#: Cells of the grid along the distance of two surfels, and how far rays must reach past a cell's middle, in cells.
CELLS_PER_SPACING, MARGIN = 2.0, 0.5

#: Cells between a camera or lamp and the side of the box: they stand in the room, not in its wall.
BEHIND = 2.0

#: Blur of the boundary, in cells: it takes the steps of the cells away.
BLUR = 1.0

#: Cells within so many distances of a surfel are taken for no room: rays of theirs pass between surfels.
NEAR = 0.6

#: Cells around the grid in which hidden room ends.
RIM = 3

#: Neighbours whose albedo an unseen surfel gets, and how much of a distance a full turn of the normal counts for.
NEIGHBOURS, TURN = 8, 2.5

#: Standard deviation of unseen surfels over their distance: a little wider than those that were fitted to edges.
SCALE = 0.87


def with_unseen_surfaces(
    surfels: Surfels,
    cameras: Sequence[Camera],
    lamps: Sequence[Tensor] = (),
    depths: Sequence[Tensor | None] = (),
    *,
    hidden: bool = True,
) -> Surfels:
    """The surfels and, after them, those of surfaces that no camera saw.

    Objects in empty space get the sides that things must have, and no walls. All end where their faces meet.

    Args:
        surfels: N ≥ 2 of a scene that `cameras` saw.
        cameras: those that it was made from.
        lamps: (3,) places of lamps that lit it; like cameras they stand in the room, not behind its walls.
        depths: what is known of the depth (H, W) of the cameras' photographs, for each of them.
        hidden: whether surfaces of room that things hide are added where no plane goes on. Without, planes go on
            alone, which takes little of the time.
    """
    if not cameras or len(surfels) <= NEIGHBOURS:
        return surfels
    is_room = openness(_tree(surfels), surfels) <= MOST_OPEN
    centers = surfels.centers.double().cpu().numpy()
    spacing = float(np.median(cKDTree(centers).query(centers, k=2)[0][:, 1]))
    planes = planes_of(surfels, spacing)
    frame = frame_of(planes)
    planes = [plane.turned(frame) for plane in planes]
    turned = [_camera_turned(camera, frame) for camera in cameras]
    along = _turned(surfels, frame)
    space = SeenSpace.of(_tree(along), turned, depths)
    if is_room:
        inside = torch.stack([*(camera.origin for camera in cameras), *lamps]).double().cpu() @ frame.T
        found = _unseen_of_room(along, planes, space, inside, spacing, hidden)
    else:
        found = _unseen_of_object(along, planes, space, spacing)
    if hidden and len(found):
        log.info("%d surfels close the scene where no camera saw what is there.", len(found))
    axes = frame.numpy()
    closed = _ended(_joined(surfels, found.places @ axes, found.normals @ axes, spacing), len(surfels), spacing)
    return replace(closed, guessed=doubts_of_guesses(closed))


def _unseen_of_object(surfels: Surfels, planes: Sequence[Plane], space: SeenSpace, spacing: float) -> Continued:
    """Where surfels of things in the open are missing, as far as their shape tells it."""
    centers = surfels.centers.double().cpu()
    grid = Grid.over(centers.amin(dim=0), centers.amax(dim=0), spacing)
    guessed = _shapes(surfels, planes, space, grid, spacing, is_room=False)
    # Behind things one sees their backs as long as these are open.
    whole = _tree(_joined(surfels, guessed.places, guessed.normals, spacing))
    return guessed.chosen(_is_within(whole, guessed, spacing))


def _unseen_of_room(
    surfels: Surfels, planes: Sequence[Plane], space: SeenSpace, inside: Tensor, spacing: float, hidden: bool
) -> Continued:
    """Where surfels are missing, in a room whose axes are x, y and z; `inside` (I, 3) are places in it."""
    centers = surfels.centers.double().cpu()
    edge = spacing / CELLS_PER_SPACING
    lower = torch.minimum(centers.amin(dim=0), inside.amin(dim=0) - BEHIND * edge)
    upper = torch.maximum(centers.amax(dim=0), inside.amax(dim=0) + BEHIND * edge)
    # Edges are looked for at the distance of surfels: finer cells would take eight times as long.
    guessed = _shapes(surfels, planes, space, Grid.over(lower, upper, spacing), spacing, is_room=True)
    guessed = guessed.chosen(_is_within(_tree(surfels), guessed, spacing))
    # What lies before an open front is no part of the room, and needs no cells.
    known = torch.cat([centers, torch.from_numpy(guessed.places)])
    grid = Grid.over(known.amin(dim=0), known.amax(dim=0), edge if hidden else spacing)
    cell = float(grid.cell.mean())
    seen = space.cells(grid, MARGIN * cell)
    free = seen
    while True:
        bvh = _tree(_joined(surfels, guessed.places, guessed.normals, spacing))
        tree = cKDTree(np.concatenate([centers.numpy(), guessed.places]))
        free = with_hidden_room(grid, bvh, free, _near(tree, grid, NEAR * spacing))
        bounds = _bounds_room(guessed, grid, free.numpy(), spacing)
        if bounds.all():
            break
        guessed = guessed.chosen(bounds)
    if not hidden:
        return guessed
    places, normals = _boundary(grid, free.numpy(), seen.numpy())
    bare = tree.query(places)[0] > BARE * max(spacing, CELLS_PER_SPACING * cell)
    rest = Continued(places[bare], normals[bare])
    rest = rest.chosen(_is_solid(bvh, rest.places - CELLS_PER_SPACING * cell * rest.normals))
    return Continued.joined([guessed, rest.chosen(_apart(rest.places, spacing))])


def _shapes(
    surfels: Surfels, planes: Sequence[Plane], space: SeenSpace, grid: Grid, spacing: float, *, is_room: bool
) -> Continued:
    """What flat surfaces and round things become where nothing was seen."""
    centers, normals = (part.double().cpu().numpy() for part in (surfels.centers, surfels.normals))
    bent = round_things(centers, normals, space, spacing)
    flat = [plane for plane in planes if np.isin(plane.members.numpy(), bent.members).mean() < 0.5]
    planes_on = continued(flat, centers, grid, space, spacing, is_room=is_room, things=bent.whole)
    return Continued.joined([planes_on, bent.added])


def _ended(surfels: Surfels, seen: int, spacing: float) -> Surfels:
    """The surfels, of which cameras saw the first `seen`, ending where their faces meet others."""
    centers, normals = (part.double().cpu().numpy() for part in (surfels.centers, surfels.normals))
    axes = quaternion_to_axes(surfels.rotations.double()).cpu().numpy()[:, :2]
    known = (part.double().cpu().numpy() for part in (surfels.clip_offsets, surfels.clip_angles))
    found = ends(centers, normals, axes, *known, seen, spacing)
    offsets, angles = torch.from_numpy(found.offsets), torch.from_numpy(found.angles)
    cut = replace(surfels, clip_offsets=offsets.to(surfels.clip_offsets), clip_angles=angles.to(surfels.clip_angles))
    return cut.selected(torch.from_numpy(np.flatnonzero(found.kept)))


def _turned(surfels: Surfels, frame: Tensor) -> Surfels:
    """The surfels in coordinates along the rows of `frame` (3, 3)."""
    centers = surfels.centers.double().cpu() @ frame.T
    turn = Rotation.from_matrix(frame.numpy())
    own = Rotation.from_quat(surfels.rotations.double().cpu().numpy(), scalar_first=True)
    rotations = torch.from_numpy((turn * own).as_quat(scalar_first=True))
    return replace(surfels, centers=centers.to(surfels.centers), rotations=rotations.to(surfels.rotations))


def _camera_turned(camera: Camera, frame: Tensor) -> Camera:
    turn = torch.eye(4, dtype=torch.float64)
    turn[:3, :3] = frame
    pose = turn @ camera.camera_to_world.double().cpu()
    return replace(camera, camera_to_world=pose.to(camera.camera_to_world))


def _tree(surfels: Surfels) -> SurfelBvh:
    return SurfelBvh(replace(surfels, centers=surfels.centers.double()))


def _is_within(bvh: SurfelBvh, guessed: Continued, spacing: float) -> np.ndarray:
    """(G,) bool: the guessed places that face no backs of surfaces, as what lies behind the walls of a room does."""
    if not len(guessed):
        return np.zeros(0, dtype=bool)
    fronts, backs = parts_in_sight(bvh, torch.from_numpy(guessed.places + spacing * guessed.normals))
    return (fronts >= backs).numpy()


def _bounds_room(guessed: Continued, grid: Grid, free: np.ndarray, spacing: float) -> np.ndarray:
    """(G,) bool: the guessed places with room before them and none behind."""
    # As far as it takes for the cell's middle to be no longer NEAR.
    step = NEAR * spacing + float(grid.cell.mean())
    before, behind = (guessed.places + side * step * guessed.normals for side in (1.0, -1.0))
    return grid.at(free, before) & ~(grid.at(free, behind) & grid.contains(behind))


def _is_solid(bvh: SurfelBvh, points: np.ndarray) -> np.ndarray:
    """(P,) bool: the points (P, 3) from which one sees more of the backs of surfaces than of what is outside."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    fronts, backs = parts_in_sight(bvh, torch.from_numpy(points))
    return (backs > 1.0 - fronts - backs).numpy()


def _near(tree: cKDTree, grid: Grid, reach: float) -> Tensor:
    """(X, Y, Z) bool: cells whose middles are within `reach` of a point of the tree."""
    distance, _ = tree.query(grid.centers.numpy(), distance_upper_bound=reach)
    return torch.from_numpy(np.isfinite(distance)).reshape(grid.shape)


def _boundary(grid: Grid, free: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(F, 3) places on the boundary of `free` cells (X, Y, Z), and (F, 3) unit normals towards these.

    At the grid's sides cells that cameras have `seen` have no boundary, as rooms may be open; hidden room has.
    """
    field = np.pad(seen, RIM, mode="edge")
    field[RIM:-RIM, RIM:-RIM, RIM:-RIM] = free
    field = gaussian_filter(field.astype(np.float32), BLUR, mode="nearest")
    if field.min() >= 0.5 or field.max() <= 0.5:
        return np.empty((0, 3)), np.empty((0, 3))
    corners, triangles, _, _ = marching_cubes(field, 0.5)
    cell = grid.cell.numpy()
    lower = grid.lower.numpy() - RIM * cell
    a, b, c = (lower + (corners[triangles[:, index]] + 0.5) * cell for index in range(3))
    places, across = (a + b + c) / 3.0, np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1)
    upper = grid.lower.numpy() + cell * grid.shape
    inside = ((places > grid.lower.numpy() - 0.5 * cell) & (places < upper + 0.5 * cell)).all(axis=1)
    real = inside & (length > 1e-6 * float(cell.mean()) ** 2)
    places, normals = places[real], across[real] / length[real, None]

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
        "guessed": spread_of_albedo(surfels).expand(count),
    }
    joined = {name: torch.cat([tensor, own[name].to(tensor)]) for name, tensor in surfels.tensors().items()}
    gloss = surfels.gloss
    if gloss is not None:
        dull, exponents = gloss.reflectance.new_zeros(count, 3), gloss.exponents.median().expand(count)
        gloss = Gloss(torch.cat([gloss.reflectance, dull]), torch.cat([gloss.exponents, exponents]))
    return replace(surfels, **joined, gloss=gloss)

"""A closed room with a box on its floor whose back no camera saw, so that it has no surfels."""

from __future__ import annotations

from dataclasses import fields, replace

import torch

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Camera, Surfels, look_at
from rgspipe.scene.rectangles import Rectangles, inside_of_box, solid_box, surfels_on

#: Albedo of the walls and of the box.
WALLS, BOX = [0.7, 0.6, 0.5], [0.3, 0.5, 0.8]

#: The box stands from x = 0.3 to BACK, from y = 0.3 to 0.7 and from the floor to TOP. Its missing face is at BACK.
BACK, SIDES, TOP = 0.7, (0.3, 0.7), 0.4

#: Surfels of the room as it is, about.
COUNT = 1500


def rows(rectangles: Rectangles, chosen: list[int]) -> Rectangles:
    return Rectangles(**{f.name: getattr(rectangles, f.name)[chosen] for f in fields(rectangles)})


def box() -> Rectangles:
    """Its four sides and top; the back is the last."""
    return rows(solid_box([0.5, 0.5, 0.5 * TOP], [0.4, 0.4, TOP], BOX), [1, 2, 3, 4, 5])


def true_room(count: int = COUNT) -> Surfels:
    """Walls, all of the box and the floor around it; the surfels of the box's back are the last."""
    surfels = surfels_on(inside_of_box([0.5, 0.5, 0.5], [1.0, 1.0, 1.0], WALLS) + box(), count)
    x, y, z = surfels.centers.unbind(1)
    return only(surfels, ~((z.abs() < 1e-6) & (x > 0.3) & (x < BACK) & (y > SIDES[0]) & (y < SIDES[1])))


def at_back(surfels: Surfels) -> torch.Tensor:
    """(N,) bool: surfels on the face that no camera saw."""
    return ((surfels.centers[:, 0] - BACK).abs() < 1e-6) & (surfels.normals[:, 0] > 0.9)


def without_back(surfels: Surfels) -> Surfels:
    """The surfels that cameras saw."""
    return only(surfels, ~at_back(surfels))


def only(surfels: Surfels, kept: torch.Tensor | slice) -> Surfels:
    return replace(surfels, **{name: tensor[kept] for name, tensor in surfels.tensors().items()})


def seen_by(cameras: list[Camera], surfels: Surfels) -> Surfels:
    """Those of the surfels that the cameras see."""
    shown, tree = torch.zeros(len(surfels)), SurfelBvh(surfels)
    for camera in cameras:
        origins, directions, _ = camera.rays()
        hits = composite(tree, origins, directions, two_sided=True)
        shown.index_add_(0, hits.indices.long().clamp(min=0).reshape(-1), hits.weights.reshape(-1))
    return only(surfels, shown > 0.5)


def cameras_in_front(resolution: int = 64) -> list[Camera]:
    """Four in front of the box, one that looks back over them, and three that look along the box's back.

    None of them sees through the missing face: none stands behind it.
    """
    middle = [0.5, 0.5, 0.3]
    seen_from = [([0.1, y, z], middle) for y in (0.1, 0.9) for z in (0.2, 0.9)]
    along = [([BACK - 0.01, y, z], [BACK + 0.1, 0.5, 0.2]) for y, z in ((0.5, 0.95), (0.05, 0.3), (0.95, 0.3))]
    back = [([0.65, 0.5, 0.6], [0.0, 0.5, 0.9])]
    return [camera_at(origin, target, resolution) for origin, target in seen_from + back + along]


def cameras_all_around(resolution: int = 64) -> list[Camera]:
    """One in each corner of the room."""
    corners = torch.cartesian_prod(*3 * [torch.tensor([0.06, 0.94])])
    return [camera_at(corner.tolist(), [0.5, 0.5, 0.35], resolution) for corner in corners]


def camera_at(origin: list[float], target: list[float], resolution: int, angle: float = 1.8) -> Camera:
    pose = look_at(torch.tensor(origin), torch.tensor(target))
    return Camera.from_field_of_view(pose, angle, resolution, resolution)

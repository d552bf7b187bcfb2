"""What is behind an opening is seen through it, and what is around it stays closed."""

from __future__ import annotations

import numpy as np
import torch

from mesh_files import cuboid_triangles, unpainted
from raycast import ROOM
from rgspipe.datasets.views import View
from rgspipe.renderer.mesh_passes import MeshPasses
from rgspipe.scene import Camera
from rgspipe.scene.mesh import TriangleMesh
from rgspipe.training.initialise import surfels_on
from rgspipe.training.initialise.mesh_cloud import cloud_from_mesh
from rgspipe.training.materials import trace_views
from rgspipe.training.operator_store import OperatorStore

SURFELS = 600  # 0.11 apart
#: Where a wall across the room has its opening, four distances of surfels wide.
ACROSS, UP = (-0.15, 0.15), (-0.1, 0.15)


def room_with_opening() -> TriangleMesh:
    """A room with a wall in y = 0 that has an opening."""
    places = np.array([[x, 0.0, z] for x in (-0.5, *ACROSS, 0.5) for z in (-0.5, *UP, 0.5)])
    cells = [4 * column + row for column in range(3) for row in range(3) if (column, row) != (1, 1)]
    wall = [[[a, a + 4, a + 5], [a, a + 5, a + 1]] for a in cells]
    room, faces = cuboid_triangles(ROOM)
    return unpainted(np.concatenate([room, places]), np.concatenate([faces, np.reshape(wall, (-1, 3)) + len(room)]))


def shown_behind(views: list[View], told: bool) -> tuple[float, float]:
    """How much of what is behind the wall pixels show in the opening, and on the wall, in the mean."""
    mesh = room_with_opening()
    eyes = np.stack([view.camera.origin.numpy() for view in views])
    surfels = surfels_on(cloud_from_mesh(mesh, eyes, SURFELS), SURFELS, seed=0, views=views if told else ())
    behind = (surfels.centers[:, 1] > 0.01).numpy().astype(float)
    shown = [weights.operator.to_scipy() @ behind for weights in trace_views(surfels, views, 4, OperatorStore())]
    through = [view.camera.rays()[0] + view.camera.rays()[1] * distances(view) for view in views]
    is_behind, shown = torch.cat(through)[:, 1].numpy() > 0.01, np.concatenate(shown)
    return float(shown[is_behind].mean()), float(shown[~is_behind].mean())


def distances(view: View) -> torch.Tensor:
    """(P, 1) along rays."""
    return (view.depth.reshape(-1).double() * view.camera.rays()[2])[:, None]


def test_openings_are_open_and_walls_around_them_closed() -> None:
    passes, views, size = MeshPasses(room_with_opening()), [], 96
    for x in (-0.2, 0.0, 0.25):
        camera = Camera.look_at([x, -0.4, 0.0], [0.0, 0.3, 0.02], fov_degrees=60.0, width=size, height=size)
        blank, whole = torch.zeros(size, size, 3), torch.ones(size, size)
        views.append(View(f"{x}", camera, blank, whole, depth=passes.seen_by(camera).depth))
    assert shown_behind(views, told=False)[0] < 0.6  # 0.47: surfels of the wall hang over
    opening, wall = shown_behind(views, told=True)
    assert opening > 0.95 and wall < 0.04  # 0.970, 0.022

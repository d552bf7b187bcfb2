"""Places are empty where a photograph with depth shows something behind them, and nowhere else."""

from __future__ import annotations

import numpy as np
import torch

from rgspipe.datasets.views import View
from rgspipe.scene import Camera
from rgspipe.training.initialise.through import LookedThrough

PIXELS = 64
#: How far behind a plane a ray has to end.
BEYOND = 0.05


def looked_through(depth: torch.Tensor, places: list[list[float]], normal: list[float]) -> list[bool]:
    """Of a camera 2 above the plane z = 0."""
    camera = Camera.look_at([0.0, 0.0, 2.0], [0.0, 0.0, 0.0], fov_degrees=60.0, width=PIXELS, height=PIXELS)
    blank = torch.zeros(PIXELS, PIXELS, 3)
    views = [View("a", camera, blank, torch.ones(PIXELS, PIXELS), depth=depth), View("b", camera, blank, blank[..., 0])]
    normals = np.broadcast_to(normal, (len(places), 3))
    return LookedThrough(views)(np.array(places), normals, BEYOND).tolist()


def test_a_place_is_empty_where_what_is_seen_is_behind_it() -> None:
    depth = torch.full((PIXELS, PIXELS), 2.0)
    depth[:, PIXELS // 2 :] = 2.5
    places = [[-0.5, 0.3, 0.0], [0.5, 0.3, 0.0], [0.5, -0.3, -0.48], [5.0, 0.0, 0.0], [0.5, 0.0, 3.0]]
    # On the surface; before what is behind; as good as on that; beside the photograph; behind the camera.
    assert looked_through(depth, places, [0.0, 0.0, 1.0]) == [False, True, False, False, False]
    assert not any(looked_through(depth, places, [0.0, 0.0, -1.0]))  # seen from behind


def test_an_aslant_plane_is_met_where_the_ray_meets_it() -> None:
    normal = [0.6, 0.0, 0.8]
    camera = Camera.look_at([0.0, 0.0, 2.0], [0.0, 0.0, 0.0], fov_degrees=60.0, width=PIXELS, height=PIXELS)
    # The plane through the origin, as the camera measures it.
    across = (torch.arange(PIXELS) + 0.5 - camera.cx) / camera.fx
    depth = (2.0 * normal[2] / (normal[2] - normal[0] * across)).expand(PIXELS, PIXELS).float()
    places = [[x, y, -0.75 * x] for x in (-0.4, 0.0, 0.37) for y in (-0.2, 0.33)]
    assert not any(looked_through(depth, places, normal))
    assert all(looked_through(depth + 0.08, places, normal))


def test_nothing_is_empty_where_depth_is_not_known_and_all_is_where_nothing_is_behind() -> None:
    places = [[-0.5, 0.0, 0.0], [0.5, 0.2, 0.0]]
    assert looked_through(torch.full((PIXELS, PIXELS), torch.nan), places, [0.0, 0.0, 1.0]) == [False, False]
    assert looked_through(torch.full((PIXELS, PIXELS), torch.inf), places, [0.0, 0.0, 1.0]) == [True, True]

"""Training knows lamps in one point alone: others are refused by name."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from raycast import room_views
from rgspipe.errors import InputError
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Light, PointLight, SpotLight
from rgspipe.scene.lights import SunLight
from rgspipe.scene.rectangles import inside_of_box, surfels_on
from rgspipe.training.lighting import trace_lighting

POINT = PointLight([0.0, 0.0, 0.3], 1.0)
SPOT = SpotLight([0.0, 0.0, 0.3], 1.0, [0.0, 0.0, -1.0], "gaussian", 0.5, 0.1)
SUN = SunLight([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, -1.0])


@pytest.mark.parametrize(("light", "name"), [(SPOT, "a spot"), (SUN, "a sun"), (None, "none in 1 of 2")])
def test_lamps_that_are_no_points_are_refused(light: Light | None, name: str) -> None:
    bvh = SurfelBvh(surfels_on(inside_of_box([0, 0, 0], [1, 1, 1], [0.5] * 3), 60).to(torch.float32))
    views = [replace(view, light=lamp) for view, lamp in zip(room_views(2, 8), (POINT, light), strict=True)]
    with pytest.raises(InputError, match=f"the training views: expected .* {name}.*{views[1].name}"):
        trace_lighting(bvh, views)

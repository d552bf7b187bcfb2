"""Which pixels tell the most depends on what errors are like."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from rgspipe.fitting import LightSpec, Search, fit_lights
from rgspipe.fitting.options import LossOptions
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera
from rgspipe.scene.lights import SunLight
from rgspipe.scene.surfels import quaternion_from_normal
from rooms import sphere


@pytest.mark.slow
def test_uneven_paint_turns_a_sun_less_where_errors_are_relative() -> None:
    """Spots of an eighth darker paint on a sphere that the model takes for even."""
    inside = sphere(800)
    outside = replace(inside, rotations=quaternion_from_normal(inside.centers))
    even = FrozenScene.freeze(outside.to(torch.float32), gather_rays=8, patches=50)
    place = even.surfels.centers
    spots = sum(torch.sigmoid(20.0 * (place @ spot - 0.8)) for spot in SPOTS)
    painted = FrozenScene.freeze(
        replace(even.surfels, albedo=even.surfels.albedo * (1.0 - 0.125 * spots)[:, None]), gather_rays=8, patches=50
    )
    camera = Camera.look_at([0.0, -6.0, 0.0], [0.0, 0.0, 0.0], fov_degrees=22, width=32, height=32)
    sun = SunLight([0.0, 0.0, 0.0], 1.0, [0.5, 0.7, -0.5])
    image = painted.render(camera, sun)
    off = {}
    for polish in ("squares", "relative"):
        solver = Search(loss=LossOptions(polish=polish))
        found = fit_lights(even, camera, image, lights=LightSpec("sun"), solver=solver, emitters=None).lights[0]
        cosine = torch.nn.functional.cosine_similarity(found.direction, sun.direction, dim=0)
        off[polish] = math.degrees(math.acos(min(1.0, float(cosine))))
    # Measured 0.74° and 1.52°.
    assert off["relative"] < 0.7 * off["squares"]


#: Where the spots are.
SPOTS = torch.nn.functional.normalize(torch.tensor([[-0.5, -0.8, 0.4], [0.3, -0.9, -0.5]]), dim=1)

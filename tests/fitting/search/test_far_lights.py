"""Lights far around an open scene are found."""

from __future__ import annotations

import pytest
import torch

from lit_room import frozen_cube
from rgspipe.fitting import fit_lights
from rgspipe.scene import Camera, PointLight, look_at

RADIUS = 0.5 * 0.5 * 3.0**0.5


@pytest.mark.parametrize("distance", [1.5, 3.0])
def test_a_light_far_from_an_object_is_found(distance: float) -> None:
    cube = frozen_cube().with_dictionary(4)
    light = PointLight(distance * RADIUS * torch.tensor([0.6, -0.64, 0.48]).double(), torch.tensor([1.0, 2.0, 0.5]))
    pose = look_at(torch.tensor([0.9, -0.7, 0.8]), torch.zeros(3))
    camera = Camera.from_field_of_view(pose, 0.7, 48, 48)
    result = fit_lights(cube, camera, cube.render(cube.view(camera), (light,), sharp=False), sharp=False)
    error = float((result.lights[0].position - light.position).norm()) / cube.size
    assert error < 1e-5  # measured 9e-8 and 3e-7

"""Drums of which one side was seen."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rgspipe.completion.revolved import things_of_revolution
from rgspipe.scene.rectangles import solid_box, surfels_on

#: Distance of surfels.
SPACING = 0.03


def drum(radius: float, height: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Of the side of an upright one about z, from −height/2."""
    turns = torch.arange(0.0, 2.0 * np.pi, SPACING / radius, dtype=torch.float64)
    levels = torch.arange(-0.5 * height, 0.5 * height, SPACING, dtype=torch.float64)
    turn, level = torch.cartesian_prod(turns, levels).unbind(1)
    normals = torch.stack([turn.cos(), turn.sin(), torch.zeros_like(turn)], dim=1)
    return radius * normals + torch.stack([0.0 * level, 0.0 * level, level], dim=1), normals


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_side_of_a_drum_tells_its_axis_and_radius(seed: int) -> None:
    """From a third of it, with normals that are 3° off."""
    generator = torch.Generator().manual_seed(seed)
    places, normals = drum(0.25, 0.6)
    centers, normals = (part[normals[:, 0] > 0.5] for part in (places, normals))
    normals = torch.nn.functional.normalize(normals + 0.05 * torch.randn(normals.shape, generator=generator), dim=1)
    (thing,) = things_of_revolution((centers + torch.tensor([1.0, 2.0, 0.5])).numpy(), normals.numpy(), SPACING)
    # Measured 0.0029 and 0.0027: a tenth of the distance of surfels.
    assert np.abs(thing.axis - [1.0, 2.0]).max() < 0.01 and abs(float(thing.radii.max()) - 0.25) < 0.01
    assert len(thing.members) > 0.98 * len(centers)  # measured 0.997


def test_a_box_is_not_round() -> None:
    sides = surfels_on(solid_box([0.0, 0.0, 0.3], [0.6, 0.4, 0.6], [0.5] * 3, 0.3), 1500)
    assert not things_of_revolution(sides.centers.numpy(), sides.normals.numpy(), SPACING)
